//! `direct`: light that reaches the camera after at most one bounce.
//!
//! A number of emitter samples and a number of BSDF samples per pixel sample, combined by multiple importance sampling
//! with these counts (Veach 1997, chapter 9).
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `shading_samples` | integer | 1 | sets both counts; excludes them |
//! | `emitter_samples` | integer | `shading_samples` | emitter samples per pixel sample |
//! | `bsdf_samples` | integer | `shading_samples` | BSDF samples per pixel sample; not both 0 |
//! | `hide_emitters` | boolean | false | lights are not seen directly |
//! | nested `light_sampler` | | by the scene's weights | which light a sample is taken of |
//!
//! ```xml
//! <integrator type="direct">
//!     <integer name="emitter_samples" value="2"/>
//!     <integer name="bsdf_samples" value="1"/>
//! </integrator>
//! ```

use super::common::{
    COMMON, HIDE, emission, find_surface, forward_integrator, mis_weight, pair_before_single, scattered, timeout,
};
use super::lights::{ByScene, LIGHTS, Lights, PickLights};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Arena, CameraRay, Integrator, LightPoint, LightSample, Lobes, Radiance, RadianceEstimator, SurfaceHit, Transport,
};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "direct",
    aliases: &[],
    summary: "direct light only",
    params: &[
        COMMON,
        &[
            HIDE,
            LIGHTS,
            Param::int("shading_samples", 1, "sets both counts below").range(1.0, MOST),
            Param::int_opt("emitter_samples", "emitter samples per pixel sample").range(0.0, MOST),
            Param::int_opt("bsdf_samples", "BSDF samples per pixel sample").range(0.0, MOST),
        ],
    ],
    build: Constructor::Integrator(build),
};

/// More samples than this per pixel sample are a mistake.
const MOST: f64 = 65536.0;

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    p.exclusive("shading_samples", "emitter_samples")?;
    p.exclusive("shading_samples", "bsdf_samples")?;
    let shading = p.int("shading_samples");
    let count = |name: &str| p.int_opt(name).unwrap_or(shading) as u32;
    let (emitter_samples, bsdf_samples) = (count("emitter_samples"), count("bsdf_samples"));
    if emitter_samples + bsdf_samples == 0 {
        return Err(p.error("bsdf_samples", "\"emitter_samples\" and \"bsdf_samples\" cannot both be 0"));
    }
    Ok(Arc::new(Direct {
        emitter_samples,
        bsdf_samples,
        hide_emitters: p.bool("hide_emitters"),
        lights: Lights::new(p),
        timeout: timeout(p),
    }))
}

struct Direct {
    lights: Lights,
    timeout: Option<f64>,
    emitter_samples: u32,
    bsdf_samples: u32,
    hide_emitters: bool,
}

forward_integrator!(Direct);

impl RadianceEstimator for Direct {
    fn prepare(&self, scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        let lights = self.lights.prepare(scene)?;
        Some(Box::new(Direct { lights, ..*self }))
    }

    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        _aovs: &mut [f32],
    ) -> Radiance {
        match self.lights.ready() {
            None => self.trace(scene, &ByScene, camera, stream, arena),
            Some(lights) => self.trace(scene, &lights, camera, stream, arena),
        }
    }
}

impl Direct {
    /// A camera path whose lights are picked by `lights`.
    fn trace(
        &self,
        scene: &Scene,
        lights: &impl PickLights,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
    ) -> Radiance {
        let ray = &camera.ray;
        let mut found = Radiance::default();
        let mut hit = SurfaceHit::default();
        let met = find_surface(scene, ray, self.hide_emitters, &mut hit, &mut found.rays);
        if !self.hide_emitters
            && let Some((_, radiance)) = emission(scene, ray, met.then_some(&hit))
        {
            found.rgb += radiance;
        }
        found.alpha = f32::from(met || (!self.hide_emitters && scene.environment().is_some()));
        if !met {
            return found;
        }
        let (emitter_count, bsdf_count) = (self.emitter_samples as f32, self.bsdf_samples as f32);
        let bsdf = scene.bsdf(&hit);
        let bxdf = bsdf.resolve(&hit, arena);

        let lobes = bsdf.lobes();
        let from = lights.vertex(&hit, lobes);
        let unblocked = |light: &LightSample| {
            let (contribution, pdf) = scattered(scene, &hit, bxdf, light);
            let weight = if light.delta { 1.0 } else { mis_weight(light.pdf * emitter_count, pdf * bsdf_count) };
            contribution * (weight / emitter_count)
        };
        let count = if lobes.is_smooth() { self.emitter_samples } else { 0 };
        for _ in 0..count {
            let worth = |light: &LightSample| unblocked(light).luminance();
            let Some(light) = lights.sample(scene, &from, stream, worth) else { continue };
            let contribution = unblocked(&light);
            if contribution.is_black() {
                continue;
            }
            found.rays += 1;
            if scene.visible(&hit, &light) {
                found.rgb += contribution;
            }
        }

        for _ in 0..self.bsdf_samples {
            let (u1, u2) = pair_before_single(stream);
            let sample = bxdf.sample(hit.wi, u1, u2, Transport::Radiance);
            let Some(sample) = sample.filter(|sample| scene.keeps_sides(&hit, sample.wo)) else { continue };
            let d = hit.to_world(sample.wo);
            let next = hit.leave(d);
            found.rays += 1;
            let light_hit = scene.intersect_surface(&next);
            let Some((id, radiance)) = emission(scene, &next, light_hit.as_ref()) else { continue };
            let weight = if sample.lobe.intersects(Lobes::DELTA) {
                1.0
            } else {
                let point = match &light_hit {
                    Some(light_hit) => LightPoint::of_hit(hit.p, light_hit, d),
                    None => LightPoint::of_environment(d),
                };
                mis_weight(sample.pdf * bsdf_count, lights.pdf(scene, id, &from, &point) * emitter_count)
            };
            found.rgb += Rgb::splat(weight / bsdf_count) * radiance * sample.weight;
        }
        found
    }
}
