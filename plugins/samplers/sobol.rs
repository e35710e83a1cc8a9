//! `sobol`: Owen-scrambled points of a (0, 2)-sequence; the default.
//!
//! Every pair of numbers comes from the first two dimensions of Sobol's sequence, scrambled and put in another order
//! for each pixel and dimension ("padding"; Burley 2020, "Practical hash-based Owen scrambling"). Any number of samples
//! is allowed and more can be added; powers of two are best: then every elementary interval of each pair is hit equally
//! often.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `sample_count` | integer | 4 | samples per pixel, best a power of two |
//! | `seed` | integer | 0 | another number gives other noise |
//!
//! ```xml
//! <sampler type="sobol">
//!     <integer name="sample_count" value="64"/>
//! </sampler>
//! ```

use super::{COMMON, Common, Counted, dimension_key, pixel_key};
use lucerna_core::interfaces::{Sampler, mix};
use lucerna_core::math::{UVec2, Vec2};
use lucerna_core::sampling::{PointSet, sobol};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "sobol",
    aliases: &[],
    summary: "Owen-scrambled low-discrepancy points, the default",
    params: &[COMMON],
    build: Constructor::Sampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sampler> {
    Ok(Arc::new(Sobol(Common::new(p, |asked| asked))))
}

struct Sobol(Common);

impl Sampler for Sobol {
    fn sample_count(&self) -> u32 {
        self.0.sample_count
    }

    fn seed(&self) -> u32 {
        self.0.seed
    }

    fn is_sequence(&self) -> bool {
        true
    }

    fn point_set(&self, seed: u32, _spp: u32, _film_size: UVec2) -> Option<Box<dyn PointSet>> {
        Some(Box::new(Points { seed }))
    }
}

struct Points {
    seed: u32,
}

impl PointSet for Points {
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        let (key, reversed) = (pixel_key(self.seed, pixel, 0), sample.reverse_bits());
        for (dimension, out) in (first..).zip(out) {
            let seeds = dimension_key(key, Counted::Singles, dimension);
            *out = sobol::scrambled_single(sobol::shuffled(reversed, seeds as u32), (seeds >> 32) as u32);
        }
    }

    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]) {
        let (key, reversed) = (pixel_key(self.seed, pixel, 0), sample.reverse_bits());
        for (dimension, out) in (first..).zip(out) {
            let seeds = dimension_key(key, Counted::Pairs, dimension);
            let index = sobol::shuffled(reversed, seeds as u32);
            let third = mix(seeds) as u32;
            *out = sobol::scrambled_pair(index, [(seeds >> 32) as u32, third]);
        }
    }
}
