//! `power`: lights are chosen in proportion to the power they give off.
//!
//! Wherever the vertex is: right where lights differ in strength but are all about as far away. The power of an
//! environment and of `directional` is what they send through the sphere around the scene. A `sampling_weight` multiplies
//! the power (Shirley, Wang, Zimmerman 1996, "Monte Carlo techniques for direct lighting calculations", section 4).
//!
//! No parameters.
//!
//! ```xml
//! <integrator type="path">
//!     <light_sampler type="power"/>
//! </integrator>
//! ```

use lucerna_core::interfaces::{Light, LightSampler, LightSelection, LightVertex};
use lucerna_core::sampling::Discrete;
use lucerna_core::scene::{Built, Constructor, EmitterId, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "power",
    aliases: &[],
    summary: "lights are chosen in proportion to their power",
    params: &[],
    build: Constructor::LightSampler(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn LightSampler> {
    Ok(Arc::new(Power))
}

struct Power;

/// The power of a scene's emitter times its sampling weight, in W; finite.
pub(super) fn power_of(scene: &Scene, emitter: EmitterId) -> f64 {
    let (center, radius) = scene.bounding_sphere();
    let light = scene.emitter(emitter);
    // Not zero for want of a scene around it.
    let power = light.power(center, radius.max(f32::MIN_POSITIVE.sqrt()));
    let weight = light.sampling_weight();
    if power > 0.0 && weight > 0.0 { f64::from(power.min(f32::MAX)) * f64::from(weight) } else { 0.0 }
}

impl LightSampler for Power {
    fn prepare(&self, scene: &Scene) -> Box<dyn LightSelection> {
        let count = scene.emitters().len() as u32;
        Box::new(ByPower(Discrete::new((0..count).map(|id| power_of(scene, EmitterId(id))))))
    }
}

/// `None` if nothing gives off light.
struct ByPower(Option<Discrete>);

impl LightSelection for ByPower {
    fn choose(&self, from: &LightVertex, u: f64) -> Option<(Light, f32)> {
        let light = Light::whole(EmitterId(self.0.as_ref()?.sample_long(u)));
        let pmf = self.pmf(from, light);
        (pmf > 0.0).then_some((light, pmf))
    }

    fn pmf(&self, _from: &LightVertex, light: Light) -> f32 {
        self.0.as_ref().map_or(0.0, |choice| choice.pmf(light.emitter.0))
    }
}
