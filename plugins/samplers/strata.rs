//! What samplers that shuffle strata share: one sample in each stratum of every dimension, in an order of its own.

use super::permutation::permute;
use super::{Counted, dimension_key, in_stratum, jitters, pixel_key};
use lucerna_core::math::{UVec2, Vec2};

/// So many strata per dimension, one for each sample; more samples begin anew with other numbers.
pub struct Strata {
    /// Chooses the numbers.
    pub seed: u32,
    /// Number of strata and of samples.
    pub count: u32,
    /// Whether a sample lies anywhere in its stratum, or in its middle.
    pub jitter: bool,
}

impl Strata {
    fn offset(&self, key: u64, sample: u32) -> Vec2 {
        if self.jitter { jitters(key, sample).into() } else { Vec2::splat(0.5) }
    }

    /// One-dimensional numbers, as [`PointSet::singles`](lucerna_core::sampling::PointSet::singles).
    pub fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        let sample = sample % self.count;
        for (dimension, out) in (first..).zip(out) {
            let key = dimension_key(pixel, Counted::Singles, dimension);
            let stratum = permute(sample, self.count, key as u32);
            *out = in_stratum(stratum, self.offset(key, sample).x, self.count);
        }
    }

    /// Pairs, as [`PointSet::pairs`](lucerna_core::sampling::PointSet::pairs): `place` puts a point into a cell, given
    /// the dimension's key and where in the cell it lies.
    #[inline]
    pub fn pairs(
        &self,
        (pixel, sample): (UVec2, u32),
        first: u32,
        out: &mut [Vec2],
        place: impl Fn(u64, u32, Vec2) -> Vec2,
    ) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        let sample = sample % self.count;
        for (dimension, out) in (first..).zip(out) {
            let key = dimension_key(pixel, Counted::Pairs, dimension);
            *out = place(key, permute(sample, self.count, key as u32), self.offset(key, sample));
        }
    }
}
