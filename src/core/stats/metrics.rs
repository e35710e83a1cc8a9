//! How far a picture is from the true one, in the measures that papers use, and what several seeds say about them.
//!
//! `x` is a value of the picture, `r` that of the reference; the mean goes over all pixels and channels. Pixels where
//! either is not finite are left out of all measures and counted.
//!
//! | measure | formula | ε | source |
//! |---|---|---|---|
//! | MSE | mean (x − r)² | | |
//! | relMSE | mean (x − r)² / (r² + ε) | 0.01 | Rousselle, Knaus and Zwicker 2011, in form; ε differs between papers |
//! | relMSE trimmed | the same without the 0.1 % of pixels where it is largest, at least one | 0.01 | |
//! | MAPE | mean abs(x − r) / (abs r + ε) | 0.01 | common; ε differs between papers |
//! | SMAPE | mean abs(x − r) / (abs x + abs r + ε), at most 1 | 0.01 | common; ε and a factor of 2 differ between papers |
//! | bias² | see [`bias_squared`] | | |
//! | efficiency | 1 / (error · seconds) | | Pharr, Jakob and Humphreys 2023, section 2.2, there with the variance |
//!
//! ε is in units of radiance (its square for relMSE): it is as good as nothing where pictures are about as bright as 1.
//! FLIP has a file of its own, [`super::flip`]. `tests/metrics` compares with implementations that are not ours.

use super::student::critical_t;

/// The ε of relMSE, MAPE and SMAPE.
pub const EPSILON: f64 = 0.01;

/// Share of pixels that the trimmed relMSE leaves out.
pub const TRIMMED: f64 = 1e-3;

/// A pixel is a firefly if it is brighter than the reference by more than so many times √(r² + ε), its channels averaged.
pub const FIREFLY: f64 = 10.0;

/// How far a picture is from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Mean squared error.
    pub mse: f64,
    /// Relative mean squared error.
    pub rel_mse: f64,
    /// The same without the worst pixels.
    pub rel_mse_trimmed: f64,
    /// Mean absolute relative error.
    pub mape: f64,
    /// Symmetric mean absolute relative error.
    pub smape: f64,
    /// Mean of the picture over that of the reference, less 1.
    pub mean_difference: f64,
    /// Number of fireflies.
    pub fireflies: usize,
    /// Pixels left out because a value was not finite.
    pub left_out: usize,
}

/// The errors of a picture: values with channels interleaved.
///
/// # Errors
/// If the two differ in length, or no pixel is left.
pub fn errors(image: &[f32], reference: &[f32], channels: usize) -> Result<Errors, String> {
    if image.len() != reference.len() || channels == 0 {
        return Err(format!("the picture has {} values, the reference {}", image.len(), reference.len()));
    }
    let (mut sums, mut means, mut left_out, mut fireflies) = ([0.0; 3], [0.0; 2], 0, 0);
    let mut relative = Vec::with_capacity(image.len() / channels);
    for (x, r) in image.chunks_exact(channels).zip(reference.chunks_exact(channels)) {
        if !x.iter().chain(r).all(|v| v.is_finite()) {
            left_out += 1;
            continue;
        }
        let (mut squares, mut above) = (0.0, 0.0);
        for (&x, &r) in x.iter().zip(r) {
            let (x, r) = (f64::from(x), f64::from(r));
            let (d, floor) = (x - r, r * r + EPSILON);
            sums[0] += d * d;
            sums[1] += d.abs() / (r.abs() + EPSILON);
            sums[2] += d.abs() / (x.abs() + r.abs() + EPSILON);
            means[0] += x;
            means[1] += r;
            squares += d * d / floor;
            above += d / floor.sqrt();
        }
        relative.push(squares / channels as f64);
        fireflies += usize::from(above / channels as f64 > FIREFLY);
    }
    if relative.is_empty() {
        return Err("no pixel is finite in both the picture and the reference".to_owned());
    }
    let (pixels, values) = (relative.len() as f64, (relative.len() * channels) as f64);
    let rel_mse = relative.iter().sum::<f64>() / pixels;
    let kept = relative.len() - ((TRIMMED * pixels).ceil() as usize).min(relative.len() - 1);
    relative.sort_by(f64::total_cmp);
    Ok(Errors {
        mse: sums[0] / values,
        rel_mse,
        rel_mse_trimmed: relative[..kept].iter().sum::<f64>() / kept as f64,
        mape: sums[1] / values,
        smape: sums[2] / values,
        mean_difference: if means[1] == 0.0 { 0.0 } else { means[0] / means[1] - 1.0 },
        fireflies,
        left_out,
    })
}

/// Efficiency, 1 / (error · seconds): twice as much is the same error in half of the time. 0 without an error or time.
pub fn efficiency(error: f64, seconds: f64) -> f64 {
    let cost = error * seconds;
    if cost > 0.0 && cost.is_finite() { 1.0 / cost } else { 0.0 }
}

/// A value and where the true one is with a chance of 95 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The estimate.
    pub value: f64,
    /// The bounds; not known from a single seed.
    pub bounds: Option<[f64; 2]>,
}

impl Interval {
    /// Chance that the interval misses.
    pub const MISS: f64 = 0.05;

    /// Mean of independent values, after Student.
    pub fn of_mean(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        Interval::with_error(value, standard_error(values), n - 1.0)
    }

    /// Of an estimate with a standard error known with so many degrees of freedom.
    pub fn with_error(value: f64, error: Option<f64>, freedom: f64) -> Self {
        let half = error.map(|error| error * critical_t(Self::MISS, freedom.max(1.0)));
        Interval { value, bounds: half.map(|half| [value - half, value + half]) }
    }

    /// Geometric mean of the quotients of positive values that belong together, seed by seed: what both have in common
    /// (a machine that was busy for a while) drops out. `None` if a value is not positive.
    pub fn of_ratio(above: &[f64], below: &[f64]) -> Option<Self> {
        let pairs = above.iter().zip(below);
        let logs: Vec<f64> = pairs.map(|(a, b)| (a / b).ln()).collect();
        if logs.is_empty() || logs.iter().any(|log| !log.is_finite()) {
            return None;
        }
        let log = Interval::of_mean(&logs);
        Some(Interval { value: log.value.exp(), bounds: log.bounds.map(|bounds| bounds.map(f64::exp)) })
    }

    /// Of an estimate that is no mean, from those without each of the values in turn (Tukey's jackknife 1958).
    pub fn of_jackknife(whole: f64, without: &[f64]) -> Self {
        let n = without.len() as f64;
        let pseudo: Vec<f64> = without.iter().map(|v| n * whole - (n - 1.0) * v).collect();
        Interval::with_error(whole, standard_error(&pseudo), n - 1.0)
    }

    /// Whether a value is outside of the bounds.
    pub fn excludes(&self, value: f64) -> bool {
        self.bounds.is_some_and(|[low, high]| value < low || value > high)
    }
}

/// Standard error of the mean of independent values; `None` of fewer than two.
pub fn standard_error(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.len() >= 2).then(|| (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
}

/// Mean and spread of pictures that differ in nothing but their seeds, added one by one (Welford 1962).
#[derive(Clone, Debug, Default)]
pub struct Seeds {
    count: usize,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Seeds {
    /// Takes up what was kept: the mean of `count` pictures and the variance of that mean.
    pub fn stored(count: usize, mean: &[f32], variance_of_mean: &[f32]) -> Self {
        let n = count as f64;
        let squares = variance_of_mean.iter().map(|v| f64::from(*v) * n * (n - 1.0)).collect();
        Seeds { count, mean: mean.iter().copied().map(f64::from).collect(), squares }
    }

    /// Adds a picture of the same size as those before.
    ///
    /// # Errors
    /// If it has another size.
    pub fn add(&mut self, image: &[f32]) -> Result<(), String> {
        if self.count == 0 {
            self.mean = vec![0.0; image.len()];
            self.squares = vec![0.0; image.len()];
        } else if self.mean.len() != image.len() {
            return Err(format!("a picture of {} values after one of {}", image.len(), self.mean.len()));
        }
        self.count += 1;
        let n = self.count as f64;
        for ((mean, squares), x) in self.mean.iter_mut().zip(&mut self.squares).zip(image) {
            let before = f64::from(*x) - *mean;
            *mean += before / n;
            *squares += before * (f64::from(*x) - *mean);
        }
        Ok(())
    }

    /// Number of pictures.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The mean picture.
    pub fn mean(&self) -> Vec<f32> {
        self.mean.iter().map(|v| *v as f32).collect()
    }

    /// The variance of the mean picture's values; `None` of fewer than two pictures.
    pub fn variance_of_mean(&self) -> Option<Vec<f32>> {
        let n = self.count as f64;
        (self.count >= 2).then(|| self.squares.iter().map(|m2| (m2 / (n * (n - 1.0))) as f32).collect())
    }

    /// Mean over the values of the variance of a single picture: the part of its MSE that more samples reduce.
    pub fn variance(&self) -> Option<f64> {
        (self.count >= 2).then(|| finite_mean(self.squares.iter().map(|m2| m2 / (self.count as f64 - 1.0))))
    }
}

/// What one picture x of several adds to the squared bias of their mean m: mean (x − r)² and mean (x − r)(m − r).
pub fn bias_terms(image: &[f32], mean: &[f32], reference: &[f32]) -> [f64; 2] {
    let differences = || image.iter().zip(mean).zip(reference).map(|((x, m), r)| [x - r, m - r].map(f64::from));
    [finite_mean(differences().map(|[x, _]| x * x)), finite_mean(differences().map(|[x, m]| x * m))]
}

/// Mean squared bias with an interval, from [`bias_terms`] of all pictures. It is the mean of (xᵢ − r)(xⱼ − r) over all
/// pairs of pictures, less what the noise of the reference adds. `None` of fewer than two pictures.
pub fn bias_squared(terms: &[[f64; 2]], variance_of_reference: f64) -> Option<Interval> {
    let n = terms.len() as f64;
    let (own, of_mean) = (terms.iter().map(|t| t[0]).sum::<f64>(), terms.iter().map(|t| t[1]).sum::<f64>() / n);
    let of_pairs = |sum_squared: f64, own: f64, n: f64| (sum_squared - own) / (n * (n - 1.0)) - variance_of_reference;
    let whole = of_pairs(n * n * of_mean, own, n);
    // The sum of the others is n(m − r) − (x − r).
    let without = |t: &[f64; 2]| of_pairs(n * n * of_mean - 2.0 * n * t[1] + t[0], own - t[0], n - 1.0);
    match terms.len() {
        0 | 1 => None,
        2 => Some(Interval { value: whole, bounds: None }),
        _ => Some(Interval::of_jackknife(whole, &terms.iter().map(without).collect::<Vec<_>>())),
    }
}

fn finite_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The slope of log y over log x by least squares; −1 for an MSE against samples that are independent. `None` of fewer
/// than two different x.
pub fn log_slope(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> =
        points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    let xy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    (logs.len() >= 2 && xx > 1e-12).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-6 * b.abs().max(1e-6)
    }

    /// Two pixels of two channels, worked out by hand.
    #[test]
    fn by_hand() {
        let found = errors(&[1.5, 0.0, 2.0, 3.0], &[1.0, 0.0, 2.0, 1.0], 2).unwrap();
        assert!(close(found.mse, (0.25 + 4.0) / 4.0));
        assert!(close(found.rel_mse, (0.25 / 1.01 + 4.0 / 1.01) / 4.0));
        // One of two pixels goes: the one of 4 / 1.01.
        assert!(close(found.rel_mse_trimmed, 0.25 / 1.01 / 2.0));
        assert!(close(found.mape, (0.5 / 1.01 + 2.0 / 1.01) / 4.0));
        assert!(close(found.smape, (0.5 / 2.51 + 2.0 / 4.01) / 4.0));
        assert!(close(found.mean_difference, 6.5 / 4.0 - 1.0));
        assert_eq!((found.fireflies, found.left_out), (0, 0));
    }

    #[test]
    fn planted_errors() {
        let reference = vec![1.0_f32; 3 * 5000];
        let equal = errors(&reference, &reference, 3).unwrap();
        assert_eq!((equal.mse, equal.smape, equal.mean_difference), (0.0, 0.0, 0.0));
        // One firefly of 5000 pixels: in the raw measure, not in the trimmed one.
        let mut spiked = reference.clone();
        spiked[3..6].fill(1001.0);
        let found = errors(&spiked, &reference, 3).unwrap();
        assert!(close(found.rel_mse, 1e6 / 1.01 / 5000.0) && found.rel_mse_trimmed == 0.0 && found.fireflies == 1);
        // Dark pixels are errors, not fireflies; NaN is told, on either side.
        let mut broken = reference.clone();
        broken[0] = f32::NAN;
        broken[3] = -1000.0;
        let found = errors(&broken, &reference, 3).unwrap();
        assert_eq!((found.left_out, found.fireflies), (1, 0));
        assert_eq!(errors(&reference, &broken, 3).unwrap().left_out, 1);
        assert!(errors(&[f32::NAN], &[1.0], 1).is_err() && errors(&[1.0], &[1.0, 1.0], 1).is_err());
    }

    /// MSE = variance + bias², and each is found with what was planted: σ² = 0.04/3 and a bias of 0.1.
    #[test]
    fn bias_and_variance_are_told_apart() {
        let mut pcg = Pcg32::new(1, 2);
        let pixels = 20_000;
        let reference = vec![1.0_f32; pixels];
        for bias in [0.0_f32, 0.1] {
            let (mut seeds, mut mse, mut images) = (Seeds::default(), 0.0, Vec::new());
            for _ in 0..4 {
                let image: Vec<f32> = (0..pixels).map(|_| 0.8 + bias + 0.4 * pcg.next_f32()).collect();
                mse += errors(&image, &reference, 1).unwrap().mse / 4.0;
                seeds.add(&image).unwrap();
                images.push(image);
            }
            let mean = seeds.mean();
            let terms: Vec<[f64; 2]> = images.iter().map(|image| bias_terms(image, &mean, &reference)).collect();
            let (variance, found) = (seeds.variance().unwrap(), bias_squared(&terms, 0.0).unwrap());
            assert!((variance - 0.04 / 3.0).abs() < 2e-4, "{variance}");
            assert!((found.value - f64::from(bias * bias)).abs() < 3e-4, "{found:?}");
            assert!((mse - variance - found.value).abs() < 1e-8, "{mse}");
            // The spread over the pictures tells how well it is known, here to about 1e-4.
            let [low, high] = found.bounds.unwrap();
            assert!(high - low < 2e-3 && !found.excludes(f64::from(bias * bias)), "{found:?}");
            assert_eq!(bias_squared(&terms[..1], 0.0), None);
            assert_eq!(bias_squared(&terms, 0.5).unwrap().value, found.value - 0.5);
        }
    }

    #[test]
    fn what_was_kept_goes_on() {
        let pictures = [[1.0_f32, 2.0], [3.0, 2.5], [2.0, 7.0]];
        let (mut whole, mut first) = (Seeds::default(), Seeds::default());
        pictures.iter().for_each(|p| whole.add(p).unwrap());
        pictures[..2].iter().for_each(|p| first.add(p).unwrap());
        let mut resumed = Seeds::stored(2, &first.mean(), &first.variance_of_mean().unwrap());
        resumed.add(&pictures[2]).unwrap();
        assert!(close(resumed.variance().unwrap(), whole.variance().unwrap()) && resumed.count() == 3);
        assert_eq!(whole.mean()[0], 2.0);
        assert!(whole.add(&[1.0]).is_err());
    }

    #[test]
    fn intervals() {
        // Mean 2, standard error 1/√3, and t = 4.303 with two degrees of freedom.
        let found = Interval::of_mean(&[1.0, 2.0, 3.0]);
        let [low, high] = found.bounds.unwrap();
        assert!((high - 2.0 - 4.3027 / 3.0_f64.sqrt()).abs() < 1e-3 && close(2.0 - low, high - 2.0));
        assert!(found.excludes(5.0) && !found.excludes(0.0));
        assert_eq!(Interval::of_mean(&[1.0]).bounds, None);
        // Pairs twenty per cent apart, whatever they share.
        let ratio = Interval::of_ratio(&[1.2, 12.0, 2.4], &[1.0, 10.0, 2.0]).unwrap();
        assert!(close(ratio.value, 1.2) && ratio.excludes(1.0));
        assert_eq!(Interval::of_ratio(&[0.0], &[1.0]), None);
        // Of a mean, the jackknife gives what Student does.
        let values = [1.0, 2.0, 6.0];
        let without = [0, 1, 2].map(|i| (9.0 - values[i]) / 2.0);
        assert_eq!(Interval::of_jackknife(3.0, &without), Interval::of_mean(&values));
    }

    /// The interval holds the true mean in about 95 of 100 cases.
    #[test]
    fn intervals_cover() {
        let mut pcg = Pcg32::new(5, 6);
        let held = (0..4000).filter(|_| {
            let values: Vec<f64> = (0..5).map(|_| (0..6).map(|_| f64::from(pcg.next_f32())).sum()).collect();
            !Interval::of_mean(&values).excludes(3.0)
        });
        let share = held.count() as f64 / 4000.0;
        assert!((share - 0.95).abs() < 0.015, "{share}");
    }

    #[test]
    fn slopes() {
        let points: Vec<(f64, f64)> = (0..6).map(|i| f64::from(1 << i)).map(|x| (x, 3.0 / x)).collect();
        assert!(close(log_slope(&points).unwrap(), -1.0));
        assert_eq!(log_slope(&points[..1]), None);
        assert_eq!(efficiency(0.5, 4.0), 0.5);
        assert_eq!(efficiency(0.0, 4.0), 0.0);
    }
}
