//! Which light a vertex samples.
//!
//! A [`LightSampler`] is what a scene asks for; made ready for a scene it is a [`LightSelection`], which answers
//! questions about vertices and never changes. What is chosen is a [`Light`]: an emitter, or one part of an emitter that
//! [can be sampled in parts](super::Emitter::part_count).

use super::{LightPoint, LightSample};
use crate::math::{Vec2, Vec3};
use crate::sampling::Stream;
use crate::scene::{EmitterId, Scene};

/// A vertex as far as the choice of a light depends on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightVertex {
    /// The point.
    pub p: Vec3,
    /// Unit shading normal on the side that light is scattered from; zero where light from all directions counts (in a
    /// medium, and where a surface lets light through).
    pub n: Vec3,
}

/// A light that is chosen as a whole: an emitter, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Light {
    /// The emitter.
    pub emitter: EmitterId,
    /// The part of it, less than its [`part_count`](super::Emitter::part_count); `None` for all of it.
    pub part: Option<u32>,
}

impl Light {
    /// All of an emitter.
    pub fn whole(emitter: EmitterId) -> Self {
        Light { emitter, part: None }
    }
}

/// A plugin that decides which light a vertex samples.
pub trait LightSampler: Send + Sync {
    /// Looks at the lights of a scene. Deterministic.
    fn prepare(&self, scene: &Scene) -> Box<dyn LightSelection>;
}

/// Chooses lights of one scene.
///
/// [`pmf`](Self::pmf) equals what [`choose`](Self::choose) does, also for a light that was hit by chance, so that
/// estimators can be weighted against each other. A light that gives no light anywhere, or has the sampling weight 0, is
/// never chosen; any other has a chance wherever its light could be scattered at the vertex.
pub trait LightSelection: Send + Sync {
    /// Whether [`Light`]s are parts of emitters, where emitters have parts.
    fn in_parts(&self) -> bool {
        false
    }

    /// Picks a light by a number in [0, 1), and its chance, greater than zero. `None` where no light is worth it: what
    /// the chances lack to one is the chance of this.
    fn choose(&self, from: &LightVertex, u: f64) -> Option<(Light, f32)>;

    /// Chance with which [`choose`](Self::choose) gives this light.
    fn pmf(&self, from: &LightVertex, light: Light) -> f32;

    /// Samples light that may reach the vertex; visibility is not tested. The chance of the choice is part of density and
    /// weight; the density is that of [`pdf`](Self::pdf). `worth` tells the luminance that a sample would add if nothing
    /// blocked it, with its weight against other estimators.
    ///
    /// The choice takes a pair of numbers of its own: twenty-four bits shared with the place on the light would leave it
    /// few where there are many lights.
    fn sample(
        &self,
        scene: &Scene,
        from: &LightVertex,
        stream: &mut Stream<'_>,
        _worth: &dyn Fn(&LightSample) -> f32,
    ) -> Option<LightSample> {
        let u = long_number(stream.next_2d());
        let u2 = stream.next_2d();
        let (light, pmf) = self.choose(from, u)?;
        scene.sample_light(light, pmf, from.p, u2)
    }

    /// Density that [`sample`](Self::sample) goes by at this point of this emitter, for weights against other
    /// estimators.
    fn pdf(&self, scene: &Scene, emitter: EmitterId, from: &LightVertex, point: &LightPoint) -> f32 {
        let part = if self.in_parts() { scene.light_part(emitter, point) } else { None };
        let light = Light { emitter, part };
        match self.pmf(from, light) {
            0.0 => 0.0,
            pmf => pmf * scene.pdf_light(light, from.p, point),
        }
    }

    /// Whether what it has built is in order; what is wrong, else.
    ///
    /// # Errors
    /// A mistake of this code, found by tests.
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// A number in [0, 1) with the bits of two.
#[inline]
pub fn long_number(u2: Vec2) -> f64 {
    /// Largest number of double precision below one.
    const BELOW_ONE: f64 = 1.0 - f64::EPSILON * 0.5;
    (f64::from(u2.x) + f64::from(u2.y) * (0.5 * f64::from(f32::EPSILON))).min(BELOW_ONE)
}
