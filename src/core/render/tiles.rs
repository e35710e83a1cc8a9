//! The loop over passes, tiles, pixels and samples that all forward estimators share, also those that learn
//! ([`super::training`]).

use super::checkpoint::Keeper;
use super::film_store::TileStore;
use super::{
    BadSample, BadSamples, Budget, FilmStore, Progress, ReferenceOrder, RenderContext, RenderError, Report,
    SampleOrder, Schedule, Window,
};
use crate::interfaces::{Arena, CameraRay, Radiance, RadianceEstimator, stream};
use crate::io::limits::Cursor;
use crate::math::{UVec2, Vec2};
use crate::sampling::{PointSet, Stream};
use crate::scene::Scene;
use glam::IVec2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Edge of a tile in pixels.
const TILE: u32 = 16;

/// Tiles whose results are held at the same time; bounds memory on large films.
pub(super) const BATCH: usize = 1024;

/// Samples per pixel that a run with a time limit plans for: enough for any budget.
const ENDLESS: u32 = 1 << 24;

/// Takes the samples of a run. Each tile notes something besides its pixels.
pub(super) trait Tracer: Sync {
    /// What a tile notes.
    type Notes: Send;

    /// Nothing noted yet.
    fn notes(&self) -> Self::Notes;

    /// As [`RadianceEstimator::wants_differentials`].
    fn wants_differentials(&self) -> bool;

    /// As [`RadianceEstimator::radiance`], for a pixel relative to the crop window.
    #[allow(clippy::too_many_arguments)]
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
        pixel: IVec2,
        notes: &mut Self::Notes,
    ) -> Radiance;

    /// Told of each sample that enters the film, and its pixel relative to the crop window.
    fn taken(&self, notes: &mut Self::Notes, pixel: IVec2, value: Radiance);
}

/// An estimator that learns nothing.
impl Tracer for &dyn RadianceEstimator {
    type Notes = ();

    fn notes(&self) {}

    #[inline]
    fn wants_differentials(&self) -> bool {
        (**self).wants_differentials()
    }

    #[inline]
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
        _pixel: IVec2,
        (): &mut (),
    ) -> Radiance {
        (**self).radiance(scene, camera, stream, arena, aovs)
    }

    #[inline]
    fn taken(&self, (): &mut (), _pixel: IVec2, _value: Radiance) {}
}

/// Renders an estimator into the context's film until the budget is spent.
///
/// # Errors
/// If the context asks for what cannot be had, or its checkpoint is of another run.
pub fn render_estimator(cx: &mut RenderContext<'_>, estimator: &dyn RadianceEstimator) -> Result<Report, RenderError> {
    if cx.guide_file.is_some() {
        return Err(RenderError("a file of what a guide has learnt needs an integrator with a guide".to_owned()));
    }
    let prepared = estimator.prepare(cx.scene);
    let estimator = prepared.as_deref().unwrap_or(estimator);
    let asked = asked_spp(cx);
    let points = points(cx, asked);
    let run = Run::new(cx, points.as_deref(), asked);
    let (report, store) = run.passes(&estimator)?;
    cx.store = store;
    Ok(report)
}

/// Samples per pixel of the whole run, as far as is known.
pub(super) fn asked_spp(cx: &RenderContext<'_>) -> u32 {
    match cx.budget {
        Budget::Samples(spp) => cx.sampler.round_spp(spp),
        Budget::Seconds(_) => ENDLESS,
    }
}

/// The point set of a run of so many samples per pixel.
pub(super) fn points(cx: &RenderContext<'_>, asked: u32) -> Option<Box<dyn PointSet>> {
    match cx.order {
        SampleOrder::PerSample => cx.sampler.point_set(cx.seed, asked, cx.film.size),
        SampleOrder::Reference { .. } => None,
    }
}

/// The value of one pixel sample, with the very numbers it has in a full run. `pixel` belongs to the full film.
pub fn replay(cx: &RenderContext<'_>, estimator: &dyn RadianceEstimator, pixel: UVec2, sample: u32) -> Radiance {
    let prepared = estimator.prepare(cx.scene);
    let estimator = prepared.as_deref().unwrap_or(estimator);
    let points = cx.sampler.point_set(cx.seed, asked_spp(cx), cx.film.size);
    let mut stream = stream(points.as_deref(), cx.seed, pixel, sample);
    let mut aovs = vec![0.0; cx.store.aovs().len()];
    sample_pixel(cx, &estimator, pixel.as_ivec2(), &mut stream, &mut Arena::new(), &mut aovs, &mut ()).1
}

/// A run over the context's film.
pub(super) struct Run<'r, 'a> {
    cx: &'r RenderContext<'a>,
    points: Option<&'r dyn PointSet>,
    reference: Option<ReferenceOrder>,
    tiles: Vec<Window>,
    /// Samples per pixel of the whole run.
    asked: u32,
    taken: AtomicU64,
}

/// What a tile gives back.
struct TileResult<N> {
    store: TileStore,
    notes: N,
    samples: u64,
    rays: u64,
    bad: BadSamples,
    complete: bool,
}

impl<'r, 'a> Run<'r, 'a> {
    pub(super) fn new(cx: &'r RenderContext<'a>, points: Option<&'r dyn PointSet>, asked: u32) -> Self {
        let (reference, taken) = (cx.reference_order(), AtomicU64::new(0));
        let mut run = Run { cx, points, reference, tiles: Vec::new(), asked, taken };
        run.tiles = run.cut();
        run
    }

    fn passes(&self, tracer: &impl Tracer) -> Result<(Report, FilmStore), RenderError> {
        let cx = self.cx;
        let keeper = Keeper::of(cx)?;
        let read = |from: &mut Cursor<'_>| Ok((Report::unpack(from, self.asked)?, cx.store.unpack(from)?));
        let kept = keeper.as_ref().map(|keeper| keeper.resume(read)).transpose()?.flatten();
        let (mut report, mut store) = kept.unwrap_or_else(|| (Report::default(), cx.store.clone()));
        self.goes_on(&report);
        let earlier = report.seconds;
        let keep = |keeper: &Keeper<'_>, report: &Report, store: &FilmStore| {
            keeper.write(report.spp, |seconds, to| {
                report.pack(earlier + seconds, to);
                store.pack(to);
            })
        };
        // As of the end of the latest pass.
        let mut complete = report.clone();
        let in_one_pass = matches!(cx.order, SampleOrder::Reference { .. });
        let mut pass = 0;
        loop {
            while !in_one_pass && Schedule::pass(pass).1 <= report.spp {
                pass += 1;
            }
            let start = report.spp;
            let end = if in_one_pass { self.asked } else { Schedule::pass(pass).1.min(self.asked) };
            if start >= end || (start > 0 && cx.control.should_stop()) {
                break;
            }
            // A pass that is cut short is lost, so that the picture is that of so many samples; but for the first one.
            let before = (start > 0).then(|| store.clone());
            if !self.pass(tracer, (start, end), BATCH, &mut store, &mut report, |_| ()) {
                store = before.unwrap_or(store);
                break;
            }
            report.spp = end;
            complete = report.clone();
            let flow = cx.control.end_pass(end, &cx.film, || &store);
            if let Some(keeper) = keeper.as_ref().filter(|keeper| keeper.is_due()) {
                report.tell_once(keep(keeper, &complete, &store));
            }
            if flow.is_break() {
                break;
            }
        }
        if let Some(keeper) = keeper.as_ref().filter(|keeper| keeper.is_behind(complete.spp)) {
            report.tell_once(keep(keeper, &complete, &store));
        }
        self.conclude(&mut report, earlier);
        Ok((report, store))
    }

    /// Samples were taken in an earlier part of the run.
    pub(super) fn goes_on(&self, from: &Report) {
        self.taken.store(from.samples, Ordering::Relaxed);
    }

    /// Writes the end of the run into the report; so many seconds were spent in earlier parts of it.
    pub(super) fn conclude(&self, report: &mut Report, earlier: f64) {
        report.stopped = report.spp < self.asked && matches!(self.cx.budget, Budget::Samples(_));
        report.seconds = earlier + self.cx.control.seconds();
    }

    /// Takes samples `start..end` of all pixels into the film. What tiles note is handed over in their order, `batch`
    /// tiles at a time. Whether the pass is complete.
    pub(super) fn pass<T: Tracer>(
        &self,
        tracer: &T,
        (start, end): (u32, u32),
        batch: usize,
        store: &mut FilmStore,
        report: &mut Report,
        mut hand_over: impl FnMut(Vec<T::Notes>),
    ) -> bool {
        let mut complete = true;
        for batch in self.tiles.chunks(batch) {
            let results: Vec<TileResult<T::Notes>> = batch
                .par_iter()
                // Else several tiles are one piece of work, and some threads have nothing to do in the end.
                .with_max_len(1)
                .map(|tile| {
                    let result = self.tile(tracer, *tile, start, end, report.spp);
                    let taken = self.taken.fetch_add(result.samples, Ordering::Relaxed) + result.samples;
                    self.tell_progress(taken, report.spp);
                    result
                })
                .collect();
            let mut notes = Vec::with_capacity(results.len());
            for result in results {
                store.add_tile(&result.store);
                report.samples += result.samples;
                report.rays += result.rays;
                report.bad.append(result.bad);
                complete &= result.complete;
                notes.push(result.notes);
            }
            hand_over(notes);
        }
        complete
    }

    /// The sampled window cut into tiles, relative to the crop window.
    fn cut(&self) -> Vec<Window> {
        let border = self.cx.border();
        let size = self.cx.film.crop_size + 2 * border;
        let mut tiles = Vec::new();
        for y in (0..size.y).step_by(TILE as usize) {
            for x in (0..size.x).step_by(TILE as usize) {
                let min = UVec2::new(x, y);
                let size = (size - min).min(UVec2::splat(TILE));
                tiles.push(Window { min: min.as_ivec2() - IVec2::splat(border as i32), size });
            }
        }
        tiles
    }

    fn tell_progress(&self, taken: u64, spp: u32) {
        let size = self.cx.film.crop_size + 2 * self.cx.border();
        let total = f64::from(size.x) * f64::from(size.y) * f64::from(self.asked);
        let fraction = match (self.cx.budget, self.cx.control.time_fraction()) {
            (Budget::Seconds(_), Some(fraction)) => fraction,
            _ => taken as f64 / total,
        };
        self.cx.control.progress(Progress { fraction, samples: taken, spp });
    }

    fn tile<T: Tracer>(
        &self,
        tracer: &T,
        tile: Window,
        start: u32,
        end: u32,
        complete_spp: u32,
    ) -> TileResult<T::Notes> {
        let cx = self.cx;
        let mut result = TileResult {
            store: TileStore::new(tile, &*cx.film.filter, cx.store.aovs().len()),
            notes: tracer.notes(),
            samples: 0,
            rays: 0,
            bad: BadSamples::default(),
            complete: true,
        };
        let mut arena = Arena::new();
        let mut aovs = vec![0.0; cx.store.aovs().len()];
        let crop = cx.film.crop_offset.as_ivec2();
        for y in 0..tile.size.y {
            for x in 0..tile.size.x {
                // The first pass is finished in any case, so that every pixel has a sample, unless the user insists.
                let stop = if complete_spp > 0 { cx.control.should_stop() } else { cx.control.is_stopped() };
                if stop {
                    result.complete = false;
                    return result;
                }
                let inside = tile.min + UVec2::new(x, y).as_ivec2();
                let pixel = crop + inside;
                // Border pixels may have negative coordinates; the key wraps them to large ones.
                let key = UVec2::new(pixel.x as u32, pixel.y as u32);
                let mut shared = self.reference.as_ref().map(|r| {
                    let sampled = (inside + IVec2::splat(cx.border() as i32)).as_uvec2();
                    Stream::independent(r.generator(sampled))
                });
                for sample in start..end {
                    aovs.fill(0.0);
                    let notes = &mut result.notes;
                    let (offset, value) = match &mut shared {
                        Some(shared) => sample_pixel(cx, tracer, pixel, shared, &mut arena, &mut aovs, notes),
                        None => {
                            let mut own = stream(self.points, cx.seed, key, sample);
                            sample_pixel(cx, tracer, pixel, &mut own, &mut arena, &mut aovs, notes)
                        }
                    };
                    arena.reset();
                    result.samples += 1;
                    result.rays += u64::from(value.rays);
                    if usable(value, &aovs) {
                        let position = inside.as_vec2() + offset;
                        result.store.splat(&*cx.film.filter, inside, position, value, &aovs);
                        tracer.taken(&mut result.notes, inside, value);
                    } else {
                        let value = value.rgb.to_array();
                        result.bad.add(BadSample { pixel: pixel.max(IVec2::ZERO).as_uvec2(), sample, value });
                    }
                }
            }
        }
        result
    }
}

/// Finite, and no negative radiance.
#[inline]
fn usable(value: Radiance, aovs: &[f32]) -> bool {
    let c = value.rgb;
    c.is_finite() && c.r >= 0.0 && c.g >= 0.0 && c.b >= 0.0 && aovs.iter().all(|a| a.is_finite())
}

/// Takes one sample of a pixel of the full film: where in the pixel, and what was found.
#[inline]
fn sample_pixel<T: Tracer>(
    cx: &RenderContext<'_>,
    tracer: &T,
    pixel: IVec2,
    stream: &mut Stream<'_>,
    arena: &mut Arena,
    aovs: &mut [f32],
    notes: &mut T::Notes,
) -> (Vec2, Radiance) {
    let offset = stream.next_2d();
    let film = (pixel.as_vec2() + offset) / cx.film.size.as_vec2();
    let lens = if cx.sensor.needs_lens() { stream.next_2d() } else { Vec2::splat(0.5) };
    if cx.sensor.shutter().1 > cx.sensor.shutter().0 {
        // Nothing moves yet; the number is drawn so that the others stay the same when something will.
        stream.next_1d();
    }
    let mut camera = cx.sensor.ray(film, lens);
    if tracer.wants_differentials() {
        let step = cx.differential_step();
        let beside = |offset: Vec2| cx.sensor.ray(film + offset, lens).ray;
        camera.offsets = Some([beside(Vec2::new(step.x, 0.0)), beside(Vec2::new(0.0, step.y))]);
    }
    let mut value =
        tracer.radiance(cx.scene, &camera, stream, arena, aovs, pixel - cx.film.crop_offset.as_ivec2(), notes);
    value.rgb *= camera.weight;
    (offset, value)
}
