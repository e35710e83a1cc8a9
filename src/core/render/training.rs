//! The run of an estimator that learns where light comes from.
//!
//! Rendering is cut into iterations. In each, paths are guided by what the iterations before have taught, and note what
//! they find; what a field gives does not change meanwhile. So every picture is unbiased, and has the same bits for any
//! number of threads. First come some iterations of one sample per pixel, by which the field learns where paths go at
//! all; then each has twice the samples of the one before. The last one takes all that is left of the budget, once the
//! one after it could not be completed, and notes nothing (Müller, Gross, Novák 2017, section 5; Müller 2019, sections
//! 10.2 and 10.7). How the pictures become one: [`super::combine`].

use super::combine::{Iterations, Moments};
use super::notebook::Notebook;
use super::tiles::{Run, Tracer, asked_spp, points};
use super::{Budget, FilmStore, RenderContext, RenderError, Report, SampleOrder};
use crate::interfaces::{Arena, CameraRay, EmitterSampling, Guide, GuideField, GuideLearner, Radiance, Training};
use crate::sampling::Stream;
use crate::scene::Scene;
use glam::IVec2;
use std::sync::Arc;

/// Tiles whose notes are held at the same time, at one sample per pixel: about 40 MiB.
const NOTED: usize = 512;

/// Samples per pixel of a pass at most, as in [`super::Schedule`].
const LONGEST_PASS: u32 = 16;

/// Samples per pixel until which lights are sampled if that is for a start only (the default of the public code).
const KICKSTART: u32 = 128;

/// What holds during a pass.
#[derive(Clone, Copy)]
pub struct Guidance<'a> {
    /// What has been learnt.
    pub field: &'a dyn GuideField,
    /// Whether lights are sampled.
    pub sample_emitters: bool,
    /// Whether paths note what they find.
    pub learning: bool,
    /// Narrower lobes than this are not guided.
    pub least_roughness: f32,
}

/// A forward estimator that is guided and notes what it finds.
pub trait GuidedEstimator: Sync {
    /// As [`crate::interfaces::RadianceEstimator::radiance`]. What the path finds is noted if `guidance.learning`.
    #[allow(clippy::too_many_arguments)]
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
        guidance: Guidance<'_>,
        notes: &mut Notebook,
    ) -> Radiance;
}

/// Renders a guided estimator into the context's film until the budget is spent, and gives what was learnt.
///
/// # Errors
/// If the context asks for what a run with learning cannot do.
pub fn render_guided(
    cx: &mut RenderContext<'_>,
    estimator: &dyn GuidedEstimator,
    guide: &dyn Guide,
) -> Result<(Report, Arc<dyn GuideField>), RenderError> {
    if cx.order != SampleOrder::PerSample {
        return Err(RenderError("random numbers in the reference's order and a guide exclude each other".to_owned()));
    }
    let asked = asked_spp(cx);
    let points = points(cx, asked);
    let run = Run::new(cx, points.as_deref(), asked);
    let learner = guide.start(cx.scene.accel().bounds());
    let empty = FilmStore::new(cx.store.size(), cx.store.aovs().to_vec());
    let training = guide.training();
    let pictures = Iterations::new(&empty, training.combination);
    let report = Report::default();
    let mut lesson = Lesson { cx, run, estimator, training, learner, pictures, report, asked, pace: 0.0 };
    lesson.iterations();
    let Lesson { run, mut report, learner, pictures, .. } = lesson;
    run.conclude(&mut report);
    report.notes = learner.summary();
    cx.store.add(&pictures.combined());
    Ok((report, learner.field()))
}

/// A run under way.
struct Lesson<'r, 'a> {
    cx: &'r RenderContext<'a>,
    run: Run<'r, 'a>,
    estimator: &'r dyn GuidedEstimator,
    training: Training,
    learner: Box<dyn GuideLearner>,
    pictures: Iterations,
    report: Report,
    /// Samples per pixel of the whole run.
    asked: u32,
    /// Seconds that a sample per pixel took in the latest pass; 0 before.
    pace: f64,
}

/// An iteration.
#[derive(Clone, Copy)]
struct Part {
    /// It is one of those at the start.
    startup: bool,
    /// Samples per pixel of the run when it is complete.
    end: u32,
    /// Whether paths note what they find.
    learning: bool,
}

impl Lesson<'_, '_> {
    fn iterations(&mut self) {
        let mut pace = 0.0;
        for index in 0.. {
            let Some(part) = self.part(index, pace) else { return };
            // The first ones share a picture, for one sample has no variance.
            if index == 0 || !part.startup {
                self.pictures.begin();
            }
            let (before, spp_before) = (self.cx.control.seconds(), self.report.spp);
            if !self.iteration(part) {
                return;
            }
            if !part.startup || index + 1 == self.training.startup {
                self.pictures.complete();
            }
            if part.learning {
                self.learner.refine(part.end - spp_before);
            }
            pace = (self.cx.control.seconds() - before) / f64::from(part.end - spp_before);
        }
    }

    /// The iteration of this number, if there is to be one; those before it took `pace` seconds for a sample per pixel.
    fn part(&self, index: u32, pace: f64) -> Option<Part> {
        let startup = index < self.training.startup;
        let wanted = if startup { 1 } else { 1_u32 << (index - self.training.startup).min(30) };
        // The one after it would not be completed: this one is the last, and as long as can be.
        let last = !startup && wanted.saturating_mul(3) > self.samples_left(pace);
        let left = self.asked - self.report.spp;
        let size = if last { left } else { wanted.min(left) };
        if size == 0 || (index > 0 && self.cx.control.should_stop()) {
            return None;
        }
        Some(Part { startup, end: self.report.spp + size, learning: !last && size < left })
    }

    /// Samples per pixel that the budget still allows, about, at so many seconds each.
    fn samples_left(&self, pace: f64) -> u32 {
        let left = self.asked - self.report.spp;
        self.samples_in_time(pace).map_or(left, |samples| left.min(samples))
    }

    /// Samples per pixel until the time of the budget is over, if it is one of time and the pace is known.
    fn samples_in_time(&self, pace: f64) -> Option<u32> {
        let is_time = matches!(self.cx.budget, Budget::Seconds(_)) && pace > 0.0;
        let seconds = self.cx.control.seconds_left().filter(|_| is_time)?;
        Some((seconds / pace) as u32)
    }

    /// Where a pass ends that begins now. One that the deadline cuts short is lost: towards the end, passes take half of
    /// the time that is left, so that no more than a sample per pixel is.
    fn pass_end(&self, part: Part) -> u32 {
        let start = self.report.spp;
        let most = self.samples_in_time(self.pace).map_or(LONGEST_PASS, |samples| (samples / 2).max(1));
        start + (start / 8).clamp(1, LONGEST_PASS).min(most).min(part.end - start)
    }

    /// Takes the samples of an iteration. Whether they are complete and the run is to go on.
    fn iteration(&mut self, part: Part) -> bool {
        while self.report.spp < part.end {
            let start = self.report.spp;
            if start > 0 && self.cx.control.should_stop() {
                return false;
            }
            let (next, began) = (self.pass_end(part), self.cx.control.seconds());
            if !self.pass((start, next), part.learning) {
                return false;
            }
            let control = self.cx.control;
            self.pace = (control.seconds() - began) / f64::from(next - start);
            if control.end_pass(next, &self.cx.film, || self.pictures.combined()).is_break() {
                return false;
            }
        }
        true
    }

    /// One pass; one that is cut short is lost, but for the first.
    fn pass(&mut self, (start, end): (u32, u32), learning: bool) -> bool {
        let mut film = self.pictures.film();
        let mut moments = Vec::new();
        let sample_emitters = match self.training.emitter_sampling {
            EmitterSampling::Never => false,
            EmitterSampling::Kickstart => start < KICKSTART,
            EmitterSampling::Always => true,
        };
        let Training { learn_direct, least_roughness, .. } = self.training;
        let (field, learner) = (self.learner.field(), &mut self.learner);
        let guidance = Guidance { field: &*field, sample_emitters, learning, least_roughness };
        let guided = Guided { estimator: self.estimator, guidance, learn_direct };
        // Notes are taken in as they come, so that those of a few tiles at most are held. A pass that is lost afterwards
        // has taught something nevertheless.
        let batch = (NOTED / (end - start) as usize).max(1);
        let hand_over = |notes: Vec<TileNotes>| {
            let (records, found): (Vec<_>, Vec<_>) =
                notes.into_iter().map(|TileNotes { book, moments }| (book.into_records(), moments)).unzip();
            if learning {
                learner.learn(&records);
            }
            moments.extend(found);
        };
        let complete = self.run.pass(&guided, (start, end), batch, &mut film, &mut self.report, hand_over);
        if !complete && start > 0 {
            return false;
        }
        self.pictures.extend(film, end - start, &moments);
        self.report.spp = if complete { end } else { start };
        complete
    }
}

/// What a tile gathers besides its pixels.
struct TileNotes {
    book: Notebook,
    moments: Moments,
}

/// A guided estimator in the pass loop.
struct Guided<'a> {
    estimator: &'a dyn GuidedEstimator,
    guidance: Guidance<'a>,
    learn_direct: bool,
}

impl Tracer for Guided<'_> {
    type Notes = TileNotes;

    fn notes(&self) -> TileNotes {
        TileNotes { book: Notebook::new(self.learn_direct), moments: Moments::default() }
    }

    fn wants_differentials(&self) -> bool {
        false
    }

    #[inline]
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
        notes: &mut TileNotes,
    ) -> Radiance {
        self.estimator.radiance(scene, camera, stream, arena, aovs, self.guidance, &mut notes.book)
    }

    #[inline]
    fn taken(&self, notes: &mut TileNotes, pixel: IVec2, value: Radiance) {
        notes.moments.add(pixel, value);
    }
}
