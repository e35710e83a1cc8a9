//! What is seen of a render while it runs, and told when it ends: bar, errors against a reference, the estimate of the
//! error that is left, viewers.
//!
//! None of it changes the picture; only a target for the error ends the run, between passes, and then the picture is
//! that of so many samples. The clock of the run stands still meanwhile ([`Control::with_pass_end`]).
//!
//! [`Control::with_pass_end`]: lucerna_core::render::Control::with_pass_end

mod bar;
pub mod directions;
pub mod http;
mod letters;
mod live;
mod reference;
mod summary;
pub mod tev;

pub use bar::Bar;
pub use live::{Facts, Page};
pub use reference::Reference;
pub use summary::{Summary, tell_bad_samples};

use lucerna_core::interfaces::FilmSettings;
use lucerna_core::render::{FilmStore, PassEnd, Progress, Report};
use lucerna_core::stats::doublings::{Doublings, FEWEST};
use lucerna_core::stats::metrics::Errors;
use std::cell::OnceCell;
use std::ops::ControlFlow;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tev::Tev;

/// What to show.
#[derive(Default)]
pub struct Wanted {
    /// The picture to compare with.
    pub reference: Option<Reference>,
    /// The estimated relMSE that ends the run.
    pub target: Option<f64>,
    /// The tev viewer.
    pub tev: Option<Tev>,
    /// The page.
    pub page: Option<Page>,
    /// Whether the sampler's numbers are independent of each other.
    pub independent: bool,
    /// No table.
    pub quiet: bool,
}

/// How good the picture was at some number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Errors against the reference.
    pub errors: Option<Errors>,
    /// The estimated relMSE.
    pub estimate: Option<f64>,
}

/// Everything that watches one render.
pub struct Views {
    wanted: Wanted,
    bar: Bar,
    started: Instant,
    /// Pixels of the film.
    pixels: f64,
    seen: Mutex<Seen>,
}

#[derive(Default)]
struct Seen {
    doublings: Doublings,
    points: Vec<Point>,
    /// Samples per pixel of the latest pass.
    spp: u32,
    reached: bool,
    /// Samples per pixel at which the target will be met, as far as can be told.
    goal: Option<f64>,
}

impl Seen {
    fn look(&mut self, spp: u32, picture: &impl Fn() -> Vec<f32>, width: usize) {
        self.spp = spp;
        if self.doublings.wants(spp) {
            self.doublings.add(spp, picture(), width);
        }
    }

    /// Whether so many samples belong into the table: the first pass, then at least twice as many.
    fn is_next(&self, spp: u32) -> bool {
        self.points.last().is_none_or(|last| spp >= last.spp.saturating_mul(2))
    }
}

impl Views {
    /// Nothing to see yet. `size` is that of the picture in pixels.
    pub fn new(wanted: Wanted, size: [u32; 2]) -> Self {
        let bar = Bar::new(wanted.quiet);
        let seen = Seen { doublings: Doublings::new(wanted.independent), ..Seen::default() };
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        Views { wanted, bar, started: Instant::now(), pixels, seen: Mutex::new(seen) }
    }

    /// Whether the picture is looked at between passes.
    pub fn watches_passes(&self) -> bool {
        let w = &self.wanted;
        w.reference.is_some() || w.target.is_some() || w.tev.is_some() || w.page.is_some()
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows how far the run is; from any thread.
    pub fn progress(&self, progress: Progress) {
        let seconds = self.started.elapsed().as_secs_f64();
        let goal = if self.wanted.target.is_some() { self.seen().goal } else { None };
        // With a target, the number of samples is only the most that may be taken.
        let fraction = goal.map_or(0.0, |goal| progress.samples as f64 / self.pixels / goal);
        let known = goal.is_some() || self.wanted.target.is_none();
        let progress = Progress { fraction: progress.fraction.max(fraction).min(1.0), ..progress };
        self.bar.show(progress, seconds);
        if let Some(page) = &self.wanted.page {
            page.progress(progress, seconds, known);
        }
    }

    /// Looks at the picture after a pass; breaks off when the target is met.
    pub fn pass_end(&self, end: PassEnd<'_>) -> ControlFlow<()> {
        let size = end.store.size();
        let rgb = OnceCell::new();
        let picture = || rgb.get_or_init(|| rgb_of(end.store)).clone();
        let mut seen = self.seen();
        seen.look(end.spp, &picture, size.x as usize);
        let estimate = seen.doublings.rel_mse(end.spp);
        if seen.is_next(end.spp) {
            self.add_point(&mut seen, end.spp, end.seconds, &picture);
        }
        let reached = self.meets_target(end.spp, estimate);
        seen.reached = reached;
        if let (Some(target), Some(estimate)) = (self.wanted.target, estimate) {
            seen.goal = Some(f64::from(end.spp) * (estimate / target).powf(1.0 / seen.doublings.exponent()).max(1.0));
        }
        drop(seen);
        if let Some(tev) = &self.wanted.tev
            && tev.is_ready()
        {
            tev.send(end.store.picture(end.film));
        }
        if let Some(page) = &self.wanted.page {
            page.pass(end.spp, end.seconds, estimate);
            if page.wants_picture() {
                page.show(end.spp, [size.x, size.y], &picture());
            }
        }
        if reached { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn meets_target(&self, spp: u32, estimate: Option<f64>) -> bool {
        let met = self.wanted.target.zip(estimate).is_some_and(|(target, estimate)| estimate <= target);
        met && spp >= FEWEST
    }

    fn add_point(&self, seen: &mut Seen, spp: u32, seconds: f64, picture: &impl Fn() -> Vec<f32>) {
        let errors = self.wanted.reference.as_ref().and_then(|reference| reference.errors(picture()));
        let point = Point { spp, seconds, errors, estimate: seen.doublings.rel_mse(spp) };
        if self.wanted.reference.is_some() && !self.wanted.quiet {
            if seen.points.is_empty() {
                self.bar.print(reference::HEAD);
            }
            self.bar.print(&reference::row(&point));
        }
        seen.points.push(point);
        if let Some(page) = &self.wanted.page {
            page.point(point);
        }
    }

    /// The end of a run: the last row of the table, and the finished picture to the viewers.
    pub fn finish(&self, report: &Report, store: &FilmStore, film: &FilmSettings) -> Summary {
        if !self.watches_passes() {
            self.bar.finish();
            return Summary::default();
        }
        let picture = || rgb_of(store);
        let mut seen = self.seen();
        if report.spp > 0 {
            seen.look(report.spp, &picture, store.size().x as usize);
            if seen.points.last().is_none_or(|last| last.spp != report.spp) {
                self.add_point(&mut seen, report.spp, report.seconds, &picture);
            }
        }
        self.bar.finish();
        let summary = Summary {
            estimate: seen.doublings.rel_mse(report.spp),
            target: self.wanted.target,
            reached: seen.reached,
            points: if self.wanted.reference.is_some() { seen.points.clone() } else { Vec::new() },
        };
        drop(seen);
        if let Some(page) = &self.wanted.page {
            page.pass(report.spp, report.seconds, summary.estimate);
            page.show(report.spp, store.size().to_array(), &picture());
        }
        if let Some(tev) = &self.wanted.tev {
            tev.finish(store.picture(film));
        }
        summary
    }

    /// Tells viewers that the picture is written, and waits for those that are about to take it; with `keep` until
    /// `is_over`.
    pub fn close(&self, message: &str, keep: bool, is_over: &dyn Fn() -> bool) {
        if let Some(page) = &self.wanted.page {
            page.close(message, keep, is_over);
        }
    }
}

/// Red, green and blue of all pixels.
fn rgb_of(store: &FilmStore) -> Vec<f32> {
    let size = store.size();
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y)));
    pixels.flat_map(|(x, y)| store.pixel(x, y).rgb.to_array()).collect()
}
