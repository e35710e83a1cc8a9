//! The progress bar: rate and time left, silent where nobody watches.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lucerna_core::render::Progress;
use std::io::IsTerminal;

/// Steps of the bar.
const STEPS: u64 = 1000;

/// A bar on standard error, hidden if that is no terminal or if `quiet`.
pub struct Bar(ProgressBar);

impl Bar {
    /// An empty bar.
    pub fn new(quiet: bool) -> Self {
        let target = if quiet || !std::io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(5)
        };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {msg}  {elapsed} gone, {eta} left") {
            bar.set_style(style);
        }
        Bar(bar)
    }

    /// Shows how far the run is.
    pub fn show(&self, progress: Progress, seconds: f64) {
        self.0.set_position((progress.fraction * STEPS as f64) as u64);
        let rate = progress.samples as f64 / seconds.max(1e-9) / 1e6;
        self.0.set_message(format!("{} spp, {rate:.2} Msamples/s", progress.spp));
    }

    /// Prints a line on standard error, above the bar if there is one.
    pub fn print(&self, line: &str) {
        self.0.suspend(|| eprintln!("{line}"));
    }

    /// Takes the bar off the screen.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
