//! `path`: unidirectional path tracing with emitter sampling.
//!
//! At each vertex one light is sampled and one direction of the BSDF; where both could have found the same light they
//! are combined by multiple importance sampling (Kajiya 1986; Veach 1997, chapter 9). Paths end by depth or by Russian
//! roulette on the throughput. A sample that met nothing but surfaces that let it straight through, and no environment,
//! is transparent: alpha 0 and, as in the reference, no colour. Surfaces only; `volpath` also looks through
//! index-matched surfaces on the way to a light.
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
//! | nested `roulette` | | `throughput`; with a guide `adjoint` | whether a path goes on, stops or splits |
//!
//! ```xml
//! <integrator type="path">
//!     <integer name="max_depth" value="8"/>
//! </integrator>
//! ```

use super::ahead::Ahead;
use super::common::{COMMON, PATH, PathLimits, timeout};
use super::directions::{Directions, Unguided};
use super::guided::Guided;
use super::lights::{ByScene, LIGHTS, Lights};
use super::path_kernel::trace;
use crate::roulettes::ByThroughput;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, CameraRay, Guide, Integrator, Radiance, RadianceEstimator, Roulette, Subjects};
use lucerna_core::render::{
    Guidance, GuidedEstimator, Notebook, RenderContext, RenderError, Report, films_of, render_estimator, render_guided,
};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "path",
    aliases: &[],
    summary: "path tracing with emitter sampling and multiple importance sampling",
    params: &[
        COMMON,
        PATH,
        &[
            LIGHTS,
            Param::child(ObjectKind::Guide, 0, 1, "learns where light comes from"),
            Param::child(ObjectKind::Roulette, 0, 1, "decides whether a path goes on, stops or splits"),
        ],
    ],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    let (limits, lights, timeout) = (PathLimits::new(p), Lights::new(p), timeout(p));
    let guide = p.guide();
    let roulette = p.roulette().or_else(|| guide.is_some().then(crate::roulettes::by_default));
    let teacher = roulette.as_ref().and_then(|roulette| roulette.teacher());
    let subjects = Subjects { directions: guide.is_some(), outlook: teacher.is_some() };
    Ok(Arc::new(Path { limits, lights, timeout, teacher: guide.or(teacher), subjects, roulette }))
}

struct Path {
    limits: PathLimits,
    lights: Lights,
    timeout: Option<f64>,
    /// Who learns from the samples: a guide, or somebody who learns for roulette alone.
    teacher: Option<Arc<dyn Guide>>,
    subjects: Subjects,
    roulette: Option<Arc<dyn Roulette>>,
}

impl Path {
    /// With lights that are ready for a scene; `None` where nothing has to be made.
    fn prepared(&self, scene: &Scene) -> Option<Self> {
        let lights = self.lights.prepare(scene)?;
        let (teacher, roulette) = (self.teacher.clone(), self.roulette.clone());
        Some(Path { lights, teacher, roulette, ..*self })
    }
}

impl Integrator for Path {
    fn render(&self, cx: &mut RenderContext<'_>) -> Result<Report, RenderError> {
        match &self.teacher {
            None => render_estimator(cx, self),
            Some(teacher) => {
                let prepared = self.prepared(cx.scene);
                let estimator = prepared.as_ref().unwrap_or(self);
                render_guided(cx, estimator, &**teacher, self.subjects).map(|(report, _)| report)
            }
        }
    }

    fn films(&self) -> u64 {
        self.teacher.as_ref().map_or(1, |teacher| films_of(&teacher.training()))
    }

    fn timeout(&self) -> Option<f64> {
        self.timeout
    }

    /// Samples that are guided depend on those before.
    fn estimator(&self) -> Option<&dyn RadianceEstimator> {
        self.teacher.is_none().then_some(self)
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
        let (limits, to) = (self.limits, &mut Unguided);
        match (self.lights.ready(), &self.roulette) {
            (None, None) => trace(limits, scene, &ByScene, &ByThroughput, camera, stream, arena, to),
            (Some(lights), None) => trace(limits, scene, &lights, &ByThroughput, camera, stream, arena, to),
            (None, Some(roulette)) => trace(limits, scene, &ByScene, &&**roulette, camera, stream, arena, to),
            (Some(lights), Some(roulette)) => trace(limits, scene, &lights, &&**roulette, camera, stream, arena, to),
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
        match guidance.subjects.directions {
            true => self.trace(scene, camera, stream, arena, Guided { guidance, notes, arena, prospects: Rgb::WHITE }),
            false => self.trace(scene, camera, stream, arena, Ahead { guidance, notes }),
        }
    }
}

impl Path {
    /// A sample by these directions, for which something is learnt.
    #[inline]
    fn trace<'a, D: Directions<Here: 'a>>(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &'a Arena,
        mut directions: D,
    ) -> Radiance {
        let (limits, to) = (self.limits, &mut directions);
        let roulette: &dyn Roulette = self.roulette.as_deref().unwrap_or(&ByThroughput);
        match self.lights.ready() {
            None => trace(limits, scene, &ByScene, &roulette, camera, stream, arena, to),
            Some(lights) => trace(limits, scene, &lights, &roulette, camera, stream, arena, to),
        }
    }
}
