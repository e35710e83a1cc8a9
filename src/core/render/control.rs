//! How long to render, and how to be told and stopped meanwhile.

use super::FilmStore;
use crate::image::Image;
use crate::interfaces::FilmSettings;
use std::borrow::Borrow;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How long to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// So many samples per pixel.
    Samples(u32),
    /// So many seconds of wall-clock time, at least one pass.
    Seconds(f64),
}

/// The sample ranges of the passes: 16 of one sample per pixel, then each an eighth to a sixteenth of what is there, at
/// most 16 samples. It depends on nothing but the pass, so that a run that stops early is the beginning of a longer one;
/// and since a pass that is cut short is lost, passes are short against what went before.
#[derive(Clone, Copy, Debug, Default)]
pub struct Schedule;

impl Schedule {
    /// First sample of a pass, and the first of the next one.
    pub fn pass(index: u32) -> (u32, u32) {
        let start = |i: u32| match i / 8 {
            0 => i,
            doublings @ 1..=4 => (8 + i % 8) << (doublings - 1),
            _ => 16_u32.saturating_mul(i - 32),
        };
        (start(index), start(index + 1))
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Part of the work that is done, in [0, 1].
    pub fraction: f64,
    /// Pixel samples so far.
    pub samples: u64,
    /// Samples per pixel in complete passes.
    pub spp: u32,
}

/// What is there when a pass is complete.
#[derive(Clone, Copy)]
pub struct PassEnd<'r> {
    /// Samples per pixel so far.
    pub spp: u32,
    /// Seconds of rendering so far; time spent in the function this is given to does not count.
    pub seconds: f64,
    /// Size, window and filter, to develop the picture with.
    pub film: &'r FilmSettings,
    /// The sums so far.
    pub store: &'r FilmStore,
}

impl PassEnd<'_> {
    /// The picture so far.
    pub fn picture(&self) -> Image {
        self.store.picture(self.film)
    }
}

/// Looks at the picture between passes, and may end the run.
pub type OnPass<'a> = &'a (dyn Fn(PassEnd<'_>) -> ControlFlow<()> + Sync);

/// Tells the time since some moment.
pub type Clock<'a> = &'a (dyn Fn() -> Duration + Sync);

/// Stop button, deadline and progress of a run.
pub struct Control<'a> {
    stop: AtomicBool,
    started: Instant,
    /// Another clock than the system's, which shows 0 at the start.
    clock: Option<Clock<'a>>,
    /// Nanoseconds that were not spent on rendering.
    aside: AtomicU64,
    limit: Option<Duration>,
    on_progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    on_pass: Option<OnPass<'a>>,
}

impl Default for Control<'_> {
    fn default() -> Self {
        Control {
            stop: AtomicBool::new(false),
            started: Instant::now(),
            clock: None,
            aside: AtomicU64::new(0),
            limit: None,
            on_progress: None,
            on_pass: None,
        }
    }
}

impl<'a> Control<'a> {
    /// A run that starts now.
    pub fn new() -> Self {
        Control::default()
    }

    /// Stops by itself after so many seconds.
    pub fn with_deadline(mut self, seconds: f64) -> Self {
        // More than a century is no deadline (and would overflow the clock).
        self.limit = (seconds < 3.2e9).then(|| Duration::from_secs_f64(seconds.max(0.0)));
        self
    }

    /// Goes by another clock, which shows 0 at the start: for tests that no machine's speed may decide.
    pub fn with_clock(mut self, clock: Clock<'a>) -> Self {
        self.clock = Some(clock);
        self
    }

    /// Calls a function as work gets done, from any thread.
    pub fn with_progress(mut self, on_progress: &'a (dyn Fn(Progress) + Sync)) -> Self {
        self.on_progress = Some(on_progress);
        self
    }

    /// Calls a function after each complete pass, between passes; the clock of the run stands still meanwhile.
    pub fn with_pass_end(mut self, on_pass: OnPass<'a>) -> Self {
        self.on_pass = Some(on_pass);
        self
    }

    /// Asks the run to stop soon and keep what it has.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether [`stop`](Self::stop) was called.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Whether the run should end: it was stopped, or the deadline has passed.
    pub fn should_stop(&self) -> bool {
        self.is_stopped() || self.limit.is_some_and(|limit| self.rendering() >= limit)
    }

    /// Seconds of rendering since the start.
    pub fn seconds(&self) -> f64 {
        self.rendering().as_secs_f64()
    }

    /// Part of the time until the deadline that has passed, if there is one.
    pub fn time_fraction(&self) -> Option<f64> {
        let total = self.limit?.as_secs_f64();
        Some(if total > 0.0 { (self.seconds() / total).min(1.0) } else { 1.0 })
    }

    /// Seconds of rendering until the deadline, if there is one.
    pub fn seconds_left(&self) -> Option<f64> {
        Some(self.limit?.saturating_sub(self.rendering()).as_secs_f64())
    }

    fn elapsed(&self) -> Duration {
        self.clock.map_or_else(|| self.started.elapsed(), |clock| clock())
    }

    fn rendering(&self) -> Duration {
        self.elapsed().saturating_sub(Duration::from_nanos(self.aside.load(Ordering::Relaxed)))
    }

    /// To be called between passes. `store` gives the film so far, if anybody looks at it; its time does not count.
    pub(crate) fn end_pass<S: Borrow<FilmStore>>(
        &self,
        spp: u32,
        film: &FilmSettings,
        store: impl FnOnce() -> S,
    ) -> ControlFlow<()> {
        let Some(on_pass) = self.on_pass else { return ControlFlow::Continue(()) };
        let seconds = self.seconds();
        self.aside(|| on_pass(PassEnd { spp, seconds, film, store: store().borrow() }))
    }

    /// Does something that does not count as rendering, between passes.
    pub(crate) fn aside<T>(&self, work: impl FnOnce() -> T) -> T {
        let began = self.elapsed();
        let done = work();
        self.aside.fetch_add(self.elapsed().saturating_sub(began).as_nanos() as u64, Ordering::Relaxed);
        done
    }

    pub(crate) fn progress(&self, progress: Progress) {
        if let Some(on_progress) = self.on_progress {
            on_progress(progress);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_follow_each_other() {
        let mut next = 0;
        for pass in 0..100 {
            let (start, end) = Schedule::pass(pass);
            assert!(start == next && end > start && end - start <= 16 && end - start <= 1 + start / 8);
            next = end;
        }
        assert_eq!([8, 16, 24, 32, 40, 41].map(|i| Schedule::pass(i).0), [8, 16, 32, 64, 128, 144]);
    }
}
