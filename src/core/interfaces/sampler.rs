//! Where the random numbers of a pixel sample come from.

use crate::math::UVec2;
use crate::sampling::{Pcg32, PointSet, Stream};

/// A sampler plugin.
pub trait Sampler: Send + Sync {
    /// Samples per pixel the scene asks for, already rounded as [`round_spp`](Self::round_spp) says.
    fn sample_count(&self) -> u32;

    /// Offset to the seed.
    fn seed(&self) -> u32 {
        0
    }

    /// The nearest number of samples per pixel the sampler can do, not below 1.
    fn round_spp(&self, asked: u32) -> u32 {
        asked.max(1)
    }

    /// Whether the numbers of a sample do not depend on how many there will be: then the first samples of a long run are a
    /// short one, and its picture can be looked at on the way.
    fn is_sequence(&self) -> bool {
        false
    }

    /// The point set for a run, or `None` for independent numbers. `spp` is what
    /// [`round_spp`](Self::round_spp) gave.
    fn point_set(&self, seed: u32, spp: u32, film_size: UVec2) -> Option<Box<dyn PointSet>>;
}

/// The numbers of pixel sample `(pixel, sample)`: independent ones if there is no point set.
///
/// A pure function of its arguments, so that any sample of any run can be replayed.
pub fn stream<'a>(points: Option<&'a dyn PointSet>, seed: u32, pixel: UVec2, sample: u32) -> Stream<'a> {
    match points {
        Some(points) => Stream::structured(points, pixel, sample),
        None => {
            let key = (u64::from(pixel.x) << 32) | u64::from(pixel.y);
            Stream::independent(Pcg32::new(mix(key ^ mix(u64::from(seed))), mix(u64::from(sample).wrapping_add(key))))
        }
    }
}

/// A bijection of 64-bit integers that spreads every input bit over all output bits (Steele, Lea, Flood 2014,
/// "Fast splittable pseudorandom number generators", variant 13).
#[inline]
pub fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
