//! `path`: unidirectional path tracing with emitter sampling.
//!
//! At each vertex one light is sampled and one direction of the BSDF; where both could have found the same light they
//! are combined by multiple importance sampling (Kajiya 1986; Veach 1997, chapter 9). Paths end by depth or by Russian
//! roulette on the throughput. A sample that met nothing but surfaces that let it straight through, and no environment,
//! is transparent: alpha 0 and, as in the reference, no colour. Surfaces only; `volpath` also looks through index-matched surfaces on the way to a light.
//!
//! With a nested guide directions come from a mixture of the BSDF and of what earlier samples have taught. The picture
//! stays unbiased. Such a `path` cannot be nested itself, since its samples depend on each other.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth` | integer | -1 | longest path: 0 black, 1 lights only, 2 direct light, -1 no limit |
//! | `rr_depth` | integer | 5 | depth from which Russian roulette may end a path, at least 1 |
//! | `hide_emitters` | boolean | false | lights are not seen directly; the light they give is unchanged |
//! | nested `light_sampler` | | by the scene's weights | which light a vertex samples |
//! | nested `guide` | | none | learns where light comes from, as `sd_tree` |
//!
//! ```xml
//! <integrator type="path">
//!     <integer name="max_depth" value="8"/>
//! </integrator>
//! ```

use super::common::{COMMON, PATH, PathLimits, timeout};
use super::lights::{ByScene, LIGHTS, Lights};
use super::path_kernel::{Guided, Unguided, trace};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, CameraRay, Guide, Integrator, Radiance, RadianceEstimator};
use lucerna_core::render::{
    Guidance, GuidedEstimator, Notebook, RenderContext, RenderError, Report, render_estimator, render_guided,
};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "path",
    aliases: &[],
    summary: "path tracing with emitter sampling and multiple importance sampling",
    params: &[COMMON, PATH, &[LIGHTS, Param::child(ObjectKind::Guide, 0, 1, "learns where light comes from")]],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(Path { limits: PathLimits::new(p), lights: Lights::new(p), timeout: timeout(p), guide: p.guide() }))
}

struct Path {
    limits: PathLimits,
    lights: Lights,
    timeout: Option<f64>,
    guide: Option<Arc<dyn Guide>>,
}

impl Path {
    /// With lights that are ready for a scene; `None` where nothing has to be made.
    fn prepared(&self, scene: &Scene) -> Option<Self> {
        let lights = self.lights.prepare(scene)?;
        Some(Path { lights, guide: self.guide.clone(), ..*self })
    }
}

impl Integrator for Path {
    fn render(&self, cx: &mut RenderContext<'_>) -> Result<Report, RenderError> {
        match &self.guide {
            None => render_estimator(cx, self),
            Some(guide) => {
                let prepared = self.prepared(cx.scene);
                render_guided(cx, prepared.as_ref().unwrap_or(self), &**guide).map(|(report, _)| report)
            }
        }
    }

    fn timeout(&self) -> Option<f64> {
        self.timeout
    }

    /// Samples that are guided depend on those before.
    fn estimator(&self) -> Option<&dyn RadianceEstimator> {
        self.guide.is_none().then_some(self)
    }
}

impl RadianceEstimator for Path {
    fn prepare(&self, scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        Some(Box::new(self.prepared(scene)?))
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
            None => trace(self.limits, scene, &ByScene, camera, stream, arena, &mut Unguided),
            Some(lights) => trace(self.limits, scene, &lights, camera, stream, arena, &mut Unguided),
        }
    }
}

impl GuidedEstimator for Path {
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        _aovs: &mut [f32],
        guidance: Guidance<'_>,
        notes: &mut Notebook,
    ) -> Radiance {
        let arena = &*arena;
        let mut directions = Guided { guidance, notes, arena, prospects: Rgb::WHITE };
        match self.lights.ready() {
            None => trace(self.limits, scene, &ByScene, camera, stream, arena, &mut directions),
            Some(lights) => trace(self.limits, scene, &lights, camera, stream, arena, &mut directions),
        }
    }
}
