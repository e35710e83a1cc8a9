//! The report.
use super::Options;
use super::results::{SceneResult, to_csv, to_json};
use lucerna_core::stats::metrics::Interval;
use std::path::PathBuf;
/// x
pub fn times(g: &Interval) -> String {
    format!("{:.3} ×", g.value)
}
/// x
pub fn write(
    scenes: &[SceneResult],
    failed: &[(PathBuf, String)],
    options: &Options,
    command: &str,
) -> Result<(), String> {
    let put = |name: &str, t: &str| std::fs::write(options.output.join(name), t).map_err(|e| e.to_string());
    put("results.json", &format!("{:#}\n", to_json(scenes, failed, options, command)))?;
    put("results.csv", &to_csv(scenes, options))
}
