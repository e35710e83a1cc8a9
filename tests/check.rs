//! `lucerna check` as a user meets it: verdicts, exit codes, what it writes and keeps. None of these tests needs the
//! reference: where it has to be asked, a small program stands in for Python.

mod support;

use serde_json::Value;
use std::path::{Path, PathBuf};
use support::program::{Run, folder_of, text};

const SCENE: &str = "scenes/tests/emitters/point.xml";

/// Runs the program; `python` is what it takes for the reference's interpreter.
fn check(python: &Path, arguments: &[&str]) -> Run {
    let arguments = [&["check"], arguments].concat();
    Run::of(&arguments, |command| _ = command.env("LUCERNA_REFERENCE_PYTHON", python))
}

fn nobody() -> &'static Path {
    Path::new("/nowhere/python")
}

/// An empty folder for one test.
fn temporary(test: &str) -> PathBuf {
    let folder = folder_of("check", test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
}

/// A copy of a repository with one scene and its references; `change` rewrites the manifest's entry.
fn copy(test: &str, name: &str, factor: Option<f32>) -> PathBuf {
    use lucerna::core::image::{ReadLimits, exr};
    let (from, to) = (Path::new(env!("CARGO_MANIFEST_DIR")), temporary(test));
    let scene = format!("scenes/tests/{name}.xml");
    for file in [&scene, "reference/apart.toml", "reference/manifest.toml"] {
        std::fs::create_dir_all(to.join(file).parent().expect("folder")).expect("folder");
        std::fs::copy(from.join(file), to.join(file)).expect("copied");
    }
    for suffix in ["", ".var"] {
        let file = format!("reference/images/{name}{suffix}.exr");
        let mut image = exr::read(&from.join(&file), &ReadLimits::default()).expect("image").image;
        if let (Some(factor), "") = (factor, suffix) {
            image.data.iter_mut().for_each(|v| *v *= factor);
        }
        std::fs::create_dir_all(to.join(&file).parent().expect("folder")).expect("folder");
        exr::write(&to.join(&file), &image, &exr::ExrOptions::default()).expect("written");
    }
    to.join(scene)
}

fn json(run: &Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}: {} {}", run.stdout, run.stderr))
}

#[test]
fn a_stored_reference_needs_no_python() {
    let run = check(nobody(), &[SCENE, "--spp", "256"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("agrees") && run.stdout.contains("1 scene: 1 agree, 0 differ"), "{}", run.stdout);
    let run = check(nobody(), &[SCENE, "--exact"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("% of pixels follow"), "{}", run.stdout);
}

/// Sample for sample with these samples and this seed: an image that is stored, or one that has to be rendered.
#[test]
fn exact_images_are_those_asked_for() {
    let reference = |arguments: &[&str]| {
        let run = check(nobody(), &[&[SCENE, "--exact", "--json"], arguments].concat());
        let told = json(&run);
        (
            run.code,
            told["scenes"][0]["reference"].as_str().map(str::to_owned),
            told["scenes"][0]["spp"]["ours"].as_u64(),
        )
    };
    let stored = |count: u32, spp: u64| (0, Some(format!("{count} stored images of scalar_rgb")), Some(spp));
    assert_eq!(reference(&[]), stored(2, 4));
    assert_eq!(reference(&["--spp", "1"]), stored(1, 1));
    assert_eq!(reference(&["--seed", "3"]), stored(1, 4));
    // None is stored, and there is nobody to render it.
    for arguments in [["--spp", "2"], ["--seed", "1"]] {
        let run = check(nobody(), &[&[SCENE, "--exact"][..], &arguments].concat());
        assert!(run.code == 2 && run.stdout.contains("LUCERNA_REFERENCE_PYTHON=/nowhere"), "{}", run.stdout);
    }
}

#[test]
fn a_wrong_picture_is_told_shown_and_counted() {
    let scene = copy("wrong", "emitters/point", Some(1.02));
    let output = scene.with_file_name("out");
    let run = check(nobody(), &[text(&scene), "--spp", "512", "--json", "-o", text(&output)]);
    assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
    let told = json(&run);
    let told = &told["scenes"][0];
    assert_eq!(told["verdict"], "differs");
    let difference = told["mean_difference"]["relative"].as_f64().expect("a number");
    assert!((difference + 0.02 / 1.02).abs() < 0.005, "{difference}");
    assert!(told["mean"]["worst_sigma"].as_f64() > told["mean"]["limit_sigma"].as_f64(), "{told}");
    let page = std::fs::read_to_string(output.join("report.html")).expect("a report");
    assert!(page.contains("DIFFERS") && page.contains("data:image/png;base64,iVBOR") && page.contains("darker"));
    // It stands alone.
    assert!(!page.contains("http") && !page.contains("src=\"0") && !page.contains("<link"));
    for name in ["image", "reference", "difference", "z-map"] {
        for extension in ["exr", "png"] {
            let file = output.join("01-emitters-point").join(name).with_extension(extension);
            assert!(file.is_file(), "{}", file.display());
        }
    }
}

#[test]
fn a_reference_older_than_its_scene_is_refused() {
    let scene = copy("old", "emitters/point", None);
    let changed = std::fs::read_to_string(&scene).expect("scene").replace("</scene>", "<!-- --></scene>");
    std::fs::write(&scene, changed).expect("written");
    let run = check(nobody(), &[text(&scene)]);
    assert_eq!(run.code, 2, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("not run") && run.stdout.contains("older than the scene"), "{}", run.stdout);
}

#[test]
fn what_cannot_run_says_why() {
    let folder = temporary("cannot");
    let scene = folder.join("scene.xml");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.xml"), &scene).expect("copied");
    let run = check(nobody(), &[text(&scene)]);
    assert_eq!(run.code, 2);
    assert!(run.stdout.contains("LUCERNA_REFERENCE_PYTHON=/nowhere/python"), "{}", run.stdout);
    for (arguments, message) in [
        (&["missing.xml"][..], "no such file or folder"),
        (&["src"], "the folder holds no scenes"),
        (&[SCENE, "--all"], "cannot be used with"),
        (&[SCENE, "--size", "0"], "expected a width"),
    ] {
        let run = check(nobody(), arguments);
        assert!(run.code == 2 && run.stderr.contains(message), "{arguments:?}: {}", run.stderr);
    }
}

/// A scene with a medium is skipped in a folder, but could not be run if it was named.
#[test]
fn what_is_not_built_is_skipped_in_folders() {
    let folder = temporary("media");
    let scene = folder.join("fog.xml");
    std::fs::write(
        &scene,
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><integrator type=\"path\"/>\
         <medium type=\"homogeneous\" id=\"fog\"/></scene>",
    )
    .expect("written");
    let run = check(nobody(), &[text(&folder)]);
    assert!(run.code == 2 && run.stdout.contains("skipped") && run.stdout.contains("not built"), "{}", run.stdout);
    let run = check(nobody(), &[text(&scene)]);
    assert!(run.code == 2 && run.stdout.contains("not run") && run.stdout.contains("not built"), "{}", run.stdout);
    std::fs::copy(copy("media-good", "emitters/point", None), folder.join("good.xml")).expect("copied");
    // One scene without a reference, one with a medium: nothing was compared.
    assert_eq!(check(nobody(), &[text(&folder)]).code, 2);
}

/// A stand-in for the reference answers with an even picture and notes each call; the second run takes the cache's.
#[cfg(unix)]
#[test]
fn rendered_references_are_kept() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = temporary("cache");
    let scene = folder.join("scene.xml");
    std::fs::write(
        &scene,
        "<scene version=\"3.0.0\"><integrator type=\"path\"/>\
         <emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.5 0.5 0.5\"/></emitter>\
         <sensor type=\"perspective\"><film type=\"hdrfilm\"><integer name=\"width\" value=\"9\"/>\
         <integer name=\"height\" value=\"7\"/><string name=\"pixel_format\" value=\"rgb\"/><rfilter type=\"box\"/></film>\
         <sampler type=\"independent\"/></sensor></scene>",
    )
    .expect("written");
    let calls = folder.join("calls");
    let pass = folder.join("pass");
    let values = [0.5_f32; 9 * 7 * 3];
    let bytes = [&0.25_f64.to_le_bytes()[..], &values.map(f32::to_le_bytes).concat()].concat();
    std::fs::write(&pass, bytes.repeat(16)).expect("written");
    let python = folder.join("python");
    let head = r#"{"mitsuba":"0.0","variant":"llvm_ad_rgb","width":9,"height":7,"channels":["R","G","B"],"notes":[]}"#;
    std::fs::write(
        &python,
        format!(
            "#!/bin/sh\nread job\nif [ -z \"$job\" ]; then echo '{{\"mitsuba\":\"0.0\"}}'; exit; fi\n\
             echo \"$job\" >> '{}'\necho '{head}'\ncat '{}'\n",
            calls.display(),
            pass.display()
        ),
    )
    .expect("written");
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).expect("executable");
    let cache = folder.join("references");
    let run = |more: &[&str]| {
        let arguments = [&[text(&scene), "--cache", text(&cache), "--spp", "64", "--json"], more].concat();
        let run = check(&python, &arguments);
        assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
        let told = json(&run)["scenes"][0]["reference"].as_str().expect("text").to_owned();
        (told, std::fs::read_to_string(&calls).expect("calls").lines().count())
    };
    assert_eq!(run(&[]), ("rendered, mitsuba 0.0, llvm_ad_rgb, 16 passes of 4 spp".to_owned(), 1));
    assert_eq!(run(&[]), ("cached, mitsuba 0.0, llvm_ad_rgb, 16 passes of 4 spp".to_owned(), 1));
    assert_eq!(run(&["--seed", "5"]).1, 2);
    // A damaged entry is rendered again.
    for entry in std::fs::read_dir(&cache).expect("cache") {
        std::fs::write(entry.expect("entry").path().join("tiles.exr"), "x").expect("written");
    }
    assert_eq!(run(&[]).1, 3);
    // Another scene under the same name is another reference.
    let other = std::fs::read_to_string(&scene).expect("scene").replace("0.5 0.5 0.5", "0.50 0.5 0.5");
    std::fs::write(&scene, other).expect("written");
    assert_eq!(run(&[]).1, 4);
}
