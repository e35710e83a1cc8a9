//! Which direction a path takes: learnt from earlier samples.
//!
//! A [`Guide`] is the plugin, with its settings. It makes a [`GuideLearner`], which takes in what the paths of a run
//! have noted, tile after tile, and makes a [`GuideField`] of it after each iteration. A field never changes; so it has
//! the same bits for any number of threads. At a vertex it gives [`GuidedDirections`], which are read once and then
//! used for sampling, for densities, and for the weights of emitter sampling alike: otherwise pictures would be biased.
//!
//! A guide never stands alone. Directions come from the mixture of the guide and the BSDF, and the probability of the
//! guide is at most [`MOST_GUIDED`], so that whatever a field has learnt, right or wrong, no light is lost.

use super::{Arena, Bxdf, Lobes, Outlook, SurfaceHit};
use crate::io::{IoError, Result};
use crate::math::{Aabb, Vec2, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

/// The largest probability with which a direction comes from a guide.
pub const MOST_GUIDED: f32 = 0.95;

/// A plugin that guides paths.
pub trait Guide: Send + Sync {
    /// Somebody who knows nothing yet, for a scene inside `bounds`.
    fn start(&self, bounds: Aabb) -> Box<dyn GuideLearner>;

    /// How a run learns and what it keeps.
    fn training(&self) -> Training;

    /// The name of the plugin whose files of learnt state it reads and writes; `None` if it has none.
    fn kept_as(&self) -> Option<&'static str> {
        None
    }

    /// The file that a run begins with and leaves what it has learnt in, if the scene names one.
    fn file(&self) -> Option<GuideFile> {
        None
    }

    /// Somebody who knows what [`GuideLearner::save`] wrote of a scene inside the same `bounds`. The bytes may be
    /// anything; they are checked.
    ///
    /// # Errors
    /// If they are not what was written, in one line.
    fn recall(&self, _bounds: Aabb, _saved: &[u8]) -> Result<Box<dyn GuideLearner>> {
        Err(IoError::new("what this guide learns cannot be kept"))
    }
}

/// A file that a guided run begins with, if it is there, and leaves what it has learnt in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuideFile {
    /// The file.
    pub path: PathBuf,
    /// Nothing is learnt, and the file stays as it is.
    pub frozen: bool,
}

/// How a run learns and what it keeps of its iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Training {
    /// Iterations of one sample per pixel at the start, so that the field finds out where paths go.
    pub startup: u32,
    /// When the last iteration begins.
    pub ending: Ending,
    /// The part of the budget that may be spent when an iteration begins from which something is to be learnt. (Each is as
    /// long as all before it; where a run begins with a file, it counts as spent what that would take.) Half of it where no
    /// directions are learnt.
    pub learning: f64,
    /// What becomes of the pictures of the iterations.
    pub combination: Combination,
    /// When lights are sampled.
    pub emitter_sampling: EmitterSampling,
    /// Whether light that emitter sampling also finds is learnt, times the weight of finding it by scattering.
    pub learn_direct: bool,
    /// Narrower lobes than this are not guided.
    pub least_roughness: f32,
    /// The part of a guide's directions that go where the environment is bright, in scenes where emitter sampling cannot see
    /// all that a ray sees of it.
    pub to_environment: f32,
    /// The part of a guide's directions, at most, that go where [`Photon`]s came from, in scenes with surfaces that turn light
    /// without scattering it; 0 if none are sent out.
    pub to_photons: f32,
    /// Directions that are tried at a vertex before one of them is chosen by the product of the BSDF and the light
    /// learnt.
    pub candidates: u32,
}

/// When the last iteration begins, which has all that is left of the budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Once [`Training::learning`] of the budget is spent.
    Doubling,
    /// Then, or when the variance that the rest of the budget would leave no longer falls from iteration to iteration
    /// (Müller, Gross, Novák 2017, section 5).
    Variance,
}

/// What is learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Subjects {
    /// Where light comes from, so that paths are guided: [`GuideRecord`]s.
    pub directions: bool,
    /// What scattering brings, so that roulette can decide: [`VertexRecord`]s.
    pub outlook: bool,
}

/// What becomes of the pictures of the iterations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combination {
    /// All samples count alike.
    All,
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

/// Light that has arrived where paths are guided, on its way from a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where.
    pub p: Vec3,
    /// World direction to where it came from.
    pub d: Vec3,
    /// Its power times the number of those sent out, in the unit of radiance times m² sr, the mean of the channels; positive.
    pub power: f32,
}

/// Takes in what paths have found.
pub trait GuideLearner: Send {
    /// Takes in the records of some tiles, in the order of the tiles.
    fn learn(&mut self, tiles: &[Vec<GuideRecord>]);

    /// Takes in what the vertices in some tiles have scattered, in the order of the tiles.
    fn learn_outlook(&mut self, _tiles: &[Vec<VertexRecord>]) {}

    /// Takes in photons, when all records of an iteration are: all that have arrived so far, those told of before among them.
    fn learn_photons(&mut self, _photons: &[Photon]) {}

    /// Ends an iteration of so many samples per pixel: [`field`](Self::field) now has what was taken in.
    fn refine(&mut self, spp: u32);

    /// What was known at the end of the last iteration.
    fn field(&self) -> Arc<dyn GuideField>;

    /// What it holds, for the report: a few words per item.
    fn summary(&self) -> Vec<String>;

    /// All it knows, to the bit, for [`Guide::recall`].
    fn save(&self) -> Vec<u8> {
        Vec::new()
    }

    /// What it holds, in numbers.
    fn facts(&self) -> Vec<GuideFact> {
        Vec::new()
    }
}

/// Something that can be told of what was learnt.
#[derive(Clone, Debug, PartialEq)]
pub struct GuideFact {
    /// Its name, in words of lower case.
    pub name: &'static str,
    /// How much.
    pub value: FactValue,
}

/// A number or several.
#[derive(Clone, Debug, PartialEq)]
pub enum FactValue {
    /// A number of things.
    Count(u64),
    /// A number.
    Number(f64),
    /// The least and the largest.
    Range([f64; 2]),
    /// Numbers of things at depth 0, 1, 2, …
    PerDepth(Vec<u64>),
}

/// What has been learnt.
pub trait GuideField: Send + Sync {
    /// The number of the cell of space in which a point lies, by which [`at`](Self::at) and [`outlook`](Self::outlook) are
    /// asked: a vertex asks both, and looks for it once.
    fn cell(&self, p: Vec3) -> usize;

    /// The directions learnt where a path is scattered, in cell `cell`; `None` where nothing is known.
    fn at<'g>(
        &'g self,
        cell: usize,
        hit: &SurfaceHit,
        vertex: GuidedVertex,
        arena: &'g Arena,
    ) -> Option<&'g dyn GuidedDirections>;

    /// Whether paths are to be guided. If not, nobody asks [`at`](Self::at) or tells of directions.
    fn guides(&self) -> bool {
        true
    }

    /// Which sets of directions it has: what records must tell it.
    fn sets(&self) -> GuideSets {
        GuideSets::One
    }

    /// The radiance that arrives at a point from world direction `d`, roughly; `None` where nothing is known.
    fn incident(&self, p: Vec3, d: Vec3) -> Option<f32>;

    /// What scattering in a cell brings, on the side of a surface to which unit normal `n` points; `None` where too
    /// little is known.
    fn outlook(&self, _cell: usize, _n: Vec3) -> Option<Outlook> {
        None
    }

    /// Checks everything that must hold of the structure.
    ///
    /// # Errors
    /// What does not hold.
    fn validate(&self) -> std::result::Result<(), String>;
}

/// The sets of directions that a field has at each place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GuideSets {
    /// One, for all light and all vertices.
    #[default]
    One,
    /// One for light of emitters that a scattered ray runs into, another for the rest. Directions come from their mixture.
    DirectIndirect,
    /// One for the light that first hits scatter towards the camera, another for the light that arrives at later vertices.
    PrimaryProduct,
}

/// What a field is told about a vertex besides the hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GuidedVertex {
    /// Only the side of `hit.wi` can be reached.
    pub one_sided: bool,
    /// The first vertex of a path from the camera.
    pub primary: bool,
}

/// The directions learnt at a vertex.
pub trait GuidedDirections {
    /// Probability of taking a direction from the guide instead of the BSDF, in [0, [`MOST_GUIDED`]].
    fn p_guide(&self) -> f32;

    /// A world direction and its density per solid angle.
    fn sample(&self, u2: Vec2) -> (Vec3, f32);

    /// Density of a world direction per solid angle: that of [`sample`](Self::sample).
    fn pdf(&self, d: Vec3) -> f32;

    /// Densities of a world direction in the two sets of a field that has light met directly [apart](GuideSets), then in
    /// that of the rest. Where there is one alone its density stands for both.
    fn pdf_sets(&self, d: Vec3) -> [f32; 2] {
        [self.pdf(d); 2]
    }

    /// Light that arrives from a world direction, as a multiple of the mean over all that a diffuse surface would
    /// scatter, roughly.
    fn light(&self, d: Vec3) -> f32 {
        4.0 * std::f32::consts::PI * self.pdf(d)
    }
}

/// Whether directions at a BSDF with these lobes are guided: it scatters into more than single directions, and no lobe
/// is narrower than [`Training::least_roughness`].
#[inline]
pub fn is_guided(bxdf: &dyn Bxdf, lobes: Lobes, least_roughness: f32) -> bool {
    lobes.is_smooth() && bxdf.roughness() >= least_roughness
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
    /// The part of `radiance` that the emitter gives which the ray ran into.
    pub direct: f32,
    /// Estimate of the radiance that the vertex scattered, mean of the channels: radiance times the weight of the
    /// direction.
    pub scattered: f32,
    /// Density of the direction in the mixture that it was drawn from, per solid angle.
    pub pdf: f32,
    /// Density of the direction in the BSDF's sampling; of a delta lobe, its probability.
    pub pdf_bsdf: f32,
    /// Density of the direction in the guide; 0 if there was none.
    pub pdf_guide: f32,
    /// As [`GuidedDirections::pdf_sets`] gives them; 0 if there was no guide, or the field does not have light met directly
    /// apart.
    pub pdf_sets: [f32; 2],
    /// How the direction was found.
    pub kind: RecordKind,
    /// The first vertex of a path from the camera.
    pub primary: bool,
}

/// What one scattering at a vertex has brought: see [`Outlook`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexRecord {
    /// The vertex.
    pub p: Vec3,
    /// Unit normal on the side that light is scattered from.
    pub n: Vec3,
    /// Luminance of the estimate of the radiance scattered, over that of the albedo.
    pub light: f32,
    /// Rays that it took.
    pub cost: f32,
    /// Variance of `light` among the branches of a vertex that split, told with the last of them.
    pub spread: Option<f32>,
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
