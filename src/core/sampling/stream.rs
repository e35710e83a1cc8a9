//! The numbers one pixel sample consumes.

use super::Pcg32;
use crate::interfaces::mix;
use crate::math::{UVec2, Vec2};

/// How many numbers a [`PointSet`] hands over per call.
const BLOCK: usize = 8;

/// A set of well-distributed points, asked for in blocks so that no virtual call is made per number.
///
/// A point of pixel sample `(pixel, sample)` is a pure function of these two, the seed and the dimension. One- and
/// two-dimensional numbers are counted apart: a pair is stratified as a pair.
pub trait PointSet: Send + Sync {
    /// One-dimensional numbers `first..first + out.len()` of a pixel sample, each in [0, 1).
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]);
    /// Two-dimensional numbers `first..first + out.len()` of a pixel sample, each in [0, 1)².
    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]);
}

/// The stream of numbers in [0, 1) that a pixel sample consumes.
pub struct Stream<'a>(Source<'a>);

/// Independent numbers come straight from a [`Pcg32`]; anything else comes from a [`PointSet`] in blocks.
#[allow(clippy::large_enum_variant)] // lives on the stack, for one pixel sample
enum Source<'a> {
    Independent(Pcg32),
    Structured(Blocks<'a>),
}

struct Blocks<'a> {
    points: &'a dyn PointSet,
    pixel: UVec2,
    sample: u32,
    singles: [f32; BLOCK],
    pairs: [Vec2; BLOCK],
    next_single: u32,
    next_pair: u32,
}

impl<'a> Stream<'a> {
    /// Independent numbers.
    #[inline]
    pub fn independent(pcg: Pcg32) -> Self {
        Stream(Source::Independent(pcg))
    }

    /// Numbers of a point set.
    pub fn structured(points: &'a dyn PointSet, pixel: UVec2, sample: u32) -> Self {
        Stream(Source::Structured(Blocks {
            points,
            pixel,
            sample,
            singles: [0.0; BLOCK],
            pairs: [Vec2::ZERO; BLOCK],
            next_single: 0,
            next_pair: 0,
        }))
    }

    /// What the [`branch`](Self::branch)es of a path that splits depend on; drawn from this stream.
    pub fn key(&mut self) -> u64 {
        let u2 = self.next_2d();
        u64::from(u2.x.to_bits()) << 32 | u64::from(u2.y.to_bits())
    }

    /// Independent numbers for one branch of several.
    pub fn branch(key: u64, index: u32) -> Self {
        Stream::independent(Pcg32::new(mix(key), mix(key ^ u64::from(index).rotate_right(16))))
    }

    /// The next number.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        match &mut self.0 {
            Source::Independent(pcg) => pcg.next_f32(),
            Source::Structured(blocks) => blocks.next_1d(),
        }
    }

    /// The next pair; of independent numbers, x is drawn first.
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        match &mut self.0 {
            Source::Independent(pcg) => {
                let x = pcg.next_f32();
                Vec2::new(x, pcg.next_f32())
            }
            Source::Structured(blocks) => blocks.next_2d(),
        }
    }
}

impl Blocks<'_> {
    fn next_1d(&mut self) -> f32 {
        let slot = self.next_single as usize % BLOCK;
        if slot == 0 {
            self.points.singles(self.pixel, self.sample, self.next_single, &mut self.singles);
        }
        self.next_single += 1;
        self.singles[slot]
    }

    fn next_2d(&mut self) -> Vec2 {
        let slot = self.next_pair as usize % BLOCK;
        if slot == 0 {
            self.points.pairs(self.pixel, self.sample, self.next_pair, &mut self.pairs);
        }
        self.next_pair += 1;
        self.pairs[slot]
    }
}
