//! The error that is left in a picture, estimated while it is rendered and without knowing the true one.
//!
//! Let x_n be the mean of the first n samples of a pixel and V(n) its variance. The samples of a run can change places
//! (with `independent` always; with points in a random order or scrambled digits, the two halves of 2ⁿ points at
//! least), so the covariance of x_n and x_2n is V(2n), and
//!
//! > E (x_n − x_2n)² = V(n) − V(2n).    (1)
//!
//! It is a quarter of the squared difference of the halves, n samples each, whether these are independent or not. For
//! independent ones it *is* V(2n). Low-discrepancy points spoil that: where one half is too bright, the other one makes
//! up for it, the halves differ by more than the error of their mean, and (1) taken as V(2n) is too much. But the sum
//! of (1) over all doublings to come is V(2n) for every kind of points, for it telescopes and the variance goes to
//! zero. If V falls as n^−α, the sum is a geometric series:
//!
//! > V(2n) = E (x_n − x_2n)² / (2^α − 1).    (2)
//!
//! α is 1 for independent samples. Otherwise it is measured: by (1), the changes of successive doublings fall by the
//! same 2^−α. It is kept in [1, 2]: below 1 are only runs that have found something new, a firefly say, and above 2
//! nothing that paths do.
//!
//! The sums go over pixels and channels, each value divided by r² + ε as in relMSE ([`super::metrics`]). For r, which
//! is not known, stands the mean so far, but no more than that of the four brightest of the eight neighbours: without
//! that, a firefly divides its own error. All eight would call small lights fireflies, the brightest alone believes too
//! much. What stays out is light that no path has found yet. How far the estimate goes is measured by `tests/live.rs`
//! and told in the README.
//!
//! Between doublings, n is the sum of powers of two, and the samples one after the other are blocks of so many. As if
//! blocks had nothing to do with each other, V(n) = Σ (b/n)² V(b) over the blocks b; with α = 1 that is V(p) p / n.

use super::metrics::EPSILON;

/// Fewest samples per pixel that an estimate is made of.
pub const FEWEST: u32 = 16;

/// Successive changes of which the exponent is measured: fewer are noisier, more reach back to the first samples, which
/// behave differently.
const SPAN: usize = 4;

/// Red, green and blue.
const CHANNELS: usize = 3;

/// Where the exponent of V is looked for.
const EXPONENTS: [f64; 2] = [1.0, 2.0];

/// Share of values without which α is measured: it is that of most of the picture, not that of one firefly.
const TRIMMED: f64 = 0.01;

/// A doubling of the number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// Samples per pixel after it.
    spp: u32,
    /// How many times as many these are, 2 wherever passes end at powers of two.
    factor: f64,
    /// Mean over the values of (x_n − x_2n)² / (r² + ε).
    change: f64,
    /// The same without the values that change most.
    trimmed: f64,
}

/// Watches a picture as its samples double.
#[derive(Clone, Debug, Default)]
pub struct Doublings {
    independent: bool,
    last: Option<(u32, Vec<f32>)>,
    steps: Vec<Step>,
}

impl Doublings {
    /// Nothing seen yet. `independent`: no sample of a pixel has anything to do with another one.
    pub fn new(independent: bool) -> Self {
        Doublings { independent, ..Doublings::default() }
    }

    /// Whether so many samples per pixel are a doubling, and the picture is wanted.
    pub fn wants(&self, spp: u32) -> bool {
        self.last.as_ref().is_none_or(|(last, _)| spp >= last.saturating_mul(2) || spp < *last)
    }

    /// Takes the picture of so many samples per pixel: red, green and blue, row by row, of `width` pixels each. If
    /// there are fewer samples or another number of values than before, a new run has started.
    pub fn add(&mut self, spp: u32, picture: Vec<f32>, width: usize) {
        if let Some((last, before)) = &self.last {
            if spp > *last && before.len() == picture.len() {
                let factor = f64::from(spp) / f64::from(*last);
                let [change, trimmed] = relative_changes(before, &picture, width.max(1));
                self.steps.push(Step { spp, factor, change, trimmed });
            } else {
                self.steps.clear();
            }
        }
        self.last = Some((spp, picture));
    }

    /// The exponent α with which the variance falls.
    pub fn exponent(&self) -> f64 {
        let [low, high] = EXPONENTS;
        let steps = &self.steps[self.steps.len().saturating_sub(SPAN)..];
        let [first, .., last] = steps else { return low };
        if self.independent || steps.len() < 3 || !(first.trimmed > 0.0 && last.trimmed > 0.0) {
            return low;
        }
        let doublings = f64::from(last.spp) / f64::from(first.spp);
        ((first.trimmed / last.trimmed).ln() / doublings.ln()).clamp(low, high)
    }

    /// The relMSE expected of the picture with so many samples per pixel, from its last doubling on. `None` if there is
    /// none that ended with at least [`FEWEST`] samples.
    pub fn rel_mse(&self, spp: u32) -> Option<f64> {
        let step = self.steps.last().filter(|step| step.spp >= FEWEST && step.change.is_finite())?;
        let alpha = self.exponent();
        let variance = step.change / (step.factor.powf(alpha) - 1.0);
        let (n, p) = (f64::from(spp), f64::from(step.spp));
        let blocks = (0..u32::BITS).map(|bit| spp & (1 << bit)).filter(|block| *block > 0).map(f64::from);
        let share: f64 = blocks.map(|b| (b / n).powi(2) * (p / b).powf(alpha)).sum();
        // A step that did not end at a power of two has nothing to be compared with.
        Some(variance * if step.spp.is_power_of_two() { share } else { (p / n).powf(alpha) })
    }
}

/// Mean over the finite values of (a − b)² / (r² + ε), with and without the largest ones; r is b, but no more than the
/// brighter half of its neighbours.
fn relative_changes(a: &[f32], b: &[f32], width: usize) -> [f64; 2] {
    let mut changes = Vec::with_capacity(b.len());
    for (i, (a, x)) in a.iter().zip(b).enumerate() {
        if a.is_finite() && x.is_finite() {
            let (a, x) = (f64::from(*a), f64::from(*x));
            let r = x.min(brighter_neighbours(b, width, i));
            changes.push((a - x).powi(2) / (r * r + EPSILON));
        }
    }
    let kept = changes.len() - (TRIMMED * changes.len() as f64).ceil() as usize;
    if kept == 0 {
        return [f64::NAN; 2];
    }
    let all = changes.iter().sum::<f64>() / changes.len() as f64;
    changes.sort_unstable_by(f64::total_cmp);
    [all, changes[..kept].iter().sum::<f64>() / kept as f64]
}

/// Mean of the brighter half of the neighbours of a value, in its channel; infinite for a picture of a single pixel.
fn brighter_neighbours(picture: &[f32], width: usize, at: usize) -> f64 {
    let row = width * CHANNELS;
    let (line, column, height) = (at / row, at % row / CHANNELS, picture.len() / row);
    let (mut found, mut count) = ([f32::NEG_INFINITY; 8], 0);
    for y in line.saturating_sub(1)..(line + 2).min(height) {
        for x in column.saturating_sub(1)..(column + 2).min(width) {
            if (x, y) != (column, line) {
                found[count] = picture[y * row + x * CHANNELS + at % CHANNELS];
                count += 1;
            }
        }
    }
    let neighbours = &mut found[..count];
    neighbours.sort_unstable_by(f32::total_cmp);
    let brighter = &neighbours[count / 2..];
    let sum: f64 = brighter.iter().map(|v| f64::from(*v)).sum();
    if sum.is_finite() && !brighter.is_empty() { sum / brighter.len() as f64 } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    const WIDTH: usize = 64;

    /// Feeds pictures of 64 x 64 pixels of the value 1 whose noise has a given standard deviation after so many
    /// samples.
    fn watch(independent: bool, samples: &[u32], noise: impl Fn(&mut Pcg32, u32) -> Vec<f32>) -> Doublings {
        let mut pcg = Pcg32::new(3, 4);
        let mut sums = vec![0.0_f32; WIDTH * WIDTH * CHANNELS];
        let (mut seen, mut n) = (Doublings::new(independent), 0);
        for &spp in samples {
            while n < spp {
                let more = noise(&mut pcg, n);
                sums.iter_mut().zip(more).for_each(|(s, v)| *s += v);
                n += 1;
            }
            if seen.wants(spp) {
                seen.add(spp, sums.iter().map(|s| 1.0 + s / spp as f32).collect(), WIDTH);
            }
        }
        seen
    }

    fn uniform(pcg: &mut Pcg32) -> Vec<f32> {
        (0..WIDTH * WIDTH * CHANNELS).map(|_| pcg.next_f32() - 0.5).collect()
    }

    /// Uniform noise of variance 1/12 per sample: the expected relMSE is 1/12/n/1.01, whatever the passes.
    #[test]
    fn independent_samples() {
        let passes: Vec<u32> = (1..=80).collect();
        let seen = watch(true, &passes, |pcg, _| uniform(pcg));
        for spp in [64, 72, 80] {
            let ratio = seen.rel_mse(spp).unwrap() * 12.0 * 1.01 * f64::from(spp);
            assert!((ratio - 1.0).abs() < 0.06, "{spp}: {ratio}");
        }
        // Measured, the exponent is nearly the same.
        assert!(watch(false, &passes, |pcg, _| uniform(pcg)).exponent() < 1.03);
        // Passes that know nothing of powers of two.
        let seen = watch(true, &[5, 15, 45, 60], |pcg, _| uniform(pcg));
        let ratio = seen.rel_mse(60).unwrap() * 12.0 * 1.01 * 60.0;
        assert!((ratio - 1.0).abs() < 0.06, "{ratio}");
    }

    /// Every second sample makes up for half of the one before, every fourth for half of the pair before, and so on, as
    /// points of low discrepancy do: the variance is known, and falls faster than 1/n.
    #[test]
    fn samples_that_make_up_for_each_other() {
        // Sample n is Σ over its bits k of ±g_k, the sign being the bit, fresh numbers for every block of 2^(k+1)
        // samples.
        let levels = std::cell::RefCell::new(vec![Vec::new(); 8]);
        let strength = |k: usize| 0.5_f32.powi(k as i32);
        let noise = |pcg: &mut Pcg32, n: u32| {
            let mut levels = levels.borrow_mut();
            for (k, level) in levels.iter_mut().enumerate() {
                if n.is_multiple_of(2 << k) {
                    *level = uniform(pcg);
                }
            }
            let sign = |k: usize| if n >> k & 1 == 0 { strength(k) } else { -strength(k) };
            (0..WIDTH * WIDTH * CHANNELS)
                .map(|i| levels.iter().enumerate().map(|(k, l)| sign(k) * l[i]).sum())
                .collect()
        };
        let seen = watch(false, &[1, 2, 4, 8, 16, 32], noise);
        // After 32 samples the levels 0 to 4 are balanced and 5 to 7 are left, each with its sign fixed.
        let left: f64 = (5..8).map(|k| f64::from(strength(k)).powi(2) / 12.0 / 1.01).sum();
        // The series is cut at eight levels, which takes 1.6 % off.
        let ratio = seen.rel_mse(32).unwrap() / left;
        assert!((ratio - 1.0).abs() < 0.08 && seen.exponent() > 1.9, "{ratio} {}", seen.exponent());
        // As if samples were independent, it would be three times too much.
        let naive = Doublings { independent: true, ..seen };
        assert!(naive.rel_mse(32).unwrap() > 2.7 * left);
    }

    #[test]
    fn what_cannot_be_told_is_not_told() {
        let mut seen = Doublings::new(false);
        assert!(seen.wants(1) && seen.rel_mse(100).is_none());
        for spp in [1, 2, 4, 8] {
            seen.add(spp, vec![1.0 / spp as f32; 3], 1);
            assert_eq!(seen.rel_mse(spp), None, "fewer than {FEWEST} samples");
        }
        assert!(!seen.wants(15) && seen.wants(16));
        seen.add(16, vec![0.0; 3], 1);
        assert!(seen.rel_mse(16).unwrap() > 0.0);
        // A new run, a broken picture, no picture.
        seen.add(1, vec![0.0; 3], 1);
        assert_eq!(seen.rel_mse(16), None);
        seen.add(32, vec![f32::NAN; 3], 1);
        assert_eq!(seen.rel_mse(32), None);
        seen.add(64, Vec::new(), 0);
        assert_eq!(seen.rel_mse(64), None);
    }

    /// A firefly counts with what it does to the error, not divided by itself.
    #[test]
    fn fireflies_are_seen() {
        let mut seen = Doublings::new(true);
        let picture = |spike: f32| {
            let mut values = vec![1.0; 9 * CHANNELS];
            values[4 * CHANNELS] += spike;
            values
        };
        seen.add(8, picture(0.0), 3);
        seen.add(16, picture(100.0), 3);
        let expected = 100.0 * 100.0 / 1.01 / 27.0;
        assert!((seen.rel_mse(16).unwrap() / expected - 1.0).abs() < 1e-6);
    }
}
