//! `ldsampler`: the points of a (0, 2)-sequence, with randomly flipped digits and in random order per dimension
//! (Kollig and Keller 2002, "Efficient multidimensional sampling").
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `sample_count` | integer | 4 | samples per pixel, rounded up to a power of four |
//! | `seed` | integer | 0 | another number gives other noise |
//!
//! ```xml
//! <sampler type="ldsampler">
//!     <integer name="sample_count" value="64"/>
//! </sampler>
//! ```

use super::permutation::permute;
use super::{COMMON, Common, Counted, dimension_key, pixel_key};
use lucerna_core::interfaces::{Sampler, mix};
use lucerna_core::math::{UVec2, Vec2};
use lucerna_core::sampling::{PointSet, sobol};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "ldsampler",
    aliases: &[],
    summary: "(0, 2)-sequence with randomly flipped digits",
    params: &[COMMON],
    build: Constructor::Sampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sampler> {
    Ok(Arc::new(LowDiscrepancy(Common::new(p, next_power))))
}

/// The next power of four from 4 on, at most 2³⁰.
fn next_power(asked: u32) -> u32 {
    let mut power = 4;
    while power < asked && power < 1 << 30 {
        power *= 4;
    }
    power
}

struct LowDiscrepancy(Common);

impl Sampler for LowDiscrepancy {
    fn sample_count(&self) -> u32 {
        self.0.sample_count
    }

    fn seed(&self) -> u32 {
        self.0.seed
    }

    fn round_spp(&self, asked: u32) -> u32 {
        next_power(asked)
    }

    fn point_set(&self, seed: u32, spp: u32, _film_size: UVec2) -> Option<Box<dyn PointSet>> {
        Some(Box::new(Points { seed, count: next_power(spp) }))
    }
}

struct Points {
    seed: u32,
    count: u32,
}

impl PointSet for Points {
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        for (dimension, out) in (first..).zip(out) {
            let key = dimension_key(pixel, Counted::Singles, dimension);
            let index = permute(sample % self.count, self.count, key as u32);
            *out = sobol::to_unit(index.reverse_bits() ^ (key >> 32) as u32);
        }
    }

    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        for (dimension, out) in (first..).zip(out) {
            let key = dimension_key(pixel, Counted::Pairs, dimension);
            let index = permute(sample % self.count, self.count, key as u32);
            let flips = mix(key);
            *out = Vec2::new(
                sobol::to_unit(index.reverse_bits() ^ flips as u32),
                sobol::to_unit(sobol::second_reversed(index).reverse_bits() ^ (flips >> 32) as u32),
            );
        }
    }
}
