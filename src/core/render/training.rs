//! The run of an estimator that learns where light comes from.
//!
//! Rendering is cut into iterations. In each, paths are guided by what the iterations before have taught, and note what
//! they find; what a field gives does not change meanwhile. So every picture is unbiased, and has the same bits for any
//! number of threads. First come some iterations of one sample per pixel, by which the field learns where paths go at
//! all; then each has as many as all before it together. The last one takes all that is left of the budget, if that is
//! less than twice as much, and notes nothing (after Müller, Gross, Novák 2017, section 5, and Müller 2019, sections
//! 10.2 and 10.7, where iterations begin to double at one sample again, and the last one is as long as two: half of
//! the picture then is guided by an eighth of the samples). How the pictures become one: [`super::combine`].

use super::combine::{Iterations, Moments};
use super::notebook::Notebook;
use super::tiles::{Run, Tracer, asked_spp, points};
use super::{Budget, RenderContext, RenderError, Report, SampleOrder};
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
    /// Directions that are tried at a vertex; while nothing has been learnt it makes no difference.
    pub candidates: u32,
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
    let mut lesson = Lesson { cx, run, estimator, training: guide.training(), learner, report: Report::default() };
    let film = lesson.iterations(asked);
    let Lesson { run, mut report, learner, .. } = lesson;
    run.conclude(&mut report);
    report.notes = learner.summary();
    cx.store.add(&film);
    Ok((report, learner.field()))
}

/// A run under way.
struct Lesson<'r, 'a> {
    cx: &'r RenderContext<'a>,
    run: Run<'r, 'a>,
    estimator: &'r dyn GuidedEstimator,
    training: Training,
    learner: Box<dyn GuideLearner>,
    report: Report,
}

impl Lesson<'_, '_> {
    fn iterations(&mut self, asked: u32) -> super::FilmStore {
        let empty = super::FilmStore::new(self.cx.store.size(), self.cx.store.aovs().to_vec());
        let mut pictures = Iterations::new(&empty, self.training.combination);
        let mut pace = 0.0;
        for index in 0.. {
            let startup = index < self.training.startup;
            let wanted = if startup { 1 } else { self.report.spp.max(1) };
            let left = self.samples_left(asked, pace);
            // What would be left for another one is less than it should have: this one is the last, and takes it.
            let last = !startup && left < wanted.saturating_mul(2);
            let size = if last { asked - self.report.spp } else { wanted.min(asked - self.report.spp) };
            if size == 0 || (index > 0 && self.cx.control.should_stop()) {
                break;
            }
            // The first ones share a picture, for one sample has no variance.
            if index == 0 || !startup {
                pictures.begin();
            }
            let (before, spp_before) = (self.cx.control.seconds(), self.report.spp);
            let learning = !last && self.report.spp + size < asked;
            if !self.iteration(&mut pictures, size, learning) {
                break;
            }
            if !startup || index + 1 == self.training.startup {
                pictures.complete();
            }
            if learning {
                self.learner.refine(size);
            }
            let done = f64::from(self.report.spp - spp_before);
            pace = (self.cx.control.seconds() - before) / done;
        }
        pictures.combined()
    }

    /// Samples per pixel that the budget still allows, about.
    fn samples_left(&self, asked: u32, pace: f64) -> u32 {
        let left = asked - self.report.spp;
        match (self.cx.budget, self.cx.control.time_fraction()) {
            (Budget::Seconds(_), Some(fraction)) if fraction > 0.0 && pace > 0.0 => {
                let seconds = self.cx.control.seconds() * (1.0 / fraction - 1.0);
                left.min((seconds / pace) as u32)
            }
            _ => left,
        }
    }

    /// Takes so many samples per pixel. Whether they are complete and the run is to go on.
    fn iteration(&mut self, pictures: &mut Iterations, size: u32, learning: bool) -> bool {
        let end = self.report.spp.saturating_add(size);
        while self.report.spp < end {
            let start = self.report.spp;
            if start > 0 && self.cx.control.should_stop() {
                return false;
            }
            let next = start + (start / 8).clamp(1, LONGEST_PASS).min(end - start);
            if !self.pass(pictures, (start, next), learning) {
                return false;
            }
            let control = self.cx.control;
            if control.watches_passes() && control.end_pass(next, &self.cx.film, &pictures.combined()).is_break() {
                return false;
            }
        }
        true
    }

    /// One pass; one that is cut short is lost, but for the first.
    fn pass(&mut self, pictures: &mut Iterations, (start, end): (u32, u32), learning: bool) -> bool {
        let mut film = pictures.film();
        let mut moments = Vec::new();
        let sample_emitters = match self.training.emitter_sampling {
            EmitterSampling::Never => false,
            EmitterSampling::Kickstart => start < KICKSTART,
            EmitterSampling::Always => true,
        };
        let Training { learn_direct, least_roughness, candidates, .. } = self.training;
        let (field, learner) = (self.learner.field(), &mut self.learner);
        let guidance = Guidance { field: &*field, sample_emitters, learning, least_roughness, candidates };
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
        pictures.extend(film, end - start, &moments);
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
