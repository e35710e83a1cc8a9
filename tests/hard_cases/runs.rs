//! Runs (X).

use super::{PATH, scene, support};
use lucerna::core::render::{Budget, Control, Progress, RenderContext};
use lucerna::core::stats::figures::measured;
use std::process::{Command, Stdio};
use std::sync::Mutex;

fn program(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_lucerna"))
        .args(arguments)
        .current_dir(env!("CARGO_TARGET_TMPDIR"))
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// The memory of a picture is told before the start, and is no limit but what the user allows.
#[test]
fn hc_x03_memory_is_told_before_the_start() {
    // 16384² pixels of five sums in double precision are 10 GiB.
    let (code, said) = program(&["render", "--size", "16384x16384", "--max-memory", "1024", "-o", "large.exr"]);
    assert!(code == Some(2) && said.contains("the picture needs 10240 MiB"), "{said}");
    let (code, said) = program(&["render", "-D", "res=64", "--spp", "2", "-o", "told.exr"]);
    let first = said.lines().next().unwrap_or_default();
    assert_eq!((code, first), (Some(0), "64 x 64 pixels, 2 samples each; the picture takes 0.2 MiB"));
    // Nothing between one pixel and 100 000 samples depends on their number.
    let (code, said) = program(&["render", "-D", "res=4", "--spp", "100000", "--pixel", "1,2", "--sample", "99999"]);
    assert_eq!(code, Some(0), "{said}");
    measured("hc_x03_memory_is_told_before_the_start", "told as asked, 16k x 16k: 10240 MiB");
}

/// Triangles without area are told once, with their number, and the others are seen.
#[test]
fn hc_g06_triangles_without_area_are_told_once() {
    let mesh = "v -9 -9 0\nv 9 -9 0\nv 0 9 0\nv 1 1 1\nf 1 2 3\nf 1 1 2\nf 4 4 4\nf 2 1 2\n";
    let scene = "<scene version='3.0.0'><integrator type='path'/><sensor type='perspective'/>\
                 <shape type='obj'><string name='filename' value='slivers.obj'/></shape></scene>";
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("slivers.obj"), mesh).expect("a mesh");
    std::fs::write(folder.join("slivers.xml"), scene).expect("a scene");
    let (code, said) = program(&["render", "slivers.xml", "--size", "4x4", "--spp", "1", "-o", "slivers.exr"]);
    let notes: Vec<&str> = said.lines().filter(|line| line.contains("no area")).collect();
    assert_eq!((code, notes), (Some(0), vec!["note: 3 primitives have no area and are left out"]), "{said}");
    measured("hc_g06_triangles_without_area_are_told_once", "one note for 3 of 4 triangles");
}

/// Progress comes after every tile, of at most 16² pixels and 16 samples each, and is exactly what has been done.
#[test]
fn hc_x07_progress_is_frequent_and_true() {
    let scene = scene(PATH, 40, "", "<shape type='sphere'/><emitter type='constant'/>");
    let told: Mutex<Vec<Progress>> = Mutex::new(Vec::new());
    let listen = |progress: Progress| told.lock().expect("no panic").push(progress);
    let control = Control::new().with_progress(&listen);
    let integrator = scene.integrator().expect("an integrator");
    let spp = 200;
    let mut cx = RenderContext::new(&scene, &scene.sensors()[0], Budget::Samples(spp), 0, &control, Vec::new());
    integrator.render(&mut cx).expect("a picture");
    let mut told = told.into_inner().expect("no panic");
    told.sort_by_key(|progress| progress.samples);
    let all = u64::from(40 * 40 * spp);
    let mut before = 0;
    for progress in &told {
        assert!(progress.samples - before <= 16 * 16 * 16, "{} samples at once", progress.samples - before);
        assert_eq!(progress.fraction, progress.samples as f64 / all as f64);
        assert!(u64::from(progress.spp) * 1600 <= progress.samples);
        before = progress.samples;
    }
    assert_eq!(before, all);
    measured("hc_x07_progress_is_frequent_and_true", "after every 4096 samples or fewer, exact");
}

/// The mean of the replayed samples of a pixel is the pixel, bit for bit, for every sampler.
#[test]
fn hc_x08_replayed_samples_add_up_to_the_run() {
    use lucerna::core::math::UVec2;
    use lucerna::core::render::replay;
    let samplers = ["independent", "stratified", "multijitter", "orthogonal", "ldsampler", "sobol"];
    for sampler in samplers {
        let text = lucerna::DEFAULT_SCENE
            .replace("<sampler type=\"independent\">", &format!("<sampler type=\"{sampler}\">"))
            .replace("$res", "12");
        let scene = support::load_text(&text, std::path::Path::new("."));
        let camera = &scene.sensors()[0];
        let spp = camera.sampler.round_spp(9);
        let control = Control::new();
        let integrator = scene.integrator().expect("an integrator");
        let mut cx = RenderContext::new(&scene, camera, Budget::Samples(spp), 3, &control, Vec::new());
        integrator.render(&mut cx).expect("a picture");
        let estimator = integrator.estimator().expect("an estimator");
        for (x, y) in [(0, 0), (5, 7), (11, 11)] {
            let mut sum = [0.0; 3];
            for sample in 0..spp {
                let value = replay(&cx, estimator, UVec2::new(x, y), sample).rgb.to_array();
                sum.iter_mut().zip(value).for_each(|(sum, v)| *sum += f64::from(v));
            }
            let mean = sum.map(|sum| (sum / f64::from(spp)) as f32);
            assert_eq!(cx.store.pixel(x, y).rgb.to_array(), mean, "{sampler}");
        }
    }
    measured("hc_x08_replayed_samples_add_up_to_the_run", format!("equal bits for {} samplers", samplers.len()));
}
