//! `independent`: numbers that have nothing to do with each other.
//!
//! From a PCG32 generator per pixel sample. Noisier than the structured samplers, and never wrong.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `sample_count` | integer | 4 | samples per pixel |
//! | `seed` | integer | 0 | another number gives other noise |
//!
//! ```xml
//! <sampler type="independent">
//!     <integer name="sample_count" value="64"/>
//! </sampler>
//! ```

use super::{COMMON, Common};
use lucerna_core::interfaces::Sampler;
use lucerna_core::math::UVec2;
use lucerna_core::sampling::PointSet;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "independent",
    aliases: &[],
    summary: "numbers that have nothing to do with each other",
    params: &[COMMON],
    build: Constructor::Sampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sampler> {
    Ok(Arc::new(Independent(Common::new(p, |asked| asked))))
}

struct Independent(Common);

impl Sampler for Independent {
    fn sample_count(&self) -> u32 {
        self.0.sample_count
    }

    fn seed(&self) -> u32 {
        self.0.seed
    }

    fn is_sequence(&self) -> bool {
        true
    }

    fn point_set(&self, _seed: u32, _spp: u32, _film_size: UVec2) -> Option<Box<dyn PointSet>> {
        None
    }
}
