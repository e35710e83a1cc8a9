//! `uniform`: all lights have the same chance, or that of their `sampling_weight`.
//!
//! What the reference does, and what an integrator does without a `light_sampler`: the pictures have the same bits. An
//! emitter that gives off no light is never chosen. The place on the light is sampled with what the choice has left of
//! the random number.
//!
//! No parameters.
//!
//! ```xml
//! <integrator type="path">
//!     <light_sampler type="uniform"/>
//! </integrator>
//! ```

use lucerna_core::interfaces::{Light, LightSample, LightSampler, LightSelection, LightVertex};
use lucerna_core::sampling::{Discrete, Stream};
use lucerna_core::scene::{Built, Constructor, EmitterId, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "uniform",
    aliases: &[],
    summary: "all lights have the same chance",
    params: &[],
    build: Constructor::LightSampler(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn LightSampler> {
    Ok(Arc::new(Uniform))
}

struct Uniform;

impl LightSampler for Uniform {
    fn prepare(&self, scene: &Scene) -> Box<dyn LightSelection> {
        let count = scene.emitters().len() as u32;
        let pmf: Vec<f32> = (0..count).map(|id| scene.emitter_pmf(EmitterId(id))).collect();
        Box::new(ByWeight { choice: Discrete::new(pmf.iter().map(|p| f64::from(*p))), pmf })
    }
}

/// By the scene's weights.
struct ByWeight {
    choice: Option<Discrete>,
    pmf: Vec<f32>,
}

impl LightSelection for ByWeight {
    fn choose(&self, _from: &LightVertex, u: f64) -> Option<(Light, f32)> {
        let index = self.choice.as_ref()?.sample_long(u);
        Some((Light::whole(EmitterId(index)), self.pmf[index as usize]))
    }

    fn pmf(&self, _from: &LightVertex, light: Light) -> f32 {
        self.pmf[light.emitter.0 as usize]
    }

    fn sample(
        &self,
        scene: &Scene,
        from: &LightVertex,
        stream: &mut Stream<'_>,
        _worth: &dyn Fn(&LightSample) -> f32,
    ) -> Option<LightSample> {
        scene.sample_emitter(from.p, stream.next_2d()).map(|(_, sample)| sample)
    }
}
