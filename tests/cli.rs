//! The program as a user meets it: options, files it writes, messages and exit codes.

mod support;

use lucerna::core::image::exr::Attribute;
use lucerna::core::image::{self, Image, ReadLimits, exr};
use lucerna::core::scene::xml::{LoadOptions, load, load_upgraded};
use lucerna::core::scene::{Description, NodeId, Value};
use std::path::{Path, PathBuf};
use support::program::{Run, folder_of, text};

/// Edge of the pictures rendered here.
const RES: u32 = 16;

fn lucerna(arguments: &[&str]) -> Run {
    Run::of(arguments, |_| ())
}

/// A run that must succeed.
fn done(arguments: &[&str]) -> Run {
    let run = lucerna(arguments);
    assert_eq!(run.code, 0, "{arguments:?}: {}", run.stderr);
    run
}

/// A place for a file of one test.
fn temporary(test: &str, name: &str) -> PathBuf {
    let folder = folder_of("cli", test);
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    let file = folder.join(name);
    let _ = std::fs::remove_file(&file);
    file
}

/// Renders the built-in scene at a tiny size and reads what was written.
fn cornell(test: &str, name: &str, more: &[&str]) -> exr::ExrFile {
    let file = temporary(test, name);
    let mut arguments = vec!["render", "-q", "-D", "res=16", "-o", text(&file)];
    arguments.extend(more);
    done(&arguments);
    exr::read(&file, &ReadLimits::default()).expect("a valid EXR file")
}

/// Red, green and blue of a pixel; EXR files keep channels in alphabetical order.
fn rgb(image: &Image, x: u32, y: u32) -> [f32; 3] {
    ["R", "G", "B"].map(|name| image.pixel(x, y)[image.channel(name).expect("a colour")])
}

fn mean(image: &Image) -> f64 {
    image.data.iter().map(|v| f64::from(*v)).sum::<f64>() / image.data.len() as f64
}

fn attribute<'f>(file: &'f exr::ExrFile, name: &str) -> &'f Attribute {
    let found = file.attributes.iter().find(|(n, _)| n == name);
    &found.unwrap_or_else(|| panic!("no attribute {name} in {:?}", file.attributes)).1
}

fn number(file: &exr::ExrFile, name: &str) -> f64 {
    match attribute(file, name) {
        Attribute::Number(v) => *v,
        other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn every_kind_of_picture_is_written() {
    let exact = cornell("kinds", "box.exr", &["--spp", "4"]).image;
    let exact: Vec<f32> = (0..RES * RES).flat_map(|i| rgb(&exact, i % RES, i / RES)).collect();
    let largest = exact.iter().fold(0.0_f32, |a, b| a.max(*b));
    for (name, tolerance) in [("box.pfm", 0.0), ("box.hdr", 0.01), ("box.png", 0.01)] {
        let file = temporary("kinds", name);
        done(&["render", "-q", "-D", "res=16", "--spp", "4", "-o", text(&file)]);
        let picture = image::read(&file, &ReadLimits::default()).expect("a valid picture");
        assert_eq!((picture.width, picture.height), (RES, RES), "{name}");
        let is_png = name.ends_with("png");
        for (read, written) in picture.to_f32(false).iter().zip(&exact) {
            let wanted = if is_png { written.min(1.0) } else { *written };
            // The shared exponent of .hdr and the 8 bits of .png belong to the brightest channel and to the display.
            let scale = if is_png { 1.0 } else { largest };
            assert!((read - wanted).abs() <= tolerance * scale, "{name}: {read} instead of {wanted}");
        }
    }
}

#[test]
fn an_exr_file_tells_how_it_was_made() {
    let file = cornell("metadata", "box.exr", &["--spp", "3", "--seed", "7"]);
    assert_eq!((file.image.width, file.image.height), (RES, RES));
    assert_eq!(*attribute(&file, "lucerna:version"), Attribute::Text(env!("CARGO_PKG_VERSION").to_owned()));
    assert_eq!(*attribute(&file, "lucerna:scene"), Attribute::Text("built-in scene".to_owned()));
    assert_eq!(number(&file, "lucerna:spp"), 3.0);
    assert_eq!(number(&file, "lucerna:seed"), 7.0);
    assert_eq!(number(&file, "lucerna:samples"), f64::from(3 * RES * RES));
    assert!(number(&file, "lucerna:seconds") > 0.0);
}

#[test]
fn other_integrators_and_samplers_can_be_chosen() {
    let path = cornell("chosen", "path.exr", &["--spp", "64"]);
    let direct = cornell("chosen", "direct.exr", &["--spp", "64", "--integrator", "direct"]);
    assert_eq!(*attribute(&path, "lucerna:integrator"), Attribute::Text("path".to_owned()));
    assert_eq!(*attribute(&direct, "lucerna:integrator"), Attribute::Text("direct".to_owned()));
    assert!(mean(&direct.image) < 0.9 * mean(&path.image), "direct light only must be darker");
    let short = cornell("chosen", "short.exr", &["--spp", "64", "--integrator", "path:max_depth=2"]);
    let difference = (mean(&short.image) / mean(&direct.image) - 1.0).abs();
    assert!(difference < 0.02, "paths of depth 2 are direct light: {difference}");

    let jittered = cornell("chosen", "jittered.exr", &["--spp", "64", "--sampler", "multijitter:jitter=false"]);
    assert_ne!(jittered.image.data, path.image.data);
    let difference = (mean(&jittered.image) / mean(&path.image) - 1.0).abs();
    assert!(difference < 0.02, "the sampler changes noise, not brightness: {difference}");

    let file = temporary("chosen", "rounded.exr");
    let run = done(&["render", "-D", "res=4", "--spp", "5", "--sampler", "stratified", "-o", text(&file)]);
    assert!(run.stderr.contains("5 samples per pixel become 9"), "{}", run.stderr);
}

#[test]
fn a_crop_is_a_window_of_the_whole() {
    let whole = cornell("crop", "whole.exr", &["--spp", "2"]).image;
    let part = cornell("crop", "part.exr", &["--spp", "2", "--crop", "4,5,6,7"]).image;
    assert_eq!((part.width, part.height), (6, 7));
    for (x, y) in (0..7).flat_map(|y| (0..6).map(move |x| (x, y))) {
        assert_eq!(part.pixel(x, y), whole.pixel(x + 4, y + 5));
    }
    let file = temporary("crop", "outside.exr");
    let run = lucerna(&["render", "-D", "res=16", "--crop", "12,0,5,1", "-o", text(&file)]);
    assert!(run.code == 2 && run.stderr.contains("16 x 16 pixels"), "{}", run.stderr);
}

#[test]
fn hc_x08_a_replayed_sample_is_that_of_the_run() {
    let whole = cornell("replay", "whole.exr", &["--spp", "1", "--seed", "5"]).image;
    for (x, y) in [(3, 4), (8, 0), (15, 15)] {
        let pixel = format!("{x},{y}");
        let run = done(&["render", "-D", "res=16", "--spp", "1", "--seed", "5", "--pixel", &pixel, "--sample", "0"]);
        let words: Vec<&str> = run.stdout.split_whitespace().collect();
        let value: Vec<f32> = words[4..7].iter().map(|word| word.parse().expect("a number")).collect();
        assert_eq!(value, rgb(&whole, x, y), "{}", run.stdout);
    }
}

#[test]
fn a_time_limit_gives_the_picture_of_so_many_samples() {
    let timed = cornell("seconds", "timed.exr", &["--seconds", "0.2"]);
    let spp = number(&timed, "lucerna:spp");
    assert!(spp >= 1.0 && spp.fract() == 0.0);
    assert!(number(&timed, "lucerna:seconds") < 2.0, "stops soon");
    let counted = cornell("seconds", "counted.exr", &["--spp", &spp.to_string()]);
    assert_eq!(timed.image.data, counted.image.data, "{spp} spp");
}

#[test]
fn a_scene_may_set_a_time_limit() {
    let arguments = ["--spp", "1000000", "--integrator", "path:timeout=0.2,max_depth=3"];
    let timed = cornell("timeout", "timed.exr", &arguments);
    let spp = number(&timed, "lucerna:spp").to_string();
    assert!(number(&timed, "lucerna:seconds") < 2.0, "stops soon");
    let counted = cornell("timeout", "counted.exr", &["--spp", &spp, "--integrator", "path:max_depth=3"]);
    assert_eq!(timed.image.data, counted.image.data, "{spp} spp");
}

#[test]
fn statistics_are_written_in_json() {
    let stats = temporary("stats", "stats.json");
    cornell("stats", "box.exr", &["--spp", "2", "--stats-json", text(&stats)]);
    let stats = std::fs::read_to_string(stats).expect("a file");
    let stats: serde_json::Value = serde_json::from_str(&stats).expect("valid JSON");
    assert_eq!(stats["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(stats["spp"], 2);
    assert_eq!(stats["samples"], 2 * RES * RES);
    assert_eq!(stats["bad_samples"], 0);
    assert_eq!(stats["stopped"], false);
    assert!(stats["rays"].as_u64() >= stats["samples"].as_u64());
    for rate in ["render_seconds", "msamples_per_second", "mrays_per_second"] {
        assert!(stats[rate].as_f64().is_some_and(|v| v > 0.0), "{rate} in {stats}");
    }
}

#[test]
fn bad_samples_can_fail_a_run() {
    // What the lamp gives off and what it reflects are both near the largest 32-bit number; the sum is not finite.
    let scene = "<scene version='3.0.0'><integrator type='direct'/>
        <sensor type='perspective'><film type='hdrfilm'><integer name='width' value='8'/>
            <integer name='height' value='8'/><string name='component_format' value='float32'/>
            <rfilter type='box'/></film></sensor>
        <emitter type='constant'><float name='radiance' value='3e38'/></emitter>
        <shape type='rectangle'>
            <transform name='to_world'><rotate y='1' angle='180'/><translate z='3'/></transform>
            <bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>
            <emitter type='area'><float name='radiance' value='3e38'/></emitter>
        </shape>
    </scene>";
    let file = temporary("bad", "bright.xml");
    std::fs::write(&file, scene).expect("a file");
    let output = temporary("bad", "bright.exr");
    let strict = lucerna(&["render", text(&file), "-o", text(&output), "--strict-nan"]);
    assert_eq!(strict.code, 3, "{}", strict.stderr);
    assert!(strict.stderr.contains("NaN, infinite or negative"), "{}", strict.stderr);
    assert!(strict.stderr.contains("repeat with --pixel "), "{}", strict.stderr);
    let written = exr::read(&output, &ReadLimits::default()).expect("the picture is written all the same");
    assert!(written.image.data.iter().all(|v| v.is_finite()));
    assert_eq!(lucerna(&["render", text(&file), "-o", text(&output)]).code, 0, "a warning without --strict-nan");
}

#[test]
fn every_plugin_is_listed_and_described() {
    let registry = lucerna::builtin();
    let list = done(&["plugins"]).stdout;
    for plugin in registry.all() {
        let kind = plugin.build.kind().tag();
        assert!(list.lines().any(|line| line.split_whitespace().next() == Some(plugin.name)), "{}", plugin.name);
        let manual = done(&["plugins", kind, plugin.name]).stdout;
        assert!(manual.starts_with(&format!("{kind} \"{}\": {}\n", plugin.name, plugin.summary)), "{manual}");
        for param in plugin.all_params() {
            let row = manual.lines().skip(1).find(|line| line.split_whitespace().next() == Some(param.name));
            let row = row.unwrap_or_else(|| panic!("{kind} {}: no row for {}", plugin.name, param.name));
            assert!(row.contains(param.doc) && row.contains(&param.default_text()), "{row}");
        }
    }
    assert!(done(&["plugins", "bsdfs"]).stdout.contains("roughconductor"), "the plural names the kind, too");
    let run = lucerna(&["plugins", "bsdf", "difuse"]);
    assert!(run.code == 2 && run.stderr.contains("did you mean \"diffuse\"?"), "{}", run.stderr);
    let run = lucerna(&["plugins", "bsfd"]);
    assert!(run.code == 2 && run.stderr.contains("did you mean \"bsdf\"?"), "{}", run.stderr);
}

#[test]
fn info_counts_what_a_scene_holds() {
    let run = done(&["info", "scenes/cornell-box.xml", "-D", "res=20"]);
    for line in ["6  shape rectangle", "2  shape cube", "3  bsdf diffuse", "1  emitters", "20 x 20 pixels, 64 spp"] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
    assert_eq!(done(&["info", "-D", "res=20"]).stdout.lines().skip(1).collect::<Vec<_>>(), {
        run.stdout.lines().skip(1).collect::<Vec<_>>()
    });
}

/// Two objects with all they hold, but for positions, file names and the numbers of nameless children.
fn assert_same(a: &Description, left: NodeId, b: &Description, right: NodeId, place: &str) {
    let (first, second) = (a.node(left), b.node(right));
    let place = format!("{place}/{}", first.title());
    assert_eq!((first.kind, &first.plugin), (second.kind, &second.plugin), "{place}");
    let nameless = |name: &str| name.starts_with('_');
    assert_eq!(first.parameters.len(), second.parameters.len(), "{place}");
    for (p, q) in first.parameters.iter().zip(&second.parameters) {
        assert!(p.name == q.name || nameless(&p.name) && nameless(&q.name), "{place}: {} and {}", p.name, q.name);
        match (&p.value, &q.value) {
            (Value::Object(m), Value::Object(n)) => assert_same(a, *m, b, *n, &place),
            (Value::String(_), Value::String(_)) if p.name == "filename" => {}
            (x, y) => assert_eq!(x, y, "{place}: {}", p.name),
        }
    }
}

#[test]
fn a_converted_scene_is_the_same_scene() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut scenes = vec![root.join("scenes/cornell-box.xml")];
    for entry in std::fs::read_dir(root.join("scenes/tests/upgrade")).expect("a folder") {
        let path = entry.expect("an entry").path();
        scenes.extend(path.extension().is_some_and(|e| e == "xml").then_some(path));
    }
    assert!(scenes.len() > 1);
    for scene in scenes {
        let name = scene.file_name().expect("a name").to_str().expect("UTF-8");
        let file = temporary("convert", name);
        done(&["convert", text(&scene), text(&file), "--keep-own"]);
        let options = LoadOptions::default();
        let original = load_upgraded(&scene, &options).expect("a valid scene");
        let plain = load(&file, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(plain.version[0] >= 3, "{name} is written in today's language");
        let converted = load_upgraded(&file, &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_same(&original, original.root, &converted, converted.root, name);
        done(&["info", text(&file)]);
    }
}

#[test]
fn mistakes_are_told_with_exit_code_2() {
    for (arguments, message) in [
        (&["render", "--no-such-option"][..], "unexpected argument"),
        (&["paint"][..], "unrecognized subcommand"),
        (&["render", "-o", "picture.gif"][..], "picture.gif"),
        (&["render", "no-such-scene.xml"][..], "no-such-scene.xml"),
        (&["render", "--spp", "0"][..], "--spp"),
        (&["render", "--spp", "4", "--seconds", "1"][..], "cannot be used with"),
        (&["render", "-s", "1"][..], "there is no sensor 1"),
        (&["render", "--integrator", "paht"][..], "did you mean \"path\"?"),
        (&["render", "-D", "no_such_name=1"][..], "no_such_name"),
        (&["render", "--max-memory", "0", "-D", "res=4096"][..], "--max-memory"),
    ] {
        let run = lucerna(arguments);
        assert_eq!(run.code, 2, "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(message), "{arguments:?}: {}", run.stderr);
        assert!(run.stdout.is_empty(), "{arguments:?}: mistakes go to standard error");
    }
    assert_eq!(lucerna(&["--version"]).stdout.trim(), format!("lucerna {}", env!("CARGO_PKG_VERSION")));
}

/// A sd_tree with cells enough to look at, and the file it leaves.
const GUIDED: [&str; 4] = ["--integrator", "path", "--guide", "sd_tree:spatial_threshold=100"];

#[test]
fn what_a_guide_has_learnt_is_kept_told_and_drawn() {
    let learnt = temporary("guide", "box.guide");
    let keeps = [&GUIDED[..], &["--spp", "24", "--guide-file", text(&learnt)]].concat();
    let plain = cornell("guide", "plain.exr", &[&GUIDED[..], &["--spp", "24"]].concat());
    assert_eq!(cornell("guide", "first.exr", &keeps).image.data, plain.image.data);
    let frozen = [&keeps[..], &["--guide-frozen"]].concat();
    let second = cornell("guide", "second.exr", &frozen);
    assert_ne!(second.image.data, plain.image.data);
    assert_eq!(cornell("guide", "third.exr", &frozen).image.data, second.image.data);

    let told = done(&["guide", "info", text(&learnt), "--json"]).stdout;
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    let cells = told["learnt"]["cells_of_space"].as_u64().expect("a number");
    let by_depth = told["learnt"]["cells_of_space_by_depth"].as_array().expect("numbers");
    assert_eq!(by_depth.iter().filter_map(serde_json::Value::as_u64).sum::<u64>(), cells);
    assert!(told["guide"] == "sd_tree" && cells > 4 && told["learnt"]["fluence"][1].as_f64() > Some(0.0), "{told}");
    assert!(done(&["guide", "info", text(&learnt)]).stdout.contains(&format!("cells of space: {cells}\n")));

    let (drawn, wide) = (temporary("guide", "drawn.png"), temporary("guide", "wide.png"));
    let view = |output: &Path, pixels: &[&str]| {
        let more = pixels.iter().flat_map(|pixel| ["--pixel", pixel]);
        let fixed = ["guide", "view", "-D", "res=16", "--guide-file", text(&learnt), "-o", text(output)];
        lucerna(&fixed.into_iter().chain(more).collect::<Vec<_>>())
    };
    let run = view(&drawn, &["8,12"]);
    assert!(run.code == 0 && run.stdout.contains("pixel 8,12: at [") && run.stdout.contains("times uniform"));
    assert_eq!(view(&wide, &["8,12", "3,3", "12,8"]).code, 0);
    let [one, three] = [&drawn, &wide].map(|path| image::read(path, &ReadLimits::default()).expect("a picture"));
    assert!(three.width == 3 * one.width && three.height == one.height);
    let run = view(&drawn, &["16,0"]);
    assert!(run.code == 2 && run.stderr.contains("16 x 16 pixels"), "{}", run.stderr);
}

/// Every way in which a file of learnt state is of no use: one line, exit code 2, nothing written.
#[test]
fn hc_i22_files_of_learnt_state_that_are_of_no_use_are_told() {
    let (learnt, other) = (temporary("no_guide", "box.guide"), temporary("no_guide", "other.guide"));
    let output = temporary("no_guide", "box.exr");
    let keeps = [&GUIDED[..], &["--spp", "8", "--guide-file", text(&learnt)]].concat();
    cornell("no_guide", "box.exr", &keeps);
    let told = |more: &[&str], expected: &str| {
        let _ = std::fs::remove_file(&output);
        let run = lucerna(&[&["render", "-q", "-D", "res=16", "-o", text(&output)], more].concat());
        let lines = run.stderr.trim_end().lines().count();
        assert!(run.code == 2 && lines == 1 && run.stderr.contains(expected), "{expected}: {}", run.stderr);
        assert!(!output.exists());
    };
    let with = |file: &'static str| -> Vec<String> {
        let file = folder_of("cli", "no_guide").join(file);
        GUIDED
            .iter()
            .map(|word| (*word).to_owned())
            .chain(["--guide-file".to_owned(), text(&file).to_owned()])
            .collect()
    };
    let using = |file: &'static str, expected: &str| {
        told(&with(file).iter().map(String::as_str).collect::<Vec<_>>(), expected);
    };
    let mut bytes = std::fs::read(&learnt).expect("a file");
    bytes[100] ^= 1;
    std::fs::write(&other, &bytes).expect("written");
    using("other.guide", "damaged: its checksum is wrong");
    let run = lucerna(&["guide", "info", text(&other)]);
    assert!(run.code == 2 && run.stderr.lines().count() == 1 && run.stderr.contains("damaged"), "{}", run.stderr);
    std::fs::write(&other, &bytes[..bytes.len() / 2]).expect("written");
    using("other.guide", "damaged: its checksum is wrong");
    std::fs::write(&other, b"PNG or so").expect("written");
    using("other.guide", "is not a file of what a guide has learnt");
    std::fs::write(&other, b"").expect("written");
    using("other.guide", "is not a file of what a guide has learnt");
    using("no/such/folder.guide", "the folder does not exist");
    let frozen = [&GUIDED[..], &["--guide-frozen", "--guide-file", "none.guide"]].concat();
    told(&frozen, "none.guide: no such file, and nothing may be learnt");
    told(&["--guide-file", text(&learnt)], "needs an integrator with a guide");
    let scene = ["render", "-q", "scenes/tests/bsdfs/blendbsdf.xml", "-o", text(&output)];
    let run = lucerna(&[&scene[..], &keeps].concat());
    assert!(run.code == 2 && run.stderr.contains("is of another scene: its bounds are ["), "{}", run.stderr);
}

/// A scene that names the file does what the options do; it is beside the scene, and the options stand before it.
#[test]
fn a_scene_names_the_file_of_its_guide() {
    let scene = |name: &str, more: &str| {
        let guide = format!(
            "<integrator type='path'><guide type='sd_tree'><float name='spatial_threshold' value='100'/>{more}</guide></integrator>"
        );
        let path = temporary("scene_guide", name);
        let text = include_str!("guiding/gap.xml").replace("<!-- integrator -->", &guide);
        std::fs::write(&path, text).expect("written");
        path
    };
    let plain = scene("plain.xml", "");
    let keeps = scene("keeps.xml", "<string name='file' value='box.guide'/>");
    let frozen = scene("frozen.xml", "<string name='file' value='box.guide'/><boolean name='frozen' value='true'/>");
    let learnt = temporary("scene_guide", "box.guide");
    let options = temporary("scene_guide", "options.guide");
    let output = temporary("scene_guide", "picture.exr");
    let picture = |scene: &Path, more: &[&str]| {
        done(&[&["render", "-q", "--spp", "24", "-o", text(&output), text(scene)], more].concat());
        exr::read(&output, &ReadLimits::default()).expect("a valid EXR file").image.data
    };
    let bytes = |path: &Path| std::fs::read(path).expect("a file");
    let without = picture(&plain, &[]);
    assert!(
        picture(&keeps, &["--guide-file", text(&options)]) == without && !learnt.exists(),
        "options stand before it"
    );
    assert_eq!(picture(&keeps, &[]), without);
    assert_eq!(bytes(&learnt), bytes(&options));
    let with = picture(&frozen, &[]);
    assert!(with != without && with == picture(&plain, &["--guide-file", text(&options), "--guide-frozen"]));
    assert_eq!(bytes(&learnt), bytes(&options), "a frozen file was written");
    // Only `render` writes it.
    std::fs::remove_file(&learnt).expect("it was there");
    done(&[
        "compare",
        text(&keeps),
        "-m",
        "scene",
        "--spp",
        "8",
        "--seeds",
        "2",
        "-o",
        text(&folder_of("cli", "scene_guide").join("compared")),
    ]);
    assert!(!learnt.exists());

    let told = |scene: &Path, place: &str, expected: &str| {
        let run = lucerna(&["render", "-q", "-o", text(&output), text(scene)]);
        let place = format!("{}:{place}", text(scene));
        assert!(run.code == 2 && run.stderr.contains(&place) && run.stderr.contains(expected), "{}", run.stderr);
    };
    told(&frozen, "3:", "could not open the file \"box.guide\"");
    std::fs::write(&learnt, b"PNG or so").expect("written");
    told(&keeps, "3:", "is not a file of what a guide has learnt");
    told(&scene("alone.xml", "<boolean name='frozen' value='true'/>"), "3:", "\"frozen\" needs a \"file\"");
    told(&scene("nowhere.xml", "<string name='file' value='no/such.guide'/>"), "3:", "its folder does not exist");
}

/// The same command goes on from where a run stood, here at its end; another command is refused. (What is interrupted
/// elsewhere: `tests/determinism.rs`, `tests/guiding/kept.rs`.)
#[test]
fn hc_x02_the_same_command_continues_a_run() {
    for guide in [&[][..], &GUIDED[..]] {
        let name = format!("{}.state", guide.len());
        let state = temporary("checkpoint", &name);
        let whole = cornell("checkpoint", "whole.exr", &[guide, &["--spp", "20"]].concat());
        let keeps = [guide, &["--spp", "20", "--checkpoint", text(&state), "--checkpoint-every", "0"]].concat();
        assert_eq!(cornell("checkpoint", "kept.exr", &keeps).image.data, whole.image.data);
        let again = cornell("checkpoint", "again.exr", &keeps);
        assert!(again.image.data == whole.image.data && number(&again, "lucerna:spp") == 20.0);
        let output = temporary("checkpoint", "other.exr");
        for (more, expected) in [
            (&["--seed", "1"][..], "its seed is 0, not 1"),
            (&["--crop", "0,0,4,4"], "its window is 16x16 at 0,0, not 4x4 at 0,0"),
            (&["--light-sampler", "power"], "its scene is another"),
        ] {
            let run = lucerna(&[&["render", "-q", "-D", "res=16", "-o", text(&output)], &keeps[..], more].concat());
            assert!(run.code == 2 && run.stderr.contains(expected), "{expected}: {}", run.stderr);
        }
    }
}
