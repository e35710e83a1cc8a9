//! Ratios of times that hold on a machine that does other things, too: by ranks, which outliers hardly move.

use super::metrics::Interval;

/// Pairs beyond which the mean of logarithms does as well, and the number of Walsh averages grows unwieldy.
const MOST_PAIRS: usize = 200;

/// How many times as large values are as those they belong to: the median of all means of two logarithms of quotients
/// (Hodges and Lehmann 1963), with the interval that belongs to Wilcoxon's signed-rank test. One slow run in ten moves it
/// little, and needs no normal distribution. Of fewer than six pairs there is no such interval of 95 %, and of more than 200
/// no need: then [`Interval::of_ratio`]. `None` if a value is not positive.
pub fn typical_ratio(above: &[f64], below: &[f64]) -> Option<Interval> {
    let logs: Vec<f64> = above.iter().zip(below).map(|(a, b)| (a / b).ln()).collect();
    if logs.iter().any(|log| !log.is_finite()) {
        return None;
    }
    let Some(outermost) = (logs.len() <= MOST_PAIRS).then(|| outside(logs.len())).flatten() else {
        return Interval::of_ratio(above, below);
    };
    let mut walsh: Vec<f64> = Vec::with_capacity(logs.len() * (logs.len() + 1) / 2);
    for (i, a) in logs.iter().enumerate() {
        walsh.extend(logs[i..].iter().map(|b| 0.5 * (a + b)));
    }
    walsh.sort_by(f64::total_cmp);
    let last = walsh.len() - 1;
    let middle = 0.5 * (walsh[last / 2] + walsh[walsh.len() / 2]);
    let bounds = [walsh[outermost], walsh[last - outermost]];
    Some(Interval { value: middle.exp(), bounds: Some(bounds.map(f64::exp)) })
}

/// How many of the smallest Walsh averages of `n` values lie below the interval: one less than the most c for which a
/// signed-rank sum below c has at most half of the chance [`Interval::MISS`]. `None` if there is no such c.
fn outside(n: usize) -> Option<usize> {
    // Each rank is in the sum or not, with equal chance.
    let mut chances = vec![0.0; n * (n + 1) / 2 + 1];
    chances[0] = 1.0;
    for rank in 1..=n {
        for sum in (0..chances.len()).rev() {
            let with = if sum >= rank { chances[sum - rank] } else { 0.0 };
            chances[sum] = 0.5 * (chances[sum] + with);
        }
    }
    let mut below = 0.0;
    let allowed = chances.iter().take_while(|chance| {
        below += **chance;
        below <= 0.5 * Interval::MISS
    });
    allowed.count().checked_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    /// The critical values of tables (Hollander and Wolfe 1999, table A.4), at 5 %, two-sided.
    #[test]
    fn critical_values_are_those_of_tables() {
        assert_eq!([4, 5, 6, 8, 10, 20].map(outside), [None, None, Some(0), Some(3), Some(8), Some(52)]);
    }

    #[test]
    fn outliers_hardly_count() {
        let below = [1.0, 2.0, 1.0, 4.0, 1.0, 1.0, 3.0, 1.0, 1.0, 2.0];
        let mut above = below.map(|v| 1.1 * v);
        // Another program ran for a while.
        above[3] *= 30.0;
        let found = typical_ratio(&above, &below).unwrap();
        let [low, high] = found.bounds.unwrap();
        assert!((found.value - 1.1).abs() < 1e-9 && low > 1.09 && high < 7.0, "{found:?}");
        let mean = Interval::of_ratio(&above, &below).unwrap();
        assert!(!mean.excludes(1.0), "the mean loses it: {mean:?}");
        assert_eq!(typical_ratio(&[0.0], &[1.0]), None);
        assert_eq!(typical_ratio(&[2.0, 2.0], &[1.0, 1.0]).unwrap().value, 2.0);
    }

    /// The interval holds the true ratio in about 95 of 100 cases (97.6 % is the next for ten pairs; it is discrete).
    #[test]
    fn intervals_cover() {
        let mut pcg = Pcg32::new(5, 6);
        let held = (0..4000).filter(|_| {
            let above: Vec<f64> = (0..10).map(|_| (0.3 * f64::from(pcg.next_f32() - 0.5)).exp()).collect();
            !typical_ratio(&above, &[1.0; 10]).unwrap().excludes(1.0)
        });
        let share = held.count() as f64 / 4000.0;
        assert!((share - 0.951).abs() < 0.012, "{share}");
    }
}
