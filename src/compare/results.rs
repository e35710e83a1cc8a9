//! What a comparison found, as numbers: for the page and the tables.

use super::method::Method;
use super::truth::Truth;
use lucerna_core::stats::chi2::sidak;
use lucerna_core::stats::metrics::{Errors, Interval, efficiency, log_slope, standard_error};
use lucerna_core::stats::ranks::typical_ratio;
use lucerna_core::stats::student::two_sided_p;
use std::path::PathBuf;

/// One number of samples per pixel of a method: one entry a seed.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Samples per pixel.
    pub spp: u32,
    /// Those of the run on whose way it was seen; the same number if it was rendered for itself.
    pub of: u32,
    /// Seconds of rendering.
    pub seconds: Vec<f64>,
    /// Seconds of processor time; empty if not known.
    pub cpu: Vec<f64>,
    /// The most memory in MiB; empty if not known.
    pub memory: Vec<f64>,
    /// Errors.
    pub errors: Vec<Errors>,
    /// LDR- and HDR-FLIP; empty if no budget asks for the point.
    pub flip: Vec<[f64; 2]>,
    /// Mean variance of a picture.
    pub variance: Option<f64>,
    /// Mean squared bias.
    pub bias_squared: Option<Interval>,
}

impl Point {
    /// One measure, seed by seed.
    pub fn each(&self, measure: impl Fn(&Errors) -> f64) -> Vec<f64> {
        self.errors.iter().map(measure).collect()
    }

    /// Mean of a measure.
    pub fn mean(&self, measure: impl Fn(&Errors) -> f64) -> Interval {
        Interval::of_mean(&self.each(measure))
    }

    /// Seconds of rendering.
    pub fn time(&self) -> Interval {
        Interval::of_mean(&self.seconds)
    }

    /// Efficiencies by a measure, seed by seed.
    pub fn efficiencies(&self, measure: impl Fn(&Errors) -> f64) -> Vec<f64> {
        self.errors.iter().zip(&self.seconds).map(|(e, seconds)| efficiency(measure(e), *seconds)).collect()
    }

    /// Seconds for one sample per pixel, seed by seed: of the processors where both are known, else of the clock.
    fn per_sample(&self, of_processors: bool) -> Vec<f64> {
        let seconds = if of_processors { &self.cpu } else { &self.seconds };
        seconds.iter().map(|seconds| seconds / f64::from(self.spp)).collect()
    }

    /// Whether the processor time of every run is known.
    pub fn knows_processors(&self) -> bool {
        self.cpu.len() == self.seconds.len()
    }

    /// LDR-FLIP (0) or HDR-FLIP (1).
    pub fn flip(&self, kind: usize) -> Option<Interval> {
        let values: Vec<f64> = self.flip.iter().map(|both| both[kind]).collect();
        (!values.is_empty()).then(|| Interval::of_mean(&values))
    }

    /// The most memory in MiB.
    pub fn memory(&self) -> Option<Interval> {
        (!self.memory.is_empty()).then(|| Interval::of_mean(&self.memory))
    }

    /// Seconds of processor time.
    pub fn processor_time(&self) -> Option<Interval> {
        (!self.cpu.is_empty()).then(|| Interval::of_mean(&self.cpu))
    }

    /// How much brighter than the reference the picture is as a whole, the reference's own noise included.
    pub fn mean_difference(&self, truth: &Truth) -> Interval {
        let value = self.mean(|e| e.mean_difference).value;
        Interval::with_error(value, self.error_of_mean_difference(truth), self.errors.len() as f64 - 1.0)
    }

    /// Standard error of that; `None` of a single seed.
    fn error_of_mean_difference(&self, truth: &Truth) -> Option<f64> {
        let of_truth = truth.noise.map_or(0.0, |[.., variance]| variance);
        standard_error(&self.each(|e| e.mean_difference)).map(|error| error.hypot(of_truth.sqrt()))
    }
}

/// One method in one scene.
#[derive(Clone, Debug)]
pub struct MethodResult {
    /// The method.
    pub method: Method,
    /// Why it gave no numbers.
    pub failed: Option<String>,
    /// Rising in samples per pixel.
    pub points: Vec<Point>,
    /// The point of each budget.
    pub stops: Vec<usize>,
    /// The picture of the first seed and the last point.
    pub picture: Vec<f32>,
    /// Its HDR-FLIP, pixel by pixel.
    pub flip_map: Vec<f32>,
    /// Whether the points of its curve were seen on the way of one run.
    pub is_sequence: bool,
}

/// When a method reaches an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reached {
    /// After so many seconds.
    After(Interval),
    /// Not within the longest run.
    NotWithin(f64),
}

impl MethodResult {
    /// Of a method that has no runs yet.
    pub fn new(method: Method) -> Self {
        MethodResult {
            method,
            failed: None,
            points: Vec::new(),
            stops: Vec::new(),
            picture: Vec::new(),
            flip_map: Vec::new(),
            is_sequence: false,
        }
    }

    /// Seconds until the relMSE falls to `target`, on the straight lines between the points of the mean curve in
    /// logarithms; the interval is the jackknife's, over the seeds. `None` if there are fewer than two points.
    pub fn time_to(&self, target: f64) -> Option<Reached> {
        let last = self.last().filter(|_| self.points.len() >= 2)?;
        // The rounding of a mean is not an error that is missed.
        if last.mean(|e| e.rel_mse).value > target * (1.0 + 1e-9) {
            return Some(Reached::NotWithin(last.time().value));
        }
        let seeds = last.errors.len();
        let whole = self.log_time_to(target, None)?;
        let without = (0..seeds).map(|seed| self.log_time_to(target, Some(seed))).collect::<Option<Vec<_>>>();
        let found = match without.filter(|_| seeds >= 3) {
            Some(without) => Interval::of_jackknife(whole, &without),
            None => Interval { value: whole, bounds: None },
        };
        Some(Reached::After(Interval { value: found.value.exp(), bounds: found.bounds.map(|b| b.map(f64::exp)) }))
    }

    /// Logarithm of the seconds, from all seeds but one; the last line goes on beyond the last point.
    fn log_time_to(&self, target: f64, without: Option<usize>) -> Option<f64> {
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let kept = values.enumerate().filter(|(seed, _)| Some(*seed) != without);
            let (sum, count) = kept.fold((0.0, 0.0), |(sum, count), (_, v)| (sum + v, count + 1.0));
            f64::ln(sum / count)
        };
        let logs: Vec<(f64, f64)> = (self.points.iter())
            .map(|p| (mean(&mut p.seconds.iter().copied()), mean(&mut p.errors.iter().map(|e| e.rel_mse))))
            .filter(|(t, e)| t.is_finite() && e.is_finite())
            .collect();
        let wanted = target.ln();
        if logs.first()?.1 <= wanted {
            return Some(logs[0].0);
        }
        let at = (1..logs.len()).find(|&i| logs[i].1 <= wanted).unwrap_or(logs.len() - 1);
        let [(t0, e0), (t1, e1)] = [*logs.get(at.checked_sub(1)?)?, logs[at]];
        (e1 < e0).then(|| t0 + (t1 - t0) * (wanted - e0) / (e1 - e0))
    }

    /// The point of the longest budget.
    pub fn last(&self) -> Option<&Point> {
        self.points.last().filter(|_| self.failed.is_none())
    }

    /// Slopes of log MSE over log samples and over log seconds, with intervals from the seeds.
    pub fn slopes(&self) -> [Option<Interval>; 2] {
        let seeds = self.points.iter().map(|p| p.errors.len()).min().unwrap_or(0);
        let slope = |x: &dyn Fn(&Point, usize) -> f64| {
            let of_seed = |seed: usize| {
                let points = self.points.iter().map(|p| (x(p, seed), p.errors[seed].mse));
                log_slope(&points.collect::<Vec<_>>())
            };
            let slopes = (0..seeds).map(of_seed).collect::<Option<Vec<f64>>>()?;
            (self.points.len() >= 3 && !slopes.is_empty()).then(|| Interval::of_mean(&slopes))
        };
        [slope(&|p, _| f64::from(p.spp)), slope(&|p, seed| p.seconds[seed])]
    }
}

/// One scene.
pub struct SceneResult {
    /// Its file, as it was named.
    pub scene: PathBuf,
    /// What methods were compared with.
    pub truth: Truth,
    /// In the order they were named.
    pub methods: Vec<MethodResult>,
    /// The one that others are measured by.
    pub baseline: usize,
}

impl SceneResult {
    /// The numbers of the method and of the baseline that a budget gave.
    pub fn pair(&self, method: usize, budget: usize) -> Option<(&Point, &Point)> {
        let point = |m: &MethodResult| m.stops.get(budget).copied();
        let (ours, base) = (&self.methods[method], &self.methods[self.baseline]);
        Some((ours.points.get(point(ours)?)?, base.points.get(point(base)?)?))
    }

    /// Efficiency over the baseline's: above 1 is better.
    pub fn gain(&self, method: usize, budget: usize, measure: impl Fn(&Errors) -> f64 + Copy) -> Option<Interval> {
        let (ours, base) = self.pair(method, budget)?;
        Interval::of_ratio(&ours.efficiencies(measure), &base.efficiencies(measure))
    }

    /// The same by relMSE, without what the noise of the reference adds to both errors; `None` if that is not known, or half
    /// of an error.
    pub fn gain_without_noise(&self, method: usize, budget: usize) -> Option<Interval> {
        let [_, noise, _] = self.truth.noise?;
        let (ours, base) = self.pair(method, budget)?;
        let stands_out = ours.errors.iter().chain(&base.errors).all(|e| e.rel_mse > 2.0 * noise);
        self.gain(method, budget, |e| e.rel_mse - noise).filter(|_| stands_out)
    }

    /// Time of a sample over the baseline's, by the clock: above 1 is slower.
    pub fn slowdown(&self, method: usize, budget: usize) -> Option<Interval> {
        let (ours, base) = self.pair(method, budget)?;
        typical_ratio(&ours.per_sample(false), &base.per_sample(false))
    }

    /// The same of processor time, which other programs on the machine add little to.
    pub fn processor_slowdown(&self, method: usize, budget: usize) -> Option<Interval> {
        let (ours, base) = self.pair(method, budget)?;
        let known = ours.knows_processors() && base.knows_processors();
        known.then(|| typical_ratio(&ours.per_sample(true), &base.per_sample(true))).flatten()
    }

    /// The relMSE whose time is told: the one that was asked for, or that of the baseline's longest run.
    pub fn target(&self, asked: Option<f64>) -> Option<f64> {
        asked.or_else(|| Some(self.methods[self.baseline].last()?.mean(|e| e.rel_mse).value))
    }

    /// Whether the mean of a method's pictures is off by more than noise. The level of 5 % is shared among the methods
    /// (Šidák 1967); `None` of a single seed.
    pub fn is_biased(&self, point: &Point) -> Option<bool> {
        let error = point.error_of_mean_difference(&self.truth)?;
        let difference = point.mean_difference(&self.truth).value;
        let level = sidak(Interval::MISS, self.methods.len());
        Some(match error > 0.0 {
            true => two_sided_p(difference / error, point.errors.len() as f64 - 1.0) < level,
            false => difference != 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A method whose relMSE is `scale / seconds` in every run, up to 8 seconds; runs differ in speed by a percent.
    fn falling(scale: f64) -> MethodResult {
        let mut result = MethodResult::new(Method::of_text("path").unwrap());
        for spp in [1, 2, 4, 8] {
            let seconds: Vec<f64> = [0.99, 1.0, 1.01].map(|speed| speed * f64::from(spp)).to_vec();
            let of = |seconds: &f64| {
                let rel_mse = scale / seconds;
                let (mse, rest) = (rel_mse, [0.0; 4]);
                let [rel_mse_trimmed, mape, smape, mean_difference] = rest;
                Errors { mse, rel_mse, rel_mse_trimmed, mape, smape, mean_difference, fireflies: 0, left_out: 0 }
            };
            let errors = seconds.iter().map(of).collect();
            result.points.push(Point { spp, of: 8, seconds, errors, ..Point::default() });
        }
        result.stops = vec![3];
        result
    }

    #[test]
    fn the_time_to_an_error() {
        let method = falling(0.6);
        let Some(Reached::After(found)) = method.time_to(0.2) else { panic!("it is reached after 3 seconds") };
        assert!((found.value - 3.0).abs() < 0.01 && !found.excludes(3.0), "{found:?}");
        let [low, high] = found.bounds.unwrap();
        assert!(high - low < 0.2, "{found:?}");
        // What the last point has is reached there; less is not; more than the first has is there from the start.
        let last = method.last().unwrap().mean(|e| e.rel_mse).value;
        assert!(matches!(method.time_to(last), Some(Reached::After(t)) if (t.value - 8.0).abs() < 0.01));
        assert_eq!(method.time_to(0.99 * last), Some(Reached::NotWithin(8.0)));
        assert!(matches!(method.time_to(5.0), Some(Reached::After(t)) if (t.value - 1.0).abs() < 1e-9));
        assert_eq!(MethodResult { points: method.points[..1].to_vec(), ..method }.time_to(0.1), None);
    }

    #[test]
    fn ratios_know_who_is_better() {
        let truth = Truth {
            values: Vec::new(),
            size: [0, 0],
            channels: Vec::new(),
            noise: None,
            source: String::new(),
            spp: 0,
            reached: None,
        };
        let mut slower = falling(0.3);
        slower.points.iter_mut().for_each(|p| p.cpu = p.seconds.iter().map(|s| 1.5 * s).collect());
        let mut base = falling(0.6);
        base.points.iter_mut().for_each(|p| p.cpu = p.seconds.clone());
        let scene = SceneResult { scene: PathBuf::new(), truth, methods: vec![base, slower], baseline: 0 };
        let gain = scene.gain(1, 0, |e| e.rel_mse).unwrap();
        assert!((gain.value - 2.0).abs() < 1e-9, "half of the error in the same time: {gain:?}");
        assert_eq!(scene.gain_without_noise(1, 0), None);
        assert!((scene.processor_slowdown(1, 0).unwrap().value - 1.5).abs() < 1e-9);
        assert!((scene.slowdown(1, 0).unwrap().value - 1.0).abs() < 1e-9);
        assert_eq!(scene.target(Some(0.5)), Some(0.5));
        assert!((scene.target(None).unwrap() - 0.075).abs() < 1e-4);
        // Noise that both errors have hides a part of what is gained, or all.
        let noisy = |noise: f64| {
            let mut methods = scene.methods.clone();
            let errors = methods.iter_mut().flat_map(|method| &mut method.points).flat_map(|point| &mut point.errors);
            errors.for_each(|e| e.rel_mse += noise);
            SceneResult {
                scene: PathBuf::new(),
                truth: Truth { noise: Some([0.0, noise, 0.0]), ..scene.truth.clone() },
                methods,
                baseline: 0,
            }
        };
        let found = noisy(0.03);
        assert!(found.gain(1, 0, |e| e.rel_mse).unwrap().value < 1.6);
        assert!((found.gain_without_noise(1, 0).unwrap().value - 2.0).abs() < 1e-9);
        assert_eq!(noisy(0.04).gain_without_noise(1, 0), None);
    }
}
