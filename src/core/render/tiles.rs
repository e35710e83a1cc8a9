//! The loop over passes, tiles, pixels and samples that all forward estimators share.

use super::film_store::TileStore;
use super::{
    BadSample, BadSamples, Budget, Progress, ReferenceOrder, RenderContext, RenderError, Report, SampleOrder, Schedule,
    Window,
};
use crate::interfaces::{Arena, Radiance, RadianceEstimator, stream};
use crate::math::{UVec2, Vec2};
use crate::sampling::{PointSet, Stream};
use glam::IVec2;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Edge of a tile in pixels.
const TILE: u32 = 16;

/// Tiles whose results are held at the same time; bounds memory on large films.
const BATCH: usize = 1024;

/// Samples per pixel that a run with a time limit plans for: enough for any budget.
const ENDLESS: u32 = 1 << 24;

/// Renders an estimator into the context's film until the budget is spent.
pub fn render_estimator(cx: &mut RenderContext<'_>, estimator: &dyn RadianceEstimator) -> Result<Report, RenderError> {
    let prepared = estimator.prepare(cx.scene);
    let estimator = prepared.as_deref().unwrap_or(estimator);
    let asked = match cx.budget {
        Budget::Samples(spp) => cx.sampler.round_spp(spp),
        Budget::Seconds(_) => ENDLESS,
    };
    let points = match cx.order {
        SampleOrder::PerSample => cx.sampler.point_set(cx.seed, asked, cx.film.size),
        SampleOrder::Reference { .. } => None,
    };
    let run =
        Run { cx, estimator, points: points.as_deref(), reference: cx.reference_order(), taken: AtomicU64::new(0) };
    let (report, store) = run.passes(asked)?;
    cx.store = store;
    Ok(report)
}

/// The value of one pixel sample, with the very numbers it has in a full run. `pixel` belongs to the full film.
pub fn replay(cx: &RenderContext<'_>, estimator: &dyn RadianceEstimator, pixel: UVec2, sample: u32) -> Radiance {
    let prepared = estimator.prepare(cx.scene);
    let estimator = prepared.as_deref().unwrap_or(estimator);
    let spp = match cx.budget {
        Budget::Samples(spp) => cx.sampler.round_spp(spp),
        Budget::Seconds(_) => ENDLESS,
    };
    let points = cx.sampler.point_set(cx.seed, spp, cx.film.size);
    let mut stream = stream(points.as_deref(), cx.seed, pixel, sample);
    let mut aovs = vec![0.0; cx.store.aovs().len()];
    sample_pixel(cx, estimator, pixel.as_ivec2(), &mut stream, &mut Arena::new(), &mut aovs).1
}

struct Run<'r, 'a> {
    cx: &'r RenderContext<'a>,
    estimator: &'r dyn RadianceEstimator,
    points: Option<&'r dyn PointSet>,
    reference: Option<ReferenceOrder>,
    taken: AtomicU64,
}

/// What a tile gives back.
struct TileResult {
    store: TileStore,
    samples: u64,
    rays: u64,
    bad: BadSamples,
    complete: bool,
}

impl Run<'_, '_> {
    fn passes(&self, asked: u32) -> Result<(Report, super::FilmStore), RenderError> {
        let cx = self.cx;
        let tiles = self.tiles();
        let mut store = cx.store.clone();
        let mut report = Report::default();
        let in_one_pass = matches!(cx.order, SampleOrder::Reference { .. });
        for pass in 0.. {
            let (start, end) = match in_one_pass {
                true => (report.spp, asked),
                false => Schedule::pass(pass),
            };
            let end = end.min(asked);
            if start >= end || (pass > 0 && cx.control.should_stop()) {
                break;
            }
            // A pass that is cut short is lost, so that the picture is that of so many samples; but for the first one.
            let before = (report.spp > 0).then(|| store.clone());
            let mut complete = true;
            for batch in tiles.chunks(BATCH) {
                let results: Vec<TileResult> = batch
                    .par_iter()
                    .map(|tile| {
                        let result = self.tile(*tile, start, end, report.spp);
                        let taken = self.taken.fetch_add(result.samples, Ordering::Relaxed) + result.samples;
                        self.tell_progress(taken, asked, report.spp);
                        result
                    })
                    .collect();
                for result in results {
                    store.add_tile(&result.store);
                    report.samples += result.samples;
                    report.rays += result.rays;
                    report.bad.append(result.bad);
                    complete &= result.complete;
                }
            }
            if !complete {
                store = before.unwrap_or(store);
                break;
            }
            report.spp = end;
            if cx.control.end_pass(end, &cx.film, &store).is_break() {
                break;
            }
        }
        report.stopped = report.spp < asked && matches!(cx.budget, Budget::Samples(_));
        report.seconds = cx.control.seconds();
        Ok((report, store))
    }

    /// The sampled window cut into tiles, relative to the crop window.
    fn tiles(&self) -> Vec<Window> {
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

    fn tell_progress(&self, taken: u64, asked: u32, spp: u32) {
        let size = self.cx.film.crop_size + 2 * self.cx.border();
        let total = f64::from(size.x) * f64::from(size.y) * f64::from(asked);
        let fraction = match (self.cx.budget, self.cx.control.time_fraction()) {
            (Budget::Seconds(_), Some(fraction)) => fraction,
            _ => taken as f64 / total,
        };
        self.cx.control.progress(Progress { fraction, samples: taken, spp });
    }

    fn tile(&self, tile: Window, start: u32, end: u32, complete_spp: u32) -> TileResult {
        let cx = self.cx;
        let mut result = TileResult {
            store: TileStore::new(tile, &*cx.film.filter, cx.store.aovs().len()),
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
                    let (offset, value) = match &mut shared {
                        Some(shared) => sample_pixel(cx, self.estimator, pixel, shared, &mut arena, &mut aovs),
                        None => {
                            let mut own = stream(self.points, cx.seed, key, sample);
                            sample_pixel(cx, self.estimator, pixel, &mut own, &mut arena, &mut aovs)
                        }
                    };
                    arena.reset();
                    result.samples += 1;
                    result.rays += u64::from(value.rays);
                    if usable(value, &aovs) {
                        let position = inside.as_vec2() + offset;
                        result.store.splat(&*cx.film.filter, inside, position, value, &aovs);
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
fn sample_pixel(
    cx: &RenderContext<'_>,
    estimator: &dyn RadianceEstimator,
    pixel: IVec2,
    stream: &mut Stream<'_>,
    arena: &mut Arena,
    aovs: &mut [f32],
) -> (Vec2, Radiance) {
    let offset = stream.next_2d();
    let film = (pixel.as_vec2() + offset) / cx.film.size.as_vec2();
    let lens = if cx.sensor.needs_lens() { stream.next_2d() } else { Vec2::splat(0.5) };
    if cx.sensor.shutter().1 > cx.sensor.shutter().0 {
        // Nothing moves yet; the number is drawn so that the others stay the same when something will.
        stream.next_1d();
    }
    let mut camera = cx.sensor.ray(film, lens);
    if estimator.wants_differentials() {
        let step = cx.differential_step();
        let beside = |offset: Vec2| cx.sensor.ray(film + offset, lens).ray;
        camera.offsets = Some([beside(Vec2::new(step.x, 0.0)), beside(Vec2::new(0.0, step.y))]);
    }
    let mut value = estimator.radiance(cx.scene, &camera, stream, arena, aovs);
    value.rgb *= camera.weight;
    (offset, value)
}
