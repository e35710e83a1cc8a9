//! `volpath`: path tracing that looks through index-matched surfaces.
//!
//! Where a scene holds no medium, the rules that differ from `path` are: a shadow ray passes surfaces that let light
//! straight through (`null`, `mask`), attenuated; passing one is no event of the path and does not count as depth; and
//! roulette starts one vertex later (`depth > rr_depth`). Participating media are not built yet: a scene with one is
//! refused when it is loaded.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | integer | -1 | longest path: 0 black, 1 lights only, 2 direct light, -1 no limit |
//! | `rr_depth` | integer | 5 | depth beyond which Russian roulette may end a path |
//! | `hide_emitters` | boolean | false | lights are not seen directly |
//! | nested `light_sampler` | | by the scene's weights | which light a vertex samples |
//!
//! ```xml
//! <integrator type="volpath">
//!     <integer name="max_depth" value="16"/>
//! </integrator>
//! ```

use super::common::{
    COMMON, Met, PATH, PathLimits, Scattered, balance_weight, find_surface, forward_integrator, mis_weight,
    pair_before_single, scattered, survival, timeout, weighted_emission,
};
use super::lights::{ByScene, LIGHTS, Lights, PickLights};
use lucerna_core::accel::Ray;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Arena, CameraRay, Integrator, LightSample, Lobes, Radiance, RadianceEstimator, SurfaceHit, Transport,
};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties, Scene, shadow_ray};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "volpath",
    aliases: &[],
    summary: "path tracing that looks through index-matched surfaces",
    params: &[COMMON, PATH, &[LIGHTS]],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(VolPath::new(p, Variant::Plain)))
}

/// Surfaces a straight line may pass before it counts as blocked: bounds the work where surfaces coincide.
const MOST_PASSED: u32 = 4096;

/// Where the two plugins differ on surfaces.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Variant {
    /// `volpath`: the power heuristic.
    Plain,
    /// `volpathmis`: the balance heuristic, and a number for roulette even where nothing is left of the throughput.
    SpectralMis,
}

impl Variant {
    #[inline]
    fn weight(self, a: f32, b: f32) -> f32 {
        match self {
            Variant::Plain => mis_weight(a, b),
            Variant::SpectralMis => balance_weight(a, b),
        }
    }
}

/// The estimator, shared with `volpathmis`.
pub(super) struct VolPath {
    limits: PathLimits,
    lights: Lights,
    timeout: Option<f64>,
    variant: Variant,
}

impl VolPath {
    pub(super) fn new(p: &Properties<'_>, variant: Variant) -> Self {
        VolPath { limits: PathLimits::new(p), lights: Lights::new(p), timeout: timeout(p), variant }
    }
}

forward_integrator!(VolPath);

impl RadianceEstimator for VolPath {
    fn prepare(&self, scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        let lights = self.lights.prepare(scene)?;
        Some(Box::new(VolPath { lights, ..*self }))
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

impl VolPath {
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
        let visible_environment = !hide_emitters && scene.environment().is_some();
        found.alpha = f32::from(visible_environment);
        let mut ray = camera.ray;
        let mut throughput = Rgb::WHITE;
        let mut eta = 1.0;
        let mut depth = 0;
        let mut passed = 0;
        // Of the last vertex that changed the direction; none at the camera and after a delta lobe.
        let mut last: Option<Scattered> = None;
        // The reference picks the colour channel that media are sampled by.
        stream.next_1d();
        let mut hit = SurfaceHit::default();
        loop {
            if throughput.is_black() && self.variant == Variant::Plain {
                break;
            }
            let q = survival(throughput, eta);
            let u = stream.next_1d();
            if throughput.is_black() || depth >= max_depth {
                break;
            }
            if depth > rr_depth {
                if u >= q {
                    break;
                }
                throughput *= 1.0 / q;
            }
            let hidden = hide_emitters && depth == 0;
            let met = find_surface(scene, &ray, hidden, &mut hit, &mut found.rays);
            let weight = |a, b| self.variant.weight(a, b);
            if !hidden
                && let Some(Met { light, .. }) =
                    weighted_emission(scene, lights, &ray, met.then_some(&hit), last, weight)
            {
                found.rgb += throughput * light;
            }
            if !met {
                break;
            }
            let bsdf = scene.bsdf(&hit);
            let bxdf = bsdf.resolve(&hit, arena);
            let lobes = bsdf.lobes();
            let from = lights.vertex(&hit, lobes);
            let unblocked = |light: &LightSample| {
                let (contribution, pdf) = scattered(scene, &hit, bxdf, light);
                (!contribution.is_black())
                    .then(|| (contribution, if light.delta { 1.0 } else { self.variant.weight(light.pdf, pdf) }))
            };
            let worth =
                |light: &LightSample| unblocked(light).map_or(0.0, |(value, weight)| (value * weight).luminance());
            if depth + 1 < max_depth
                && lobes.is_smooth()
                && let Some(light) = lights.sample(scene, &from, stream, worth)
                && let Some((mut contribution, weight)) = unblocked(&light)
            {
                contribution *= transmittance(scene, &hit, &light, &mut found.rays);
                found.rgb += throughput * contribution * weight;
            }
            let (u1, u2) = pair_before_single(stream);
            let sample = bxdf.sample(hit.wi, u1, u2, Transport::Radiance);
            let Some(sample) = sample.filter(|sample| scene.keeps_sides(&hit, sample.wo)) else {
                found.alpha = 1.0;
                break;
            };
            throughput *= sample.weight;
            eta *= sample.eta;
            let d = hit.to_world(sample.wo);
            ray = hit.leave(d);
            if sample.lobe == Lobes::NULL {
                passed += 1;
                if passed > MOST_PASSED {
                    break;
                }
            } else {
                depth += 1;
                found.alpha = 1.0;
                last = (!sample.lobe.has_delta()).then_some(Scattered { from, pdf: sample.pdf });
            }
        }
        found
    }
}

/// What of the light survives the straight way to a hit through surfaces that let it pass.
fn transmittance(scene: &Scene, hit: &SurfaceHit, light: &LightSample, rays: &mut u32) -> Rgb {
    let mut ray = shadow_ray(hit, light);
    let mut left = Rgb::WHITE;
    for _ in 0..MOST_PASSED {
        *rays += 1;
        let Some(between) = scene.intersect_surface(&ray) else { return left };
        left *= scene.bsdf(&between).null_transmission(&between);
        if left.is_black() {
            return left;
        }
        let o = between.origin_towards(ray.d);
        let d = if ray.t_max.is_finite() { ray.at(ray.t_max) - o } else { ray.d };
        ray = Ray { o, d, ends: [between.triangle, ray.ends[1]], ..ray };
    }
    Rgb::BLACK
}
