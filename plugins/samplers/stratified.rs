//! `stratified`: one point in each cell of a square grid.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `sample_count` | integer | 4 | samples per pixel, rounded up to a square |
//! | `seed` | integer | 0 | another number gives other noise |
//! | `jitter` | boolean | true | random places within the cells, not their centres |
//!
//! ```xml
//! <sampler type="stratified">
//!     <integer name="sample_count" value="64"/>
//! </sampler>
//! ```

use super::strata::Strata;
use super::{COMMON, Common, JITTER, in_stratum};
use lucerna_core::interfaces::Sampler;
use lucerna_core::math::{UVec2, Vec2};
use lucerna_core::sampling::PointSet;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "stratified",
    aliases: &[],
    summary: "one point in each cell of a grid",
    params: &[COMMON, JITTER],
    build: Constructor::Sampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sampler> {
    Ok(Arc::new(Stratified { common: Common::new(p, next_square), jitter: p.bool("jitter") }))
}

/// The next square, at most 65535².
fn next_square(asked: u32) -> u32 {
    let side = f64::from(asked.max(1)).sqrt().ceil().min(65535.0) as u32;
    side * side
}

struct Stratified {
    common: Common,
    jitter: bool,
}

impl Sampler for Stratified {
    fn sample_count(&self) -> u32 {
        self.common.sample_count
    }

    fn seed(&self) -> u32 {
        self.common.seed
    }

    fn round_spp(&self, asked: u32) -> u32 {
        next_square(asked)
    }

    fn point_set(&self, seed: u32, spp: u32, _film_size: UVec2) -> Option<Box<dyn PointSet>> {
        let count = next_square(spp);
        Some(Box::new(Points {
            strata: Strata { seed, count, jitter: self.jitter },
            side: f64::from(count).sqrt() as u32,
        }))
    }
}

struct Points {
    strata: Strata,
    side: u32,
}

impl PointSet for Points {
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        self.strata.singles(pixel, sample, first, out);
    }

    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]) {
        let side = self.side;
        self.strata.pairs((pixel, sample), first, out, |_, cell, offset| {
            Vec2::new(in_stratum(cell % side, offset.x, side), in_stratum(cell / side, offset.y, side))
        });
    }
}
