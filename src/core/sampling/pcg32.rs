//! PCG32 (O'Neill 2014, "PCG: a family of simple fast space-efficient statistically good algorithms for random
//! number generation"), seeded and converted to floats as the reference renderer does, so that both can be compared
//! sample for sample.

/// A PCG32 generator: 64 bits of state, 2⁶³ selectable streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pcg32 {
    state: u64,
    increment: u64,
}

impl Pcg32 {
    /// Stream used where none is named.
    pub const DEFAULT_STREAM: u64 = 0xda3e_39cb_94b9_5bdb;
    const MULTIPLIER: u64 = 6_364_136_223_846_793_005;

    /// A generator at the start of a sequence.
    #[inline]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut pcg = Pcg32 { state: 0, increment: (stream << 1) | 1 };
        pcg.next_u32();
        pcg.state = pcg.state.wrapping_add(seed);
        pcg.next_u32();
        pcg
    }

    /// Uniform over all 32-bit integers.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(Self::MULTIPLIER).wrapping_add(self.increment);
        let xor_shifted = (((old >> 18) ^ old) >> 27) as u32;
        xor_shifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform in [0, 1): 23 bits.
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        f32::from_bits((self.next_u32() >> 9) | 0x3f80_0000) - 1.0
    }

    /// Uniform over `0..bound` without the bias of a plain remainder.
    pub fn next_below(&mut self, bound: u32) -> u32 {
        debug_assert!(bound > 0);
        let threshold = bound.wrapping_neg() % bound;
        loop {
            let u = self.next_u32();
            if u >= threshold {
                return u % bound;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First outputs of the published demo program (seed 42, stream 54).
    #[test]
    fn published_sequence() {
        let mut pcg = Pcg32::new(42, 54);
        let first: Vec<u32> = (0..6).map(|_| pcg.next_u32()).collect();
        assert_eq!(first, [0xa15c02b7, 0x7b47f409, 0xba1d3330, 0x83d2f293, 0xbfa4784b, 0xcbed606e]);
    }
}
