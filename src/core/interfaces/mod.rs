//! One trait per kind of plugin.
//!
//! # Conventions, stated here and nowhere else
//!
//! * Directions have unit length and point *away* from the surface: `wi` towards where the path came from (the
//!   camera side), `wo` towards where it goes on. BSDF directions are local: z is the shading normal.
//! * BSDF values include `|cos θo|` except for delta lobes, whose value is the weight itself.
//! * Densities are per unit solid angle unless the name says `_area`, `_length` or `_discrete`.
//! * `None` means "no energy", never an error.
//! * Radiance is in W·m⁻²·sr⁻¹, linear sRGB primaries. Lengths are scene units. Angles are radians in code, degrees
//!   in scene files.
//! * Random numbers are in [0, 1), named `u`, `u1` (one), `u2` (two).
//! * Probabilities of mixtures are named for what they choose: `p_guide`, `p_bsdf`.
//! * `eta` is the index of refraction of the inside over that of the outside; on a scattering event, of the side the
//!   path goes to over the side it came from.

mod bsdf;
mod emitter;
mod film;
mod guide;
mod integrator;
mod light_sampler;
mod rfilter;
mod roulette;
mod sampler;
mod sensor;
mod shape;
mod surface;
mod texture;

pub use bsdf::{Arena, Bsdf, Bxdf, BxdfSample, Lobes, Transport};
pub use emitter::{Emitter, EmitterFlags, LightBounds, LightPoint, LightSample};
pub use film::{ComponentFormat, FileFormat, Film, FilmSettings, PixelFormat};
pub use guide::{
    Combination, EmitterSampling, Ending, FactValue, Guide, GuideFact, GuideField, GuideFile, GuideLearner,
    GuideRecord, GuideSets, GuidedDirections, GuidedVertex, MOST_GUIDED, Photon, RecordKind, Subjects, Training,
    VertexRecord, is_guided,
};
pub use integrator::{Integrator, Radiance, RadianceEstimator};
pub use light_sampler::{Light, LightSampler, LightSelection, LightVertex, long_number};
pub use rfilter::Rfilter;
pub use roulette::{Goal, LEAST_SURVIVAL, MOST_BRANCHES, Outlook, PathState, Roulette, continuations};
pub use sampler::{Sampler, mix, stream};
pub use sensor::{CameraRay, Sensor};
pub use shape::{AreaSample, Shape};
pub use surface::SurfaceHit;
pub use texture::{ColorSource, ScalarSource, Texture};
