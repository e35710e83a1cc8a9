//! The numbers one pixel sample consumes.

use super::Pcg32;
use crate::math::{UVec2, Vec2};

/// How many numbers a [`PointSet`] hands over per call.
const BLOCK: usize = 8;

/// Numbers of a kind that lie between those of two branches: more than a path consumes, and whole blocks.
const FOR_ONE: u32 = 1 << 16;

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

    /// Goes over to the numbers for a branch of a path that splits. Each of a pixel sample has a number of its own, from 1;
    /// the branches of a number are as well distributed over the samples as the paths that they are of.
    pub fn enter_branch(&mut self, number: u32) {
        // Independent numbers are as good for one as for another.
        if let Source::Structured(blocks) = &mut self.0 {
            blocks.next_single = number.wrapping_mul(FOR_ONE);
            blocks.next_pair = number.wrapping_mul(FOR_ONE);
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every number tells its dimension.
    struct Dimensions;

    impl PointSet for Dimensions {
        fn singles(&self, _: UVec2, _: u32, first: u32, out: &mut [f32]) {
            (first..).zip(out).for_each(|(dimension, out)| *out = dimension as f32);
        }

        fn pairs(&self, _: UVec2, _: u32, first: u32, out: &mut [Vec2]) {
            (first..).zip(out).for_each(|(dimension, out)| *out = Vec2::splat(dimension as f32));
        }
    }

    #[test]
    fn branches_have_numbers_of_their_own() {
        let mut stream = Stream::structured(&Dimensions, UVec2::ZERO, 0);
        for vertex in 0..2 {
            let first = (2 * vertex) as f32;
            assert_eq!([stream.next_1d(), stream.next_1d(), stream.next_2d().y], [first, first + 1.0, vertex as f32]);
        }
        for number in [1, 2, 1000] {
            stream.enter_branch(number);
            let first = (number * FOR_ONE) as f32;
            assert_eq!([stream.next_1d(), stream.next_1d(), stream.next_2d().x], [first, first + 1.0, first]);
        }
    }
}
