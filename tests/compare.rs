//! `lucerna compare` as a user meets it: does it find what was planted, does it go on after it was killed, does it show
//! what failed, and does its report open in a browser?

mod support;

use lucerna::compare::facts::Facts;
use lucerna::compare::method::Methods;
use lucerna::compare::results::SceneResult;
use lucerna::compare::tables::{to_csv, to_json};
use lucerna::compare::turn::Place;
use lucerna::compare::{Budgets, Options, compare, page};
use lucerna::core::scene::Registry;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use support::program::chromium;

/// A floor under a lamp, whose power is a parameter.
const SCENE: &str = r#"<scene version="3.0.0">
<default name="power" value="1"/>
<integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective"><float name="fov" value="50"/>
  <transform name="to_world"><lookat origin="0, -4, 2" target="0, 0, 0.3" up="0, 0, 1"/></transform>
  <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/><rfilter type="box"/></film>
  <sampler type="independent"/></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform></shape>
<shape type="sphere"><point name="center" x="0" y="0" z="0.5"/><float name="radius" value="0.5"/></shape>
<emitter type="constant"><rgb name="radiance" value="$power"/></emitter>
</scene>"#;

/// An empty folder for one test.
fn temporary(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compare").join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    std::fs::write(folder.join("scene.xml"), SCENE).expect("written");
    folder
}

fn options(folder: &Path, spp: &[u32], seeds: u32) -> Options {
    Options {
        reading: Default::default(),
        size: None,
        budgets: Budgets::Samples(spp.to_vec()),
        seeds,
        seed: 0,
        no_curves: false,
        target: None,
        place: Place::Here,
        reference: None,
        reference_method: "path:sampler=sobol".to_owned(),
        reference_seconds: 20.0,
        cache: folder.join("cache"),
        output: folder.join("report"),
    }
}

fn run(registry: &Registry, folder: &Path, methods: &[&str], options: &Options) -> SceneResult {
    let texts: Vec<String> = methods.iter().map(|&text| text.to_owned()).collect();
    let methods = Methods::parse(&texts).expect("methods");
    compare(registry, &folder.join("scene.xml"), &methods, options, &mut |_| {}).expect("a comparison")
}

/// The program in a folder.
fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lucerna"));
    command
        .arg("compare")
        .args(arguments)
        .args(["--cache", "cache", "-o", "report"])
        .env("LUCERNA_REFERENCE_PYTHON", "/nowhere/python")
        .current_dir(folder)
        .stdin(Stdio::null());
    command
}

/// Runs it.
fn lucerna(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = command(folder, arguments).output().expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("messages are UTF-8");
    (output.status.code().expect("no signal"), text(output.stdout), text(output.stderr))
}

/// Lamps 1 % brighter and darker are found with the right sign, and the size they have; the true one is left in peace.
#[test]
fn a_planted_bias_of_one_percent_is_found() {
    let folder = temporary("bias");
    let file = folder.join("methods.toml");
    let planted = "[[method]]\nname = 'true'\nintegrator = 'path'\n\
         [[method]]\nname = 'bright'\ndefine = { power = '1.01' }\n[[method]]\nname = 'dark'\ndefine = { power = '0.99' }\n";
    std::fs::write(&file, planted).expect("written");
    let found = run(&lucerna::builtin(), &folder, &[file.to_str().expect("UTF-8")], &options(&folder, &[64], 10));
    assert_eq!(found.truth.reached, Some(true), "{}", found.truth.source);
    for (method, (expected, biased)) in found.methods.iter().zip([(0.0, false), (0.01, true), (-0.01, true)]) {
        let point = method.last().expect("points");
        let difference = point.mean_difference(&found.truth);
        assert_eq!(found.is_biased(point), Some(biased), "{}: {difference:?}", method.method.name);
        assert!((difference.value - expected).abs() < 0.003, "{}: {difference:?}", method.method.name);
        assert_eq!(difference.excludes(0.0), biased, "{}: {difference:?}", method.method.name);
    }
}

/// The MSE of independent samples falls as 1 / N, and without bias it is all variance.
#[test]
fn errors_fall_as_they_must() {
    let folder = temporary("slope");
    let found = run(&lucerna::builtin(), &folder, &["path", "direct"], &options(&folder, &[64], 4));
    let [slope, _] = found.methods[0].slopes();
    let slope = slope.expect("a slope");
    assert!((slope.value + 1.0).abs() < 0.06, "{slope:?}");
    let [path, direct] = [0, 1].map(|i| found.methods[i].last().expect("points").clone());
    let share = |p: &lucerna::compare::results::Point| p.bias_squared.expect("seeds").value / p.mean(|e| e.mse).value;
    assert!(share(&path).abs() < 0.05, "{}", share(&path));
    // What `direct` leaves out is no noise.
    assert!(share(&direct) > 0.5 && found.is_biased(&direct) == Some(true), "{}", share(&direct));
    let [_, high] = direct.mean_difference(&found.truth).bounds.expect("seeds");
    assert!(high < 0.0, "{high}");
}

/// What is whole in the folder is not rendered again, what is not is.
#[test]
fn a_killed_comparison_goes_on() {
    let folder = temporary("resume");
    let arguments = ["scene.xml", "--spp", "8", "--seeds", "3", "-m", "path", "direct"];
    let (code, _, first) = lucerna(&folder, &arguments);
    assert_eq!(code, 0, "{first}");
    let csv = || std::fs::read_to_string(folder.join("report/results.csv")).expect("a table");
    let before = csv();
    // As if it had been killed while it wrote: a document is missing, and a picture is cut short.
    let mut kept: Vec<PathBuf> =
        std::fs::read_dir(folder.join("report/runs")).expect("runs").map(|e| e.expect("entry").path()).collect();
    kept.sort();
    let of = |extension: &str| {
        kept.iter().filter(|p| p.extension().is_some_and(|e| e == extension)).cloned().collect::<Vec<_>>()
    };
    let (documents, pictures) = (of("json"), of("exr"));
    assert_eq!((documents.len(), pictures.len()), (24, 24), "4 points, 3 seeds, 2 methods");
    std::fs::remove_file(&documents[3]).expect("removed");
    let bytes = std::fs::read(&pictures[20]).expect("a picture");
    std::fs::write(&pictures[20], &bytes[..bytes.len() / 2]).expect("written");
    let (code, _, second) = lucerna(&folder, &arguments);
    assert_eq!(code, 0, "{second}");
    let runs = |text: &str| text.lines().filter(|line| line.contains(": run ")).count();
    assert_eq!(runs(&first), 6, "{first}");
    assert!((1..=2).contains(&runs(&second)), "{second}");
    assert!(!second.contains("reference, pass"), "the reference was kept: {second}");
    // All errors are the same; so are the times of all but the two that were made again.
    let column = |text: &str, i: usize| {
        text.lines().map(|l| l.split(',').nth(i).unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(column(&before, 5), column(&csv(), 5));
    let (old, new) = (column(&before, 4), column(&csv(), 4));
    assert!(old.iter().zip(&new).filter(|(a, b)| a != b).count() <= 2);
}

/// The same with a real kill: what was whole then is not rendered again, and the errors are those of a run that was left alone.
#[test]
fn a_real_kill_loses_one_turn() {
    let arguments = ["scene.xml", "--spp", "256", "--seeds", "6", "--reference-seconds", "2", "-m", "path", "direct"];
    let [killed, left_alone] = ["killed", "left_alone"].map(temporary);
    let mut child = command(&killed, &arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
    let lines = BufReader::new(child.stderr.take().expect("messages")).lines();
    assert_eq!(lines.map_while(Result::ok).filter(|line| line.contains(": run ")).take(3).count(), 3);
    child.kill().expect("it still ran");
    child.wait().expect("it ends");
    let (code, _, rest) = lucerna(&killed, &arguments);
    assert_eq!(code, 0, "{rest}");
    let runs = rest.lines().filter(|line| line.contains(": run ")).count();
    assert!(runs <= 9, "{runs} of 12 runs again: {rest}");
    let (code, _, said) = lucerna(&left_alone, &arguments);
    assert_eq!(code, 0, "{said}");
    let measured = |folder: &Path| {
        let document = std::fs::read(folder.join("report/results.json")).expect("results");
        let document: Value = serde_json::from_slice(&document).expect("JSON");
        let methods = document["scenes"][0]["methods"].as_array().expect("methods").clone();
        let points = methods.iter().flat_map(|m| m["points"].as_array().expect("points").clone());
        // What does not hang on the reference, whose time was short.
        points.map(|p| (p["spp"].clone(), p["variance"].clone())).collect::<Vec<_>>()
    };
    assert_eq!(measured(&killed), measured(&left_alone));
}

/// Each is a line: the disk is full while runs are kept, and while the report is written.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_line() {
    let folder = temporary("full");
    let arguments = ["scene.xml", "-q", "--spp", "2", "--seeds", "2", "-m", "path", "direct"];
    // No file may be longer than a block, as if the disk was full then.
    let limited = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_lucerna"), "compare"])
        .args(arguments)
        .args(["--cache", "cache", "-o", "report"])
        .current_dir(&folder)
        .output()
        .expect("a shell");
    let stderr = String::from_utf8_lossy(&limited.stderr).into_owned();
    assert_eq!((limited.status.code(), stderr.lines().count()), (Some(2), 1), "{stderr}");
    assert!(stderr.contains("report/runs/") && stderr.contains("too large"), "{stderr}");
    assert_eq!(lucerna(&folder, &arguments).0, 0);
    for file in ["results.json", "index.html", "data/0-1.js"] {
        let path = folder.join("report").join(file);
        std::fs::remove_file(&path).expect("a report");
        std::os::unix::fs::symlink("/dev/full", &path).expect("a link");
        let (code, _, stderr) = lucerna(&folder, &arguments);
        assert_eq!((code, stderr.lines().count()), (2, 1), "{stderr}");
        assert!(stderr.contains(file) && stderr.contains("No space left"), "{stderr}");
        std::fs::remove_file(&path).expect("a link");
    }
    assert_eq!(lucerna(&folder, &arguments).0, 0);
}

/// A pixel that is not finite is left out and told; a reference without any that is, is a reason to fail.
#[test]
fn pixels_that_are_not_finite_are_told() {
    let folder = temporary("nan");
    let mut reference = lucerna::core::image::Image::new(24, 20, &["R", "G", "B"]);
    reference.data.fill(0.5);
    reference.data[30] = f32::NAN;
    let arguments = ["scene.xml", "--spp", "4", "--seeds", "3", "-m", "path", "--reference", "given.exr"];
    let write = |image: &lucerna::core::image::Image| {
        lucerna::core::image::exr::write(&folder.join("given.exr"), image, &Default::default()).expect("written");
    };
    write(&reference);
    let (code, _, said) = lucerna(&folder, &arguments);
    assert_eq!(code, 0, "{said}");
    let page = std::fs::read_to_string(folder.join("report/index.html")).expect("a page");
    assert!(page.contains("3 pixels of all runs are not finite and were left out"));
    let document = std::fs::read(folder.join("report/results.json")).expect("results");
    let document: Value = serde_json::from_slice(&document).expect("JSON");
    let point = &document["scenes"][0]["methods"][0]["points"][2];
    assert_eq!(point["left_out"], 3);
    assert!(point["flip_hdr"]["value"].as_f64().is_some_and(|v| v > 0.0 && v < 1.0), "{point}");
    reference.data.fill(f32::NAN);
    write(&reference);
    let (code, stdout, said) = lucerna(&folder, &arguments);
    assert_eq!(code, 2, "{stdout}{said}");
    assert!(stdout.contains("failed: no pixel is finite"), "{stdout}{said}");
}

#[test]
fn a_method_that_fails_is_shown_and_the_others_go_on() {
    let folder = temporary("failed");
    let (code, stdout, stderr) = lucerna(
        &folder,
        &[
            "scene.xml",
            "--spp",
            "4",
            "--seeds",
            "2",
            "-m",
            "path",
            "nosuch",
            "mitsuba:scalar_rgb:path",
            "path:max_depth=x",
        ],
    );
    assert_eq!(code, 2, "{stdout}{stderr}");
    assert!(stdout.contains("nosuch") && stdout.contains("failed: ") && stdout.contains("see report"), "{stdout}");
    let document = std::fs::read(folder.join("report/results.json")).expect("results");
    let document: Value = serde_json::from_slice(&document).expect("JSON");
    let methods = document["scenes"][0]["methods"].as_array().expect("methods");
    assert!(methods[0]["points"][2]["mse"]["value"].as_f64().expect("a number") > 0.0);
    let reasons: Vec<&str> = methods[1..].iter().map(|m| m["failed"].as_str().expect("a reason")).collect();
    assert!(
        reasons[0].contains("nosuch") && reasons[1].contains("/nowhere/python") && reasons[2].contains("max_depth"),
        "{reasons:?}"
    );
    let page = std::fs::read_to_string(folder.join("report/index.html")).expect("a page");
    assert!(page.contains("failed: ") && page.contains("/nowhere/python"));
}

#[test]
fn mistakes_are_one_line() {
    let folder = temporary("mistakes");
    std::fs::write(folder.join("wrong.toml"), "[[method]]\nname = 'a'\nintegrater = 'path'\n").expect("written");
    std::fs::write(folder.join("report"), "a file where the folder should be").expect("written");
    for (arguments, expected) in [
        (&["scene.xml", "-m", "path:"][..], ""),
        (&["nowhere.xml", "-m", "path"], "no such file"),
        (&["scene.xml", "-m", "wrong.toml"], "wrong.toml: line 3"),
        (&["scene.xml", "-m", "none.toml"], "none.toml"),
        (&["scene.xml", "-m", "path", "path"], "two methods"),
        (&["scene.xml", "-m", "path", "--baseline", "direct"], "--baseline direct"),
        (&["scene.xml", "-m", "path", "--spp", "1", "--seeds", "1"], "report"),
        (&["scene.xml", "-m", "nosuch", "--spp", "1"], "report"),
    ] {
        let (code, stdout, stderr) = lucerna(&folder, arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?} {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

/// What the tables hold, against each other.
#[test]
fn tables_agree() {
    let folder = temporary("tables");
    let options = options(&folder, &[2, 8], 3);
    let found = [run(&lucerna::builtin(), &folder, &["path", "path:sampler=sobol"], &options)];
    let document = to_json(&found, &[], &options, &Facts::default());
    let csv = to_csv(&found, &options);
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    // 1, 2, 4 and 8 samples, three seeds, two methods.
    assert_eq!(rows.len(), 1 + 4 * 3 * 2);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let last: Vec<f64> = rows[1..]
        .iter()
        .filter(|r| r[1] == "\"path\"" && r[2] == "8")
        .map(|r| r[5].parse().expect("a number"))
        .collect();
    let point = &document["scenes"][0]["methods"][0]["points"][3];
    assert_eq!(point["spp"], 8);
    let mean = last.iter().sum::<f64>() / 3.0;
    assert!((point["mse"]["value"].as_f64().expect("a number") / mean - 1.0).abs() < 1e-12);
    let against = &document["scenes"][0]["methods"][0]["budgets"][1]["against_baseline"];
    assert_eq!(against["efficiency_mse"]["value"], 1.0);
    assert_eq!(document["scenes"][0]["reference"]["is_good_enough"], true);
    // A given picture whose variance stands next to it does as well.
    let image = &found[0].truth;
    let given = folder.join("given.exr");
    let picture = lucerna::core::image::Image {
        width: image.size[0],
        height: image.size[1],
        channels: image.channels.clone(),
        data: image.values.clone(),
    };
    lucerna::core::image::exr::write(&given, &picture, &Default::default()).expect("written");
    let options = Options { reference: Some(given), ..options };
    let again = run(&lucerna::builtin(), &folder, &["path", "path:sampler=sobol"], &options);
    assert_eq!(again.methods[0].points[3].errors, found[0].methods[0].points[3].errors);
    assert_eq!(again.truth.noise, None);
}

/// The page in a browser, if there is one: no errors on its console, pictures with the float values they have, keys.
#[test]
fn the_page_works_in_a_browser() {
    let Some(browser) = chromium() else {
        println!("skipped: there is no chromium");
        return;
    };
    let folder = temporary("browser");
    let options = options(&folder, &[4], 2);
    // Twice: the page of a scene, and one that sums up.
    let found = [0, 1].map(|_| run(&lucerna::builtin(), &folder, &["path", "direct"], &options));
    for (number, scene) in found.iter().enumerate() {
        page::write_pictures(scene, number, &options).expect("pictures");
    }
    page::write(&found, &[], &options, &Facts::default()).expect("a report");
    let dump = |page: &str, size: &str| {
        let output = Command::new(browser)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .args(["--enable-logging=stderr", "--virtual-time-budget=4000", "--dump-dom"])
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .arg(format!("--window-size={size}"))
            .arg(format!("file://{}/{page}", options.output.display()))
            .stdin(Stdio::null())
            .output()
            .expect("chromium starts");
        let log = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!log.contains("CONSOLE"), "{log}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    // A copy of the viewer that presses keys and notes what became of them, and pages that tell whether they are too wide.
    let viewer = std::fs::read_to_string(options.output.join("viewer.html")).expect("a viewer");
    let press = r#"<script>window.addEventListener('load', () => setTimeout(() => {
      const press = (key) => document.body.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
      const chosen = () => [...document.querySelectorAll('#tabs button')].findIndex((b) => b.ariaPressed === 'true');
      const shown = () => [...document.querySelectorAll('.panel')].filter((p) => p.offsetWidth > 0).length;
      const canvas = () => [...document.querySelectorAll('.panel canvas')].map((c) => c.toDataURL()).join();
      const where = () => document.getElementById('where').textContent;
      const panel = () => [...document.querySelectorAll('.panel')].find((p) => p.offsetWidth > 0);
      const point = (type, dx, dy) => {
        const box = panel().getBoundingClientRect(), init = { bubbles: true, cancelable: true, pointerId: 1, deltaY: -300 };
        Object.assign(init, { clientX: box.left + box.width / 2 + dx, clientY: box.top + box.height / 2 + dy });
        panel().dispatchEvent(type === 'wheel' ? new WheelEvent(type, init) : new PointerEvent(type, init));
      };
      const notes = [], note = (name, value) => notes.push(name + ' ' + value);
      const changes = (name, act) => { const before = canvas(); act(); note(name, canvas() !== before); };
      note('panels', shown()); press('o'); note('alone', shown());
      press('2'); note('chosen', chosen()); press('ArrowLeft'); note('left', chosen()); press('x'); note('flipped', chosen());
      press('b'); note('side by side', !document.getElementById('compared').hidden);
      for (const key of [']', '[', '+', 'c', 'f', 'm', 'e']) changes(key, () => press(key));
      press('g');
      // The pixel under the mouse: the drag takes it along, the wheel keeps it, and moves all that is around.
      point('pointermove', 7, 5); const first = where();
      point('pointerdown', 7, 5); point('pointermove', 67, 5); note('dragged', where() === first); point('pointerup', 67, 5);
      changes('wheel', () => point('wheel', 67, 5)); point('pointermove', 67, 5); note('kept', where() === first);
      point('pointermove', 7, 5); note('moved', where() !== first);
      press('w'); press('f');
      for (let i = 0; i < 50; i++) { press('a'); press('w'); }
      for (let i = 0; i < 6; i++) press('d');
      for (let i = 0; i < 7; i++) press('s');
      note('wide', document.documentElement.scrollWidth > innerWidth);
      document.title = notes.join('; ');
    }, 500));</script></body>"#;
    std::fs::write(options.output.join("keys.html"), viewer.replace("</body>", press)).expect("written");
    let html = dump("keys.html", "1280,800");
    let notes = "panels 3; alone 1; chosen 2; left 1; flipped 2; side by side true; ] true; [ true; + true; c true; f true; m true; \
                 e true; dragged true; wheel true; kept true; moved true; wide false";
    assert!(html.contains(&format!("<title>{notes}</title>")), "{}", html.chars().take(500).collect::<String>());
    let [x, y] = [6, 7];
    assert!(html.contains(&format!("Pixel {x}, {y}")), "{html}");
    let cells = |row: &str| -> Vec<f32> {
        row.split("<td>").skip(1).filter_map(|c| c.split('<').next()?.replace('−', "-").parse().ok()).collect()
    };
    let rows: Vec<Vec<f32>> = html.split("<tbody>").nth(1).expect("values").split("<tr>").skip(1).map(cells).collect();
    let (reference, methods) = (&found[0].truth.values, &found[0].methods);
    let pixel = y * found[0].truth.size[0] as usize + x;
    let at = |values: &[f32]| values[3 * pixel..3 * pixel + 3].to_vec();
    assert_eq!(rows[0], at(reference));
    for (row, method) in rows[1..].iter().zip(methods) {
        assert_eq!(row[..3], at(&method.picture));
        // Difference, relMSE and FLIP, with three digits.
        let pairs = at(&method.picture).into_iter().zip(at(reference));
        let [difference, square] =
            pairs.fold([0.0, 0.0], |[d, e], (x, r)| [d + (x - r) / 3.0, e + (x - r).powi(2) / (r * r + 0.01) / 3.0]);
        for (shown, true_value) in row[3..].iter().zip([difference, square, method.flip_map[pixel]]) {
            assert!((shown - true_value).abs() <= 0.006 * true_value.abs(), "{row:?}: {true_value}");
        }
        assert_eq!(row.len(), 6, "{row:?}");
    }
    let index = std::fs::read_to_string(options.output.join("index.html")).expect("a page");
    // Pages in frames of a phone's width to that of a large screen tell whether they are wider than that.
    let measure = "<script>parent.postMessage('wide ' + (document.documentElement.scrollWidth > innerWidth), '*')</script></body>";
    let scene = std::fs::read_to_string(options.output.join("scene-2.html")).expect("a page");
    assert!(scene.contains("viewer.html#scene=1&amp;place=2") && index.contains("href=\"scene-2.html\""));
    for (name, page) in [("index", &index), ("scene", &scene), ("viewer", &viewer)] {
        std::fs::write(options.output.join("width.html"), page.replace("</body>", measure)).expect("written");
        for width in [360, 768, 1280, 2560] {
            let frame = format!(
                "<!doctype html><title>waits</title><script>onmessage = (e) => {{ document.title = e.data; }}</script>\
                 <iframe src=\"width.html\" style=\"width: {width}px; height: 800px\"></iframe>"
            );
            std::fs::write(options.output.join("frame.html"), frame).expect("written");
            let html = dump("frame.html", "2600,1000");
            assert!(html.contains("<title>wide false</title>"), "{name} at {width} pixels: {html}");
        }
    }
    assert!(!index.contains("http"), "it needs no network");
}
