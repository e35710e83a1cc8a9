//! The same bits for any number of threads, in every run, and for a run that stops early.

use lucerna::core::render::{Budget, Checkpoint, Control, PassEnd, Progress, RenderContext, Report};
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{Scene, instantiate, resolve, upgrade};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The built-in scene with another filter and sampler, 40 pixels wide: three tiles a side, the last one cut.
fn cornell(filter: &str, sampler: &str) -> Scene {
    let replaced = |text: String, from: &str, to: &str| {
        assert!(text.contains(from), "the built-in scene has no {from}");
        text.replace(from, to)
    };
    let text = lucerna::DEFAULT_SCENE.to_owned();
    let text = replaced(text, "<rfilter type=\"box\"/>", &format!("<rfilter type=\"{filter}\"/>"));
    let text = replaced(text, "<sampler type=\"independent\">", &format!("<sampler type=\"{sampler}\">"));
    let defines = vec![("res".to_owned(), "40".to_owned())];
    let options = LoadOptions { defines, ..LoadOptions::default() };
    let mut description = load_str(&text, "cornell-box.xml", &options).expect("the built-in scene loads");
    resolve::resolve(&mut description).expect("its references are complete");
    upgrade::upgrade(&mut description);
    instantiate(&lucerna::builtin(), description, false).expect("it builds").scene
}

/// All filters and samplers looked at here, as scenes.
fn scenes() -> impl Iterator<Item = (String, Scene)> {
    let all = ["box", "gaussian"].into_iter().flat_map(|f| ["sobol", "independent"].map(|s| (f, s)));
    all.map(|(filter, sampler)| (format!("{filter}, {sampler}"), cornell(filter, sampler)))
}

/// Renders and gives the picture's bits.
fn render(scene: &Scene, threads: usize, budget: Budget, control: &Control<'_>) -> (Report, Vec<u32>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| {
        let integrator = scene.integrator().expect("the scene has an integrator");
        let camera = &scene.sensors()[0];
        let mut cx = RenderContext::new(scene, camera, budget, 1, control, integrator.aov_names());
        let report = integrator.render(&mut cx).expect("it renders");
        let (_, data) = cx.store.develop(&cx.film);
        (report, data.iter().map(|value| value.to_bits()).collect())
    })
}

fn samples(scene: &Scene, threads: usize, spp: u32) -> Vec<u32> {
    let (report, bits) = render(scene, threads, Budget::Samples(spp), &Control::new());
    assert!(report.spp == spp && !report.stopped && report.bad.count == 0);
    bits
}

#[test]
fn hc_x01_the_number_of_threads_changes_no_bit() {
    for (name, scene) in scenes() {
        let one = samples(&scene, 1, 5);
        assert!(one.iter().any(|bits| f32::from_bits(*bits) > 0.0), "{name}: black");
        for threads in [1, 2, 3, 16] {
            assert!(samples(&scene, threads, 5) == one, "{name}: {threads} threads");
        }
    }
}

#[test]
fn hc_x01_another_load_of_the_scene_changes_no_bit() {
    let first: Vec<Vec<u32>> = scenes().map(|(_, scene)| samples(&scene, 2, 3)).collect();
    for ((name, scene), bits) in scenes().zip(first) {
        assert!(samples(&scene, 2, 3) == bits, "{name}");
    }
}

#[test]
fn the_seed_changes_the_noise() {
    let scene = cornell("box", "sobol");
    let camera = &scene.sensors()[0];
    let integrator = scene.integrator().expect("the scene has an integrator");
    let [a, b] = [1, 2].map(|seed| {
        let control = Control::new();
        let mut cx = RenderContext::new(&scene, camera, Budget::Samples(1), seed, &control, Vec::new());
        integrator.render(&mut cx).expect("it renders");
        cx.store.develop(&cx.film).1
    });
    assert_ne!(a, b);
}

#[test]
fn a_run_that_is_stopped_is_a_shorter_run() {
    for (name, scene) in scenes() {
        let taken = AtomicU64::new(0);
        let count = |progress: Progress| {
            taken.fetch_max(progress.samples, Ordering::Relaxed);
        };
        let control = Control::new().with_progress(&count);
        let (report, bits) = std::thread::scope(|threads| {
            threads.spawn(|| {
                // In the midst of a pass, most likely; but at any moment the result must be right.
                while taken.load(Ordering::Relaxed) < 24 * 40 * 40 + 700 {
                    std::thread::yield_now();
                }
                control.stop();
            });
            render(&scene, 2, Budget::Samples(5000), &control)
        });
        assert!(report.stopped && (20..5000).contains(&report.spp), "{name}: {} spp", report.spp);
        assert!(samples(&scene, 2, report.spp) == bits, "{name}: {} spp", report.spp);
    }
}

#[test]
fn a_time_limit_gives_the_picture_of_so_many_samples() {
    for (name, scene) in scenes() {
        let control = Control::new().with_deadline(0.15);
        let (report, bits) = render(&scene, 2, Budget::Seconds(0.15), &control);
        assert!(report.spp >= 1, "{name}");
        assert!(samples(&scene, 7, report.spp) == bits, "{name}: {} spp", report.spp);
    }
}

#[test]
fn no_time_still_gives_every_pixel_a_sample() {
    for (name, scene) in scenes() {
        let control = Control::new().with_deadline(0.0);
        let (report, bits) = render(&scene, 2, Budget::Seconds(0.0), &control);
        assert_eq!(report.spp, 1, "{name}");
        assert!(samples(&scene, 1, 1) == bits, "{name}");
    }
}

#[test]
fn what_looks_at_passes_can_end_the_run_there() {
    for (name, scene) in scenes() {
        let seen = Mutex::new(Vec::new());
        let look = |pass: PassEnd<'_>| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            seen.lock().unwrap().push((pass.spp, pass.seconds));
            if pass.spp < 5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let control = Control::new().with_pass_end(&look);
        let began = std::time::Instant::now();
        let (report, bits) = render(&scene, 2, Budget::Samples(64), &control);
        assert!(report.seconds + 0.1 <= began.elapsed().as_secs_f64() + 1e-3, "{name}: looking counted as rendering");
        assert!(report.stopped && report.spp == 5, "{name}: {} spp", report.spp);
        assert!(seen.lock().unwrap().iter().map(|(spp, _)| *spp).eq(1..=5), "{name}");
        assert!(samples(&scene, 1, 5) == bits, "{name}");
    }
}

/// Interrupted inside a pass and gone on with: the picture, and what the report counts, of a run without interruption.
#[test]
fn hc_x02_an_interrupted_run_has_the_same_bits() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("determinism");
    std::fs::create_dir_all(&folder).expect("a folder");
    for (number, (name, scene)) in scenes().enumerate() {
        let path = folder.join(format!("{number}.state"));
        let _ = std::fs::remove_file(&path);
        let camera = &scene.sensors()[0];
        let integrator = scene.integrator().expect("the scene has an integrator");
        let part = |control: &Control<'_>| {
            let mut cx = RenderContext::new(&scene, camera, Budget::Samples(50), 1, control, Vec::new());
            cx.checkpoint = Some(Checkpoint { path: path.clone(), every: 1e9, of: Vec::new() });
            let report = integrator.render(&mut cx).expect("it renders");
            let (_, data) = cx.store.develop(&cx.film);
            (report, data.iter().map(|value| value.to_bits()).collect::<Vec<u32>>())
        };
        for stop in [5, 6, 17, 33].map(|spp: u64| spp * 40 * 40 + 700) {
            let taken = AtomicU64::new(0);
            let count = |progress: Progress| {
                taken.fetch_max(progress.samples, Ordering::Relaxed);
            };
            let clock = || Duration::from_secs(u64::from(taken.load(Ordering::Relaxed) >= stop));
            let (report, _) = part(&Control::new().with_progress(&count).with_clock(&clock).with_deadline(0.5));
            assert!(report.stopped && report.samples > 1600 * u64::from(report.spp), "{name}: not inside a pass");
        }
        let (report, bits) = part(&Control::new());
        assert!(!report.stopped && report.samples == 50 * 40 * 40, "{name}: {} samples", report.samples);
        assert!(bits == samples(&scene, 2, 50), "{name}: another picture");
    }
}
