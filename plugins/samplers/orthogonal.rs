//! `orthogonal`: orthogonal arrays, stratified in every choice of a few dimensions at once
//! (Jarosz et al. 2019, "Orthogonal array sampling for Monte Carlo rendering").
//!
//! Of strength 2 after Bose: any two of its dimensions make a grid with one point in each cell, and each dimension
//! alone is stratified finely. Higher strengths after Bush stratify that many dimensions together, coarser. An array
//! over s levels has s dimensions; then another array begins.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `sample_count` | integer | 4 | samples per pixel, rounded up to a prime to the power of `strength` |
//! | `seed` | integer | 0 | another number gives other noise |
//! | `jitter` | boolean | true | random places within the strata, not their centres |
//! | `strength` | integer | 2 | how many dimensions are stratified together |
//!
//! ```xml
//! <sampler type="orthogonal">
//!     <integer name="sample_count" value="49"/>
//! </sampler>
//! ```

use super::permutation::permute;
use super::{COMMON, Common, Counted, JITTER, dimension_key, in_stratum, jitters, pixel_key};
use lucerna_core::interfaces::{Sampler, mix};
use lucerna_core::math::{UVec2, Vec2};
use lucerna_core::sampling::PointSet;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "orthogonal",
    aliases: &[],
    summary: "orthogonal arrays, stratified across dimensions",
    params: &[
        COMMON,
        JITTER,
        &[Param::int("strength", 2, "how many dimensions are stratified together").range(2.0, 5.0)],
    ],
    build: Constructor::Sampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sampler> {
    let strength = p.int("strength") as u32;
    let common = Common::new(p, |asked| levels(asked, strength).pow(strength));
    Ok(Arc::new(Orthogonal { common, strength, jitter: p.bool("jitter") }))
}

/// The smallest prime whose power is large enough; the largest whose power fits 32 bits if there is none.
fn levels(asked: u32, strength: u32) -> u32 {
    let is_prime = |n: u32| n >= 2 && (2..).take_while(|d| d * d <= n).all(|d| !n.is_multiple_of(d));
    let fits = |n: u32| n.checked_pow(strength);
    let mut best = 2;
    for n in (2..).take_while(|n| fits(*n).is_some()).filter(|n| is_prime(*n)) {
        best = n;
        if fits(n).is_some_and(|count| count >= asked) {
            break;
        }
    }
    best
}

struct Orthogonal {
    common: Common,
    strength: u32,
    jitter: bool,
}

impl Sampler for Orthogonal {
    fn sample_count(&self) -> u32 {
        self.common.sample_count
    }

    fn seed(&self) -> u32 {
        self.common.seed
    }

    fn round_spp(&self, asked: u32) -> u32 {
        levels(asked, self.strength).pow(self.strength)
    }

    fn point_set(&self, seed: u32, spp: u32, _film_size: UVec2) -> Option<Box<dyn PointSet>> {
        let levels = levels(spp, self.strength);
        let count = levels.pow(self.strength);
        Some(Box::new(Points { seed, levels, count, strength: self.strength, jitter: self.jitter }))
    }
}

struct Points {
    seed: u32,
    levels: u32,
    count: u32,
    strength: u32,
    jitter: bool,
}

/// One row of an array: a sample.
struct Row {
    /// The sample's number in the array's own order.
    index: u32,
    /// What the array hashes from.
    key: u64,
}

impl Points {
    /// The row for a sample in the array that holds a dimension, and the (first) column of the dimension in it.
    fn row(&self, pixel: u64, counted: Counted, sample: u32, dimension: u32) -> (Row, u32) {
        // Pairs must not be torn apart: an array holds whole ones, at least one.
        let (held, columns) = match counted {
            Counted::Singles => (self.levels, 1),
            Counted::Pairs => (self.levels / 2, 2),
        };
        let key = dimension_key(pixel, counted, dimension / held);
        (Row { index: permute(sample % self.count, self.count, key as u32), key }, dimension % held * columns)
    }

    /// The value of a row in a column: its digits taken as a polynomial, evaluated at the column's number.
    fn level(&self, row: u32, column: u32) -> u32 {
        let (mut rest, mut power, mut sum) = (row, 1, 0);
        for _ in 0..self.strength {
            sum += u64::from(rest % self.levels) * power;
            rest /= self.levels;
            power = power * u64::from(column) % u64::from(self.levels);
        }
        (sum % u64::from(self.levels)) as u32
    }

    /// The number in a column; `fine` says which of the finer strata of its level the row takes.
    fn number(&self, row: &Row, column: u32, fine: u32, sample: u32) -> f32 {
        let key = mix(row.key ^ (u64::from(column) << 3 | 5));
        let strata = self.count / self.levels;
        let stratum = permute(self.level(row.index, column), self.levels, key as u32);
        let fine = permute(fine, strata, (key >> 32) as u32);
        let offset = if self.jitter { jitters(key, sample).0 } else { 0.5 };
        in_stratum(stratum * strata + fine, offset, self.count)
    }
}

impl PointSet for Points {
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        for (dimension, out) in (first..).zip(out) {
            let (row, column) = self.row(pixel, Counted::Singles, sample, dimension);
            // Level and higher digits determine a row, so the digits tell apart the rows of one level.
            *out = self.number(&row, column, row.index / self.levels, sample);
        }
    }

    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        for (dimension, out) in (first..).zip(out) {
            let (row, column) = self.row(pixel, Counted::Pairs, sample, dimension);
            let [fine_x, fine_y] = if self.strength == 2 {
                // As in correlated multi-jittering: each coordinate's fine stratum is the other's level.
                [self.level(row.index, column + 1), self.level(row.index, column)]
            } else {
                [row.index / self.levels; 2]
            };
            *out = Vec2::new(self.number(&row, column, fine_x, sample), self.number(&row, column + 1, fine_y, sample));
        }
    }
}
