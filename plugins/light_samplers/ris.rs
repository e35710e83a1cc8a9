//! `ris`: of several candidates, the light that would bring most if nothing stood between is the likeliest.
//!
//! Resampled importance sampling (Talbot, Cline, Egbert 2005). M candidates x_1 … x_M come from another light sampler,
//! with density p. Each is worth w_i = p̂(x_i) / p(x_i), where p̂ is the luminance that it would add to the path if it
//! were visible: emission, BSDF and geometry. One, x_j, is kept with chance w_j / Σ w_i, one shadow ray is traced, and
//! its light is multiplied by Σ w_i / (M w_j). So M BSDF evaluations are paid for one shadow ray to a place where it
//! counts.
//!
//! **The weight against BSDF sampling.** The density of what is kept has no closed form, and none is needed. For any
//! function g the mean of g(x_j) / p̂(x_j) · Σ w_i / M is ∫ g, if p̂ > 0 where g ≠ 0. Let g = f · m, with f the light
//! that arrives and m any weight: sampling lights then gives ∫ f m, sampling the BSDF ∫ f (1 − m), and both together
//! are right as long as both use *the same* m, a function of the place alone. It is the power heuristic on p, the
//! candidates' density, which is known at any place, also at one hit by chance. The m is part of p̂, so that no shadow
//! ray goes where BSDF sampling does the work. What is lost against a weight that knew the density of x_j is variance
//! only.
//!
//! Candidates of one vertex share their random numbers: the choices of lights are spread evenly over [0, 1), the places
//! on lights follow a rotated lattice (Roberts 2018, "R2"). Any of them, chosen at
//! random, is uniform, which is all that the mean asks for.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `candidates` | integer | 8 | M, at least 1 |
//! | nested `light_sampler` | | `light_tree` | where candidates come from |
//!
//! Against the paper: candidates are stratified; p̂ includes the weight against BSDF sampling; one of them is kept,
//! never more.
//!
//! ```xml
//! <integrator type="path">
//!     <light_sampler type="ris">
//!         <integer name="candidates" value="8"/>
//!         <light_sampler type="power"/>
//!     </light_sampler>
//! </integrator>
//! ```

use super::light_tree::LightTree;
use lucerna_core::interfaces::{
    Light, LightPoint, LightSample, LightSampler, LightSelection, LightVertex, long_number,
};
use lucerna_core::sampling::{Reservoir, Stream, r2};
use lucerna_core::scene::{Built, Constructor, EmitterId, ObjectKind, Param, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "ris",
    aliases: &[],
    summary: "of several candidates the one that would bring most, were it visible, is the likeliest",
    params: &[&[
        Param::int("candidates", 8, "candidates for one shadow ray").range(1.0, 65536.0),
        Param::child(ObjectKind::LightSampler, 0, 1, "where candidates come from; by default `light_tree`"),
    ]],
    build: Constructor::LightSampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn LightSampler> {
    let inner = p.light_sampler().unwrap_or_else(|| Arc::new(LightTree));
    Ok(Arc::new(Ris { inner, candidates: p.int("candidates") as u32 }))
}

struct Ris {
    inner: Arc<dyn LightSampler>,
    candidates: u32,
}

impl LightSampler for Ris {
    fn prepare(&self, scene: &Scene) -> Box<dyn LightSelection> {
        Box::new(Resampled { inner: self.inner.prepare(scene), candidates: self.candidates })
    }
}

struct Resampled {
    inner: Box<dyn LightSelection>,
    candidates: u32,
}

impl LightSelection for Resampled {
    fn in_parts(&self) -> bool {
        self.inner.in_parts()
    }

    /// The choice of a candidate's light.
    fn choose(&self, from: &LightVertex, u: f64) -> Option<(Light, f32)> {
        self.inner.choose(from, u)
    }

    fn pmf(&self, from: &LightVertex, light: Light) -> f32 {
        self.inner.pmf(from, light)
    }

    /// The density of the sample is that of the candidates, see the head of this file.
    fn sample(
        &self,
        scene: &Scene,
        from: &LightVertex,
        stream: &mut Stream<'_>,
        worth: &dyn Fn(&LightSample) -> f32,
    ) -> Option<LightSample> {
        let (u, place) = (long_number(stream.next_2d()), stream.next_2d());
        let mut candidates = Reservoir::new(stream.next_1d());
        for i in 0..self.candidates {
            let u = (f64::from(i) + u) / f64::from(self.candidates);
            let Some((light, pmf)) = self.inner.choose(from, u) else { continue };
            let Some(sample) = scene.sample_light(light, pmf, from.p, r2(place, i)) else { continue };
            let w = worth(&sample);
            candidates.offer(sample, w);
        }
        let (mut sample, factor) = candidates.take(self.candidates)?;
        sample.weight *= factor;
        sample.weight.is_finite().then_some(sample)
    }

    fn pdf(&self, scene: &Scene, emitter: EmitterId, from: &LightVertex, point: &LightPoint) -> f32 {
        self.inner.pdf(scene, emitter, from, point)
    }

    fn validate(&self) -> Result<(), String> {
        self.inner.validate()
    }
}
