//! Whether a path goes on, stops, or splits.
//!
//! A [`Roulette`] is asked twice at a vertex: before light is sampled and directions are drawn there
//! ([`branches`](Roulette::branches)), and when a direction is chosen ([`survival`](Roulette::survival)). It answers
//! with the number of continuations that is to be expected; each carries the throughput divided by that number, so
//! pictures are unbiased for any answer above zero that comes from what was known before the sample.

use super::Guide;
use crate::color::Rgb;
use std::sync::Arc;

/// The least probability with which a path goes on where something learnt decides: no light is lost for good.
pub const LEAST_SURVIVAL: f32 = 0.05;

/// Continuations from a vertex at most.
pub const MOST_BRANCHES: f32 = 20.0;

/// A path at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathState {
    /// What light from ahead counts for at the camera.
    pub throughput: Rgb,
    /// What the throughput would be about if directions had been chosen by the BSDF; the throughput if that is larger.
    pub prospects: Rgb,
    /// Product of the indices of refraction along the path.
    pub eta: f32,
    /// What delta lobes have left of the light since the last vertex that has other lobes too: their weights' largest
    /// channels, with the compression of radiance in dense media taken out.
    pub passage: f32,
    /// The depth from which the integrator lets paths end has been reached.
    pub due: bool,
    /// Vertices behind this one.
    pub depth: u32,
    /// What the sample is to find out.
    pub goal: Goal,
}

/// What is known of a pixel before a sample of it is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Its luminance, brought nearer to the mean of the picture; 0 where nothing is known.
    pub image: f32,
    /// Square root of the mean cost of a sample over its mean relative variance, in the picture; 0 if unknown.
    pub effort: f32,
}

/// What scattering at a surface has brought so far: once light is sampled, a direction is drawn, and its path is
/// followed to the end. Luminances relative to that of the albedo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outlook {
    /// Mean of the light scattered.
    pub light: f32,
    /// Mean of its square.
    pub square: f32,
    /// Mean variance of what is scattered at the same vertex: what splitting lowers. Not more than that among all
    /// vertices.
    pub spread: f32,
    /// Mean cost in rays.
    pub cost: f32,
}

/// A plugin that decides whether a path goes on, stops, or splits.
pub trait Roulette: Send + Sync {
    /// Who learns [`Outlook`]s for it where paths have no guide; `None` if it needs none.
    fn teacher(&self) -> Option<Arc<dyn Guide>> {
        None
    }

    /// How many continuations a vertex is worth, to be expected. Asked only if there is a [`teacher`](Self::teacher).
    /// `albedo` is that of the vertex. The answer is brought into [[`LEAST_SURVIVAL`], [`MOST_BRANCHES`]]; what is not
    /// a number counts as 1. Not asked at the first vertex, nor where light is scattered by delta lobes alone.
    fn branches(&self, _path: &PathState, _albedo: Rgb, _outlook: Option<Outlook>) -> f32 {
        1.0
    }

    /// The probability with which a path whose direction is chosen goes on, greater than zero.
    fn survival(&self, path: &PathState) -> f32;
}

/// An answer of [`Roulette::branches`] as it is followed: what is not a number counts as 1, and no path is lost for
/// good.
#[inline]
pub fn continuations(answer: f32) -> f32 {
    if answer.is_nan() { 1.0 } else { answer.clamp(LEAST_SURVIVAL, MOST_BRANCHES) }
}
