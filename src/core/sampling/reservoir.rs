//! One of several candidates, with a probability in proportion to its worth.

use crate::math::{ONE_MINUS_EPSILON, Vec2};

/// The first point of the R2 sequence, the two-dimensional Kronecker sequence of lowest discrepancy known: powers of
/// one over the plastic number, the root of x³ = x + 1 (Roberts 2018, "The unreasonable effectiveness of quasirandom
/// sequences").
const R2: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

/// Point `i` of the R2 sequence, rotated by `shift` in [0, 1)²: any number of points that are spread evenly, each of
/// them uniform if `shift` is.
#[inline]
pub fn r2(shift: Vec2, i: u32) -> Vec2 {
    (shift + R2 * i as f32).fract().min(Vec2::splat(ONE_MINUS_EPSILON))
}

/// Keeps one of the candidates that it is offered, each with the probability worth/Σ worth, in one pass (Chao 1982, "A
/// general purpose unequal probability sampling plan"; of one item).
///
/// One random number decides about all: the newer candidate takes the place with its share of what there is so far, and
/// what is left of the number is a random number again.
pub struct Reservoir<T> {
    kept: Option<(T, f32)>,
    total: f32,
    rest: f32,
}

impl<T> Reservoir<T> {
    /// Nothing yet; `u` in [0, 1) decides.
    #[inline]
    pub fn new(u: f32) -> Self {
        Reservoir { kept: None, total: 0.0, rest: u }
    }

    /// Offers a candidate. One of no worth, or of a worth that is no finite number, is passed over.
    #[inline]
    pub fn offer(&mut self, candidate: T, worth: f32) {
        if !(worth > 0.0 && worth.is_finite()) {
            return;
        }
        self.total += worth;
        let p = worth / self.total;
        if self.rest < p {
            self.rest /= p;
            self.kept = Some((candidate, worth));
        } else {
            self.rest = (self.rest - p) / (1.0 - p);
        }
        self.rest = self.rest.min(ONE_MINUS_EPSILON);
    }

    /// What is kept, and Σ worth/(M worth of it), one over M times its probability, if M candidates were drawn. `None`
    /// if none had any worth.
    #[inline]
    pub fn take(self, drawn: u32) -> Option<(T, f32)> {
        let total = self.total;
        self.kept.map(|(candidate, worth)| (candidate, total / (worth * drawn as f32)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over evenly spread numbers each candidate is kept as often as its worth says, and what is left is evenly spread
    /// again: a second choice by it does not depend on the first.
    #[test]
    fn candidates_are_kept_by_worth_and_numbers_are_used_up_evenly() {
        const N: u32 = 40_000;
        let worths = [1.0, 0.0, 3.0, f32::NAN, 0.5, f32::INFINITY, 3.5];
        let (mut kept, mut upper) = ([0; 7], [0; 7]);
        for n in 0..N {
            let mut reservoir = Reservoir::new((n as f32 + 0.5) / N as f32);
            worths.iter().enumerate().for_each(|(i, worth)| reservoir.offer(i, *worth));
            let rest = reservoir.rest;
            assert!((0.0..1.0).contains(&rest), "{rest}");
            let (i, factor) = reservoir.take(5).expect("some have worth");
            assert!((factor - 8.0 / (5.0 * worths[i])).abs() < 1e-6, "{i}: {factor}");
            kept[i] += 1;
            upper[i] += u32::from(rest >= 0.5);
        }
        for (i, worth) in worths.into_iter().enumerate() {
            let expected = if worth.is_finite() { worth / 8.0 * N as f32 } else { 0.0 };
            assert!((kept[i] as f32 - expected).abs() < 4.0, "{i}: {} of {expected}", kept[i]);
            assert!((upper[i] as f32 - 0.5 * expected).abs() < 4.0, "{i}: {} of {}", upper[i], kept[i]);
        }
    }

    #[test]
    fn nothing_is_kept_where_nothing_has_worth() {
        let mut reservoir = Reservoir::new(0.0);
        [0.0, -1.0, f32::NAN].into_iter().for_each(|worth| reservoir.offer((), worth));
        assert!(reservoir.take(3).is_none());
        // The largest number below 1 is no exception: the first candidate of any worth is kept.
        let mut reservoir = Reservoir::new(ONE_MINUS_EPSILON);
        reservoir.offer("tiny", f32::from_bits(1));
        assert_eq!(reservoir.take(1), Some(("tiny", 1.0)));
    }

    /// Sixty-four points, wherever they begin: each eighth of either coordinate has from 6 to 10. That is the most that
    /// any rotation does; of independent points one in three would have fewer or more.
    #[test]
    fn points_are_spread_evenly() {
        for shift in [Vec2::ZERO, Vec2::new(0.3, 0.9), Vec2::splat(ONE_MINUS_EPSILON)] {
            let mut counts = [[0u32; 8]; 2];
            for p in (0..64).map(|i| r2(shift, i)) {
                assert!(p.min_element() >= 0.0 && p.max_element() < 1.0, "{p}");
                counts[0][(8.0 * p.x) as usize] += 1;
                counts[1][(8.0 * p.y) as usize] += 1;
            }
            assert!(counts.iter().flatten().all(|n| (6..=10).contains(n)), "{shift}: {counts:?}");
        }
    }
}
