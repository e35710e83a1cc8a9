//! `albedo`: a path goes on with the probability that is the product of the albedos on its way.
//!
//! As `throughput`, but at guided vertices the throughput counts as if it fell by the albedo only: what a path is worth
//! is its throughput times the light ahead, and a guide lowers the one where it raises the other (Müller 2019,
//! "Practical Path Guiding in Production", section 10.6). Where the guide was wrong the throughput is larger, and
//! counts. Without a guide it is the same as `throughput`. Nothing has to be learnt for it; `adjoint`, which guided paths
//! go by unless another is named, knows the light ahead.
//!
//! No parameters.
//!
//! ```xml
//! <integrator type="path">
//!     <guide type="sd_tree"/>
//!     <roulette type="albedo"/>
//! </integrator>
//! ```

use super::survival;
use lucerna_core::interfaces::{PathState, Roulette};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "albedo",
    aliases: &[],
    summary: "paths end by the product of albedos",
    params: &[],
    build: Constructor::Roulette(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn Roulette> {
    Ok(Arc::new(ByAlbedo))
}

struct ByAlbedo;

impl Roulette for ByAlbedo {
    fn survival(&self, path: &PathState) -> f32 {
        survival(path.prospects, path.eta)
    }
}
