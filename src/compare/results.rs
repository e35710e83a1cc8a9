//! What a comparison found, as numbers: for the page, and as JSON and CSV.

use super::method::Method;
use super::truth::Truth;
use super::{Options, machine};
use lucerna_core::stats::chi2::sidak;
use lucerna_core::stats::metrics::{
    EPSILON, Errors, FIREFLY, Interval, TRIMMED, efficiency, log_slope, standard_error,
};
use lucerna_core::stats::student::two_sided_p;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

/// One number of samples per pixel of a method: one entry a seed.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering.
    pub seconds: Vec<f64>,
    /// Errors.
    pub errors: Vec<Errors>,
    /// Mean variance of a picture.
    pub variance: Option<f64>,
    /// Mean squared bias.
    pub bias_squared: Option<f64>,
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

    /// Seconds for one sample per pixel, seed by seed.
    pub fn per_sample(&self) -> Vec<f64> {
        self.seconds.iter().map(|seconds| seconds / f64::from(self.spp)).collect()
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
}

impl MethodResult {
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

    /// Time of a sample over the baseline's: above 1 is slower.
    pub fn slowdown(&self, method: usize, budget: usize) -> Option<Interval> {
        let (ours, base) = self.pair(method, budget)?;
        Interval::of_ratio(&ours.per_sample(), &base.per_sample())
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

fn interval(found: Interval) -> Value {
    json!({ "value": found.value, "low": found.bounds.map(|b| b[0]), "high": found.bounds.map(|b| b[1]) })
}

/// The document of a comparison. `command` repeats it.
pub fn to_json(scenes: &[SceneResult], failed: &[(PathBuf, String)], options: &Options, command: &str) -> Value {
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "command": command,
        "machine": { "processor": machine(), "threads": rayon::current_num_threads(), "system": std::env::consts::OS },
        "seeds": options.seeds,
        "first_seed": options.seed,
        "budgets": options.budgets.names(),
        "confidence": 1.0 - Interval::MISS,
        "definitions": { "epsilon": EPSILON, "trimmed": TRIMMED, "firefly": FIREFLY },
        "scenes": scenes.iter().map(|scene| scene_json(scene, options)).collect::<Vec<_>>(),
        "failed_scenes": failed.iter().map(|(scene, why)| json!({ "scene": scene.display().to_string(), "failed": why })).collect::<Vec<_>>(),
    })
}

fn scene_json(scene: &SceneResult, options: &Options) -> Value {
    let truth = &scene.truth;
    let methods = scene.methods.iter().enumerate().map(|(i, method)| {
        let mut value = json!({ "name": method.method.name, "what": method.method.describe() });
        if let Some(why) = &method.failed {
            value["failed"] = json!(why);
            return value;
        }
        let [by_spp, by_seconds] = method.slopes();
        value["slopes"] = json!({ "samples": by_spp.map(interval), "seconds": by_seconds.map(interval) });
        value["points"] = method.points.iter().map(|point| point_json(point, scene)).collect();
        let budgets = options.budgets.names().into_iter().enumerate().map(|(budget, name)| {
            json!({
                "budget": name,
                "spp": scene.pair(i, budget).map(|(ours, _)| ours.spp),
                "against_baseline": {
                    "efficiency_mse": scene.gain(i, budget, |e| e.mse).map(interval),
                    "efficiency_rel_mse": scene.gain(i, budget, |e| e.rel_mse).map(interval),
                    "efficiency_rel_mse_trimmed": scene.gain(i, budget, |e| e.rel_mse_trimmed).map(interval),
                    "seconds_per_sample": scene.slowdown(i, budget).map(interval),
                },
            })
        });
        value["budgets"] = budgets.collect();
        value
    });
    json!({
        "scene": scene.scene.display().to_string(),
        "size": truth.size,
        "reference": {
            "source": truth.source,
            "spp": truth.spp,
            "noise_mse": truth.noise.map(|n| n[0]),
            "noise_rel_mse": truth.noise.map(|n| n[1]),
            "is_good_enough": truth.reached,
        },
        "baseline": scene.methods[scene.baseline].method.name,
        "methods": methods.collect::<Vec<_>>(),
    })
}

fn point_json(point: &Point, scene: &SceneResult) -> Value {
    json!({
        "spp": point.spp,
        "seconds": interval(point.time()),
        "mse": interval(point.mean(|e| e.mse)),
        "rel_mse": interval(point.mean(|e| e.rel_mse)),
        "rel_mse_trimmed": interval(point.mean(|e| e.rel_mse_trimmed)),
        "mape": interval(point.mean(|e| e.mape)),
        "smape": interval(point.mean(|e| e.smape)),
        "fireflies": interval(point.mean(|e| e.fireflies as f64)),
        "left_out": point.errors.iter().map(|e| e.left_out).sum::<usize>(),
        "efficiency_mse": interval(Interval::of_mean(&point.efficiencies(|e| e.mse))),
        "efficiency_rel_mse": interval(Interval::of_mean(&point.efficiencies(|e| e.rel_mse))),
        "variance": point.variance,
        "bias_squared": point.bias_squared,
        "mean_difference": interval(point.mean_difference(&scene.truth)),
        "is_biased": scene.is_biased(point),
    })
}

/// One line a run: comma-separated, with a head.
pub fn to_csv(scenes: &[SceneResult], options: &Options) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut text = "scene,method,spp,seed,seconds,mse,rel_mse,rel_mse_trimmed,mape,smape,mean_difference,fireflies,left_out,failed\n".to_owned();
    for scene in scenes {
        let name = quoted(&scene.scene.display().to_string());
        for method in &scene.methods {
            let label = quoted(&method.method.name);
            if let Some(why) = &method.failed {
                let _ = writeln!(text, "{name},{label},,,,,,,,,,,,{}", quoted(why));
            }
            for point in &method.points {
                for (run, (e, seconds)) in point.errors.iter().zip(&point.seconds).enumerate() {
                    let seed = options.seed.wrapping_add(run as u32);
                    let _ = writeln!(
                        text,
                        "{name},{label},{},{seed},{seconds},{},{},{},{},{},{},{},{},",
                        point.spp,
                        e.mse,
                        e.rel_mse,
                        e.rel_mse_trimmed,
                        e.mape,
                        e.smape,
                        e.mean_difference,
                        e.fireflies,
                        e.left_out
                    );
                }
            }
        }
    }
    text
}
