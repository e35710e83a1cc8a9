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
    params: &[COMMON, PATH],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(Path { limits: PathLimits::new(p), timeout: timeout(p) }))
}

struct Path {
    limits: PathLimits,
    timeout: Option<f64>,
}

forward_integrator!(Path);

impl RadianceEstimator for Path {
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        _aovs: &mut [f32],
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
                found.rgb += throughput * weighted_emission(scene, &ray, met.then_some(&hit), last, mis_weight);
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
            if bsdf.lobes().is_smooth()
                && let Some((_, light)) = scene.sample_emitter(hit.p, stream.next_2d())
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
            last = (!sample.lobe.has_delta()).then_some(Scattered { p: hit.p, pdf: sample.pdf });
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
    let wo = hit.to_local(light.point.d);
    let (value, pdf) = bxdf.eval_pdf(hit.wi, wo, Transport::Radiance);
    let contribution = value * light.weight;
    if contribution.is_black() || !scene.keeps_sides(hit, wo) {
        return Rgb::BLACK;
    }
    *rays += 1;
    if !scene.visible(hit, light) {
        return Rgb::BLACK;
    }
    contribution * if light.delta { 1.0 } else { mis_weight(light.pdf, pdf) }
}
