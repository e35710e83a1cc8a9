//! Which direction a path takes: learnt from earlier samples.
//!
//! A [`Guide`] is the plugin, with its settings. It makes a [`GuideLearner`], which takes in what the paths of a run have
//! noted, tile after tile, and makes a [`GuideField`] of it after each iteration. A field never changes; so it has the
//! same bits for any number of threads. At a vertex it gives [`GuidedDirections`], which are read once and then used
//! for sampling, for densities, and for the weights of emitter sampling alike: otherwise pictures would be biased.
//!
//! A guide never stands alone. Directions come from the mixture of the guide and the BSDF, and the probability of the
//! guide is at most [`MOST_GUIDED`], so that whatever a field has learnt, right or wrong, no light is lost.

use super::{Arena, SurfaceHit};
use crate::math::{Aabb, Vec2, Vec3};
use std::sync::Arc;

/// The largest probability with which a direction comes from a guide.
pub const MOST_GUIDED: f32 = 0.95;

/// A plugin that guides paths.
pub trait Guide: Send + Sync {
    /// Somebody who knows nothing yet, for a scene inside `bounds`.
    fn start(&self, bounds: Aabb) -> Box<dyn GuideLearner>;

    /// How a run learns and what it keeps.
    fn training(&self) -> Training;
}

/// How a run learns and what it keeps of its iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Training {
    /// Iterations of one sample per pixel at the start, so that the field finds out where paths go.
    pub startup: u32,
    /// What becomes of the pictures of the iterations.
    pub combination: Combination,
    /// When lights are sampled.
    pub emitter_sampling: EmitterSampling,
    /// Whether light that emitter sampling also finds is learnt, times the weight of finding it by scattering.
    pub learn_direct: bool,
    /// Narrower lobes than this are not guided.
    pub least_roughness: f32,
    /// Directions that are tried at a vertex before one of them is chosen by the product of the BSDF and the light learnt.
    pub candidates: u32,
}

/// What becomes of the pictures of the iterations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combination {
    /// The last four are weighted by inverse mean variance.
    InverseVariance,
    /// Only the last one is kept.
    Last,
}

/// When lights are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmitterSampling {
    /// Lights are found by scattering only.
    Never,
    /// While little has been learnt.
    Kickstart,
    /// At every vertex.
    Always,
}

/// Takes in what paths have found.
pub trait GuideLearner: Send {
    /// Takes in the records of some tiles, in the order of the tiles.
    fn learn(&mut self, tiles: &[Vec<GuideRecord>]);

    /// Ends an iteration of so many samples per pixel: [`field`](Self::field) now has what was taken in.
    fn refine(&mut self, spp: u32);

    /// What was known at the end of the last iteration.
    fn field(&self) -> Arc<dyn GuideField>;

    /// What it holds, for the report: a few words per item.
    fn summary(&self) -> Vec<String>;
}

/// What has been learnt.
pub trait GuideField: Send + Sync {
    /// The directions learnt where a path is scattered; `None` where nothing is known. `one_sided` says that only the
    /// side of `hit.wi` can be reached.
    fn at<'g>(&'g self, hit: &SurfaceHit, one_sided: bool, arena: &'g Arena) -> Option<&'g dyn GuidedDirections>;

    /// The radiance that arrives at a point from world direction `d`, roughly; `None` where nothing is known.
    fn incident(&self, p: Vec3, d: Vec3) -> Option<f32>;

    /// Checks everything that must hold of the structure.
    ///
    /// # Errors
    /// What does not hold.
    fn validate(&self) -> Result<(), String>;
}

/// The directions learnt at a vertex.
pub trait GuidedDirections {
    /// Probability of taking a direction from the guide instead of the BSDF, in [0, [`MOST_GUIDED`]].
    fn p_guide(&self) -> f32;

    /// A world direction and its density per solid angle.
    fn sample(&self, u2: Vec2) -> (Vec3, f32);

    /// Density of a world direction per solid angle: that of [`sample`](Self::sample).
    fn pdf(&self, d: Vec3) -> f32;

    /// Light that arrives from a world direction, as a multiple of the mean over all that a diffuse surface would scatter,
    /// roughly.
    fn light(&self, d: Vec3) -> f32 {
        4.0 * std::f32::consts::PI * self.pdf(d)
    }
}

/// What a path has found out at one vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideRecord {
    /// The vertex.
    pub p: Vec3,
    /// World direction in which the path went on.
    pub d: Vec3,
    /// Estimate of the radiance from there, mean of the channels; not negative.
    pub radiance: f32,
    /// Estimate of the radiance that the vertex scattered, mean of the channels: radiance times the weight of the
    /// direction.
    pub scattered: f32,
    /// Density of the direction in the mixture that it was drawn from, per solid angle.
    pub pdf: f32,
    /// Density of the direction in the BSDF's sampling; of a delta lobe, its probability.
    pub pdf_bsdf: f32,
    /// Density of the direction in the guide; 0 if there was none.
    pub pdf_guide: f32,
    /// How the direction was found.
    pub kind: RecordKind,
}

/// How a recorded direction was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordKind {
    /// No guide was there.
    Unguided,
    /// From the mixture of guide and BSDF.
    Mixed,
    /// A delta lobe of a BSDF that also has smooth ones.
    Delta,
}
