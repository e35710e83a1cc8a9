//! Turns of `lucerna compare` are processes: a planted slowdown of a tenth is found with the right sign on a machine that does
//! other things too, and a method that takes its process with it is shown as failed, while the others go on.
//!
//! This test is a program with a plugin of its own, as a third party would build one: without arguments it starts itself as
//! `compare`, which starts itself for every turn.

use lucerna::core::interfaces::Integrator;
use lucerna::core::render::{Budget, Control, FilmStore, RenderContext, RenderError, Report};
use lucerna::core::scene::{Built, Constructor, ObjectKind, Plugin, Properties, Registry};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;

/// A floor and a ball under a sky.
const SCENE: &str = r#"<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="5"/></integrator>
<sensor type="perspective"><float name="fov" value="50"/>
  <transform name="to_world"><lookat origin="0, -4, 2" target="0, 0, 0.3" up="0, 0, 1"/></transform>
  <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/><rfilter type="box"/></film>
  <sampler type="independent"/></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform></shape>
<shape type="sphere"><point name="center" x="0" y="0" z="0.5"/><float name="radius" value="0.5"/></shape>
<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
</scene>"#;

/// `path` that renders a tenth of its samples twice and throws them away.
struct Slow(Arc<dyn Integrator>);

impl Integrator for Slow {
    fn render(&self, cx: &mut RenderContext<'_>) -> Result<Report, RenderError> {
        let report = self.0.render(cx)?;
        let control = Control::new();
        let mut again = RenderContext {
            scene: cx.scene,
            sensor: cx.sensor,
            film: cx.film.clone(),
            sampler: cx.sampler,
            budget: Budget::Samples(report.spp.div_ceil(10)),
            seed: cx.seed,
            order: cx.order,
            control: &control,
            store: FilmStore::new(cx.store.size(), Vec::new()),
            checkpoint: None,
            guide_file: None,
            leaves_learnt: false,
        };
        self.0.render(&mut again)?;
        Ok(report)
    }
}

/// Ends the process.
struct Fatal;

impl Integrator for Fatal {
    fn render(&self, _: &mut RenderContext<'_>) -> Result<Report, RenderError> {
        eprintln!("something is rotten");
        std::process::abort()
    }
}

/// The constructor of `path`.
fn path(p: &Properties<'_>) -> Built<dyn Integrator> {
    let registry = lucerna::builtin();
    match registry.find(ObjectKind::Integrator, "path").expect("path").build {
        Constructor::Integrator(build) => build(p),
        _ => panic!("path is an integrator"),
    }
}

fn slow(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(Slow(path(p)?)))
}

fn fatal(p: &Properties<'_>) -> Built<dyn Integrator> {
    path(p)?;
    Ok(Arc::new(Fatal))
}

fn registry() -> Registry {
    let mut registry = lucerna::builtin();
    let params = registry.find(ObjectKind::Integrator, "path").expect("path").params;
    for (name, build) in [("slow", Constructor::Integrator(slow)), ("fatal", Constructor::Integrator(fatal))] {
        registry.add(Plugin { name, aliases: &[], summary: "", params, build });
    }
    registry
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|word| word == "compare") {
        return lucerna::run(registry());
    }
    // As the usual tests: words choose.
    let words: Vec<&String> = arguments.iter().filter(|word| !word.starts_with('-')).collect();
    let tests: [(&str, fn()); 2] =
        [("a_tenth_is_found", a_tenth_is_found), ("others_outlive_a_method", others_outlive_a_method)];
    for (name, test) in tests {
        if words.is_empty() || words.iter().any(|word| name.contains(word.as_str())) {
            test();
            println!("test {name} ... ok");
        }
    }
    ExitCode::SUCCESS
}

/// Compares in a fresh folder: exit code, what was said, and the methods' results.
fn compare(test: &str, arguments: &[&str]) -> (Option<i32>, String, Value) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("processes").join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    std::fs::write(folder.join("scene.xml"), SCENE).expect("written");
    let output = Command::new(std::env::current_exe().expect("this program"))
        .args(["compare", "scene.xml", "-q", "-o", "report", "--cache", "cache", "--reference-seconds", "2"])
        .args(arguments)
        .current_dir(&folder)
        .stdin(Stdio::null())
        .output()
        .expect("it starts");
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    let document = std::fs::read(folder.join("report/results.json")).unwrap_or_else(|_| panic!("no results: {said}"));
    let document: Value = serde_json::from_slice(&document).expect("JSON");
    (output.status.code(), said, document["scenes"][0]["methods"].clone())
}

fn a_tenth_is_found() {
    // Twice the seeds of the default, because runs are much shorter than its five seconds.
    let arguments = ["-m", "path", "slow", "--spp", "400", "--no-curves", "--seeds", "20"];
    let (code, said, methods) = compare("slow", &arguments);
    assert_eq!(code, Some(0), "{said}");
    let error = |i: usize| methods[i]["points"][0]["mse"]["value"].as_f64().expect("an error");
    assert_eq!(error(0), error(1), "the same samples have the same error");
    let against = &methods[1]["budgets"][0]["against_baseline"];
    let found = &against["processor_seconds_per_sample"];
    println!("processor time: {found}; clock: {}", against["seconds_per_sample"]);
    if found.is_null() {
        println!("skipped: this system does not tell processor time");
        return;
    }
    let [low, value, high] = ["low", "value", "high"].map(|name| found[name].as_f64().expect("a number"));
    // Slower, and not by a fifth: whatever else runs on the machine, twenty pairs of neighbours tell.
    assert!(low > 1.0 && value > 1.05 && value < 1.2 && high > value, "{found}");
}

fn others_outlive_a_method() {
    let (code, said, methods) = compare("fatal", &["-m", "path", "fatal", "--spp", "4", "--seeds", "2"]);
    assert_eq!(code, Some(2), "{said}");
    let why = methods[1]["failed"].as_str().expect("a reason");
    assert!(why.contains("ended early") && why.contains("something is rotten") && !why.contains('\n'), "{why}");
    let point = &methods[0]["points"][2];
    assert!(point["mse"]["value"].as_f64().expect("a number") > 0.0, "{said}");
    // What a process of its own tells, and that its points were seen on the way of one run.
    assert_eq!([&methods[0]["points"][0]["of_run"], &point["spp"]], [4, 4]);
    if cfg!(target_os = "linux") {
        let number = |value: &Value| value["value"].as_f64().expect("a number");
        assert!(number(&point["peak_mib"]) > 1.0 && number(&point["processor_seconds"]) > 0.0, "{point}");
    }
}
