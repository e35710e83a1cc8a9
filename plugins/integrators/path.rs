//! `path`: unidirectional path tracing with emitter sampling.
//!
//! At each vertex one light is sampled and one direction of the BSDF; where both could have found the same light they
//! are combined by multiple importance sampling (Kajiya 1986; Veach 1997, chapter 9). Paths end by depth or by Russian
//! roulette on the throughput. A sample that met nothing but surfaces that let it straight through, and no environment,
//! is transparent: alpha 0 and, as in the reference, no colour. Surfaces only; `volpath` also looks through index-matched surfaces on the way to a light.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | integer | -1 | longest path: 0 black, 1 lights only, 2 direct light, -1 no limit |
//! | `rr_depth` | integer | 5 | depth from which Russian roulette may end a path, at least 1 |
//! | `hide_emitters` | boolean | false | lights are not seen directly; the light they give is unchanged |
//! | nested `light_sampler` | | by the scene's weights | which light a vertex samples |
//!
//! ```xml
//! <integrator type="path">
//!     <integer name="max_depth" value="8"/>
//! </integrator>
//! ```

use super::common::{
    COMMON, PATH, PathLimits, Scattered, find_surface, forward_integrator, mis_weight, survival, timeout,
    weighted_emission,
};
use super::lights::{ByScene, LIGHTS, Lights, PickLights};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Arena, Bxdf, CameraRay, Integrator, LightSample, Lobes, Radiance, RadianceEstimator, SurfaceHit, Transport,
};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "path",
    aliases: &[],
    summary: "path tracing with emitter sampling and multiple importance sampling",
    params: &[COMMON, PATH, &[LIGHTS]],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(Path { limits: PathLimits::new(p), lights: Lights::new(p), timeout: timeout(p) }))
}

struct Path {
    limits: PathLimits,
    lights: Lights,
    timeout: Option<f64>,
}

forward_integrator!(Path);

impl RadianceEstimator for Path {
    fn prepare(&self, scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        let lights = self.lights.prepare(scene)?;
        Some(Box::new(Path { lights, ..*self }))
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

impl Path {
    /// A camera path whose lights are picked by `lights`.
    fn trace(
        &self,
        scene: &Scene,
        lights: &impl PickLights,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
    ) -> Radiance {
        let PathLimits { max_depth, rr_depth, hide_emitters } = self.limits;
        let mut found = Radiance::default();
        if max_depth == 0 {
            return found;
        }
        let visible_environment = !hide_emitters && scene.environment().is_some();
        found.alpha = f32::from(visible_environment);
        let mut ray = camera.ray;
        let mut throughput = Rgb::WHITE;
        let mut eta = 1.0;
        // Of the vertex before; none at the camera and after a delta lobe, where light sampling has no part.
        let mut last: Option<Scattered> = None;
        let mut depth = 0;
        let mut hit = SurfaceHit::default();
        loop {
            let hidden = hide_emitters && depth == 0;
            let met = find_surface(scene, &ray, hidden, &mut hit, &mut found.rays);
            if !hidden {
                found.rgb += throughput * weighted_emission(scene, lights, &ray, met.then_some(&hit), last, mis_weight);
            }
            if !met {
                break;
            }
            if depth + 1 >= max_depth {
                if depth == 0 && !found.rgb.is_black() {
                    found.alpha = 1.0;
                }
                break;
            }
            let bsdf = scene.bsdf(&hit);
            let bxdf = bsdf.resolve(&hit, arena);
            let lobes = bsdf.lobes();
            let from = lights.vertex(&hit, lobes);
            let worth = |light: &LightSample| {
                let (contribution, pdf) = scattered(scene, &hit, bxdf, light);
                (contribution * weight_of(light, pdf)).luminance()
            };
            if lobes.is_smooth()
                && let Some(light) = lights.sample(scene, &from, stream, worth)
            {
                found.rgb += throughput * direct_light(scene, &hit, bxdf, &light, &mut found.rays);
            }
            let (u1, u2) = (stream.next_1d(), stream.next_2d());
            let sample = bxdf.sample(hit.wi, u1, u2, Transport::Radiance);
            // Drawn at every vertex, needed or not: the numbers of the next sample depend on it in the reference's order.
            let u_roulette = stream.next_1d();
            let Some(sample) = sample.filter(|sample| scene.keeps_sides(&hit, sample.wo)) else {
                found.alpha = 1.0;
                break;
            };
            throughput *= sample.weight;
            eta *= sample.eta;
            if sample.lobe != Lobes::NULL {
                found.alpha = 1.0;
            }
            let d = hit.to_world(sample.wo);
            ray = hit.leave(d);
            last = (!sample.lobe.has_delta()).then_some(Scattered { from, pdf: sample.pdf });
            depth += 1;

            if throughput.is_black() {
                break;
            }
            if depth >= rr_depth {
                let q = survival(throughput, eta);
                if u_roulette >= q {
                    break;
                }
                throughput *= 1.0 / q;
            }
        }
        if found.alpha == 0.0 {
            found.rgb = Rgb::BLACK;
        }
        found
    }
}

/// Light of one emitter sample scattered at a hit, weighted against BSDF sampling.
#[inline]
fn direct_light(scene: &Scene, hit: &SurfaceHit, bxdf: &dyn Bxdf, light: &LightSample, rays: &mut u32) -> Rgb {
    let (contribution, pdf) = scattered(scene, hit, bxdf, light);
    if contribution.is_black() {
        return Rgb::BLACK;
    }
    *rays += 1;
    if !scene.visible(hit, light) {
        return Rgb::BLACK;
    }
    contribution * weight_of(light, pdf)
}

/// The same without the weight and as if nothing stood between, and the density of BSDF sampling.
#[inline]
fn scattered(scene: &Scene, hit: &SurfaceHit, bxdf: &dyn Bxdf, light: &LightSample) -> (Rgb, f32) {
    let wo = hit.to_local(light.point.d);
    let (value, pdf) = bxdf.eval_pdf(hit.wi, wo, Transport::Radiance);
    let contribution = value * light.weight;
    if contribution.is_black() || !scene.keeps_sides(hit, wo) {
        return (Rgb::BLACK, pdf);
    }
    (contribution, pdf)
}

/// Weight of emitter sampling against BSDF sampling with density `pdf`.
#[inline]
fn weight_of(light: &LightSample, pdf: f32) -> f32 {
    if light.delta { 1.0 } else { mis_weight(light.pdf, pdf) }
}
