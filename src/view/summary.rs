//! What is told of a render when it is over.

use super::Point;
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

    /// The estimate, for the line that tells the end.
    pub fn tell_estimate(&self) -> String {
        self.estimate.map_or_else(String::new, |estimate| format!(", estimated relMSE {estimate:.2e}"))
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

    /// Adds what was seen to a document.
    pub fn add_to(&self, document: &mut Value) {
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

/// Largest resident size of the process so far in MiB, where the system tells.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib >> 10)
}
