//! Tabulated distributions: discrete, and piecewise constant or linear over a grid.

use crate::math::ONE_MINUS_EPSILON;

/// A discrete distribution over indices, by its cumulative sums in double precision (so that 10⁶ entries, one of
/// them 10⁶ times the others, keep their exact chances).
#[derive(Clone, Debug)]
pub struct Discrete {
    /// `cdf[i]` is the sum of all weights up to and including `i`.
    cdf: Vec<f64>,
    /// For each of 2ᵏ equal parts of [0, 1] and its end: the first entry whose sum is beyond the part's beginning. So a
    /// search looks at few entries, however many there are (Chen and Asau 1974, "On generating random variates from an
    /// empirical distribution").
    guide: Vec<u32>,
    first: u32,
    last: u32,
}

impl Discrete {
    /// From non-negative finite weights. `None` if their sum is zero or not finite.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sum = 0.0;
        let cdf: Vec<f64> = weights
            .into_iter()
            .map(|w| {
                debug_assert!(w >= 0.0);
                sum += w;
                sum
            })
            .collect();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let first = cdf.partition_point(|&c| c <= 0.0) as u32;
        let last = cdf.partition_point(|&c| c < sum) as u32;
        let parts = cdf.len().next_power_of_two();
        let mut at = 0;
        let guide = (0..=parts).map(|part| {
            let target = part as f64 / parts as f64 * sum;
            at += cdf[at..].iter().take_while(|&&c| c <= target).count();
            at as u32
        });
        Some(Discrete { guide: guide.collect(), cdf, first, last })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cdf.len()
    }

    /// Never: a distribution has at least one entry.
    pub fn is_empty(&self) -> bool {
        self.cdf.is_empty()
    }

    /// Sum of the weights.
    #[inline]
    pub fn sum(&self) -> f64 {
        self.cdf[self.last as usize]
    }

    /// Probability of an index.
    #[inline]
    pub fn pmf(&self, index: u32) -> f32 {
        (self.weight(index) / self.sum()) as f32
    }

    fn weight(&self, index: u32) -> f64 {
        let i = index as usize;
        self.cdf[i] - if i == 0 { 0.0 } else { self.cdf[i - 1] }
    }

    /// The index a number in [0, 1) falls on; never one of weight zero.
    #[inline]
    pub fn sample(&self, u: f32) -> u32 {
        self.sample_long(f64::from(u))
    }

    /// As [`sample`](Self::sample), for a number with more bits than single precision has: of use where there are so many
    /// entries that some would get few of 2²⁴ numbers.
    #[inline]
    pub fn sample_long(&self, u: f64) -> u32 {
        let target = u * self.sum();
        // Exact, since the number of parts is a power of two: the entry is where a search over all would find it.
        let parts = self.guide.len() - 1;
        let part = ((u * parts as f64) as usize).min(parts - 1);
        let [begin, end] = [self.guide[part], self.guide[part + 1]].map(|i| i as usize);
        let index = begin + self.cdf[begin..end].partition_point(|&c| c <= target);
        (index as u32).clamp(self.first, self.last)
    }

    /// As [`sample`](Self::sample), with the part of `u` that was not used stretched to [0, 1).
    #[inline]
    pub fn sample_reuse(&self, u: f32) -> (u32, f32) {
        let index = self.sample(u);
        let below = if index == 0 { 0.0 } else { self.cdf[index as usize - 1] };
        let rest = (f64::from(u) * self.sum() - below) / self.weight(index);
        (index, (rest as f32).clamp(0.0, ONE_MINUS_EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_an_impossible_index() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 0.0]).unwrap();
        for (u, index) in [(0.0, 1), (0.2499, 1), (0.25, 3), (ONE_MINUS_EPSILON, 3)] {
            assert_eq!(d.sample(u), index);
        }
        assert_eq!((d.pmf(1), d.pmf(2), d.pmf(3)), (0.25, 0.0, 0.75));
        let (index, rest) = d.sample_reuse(0.625);
        assert_eq!((index, rest), (3, 0.5));
        assert!(Discrete::new([0.0, 0.0]).is_none());
    }

    #[test]
    fn the_guide_leads_where_a_full_search_does() {
        let mut pcg = crate::sampling::Pcg32::new(1, 2);
        for len in [1, 2, 3, 7, 64, 1000] {
            let weights: Vec<f64> = (0..len).map(|_| f64::from(pcg.next_f32().powi(8))).collect();
            let d = Discrete::new(weights).unwrap();
            for i in 0..2000 {
                let u = if i < 1000 { i as f32 / 1000.0 } else { pcg.next_f32() };
                let target = f64::from(u) * d.sum();
                let full = d.cdf.partition_point(|&c| c <= target) as u32;
                assert_eq!(d.sample(u), full.clamp(d.first, d.last), "{len} {u}");
            }
        }
    }
}
