//! A run with a time limit, by a clock that goes on with the samples: what it learns makes them slower, and learning takes
//! time itself.

use super::{SCENES, field, scene};
use lucerna::core::color::Rgb;
use lucerna::core::interfaces::{
    Arena, CameraRay, Guide, GuideField, GuideLearner, GuideRecord, Radiance, Subjects, Training,
};
use lucerna::core::math::Aabb;
use lucerna::core::render::{
    Budget, Control, Guidance, GuidedEstimator, Notebook, RenderContext, Report, render_guided,
};
use lucerna::core::sampling::Stream;
use lucerna::core::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What these runs learn.
const DIRECTIONS: Subjects = Subjects { directions: true, outlook: false };

/// Shows nanoseconds.
type Nanoseconds = Arc<AtomicU64>;

/// Samples that take 2 µs at first, and 8 µs when six iterations have taught.
struct Samples {
    clock: Nanoseconds,
    iterations: Arc<AtomicU64>,
    /// Samples whose iteration teaches nothing.
    of_the_last: AtomicU64,
}

impl GuidedEstimator for Samples {
    fn radiance(
        &self,
        _scene: &Scene,
        _camera: &CameraRay,
        _stream: &mut Stream<'_>,
        _arena: &mut Arena,
        _aovs: &mut [f32],
        guidance: Guidance<'_>,
        _notes: &mut Notebook,
    ) -> Radiance {
        let taught = self.iterations.load(Ordering::Relaxed).min(6);
        self.clock.fetch_add(2_000 + 1_000 * taught, Ordering::Relaxed);
        self.of_the_last.fetch_add(u64::from(!guidance.learning), Ordering::Relaxed);
        Radiance { rgb: Rgb::WHITE, alpha: 1.0, rays: 1 }
    }
}

/// Samples whose deviation is multiplied with each lesson from the ninth on.
struct Noise {
    iterations: Arc<AtomicU64>,
    factor: f32,
}

impl GuidedEstimator for Noise {
    fn radiance(
        &self,
        _scene: &Scene,
        _camera: &CameraRay,
        stream: &mut Stream<'_>,
        _arena: &mut Arena,
        _aovs: &mut [f32],
        _guidance: Guidance<'_>,
        _notes: &mut Notebook,
    ) -> Radiance {
        let lessons = self.iterations.load(Ordering::Relaxed).saturating_sub(9) as i32;
        let deviation = 0.9 * self.factor.powi(lessons);
        Radiance { rgb: Rgb::splat(1.0 + deviation * (2.0 * stream.next_1d() - 1.0)), alpha: 1.0, rays: 1 }
    }
}

/// A guide that takes 20 ms to learn.
struct Slow {
    inner: Arc<dyn Guide>,
    clock: Nanoseconds,
    iterations: Arc<AtomicU64>,
}

impl Guide for Slow {
    fn start(&self, bounds: Aabb) -> Box<dyn GuideLearner> {
        let (inner, clock, iterations) = (self.inner.start(bounds), self.clock.clone(), self.iterations.clone());
        Box::new(SlowLearner { inner, clock, iterations })
    }

    fn training(&self) -> Training {
        self.inner.training()
    }
}

struct SlowLearner {
    inner: Box<dyn GuideLearner>,
    clock: Nanoseconds,
    iterations: Arc<AtomicU64>,
}

impl GuideLearner for SlowLearner {
    fn learn(&mut self, tiles: &[Vec<GuideRecord>]) {
        self.inner.learn(tiles);
    }

    fn refine(&mut self, spp: u32) {
        self.clock.fetch_add(20_000_000, Ordering::Relaxed);
        self.iterations.fetch_add(1, Ordering::Relaxed);
        self.inner.refine(spp);
    }

    fn field(&self) -> Arc<dyn GuideField> {
        self.inner.field()
    }

    fn summary(&self) -> Vec<String> {
        Vec::new()
    }
}

/// A run of so many seconds that learns in this part of them: how it ended, the samples of its last iteration, and pixels.
fn run(seconds: f64, learning: f64) -> (Report, u64, u64) {
    let (clock, iterations) = (Nanoseconds::default(), Arc::new(AtomicU64::new(0)));
    let samples = Samples { clock: clock.clone(), iterations: iterations.clone(), of_the_last: AtomicU64::new(0) };
    let inner = field::guide(&format!("<float name='learning' value='{learning}'/>"));
    let guide = Slow { inner, clock: clock.clone(), iterations };
    let scene = scene(SCENES[0].1, "<integrator type='path'/>");
    let tell = move || Duration::from_nanos(clock.load(Ordering::Relaxed));
    let control = Control::new().with_clock(&tell).with_deadline(seconds);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread starts");
    let (report, pixels) = pool.install(|| {
        let budget = Budget::Seconds(seconds);
        let mut cx = RenderContext::new(&scene, &scene.sensors()[0], budget, 1, &control, Vec::new());
        let (report, _) = render_guided(&mut cx, &samples, &guide, DIRECTIONS).expect("it renders");
        (report, u64::from(cx.film.crop_size.x * cx.film.crop_size.y))
    });
    (report, samples.of_the_last.into_inner(), pixels)
}

/// It ends when it should, all but a sample per pixel of what was taken is in the picture, and as many samples come after
/// the last lesson as should: fewer than those that would leave room for another, although samples become slower.
#[test]
fn hc_p18_a_time_limit_is_kept_and_used() {
    let expected = [(0.333, 0.33..0.75), (0.1, 0.75..0.96)];
    let runs = [1.0, 2.5, 4.0, 7.0, 13.0].into_iter().flat_map(|seconds| expected.clone().map(|e| (seconds, e)));
    for (seconds, (learning, parts)) in runs {
        let (report, of_the_last, pixels) = run(seconds, learning);
        let sample = 8e-6 * pixels as f64;
        let (spp, lost) = (report.spp, report.samples - u64::from(report.spp) * pixels);
        assert!((report.seconds - seconds).abs() <= sample, "{seconds}: {} at {spp} spp", report.seconds);
        assert!(lost <= pixels, "{seconds}: {lost} of {} samples are lost", report.samples);
        let part = of_the_last as f64 / report.samples as f64;
        assert!(parts.contains(&part), "{seconds}, {learning}: {part} of the samples are in the last iteration");
    }
}

/// Where learning no longer lowers the variance it is over at 256 samples per pixel; where it does, it goes on as long as the
/// budget allows. Lessons: eight at the start, then at 16, 32, 64, … samples.
#[test]
fn learning_ends_when_it_no_longer_pays() {
    let lessons = |ending: &str, factor: f32, spp: u32| {
        let iterations = Arc::new(AtomicU64::new(0));
        let more = format!("<string name='ending' value='{ending}'/><float name='learning' value='0.333'/>");
        let inner = field::guide(&more);
        let guide = Slow { inner, clock: Nanoseconds::default(), iterations: iterations.clone() };
        let scene = scene(SCENES[0].1, "<integrator type='path'/>");
        let (control, budget) = (Control::new(), Budget::Samples(spp));
        let mut cx = RenderContext::new(&scene, &scene.sensors()[0], budget, 1, &control, Vec::new());
        let noise = Noise { iterations: iterations.clone(), factor };
        let (report, _) = render_guided(&mut cx, &noise, &guide, DIRECTIONS).expect("it renders");
        assert_eq!(report.spp, spp);
        iterations.load(Ordering::Relaxed)
    };
    // 256 samples are behind the thirteenth lesson.
    assert_eq!([1.0, 0.5].map(|factor| lessons("variance", factor, 4000)), [13, 16]);
    assert_eq!([1.0, 0.5].map(|factor| lessons("doubling", factor, 4000)), [16, 16]);
    assert_eq!(lessons("variance", 1.0, 500), lessons("doubling", 1.0, 500), "too early to tell");
}
