//! What is told of a render when it is over.

use super::Point;
use crate::process::peak_memory;
use lucerna_core::math::UVec2;
use lucerna_core::render::Report;
use serde_json::{Value, json};

/// What was seen of a run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// The estimated relMSE of the finished picture, where the run was watched.
    pub estimate: Option<f64>,
    /// The relMSE that was asked for.
    pub target: Option<f64>,
    /// Whether the run ended because it was met.
    pub reached: bool,
    /// The errors at doublings and at the end, if there is a reference.
    pub points: Vec<Point>,
}

impl Summary {
    /// Whether the run ended before the asked number of samples, and not because its target was met.
    pub fn is_stopped(&self, report: &Report) -> bool {
        report.stopped && !self.reached
    }

    /// How a run ended, in a line.
    pub fn tell(&self, report: &Report, size: UVec2) -> String {
        let [rate, ray_rate] = rates(report);
        let stopped = if self.is_stopped(report) { ", stopped early" } else { "" };
        let estimate = self.estimate.map_or_else(String::new, |estimate| format!(", estimated relMSE {estimate:.2e}"));
        let memory = peak_mib().map_or_else(String::new, |mib| format!(", {mib} MiB"));
        format!(
            "{} x {} pixels, {} spp{stopped}{estimate}, {:.2} s, {rate:.2} Msamples/s, {ray_rate:.2} Mrays/s{memory}",
            size.x, size.y, report.spp, report.seconds
        )
    }

    /// Why the target was not met, if it was not.
    pub fn warning(&self) -> Option<String> {
        let target = self.target.filter(|_| !self.reached)?;
        let why = match self.estimate {
            Some(estimate) => format!("the estimate is {estimate:.2e}"),
            None => "there were too few samples to tell".to_owned(),
        };
        Some(format!("warning: a relMSE of {target:e} was not reached: {why}"))
    }

    /// The same for programs.
    pub fn document(&self, report: &Report) -> Value {
        let [rate, ray_rate] = rates(report);
        let mut document = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "spp": report.spp,
            "samples": report.samples,
            "rays": report.rays,
            "render_seconds": report.seconds,
            "msamples_per_second": rate,
            "mrays_per_second": ray_rate,
            "bad_samples": report.bad.count,
            "stopped": self.is_stopped(report),
            "peak_memory_mib": peak_mib(),
        });
        if let Some(estimate) = self.estimate {
            document["estimated_rel_mse"] = json!(estimate);
        }
        if let Some(target) = self.target {
            document["target_rel_mse"] = json!(target);
            document["target_reached"] = json!(self.reached);
        }
        if !self.points.is_empty() {
            document["errors"] = self.points.iter().map(point).collect();
        }
        document
    }
}

fn point(point: &Point) -> Value {
    json!({
        "spp": point.spp,
        "seconds": point.seconds,
        "mse": point.errors.map(|e| e.mse),
        "rel_mse": point.errors.map(|e| e.rel_mse),
        "rel_mse_trimmed": point.errors.map(|e| e.rel_mse_trimmed),
        "left_out": point.errors.map(|e| e.left_out),
        "estimated_rel_mse": point.estimate,
    })
}

/// Millions of samples and of rays a second.
fn rates(report: &Report) -> [f64; 2] {
    let seconds = report.seconds.max(1e-9);
    [report.samples, report.rays].map(|count| count as f64 / seconds / 1e6)
}

/// Tells of samples that were left out, if there were any.
pub fn tell_bad_samples(report: &Report, seed: u32) {
    if report.bad.count == 0 {
        return;
    }
    let share = report.bad.count as f64 / report.samples as f64;
    eprintln!("warning: {} samples ({share:.1e} of all) were NaN, infinite or negative and left out", report.bad.count);
    for bad in &report.bad.first {
        let (x, y) = (bad.pixel.x, bad.pixel.y);
        eprintln!("warning:   {:?}; repeat with --pixel {x},{y} --sample {} --seed {seed}", bad.value, bad.sample);
    }
}

/// In whole MiB.
fn peak_mib() -> Option<u64> {
    peak_memory().map(|mib| mib as u64)
}
