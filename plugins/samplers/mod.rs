//! All samplers: one file each, one line each in [`PLUGINS`].
//!
//! Numbers are pure functions of seed, pixel, sample and dimension: any sample can be replayed alone. What a structured
//! sampler permutes, it permutes by a hash of these.

mod independent;
mod ldsampler;
mod multijitter;
mod orthogonal;
mod permutation;
mod sobol;
mod strata;
mod stratified;

use lucerna_core::interfaces::mix;
use lucerna_core::math::{ONE_MINUS_EPSILON, UVec2};
use lucerna_core::scene::{Param, Plugin, Properties};

/// The table of all samplers.
pub const PLUGINS: &[Plugin] = &[
    independent::PLUGIN,
    ldsampler::PLUGIN,
    multijitter::PLUGIN,
    orthogonal::PLUGIN,
    sobol::PLUGIN,
    stratified::PLUGIN,
];

/// What every sampler accepts.
const COMMON: &[Param] = &[
    Param::int("sample_count", 4, "samples per pixel").range(1.0, u32::MAX as f64),
    Param::int("seed", 0, "another number gives other noise").range(0.0, u32::MAX as f64),
];

/// What samplers with strata accept.
const JITTER: &[Param] = &[Param::bool("jitter", true, "random places within the strata, not their centres")];

/// What every sampler is told. The table keeps both numbers in range.
#[derive(Clone, Copy)]
struct Common {
    sample_count: u32,
    seed: u32,
}

impl Common {
    /// Reads the parameters; tells the user where the number of samples had to be rounded.
    fn new(p: &Properties<'_>, round: impl Fn(u32) -> u32) -> Self {
        let asked = p.int("sample_count") as u32;
        let sample_count = round(asked);
        if sample_count != asked {
            let plugin = p.plugin_name();
            p.warn("sample_count", format!("\"{plugin}\" takes {sample_count} samples per pixel instead of {asked}"));
        }
        Common { sample_count, seed: p.int("seed") as u32 }
    }
}

/// What all numbers of a pixel hash from. `round` counts repetitions of a finite point set.
#[inline]
fn pixel_key(seed: u32, pixel: UVec2, round: u32) -> u64 {
    let place = u64::from(pixel.x) << 32 | u64::from(pixel.y);
    mix(place ^ mix(u64::from(seed) << 32 | u64::from(round)))
}

/// Which of the two counts of dimensions a number belongs to.
#[derive(Clone, Copy)]
enum Counted {
    Singles,
    Pairs,
}

/// What a dimension of a pixel hashes from.
#[inline]
fn dimension_key(pixel: u64, counted: Counted, dimension: u32) -> u64 {
    mix(pixel ^ (u64::from(dimension) << 1 | counted as u64))
}

/// Two numbers in [0, 1) for a sample of a dimension: where in its stratum a point lies.
#[inline]
fn jitters(dimension_key: u64, sample: u32) -> (f32, f32) {
    let bits = mix(dimension_key ^ u64::from(sample).wrapping_mul(0xd6e8_feb8_6659_fd93));
    let unit = |bits: u32| (bits >> 8) as f32 * (1.0 / 16_777_216.0);
    (unit(bits as u32), unit((bits >> 32) as u32))
}

/// Point `offset` of stratum `stratum` of `count`, never 1.
#[inline]
fn in_stratum(stratum: u32, offset: f32, count: u32) -> f32 {
    ((f64::from(stratum) + f64::from(offset)) / f64::from(count)).min(f64::from(ONE_MINUS_EPSILON)) as f32
}

#[cfg(test)]
mod tests;
