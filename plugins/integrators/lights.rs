//! How integrators pick lights: by the scene's weights, or by a nested `light_sampler`.

use lucerna_core::interfaces::{LightPoint, LightSample, LightSampler, LightSelection, LightVertex, Lobes, SurfaceHit};
use lucerna_core::math::Vec3;
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{EmitterId, ObjectKind, Param, Properties, Scene};
use std::sync::Arc;

/// The decision, nested in an integrator.
pub const LIGHTS: Param =
    Param::child(ObjectKind::LightSampler, 0, 1, "which light a vertex samples; by default by the scene's weights");

/// The way lights are picked. Estimators are compiled for each, so that those who want none pay nothing.
pub trait PickLights {
    /// A hit on a surface with these lobes as a place to choose lights from.
    fn vertex(&self, hit: &SurfaceHit, lobes: Lobes) -> LightVertex;

    /// Samples light that may reach a vertex, see [`LightSelection::sample`].
    fn sample(
        &self,
        scene: &Scene,
        from: &LightVertex,
        stream: &mut Stream<'_>,
        worth: impl Fn(&LightSample) -> f32,
    ) -> Option<LightSample>;

    /// Density of [`sample`](Self::sample).
    fn pdf(&self, scene: &Scene, emitter: EmitterId, from: &LightVertex, point: &LightPoint) -> f32;
}

/// By the scene's weights.
pub struct ByScene;

impl PickLights for ByScene {
    #[inline]
    fn vertex(&self, hit: &SurfaceHit, _lobes: Lobes) -> LightVertex {
        LightVertex { p: hit.p, n: Vec3::ZERO }
    }

    #[inline]
    fn sample(
        &self,
        scene: &Scene,
        from: &LightVertex,
        stream: &mut Stream<'_>,
        _worth: impl Fn(&LightSample) -> f32,
    ) -> Option<LightSample> {
        scene.sample_emitter(from.p, stream.next_2d()).map(|(_, light)| light)
    }

    #[inline]
    fn pdf(&self, scene: &Scene, emitter: EmitterId, from: &LightVertex, point: &LightPoint) -> f32 {
        scene.pdf_emitter(emitter, from.p, point)
    }
}

impl PickLights for &dyn LightSelection {
    fn vertex(&self, hit: &SurfaceHit, lobes: Lobes) -> LightVertex {
        LightVertex { p: hit.p, n: if lobes.is_one_sided() { hit.frame.n * hit.wi.z.signum() } else { Vec3::ZERO } }
    }

    fn sample(
        &self,
        scene: &Scene,
        from: &LightVertex,
        stream: &mut Stream<'_>,
        worth: impl Fn(&LightSample) -> f32,
    ) -> Option<LightSample> {
        LightSelection::sample(*self, scene, from, stream, &worth)
    }

    fn pdf(&self, scene: &Scene, emitter: EmitterId, from: &LightVertex, point: &LightPoint) -> f32 {
        LightSelection::pdf(*self, scene, emitter, from, point)
    }
}

/// The decision as an integrator holds it.
#[derive(Clone, Default)]
pub struct Lights {
    wanted: Option<Arc<dyn LightSampler>>,
    /// What `wanted` made for the scene.
    ready: Option<Arc<dyn LightSelection>>,
}

impl Lights {
    /// Reads [`LIGHTS`].
    pub fn new(p: &Properties<'_>) -> Self {
        Lights { wanted: p.light_sampler(), ready: None }
    }

    /// Ready for a scene; `None` where nothing has to be made.
    pub fn prepare(&self, scene: &Scene) -> Option<Self> {
        let wanted = self.wanted.as_ref()?;
        Some(Lights { wanted: None, ready: Some(Arc::from(wanted.prepare(scene))) })
    }

    /// What chooses lights, if it is not the scene. Only there after [`prepare`](Self::prepare).
    #[inline]
    pub fn ready(&self) -> Option<&dyn LightSelection> {
        self.ready.as_deref()
    }
}
