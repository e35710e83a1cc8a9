//! `throughput`: a path goes on with the probability that is its throughput.
//!
//! From the integrator's `rr_depth` on a path goes on with a probability that is the largest channel of its throughput,
//! at most 0.95 (Arvo and Kirk 1990), with the compression of radiance in dense media taken out. What the reference
//! does, and what `path` does without a roulette and a guide: the pictures have the same bits. A guide takes directions
//! from which much light comes more often, and the throughput falls by as much: there it ends the paths that matter.
//!
//! No parameters.
//!
//! ```xml
//! <integrator type="path">
//!     <roulette type="throughput"/>
//! </integrator>
//! ```

use super::survival;
use lucerna_core::interfaces::{PathState, Roulette};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "throughput",
    aliases: &[],
    summary: "paths end by their throughput",
    params: &[],
    build: Constructor::Roulette(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn Roulette> {
    Ok(Arc::new(ByThroughput))
}

/// The decision.
pub(crate) struct ByThroughput;

impl Roulette for ByThroughput {
    #[inline]
    fn survival(&self, path: &PathState) -> f32 {
        survival(path.throughput, path.eta)
    }
}
