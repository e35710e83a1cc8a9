//! The run of an estimator that learns where light comes from.
//!
//! Rendering is cut into iterations. In each, paths are guided by what the iterations before have taught, and note what
//! they find; what a field gives does not change meanwhile. So every picture is unbiased, and has the same bits for any
//! number of threads. (Unbiased for certain where samples are independent. Those of a sequence that fills a pixel evenly lie
//! where the earlier ones do not, which a field depends on as far as it was taught by that pixel; no error of this kind was seen.) First come some iterations of one sample per pixel, by which the field learns where paths go at
//! all; then each has as many as all before it together. Once a part of the budget is spent ([`Training::learning`]; or
//! learning more no longer pays: [`Ending`]), the last one takes all that is left, and notes nothing, unless what is learnt
//! is kept (after Müller, Gross, Novák 2017, section 5, and Müller 2019, sections 10.2 and 10.7, where iterations begin to
//! double at one sample again, and the last one is as long as two). A field may also find that guiding does not pay
//! ([`GuideField::guides`]). How the pictures become one: [`super::combine`].

use super::checkpoint::Keeper;
use super::combine::Moments;
use super::estimates::Estimates;
use super::notebook::Notebook;
use super::photons::Photons;
use super::standing::{Course, Part, Standing};
use super::tiles::{BATCH, Run, Tracer, asked_spp, points};
use super::{Budget, Learnt, RenderContext, RenderError, Report, SampleOrder};
use crate::interfaces::{
    Arena, CameraRay, Combination, Emitter, EmitterSampling, Ending, Goal, Guide, GuideField, GuideSets, Radiance,
    Subjects, Training,
};
use crate::io::output::check_replaceable;
use crate::sampling::Stream;
use crate::scene::Scene;
use glam::IVec2;
use std::sync::Arc;

/// Tiles whose notes are held at the same time, at one sample per pixel: about 40 MiB.
const NOTED: usize = 512;

/// Records of either kind that these hold at most. Paths may split without end almost; so many of both take 1.6 GiB.
const MOST_RECORDS: usize = 1 << 24;

/// Samples per pixel of a pass at most, as in [`super::Schedule`].
const LONGEST_PASS: u32 = 16;

/// The part of [`Training::learning`] in which roulette learns what it needs, where no directions are learnt: means are known
/// soon.
const OF_OUTLOOKS: f64 = 0.5;

/// Samples per pixel until which lights are sampled if that is for a start only (the default of the public code).
const KICKSTART: u32 = 128;

/// Samples per pixel from which an extrapolated variance is believed.
const BELIEVED: u32 = 256;

/// What holds during a pass.
#[derive(Clone, Copy)]
pub struct Guidance<'a> {
    /// What has been learnt.
    pub field: &'a dyn GuideField,
    /// Whether lights are sampled.
    pub sample_emitters: bool,
    /// Whether paths note what they find.
    pub learning: bool,
    /// What the run is to learn, and goes by.
    pub subjects: Subjects,
    /// The sets of directions that the field has.
    pub sets: GuideSets,
    /// What is known of the pixel.
    pub goal: Goal,
    /// What surrounds the scene, if a part of the guide's directions is to go where it is bright, and that part.
    pub environment: Option<(&'a dyn Emitter, f32)>,
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

/// Renders a guided estimator into the context's film until the budget is spent, and gives what was learnt. `subjects`
/// says what that is to be.
///
/// # Errors
/// If the context asks for what a run with learning cannot do, or a file that it names is of another run or scene.
pub fn render_guided(
    cx: &mut RenderContext<'_>,
    estimator: &dyn GuidedEstimator,
    guide: &dyn Guide,
    subjects: Subjects,
) -> Result<(Report, Arc<dyn GuideField>), RenderError> {
    if cx.order != SampleOrder::PerSample {
        return Err(RenderError("random numbers in the reference's order and a guide exclude each other".to_owned()));
    }
    if cx.checkpoint.is_some() && guide.kept_as().is_none() {
        return Err(RenderError("what this guide learns cannot be kept in a checkpoint".to_owned()));
    }
    let file = cx.guide_file.clone().or_else(|| guide.file());
    // Where what is learnt is left.
    let left_in = file.as_ref().filter(|file| !file.frozen && (cx.guide_file.is_some() || cx.leaves_learnt));
    if let Some(file) = left_in {
        check_replaceable(&file.path).map_err(|e| RenderError(format!("{}: {e}", file.path.display())))?;
    }
    let asked = asked_spp(cx);
    let keeper = Keeper::of(cx)?;
    let resume = |keeper: &Keeper<'_>| keeper.resume(|from| Standing::unpack(from, cx, guide, asked));
    let at = match keeper.as_ref().map(resume).transpose()?.flatten() {
        Some(at) => at,
        None => Standing::begin(cx, guide, file.as_ref())?,
    };
    cx.seed = at.course.seed;
    let points = points(cx, asked);
    let run = Run::new(cx, points.as_deref(), asked);
    run.goes_on(&at.report);
    let (training, earlier) = (guide.training(), at.report.seconds);
    let frozen = file.as_ref().is_some_and(|file| file.frozen);
    let (keeps, pace, snapshot) = (left_in.is_some(), 0.0, None);
    let environment = hidden_environment(cx.scene, training.to_environment);
    let photons = (training.to_photons > 0.0).then(|| Photons::new(cx.scene, training.least_roughness)).flatten();
    let mut lesson = Lesson {
        cx,
        run,
        estimator,
        training,
        subjects,
        environment,
        photons,
        keeper,
        at,
        asked,
        frozen,
        keeps,
        earlier,
        pace,
        snapshot,
    };
    lesson.iterations();
    let Lesson { run, at, .. } = lesson;
    let Standing { course, mut report, pictures, learner, .. } = at;
    run.conclude(&mut report, earlier);
    report.notes.splice(0..0, learner.summary());
    if let (Some(file), Some(name)) = (left_in, guide.kept_as())
        && (course.taught || (report.spp > 0 && !file.path.exists()))
    {
        let bounds = cx.scene.accel().bounds();
        Learnt { guide: name.to_owned(), bounds, spp: course.reach, state: learner.save() }.write(&file.path)?;
    }
    cx.store.add(&pictures.combined());
    Ok((report, learner.field()))
}

/// How many films' memory a run takes, at most: those of the iterations that count, of the one under way, of its pass and of the
/// whole, with the moments of each and what is known of the pixels.
pub fn films_of(training: &Training) -> u64 {
    match training.combination {
        Combination::InverseVariance => 14,
        Combination::All | Combination::Last => 9,
    }
}

/// What surrounds the scene, for this part of the guide's directions, if a ray can see more of it than emitter sampling.
fn hidden_environment(scene: &Scene, part: f32) -> Option<(&dyn Emitter, f32)> {
    let environment = scene.environment().filter(|_| part > 0.0 && scene.has_windows())?;
    Some((scene.emitter(environment), part))
}

/// A run under way.
struct Lesson<'r, 'a> {
    cx: &'r RenderContext<'a>,
    run: Run<'r, 'a>,
    estimator: &'r dyn GuidedEstimator,
    training: Training,
    subjects: Subjects,
    environment: Option<(&'a dyn Emitter, f32)>,
    /// Light from the lamps, if the guide is to be told of any.
    photons: Option<Photons<'a>>,
    keeper: Option<Keeper<'a>>,
    at: Standing,
    /// Samples per pixel of the whole run.
    asked: u32,
    /// Nothing is learnt.
    frozen: bool,
    /// What is learnt is kept.
    keeps: bool,
    /// Seconds of earlier parts of the run.
    earlier: f64,
    /// Seconds that a sample per pixel took in the latest pass; 0 before.
    pace: f64,
    /// What was known before the pass under way, if it is to be kept.
    snapshot: Option<Vec<u8>>,
}

impl Lesson<'_, '_> {
    fn iterations(&mut self) {
        // Whether the latest one was guided.
        let mut guided = true;
        loop {
            let index = self.at.course.index;
            // A run that goes on is inside an iteration.
            let part = match self.at.course.part {
                Some(part) => part,
                None => {
                    let Some(part) = self.part() else { return };
                    // The first ones share a picture, for one sample has no variance; and so do all that are left to the
                    // BSDF, which differ in nothing: parts of a sequence of numbers are not as even as the whole.
                    let alike = !guided && !self.at.learner.field().guides();
                    if index == 0 || !(part.startup || alike) {
                        self.at.pictures.begin();
                    }
                    part
                }
            };
            guided = self.at.learner.field().guides();
            self.at.course.part = Some(part);
            let (seconds, spp) = (self.cx.control.seconds(), self.at.report.spp);
            let complete = self.iteration(part);
            // The last one may be over early, by the clock.
            let (done, now) = (self.at.report.spp - part.spp.0, self.at.report.spp - spp);
            let teaches = part.learning && done >= part.wanted;
            // One that is stopped here goes on here: nothing but its samples may count yet. Time that is up stops photons
            // only.
            if teaches && !self.send_photons(complete) && self.cx.control.is_stopped() {
                return;
            }
            if complete && (!part.startup || index + 1 == self.at.course.startup) {
                self.at.pictures.complete();
            }
            if teaches {
                self.at.learner.refine(done);
                self.at.course.taught = true;
                self.at.course.reach = self.at.course.reach.max(done);
            }
            if !complete {
                return;
            }
            // A run that goes on where an iteration had all its samples takes none.
            let pace = match now {
                0 => self.at.course.pace,
                _ => (self.cx.control.seconds() - seconds) / f64::from(now),
            };
            self.at.course = Course { index: index + 1, part: None, pace, ..self.at.course };
            if !part.startup {
                self.expect(pace);
            }
        }
    }

    /// Sends photons out for the paths there have been, unless there is no `more` time for that, and tells of all that have
    /// arrived. Whether all that were to be sent out were.
    fn send_photons(&mut self, more: bool) -> bool {
        let (directs, control) = (self.directs(), &self.cx.control);
        let Some(photons) = self.photons.as_mut().filter(|_| directs) else { return true };
        let all = !more || photons.send(self.at.report.samples, self.at.course.seed, || control.should_stop());
        if all || !control.is_stopped() {
            self.at.learner.learn_photons(photons.arrived());
        }
        all
    }

    /// Extrapolates the variance of the picture from the latest iteration, and judges by that if it is to be.
    fn expect(&mut self, pace: f64) {
        let left = f64::from(self.samples_left(pace));
        let expected = self.at.pictures.variance().map_or(f64::INFINITY, |variance| variance / left);
        let rises = expected > self.at.course.expected && self.at.report.spp >= BELIEVED;
        self.at.course.enough |= rises && self.training.ending == Ending::Variance;
        self.at.course.expected = expected;
    }

    /// The next iteration, if there is to be one.
    fn part(&self) -> Option<Part> {
        let Course { startup, first, index, pace, .. } = self.at.course;
        let is_startup = index < startup;
        let wanted = if is_startup { 1 } else { self.at.report.spp.max(first) };
        let enough = self.frozen || self.at.course.enough;
        let (begin, left) = (self.at.report.spp, self.asked - self.at.report.spp);
        let likely = self.samples_left(pace);
        // More would be spent on learning than is to be: this one is the last, and takes all that is left.
        let part = f64::from(wanted) / (f64::from(wanted) + f64::from(likely));
        let learning = if self.directs() { self.training.learning } else { OF_OUTLOOKS * self.training.learning };
        let last = enough || (!is_startup && part > learning);
        let size = if last { left } else { wanted.min(left) };
        // Nobody learns from the last one, unless what was learnt is kept.
        let learning = if last || size == left { self.keeps && wanted <= likely } else { true };
        (size > 0).then_some(Part { startup: is_startup, spp: (begin, begin + size), wanted, learning })
    }

    /// Whether paths are guided, as far as is known.
    fn directs(&self) -> bool {
        self.subjects.directions && self.at.learner.field().guides()
    }

    /// Samples per pixel that the budget still allows, about, at so many seconds each.
    fn samples_left(&self, pace: f64) -> u32 {
        let left = self.asked - self.at.report.spp;
        self.samples_in_time(pace).map_or(left, |samples| left.min(samples))
    }

    /// Samples per pixel until the time of the budget is over, if it is one of time and the pace is known.
    fn samples_in_time(&self, pace: f64) -> Option<u32> {
        let is_time = matches!(self.cx.budget, Budget::Seconds(_)) && pace > 0.0;
        let seconds = self.cx.control.seconds_left().filter(|_| is_time)?;
        Some((seconds / pace) as u32)
    }

    /// Where a pass ends that begins now. One that the deadline cuts short is lost: towards the end, passes take half
    /// of the time that is left, so that no more than a sample per pixel is.
    fn pass_end(&self, part: Part) -> u32 {
        let start = self.at.report.spp;
        let most = self.samples_in_time(self.pace).map_or(LONGEST_PASS, |samples| (samples / 2).max(1));
        start + (start / 8).clamp(1, LONGEST_PASS).min(most).min(part.spp.1 - start)
    }

    /// Takes the samples of an iteration. Whether they are complete and the run is to go on.
    fn iteration(&mut self, part: Part) -> bool {
        while self.at.report.spp < part.spp.1 {
            let (start, control) = (self.at.report.spp, self.cx.control);
            let before = self.at.report.clone();
            if start > 0 && control.should_stop() {
                self.keep(&before, true);
                return false;
            }
            let (next, began) = (self.pass_end(part), control.seconds());
            if self.keeper.is_some() && part.learning {
                self.snapshot = Some(self.at.learner.save());
            }
            if !self.pass((start, next), part.learning) {
                self.keep(&before, true);
                return false;
            }
            self.snapshot = None;
            self.pace = (control.seconds() - began) / f64::from(next - start);
            let flow = control.end_pass(next, &self.cx.film, || self.at.pictures.combined());
            self.keep(&self.at.report.clone(), flow.is_break() || next == self.asked);
            if flow.is_break() {
                return false;
            }
        }
        true
    }

    /// Keeps the state of the run at the end of the latest pass, with what the report was then: if it is time to, or
    /// the run is over.
    fn keep(&mut self, report: &Report, is_over: bool) {
        let Some(keeper) = &self.keeper else { return };
        let wanted = if is_over { keeper.is_behind(report.spp) } else { keeper.is_due() };
        if wanted {
            let learner = self.snapshot.take().unwrap_or_else(|| self.at.learner.save());
            let note = keeper.write(report.spp, |seconds, to| {
                self.at.pack(&learner, report, self.earlier + seconds, to);
            });
            self.at.report.tell_once(note);
        }
    }

    /// One pass; one that is cut short is lost, but for the first.
    fn pass(&mut self, (start, end): (u32, u32), learning: bool) -> bool {
        let mut film = self.at.pictures.film();
        let mut moments = Vec::new();
        let sample_emitters = match self.training.emitter_sampling {
            EmitterSampling::Never => false,
            EmitterSampling::Kickstart => start < KICKSTART && self.at.course.first == 1,
            EmitterSampling::Always => true,
        };
        let Training { learn_direct, least_roughness, candidates, .. } = self.training;
        let environment = self.environment;
        let field = self.at.learner.field();
        let subjects = Subjects { directions: self.directs(), ..self.subjects };
        let learning = learning && (subjects.directions || subjects.outlook);
        if subjects.outlook && start > 0 {
            self.at.estimates.update(self.at.report.rays as f64 / self.at.report.samples as f64);
        }
        let learner = &mut self.at.learner;
        let (sets, goal) = (field.sets(), Goal::default());
        let guidance = Guidance {
            field: &*field,
            sample_emitters,
            learning,
            subjects,
            sets,
            goal,
            environment,
            least_roughness,
            candidates,
        };
        // Notes are taken in as they come, so that those of a few tiles at most are held. A pass that is lost
        // afterwards has taught something nevertheless.
        let batch = if learning { (NOTED / (end - start) as usize).max(1) } else { BATCH };
        let (estimator, estimates, most_records) = (self.estimator, &self.at.estimates, MOST_RECORDS / batch);
        let guided = Guided { estimator, guidance, learn_direct, most_records, estimates };
        let hand_over = |notes: Vec<TileNotes>| {
            let (records, found): (Vec<_>, Vec<_>) =
                notes.into_iter().map(|TileNotes { book, moments }| (book.into_records(), moments)).unzip();
            let (records, vertices): (Vec<_>, Vec<_>) = records.into_iter().unzip();
            if learning && subjects.directions {
                learner.learn(&records);
            }
            if learning && subjects.outlook {
                learner.learn_outlook(&vertices);
            }
            moments.extend(found);
        };
        let complete = self.run.pass(&guided, (start, end), batch, &mut film, &mut self.at.report, hand_over);
        if !complete && start > 0 {
            return false;
        }
        self.at.pictures.extend(film, end - start, &moments);
        if subjects.outlook {
            self.at.estimates.extend(end - start, &moments);
        }
        self.at.report.spp = if complete { end } else { start };
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
    /// That a tile keeps.
    most_records: usize,
    estimates: &'a Estimates,
}

impl Tracer for Guided<'_> {
    type Notes = TileNotes;

    fn notes(&self) -> TileNotes {
        TileNotes {
            book: Notebook::new(self.learn_direct, self.guidance.subjects, self.most_records),
            moments: Moments::default(),
        }
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
        pixel: IVec2,
        notes: &mut TileNotes,
    ) -> Radiance {
        let guidance = Guidance { goal: self.estimates.goal(pixel), ..self.guidance };
        self.estimator.radiance(scene, camera, stream, arena, aovs, guidance, &mut notes.book)
    }

    #[inline]
    fn taken(&self, notes: &mut TileNotes, pixel: IVec2, value: Radiance) {
        notes.moments.add(pixel, value);
    }
}
