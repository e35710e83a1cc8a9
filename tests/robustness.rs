//! Whatever a file holds: an error or a picture, never a panic.
//!
//! All test scenes are damaged in many ways, deterministically, and taken the whole way: read, resolved, upgraded, built,
//! and rendered with one sample per pixel if they still can be. `fuzz_corpus.rs` has closer tests of this kind for the
//! readers of meshes and pictures; here damaged files meet the objects that use them.

mod support;

use lucerna::core::render::{Budget, Control, RenderContext};
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{Description, ObjectKind, Registry, Value, instantiate, resolve, upgrade};
use std::cell::Cell;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once};
use support::damage::{Random, damage_bytes, damage_scene};

/// Damaged versions of each scene.
const VERSIONS: usize = 100;
/// Damaged versions of each mesh and picture.
const FILE_VERSIONS: usize = 300;
/// Most pixels per side and most bounces: the question is whether it renders, not what.
const SIDE: i64 = 4;
const BOUNCES: i64 = 8;

/// Makes what is rendered small. Nothing that could be an error is repaired.
fn shrink(description: &mut Description) {
    for node in &mut description.nodes {
        for parameter in &mut node.parameters {
            let most = match (node.kind, parameter.name.as_str()) {
                (ObjectKind::Film, "width" | "height") => SIDE,
                (ObjectKind::Integrator, "max_depth") => BOUNCES,
                _ => continue,
            };
            if let Value::Integer(value) = &mut parameter.value
                && (*value > most || (*value == -1 && node.kind == ObjectKind::Integrator))
            {
                *value = most;
            }
        }
        let names = ["crop_offset_x", "crop_offset_y", "crop_width", "crop_height"];
        node.parameters.retain(|parameter| !names.contains(&parameter.name.as_str()));
    }
}

/// The whole way of a scene; true if it was rendered.
fn render(text: &str, folder: &Path, registry: &Registry, lenient: bool) -> bool {
    let options = LoadOptions { search_path: vec![folder.to_owned()], lenient, ..LoadOptions::default() };
    let Ok(mut description) = load_str(text, "scene.xml", &options) else { return false };
    if resolve::resolve(&mut description).is_err() {
        return false;
    }
    upgrade::upgrade(&mut description);
    shrink(&mut description);
    let Ok(built) = instantiate(registry, description, lenient) else { return false };
    let scene = built.scene;
    let (Some(integrator), Some(camera)) = (scene.integrator(), scene.sensors().first()) else { return false };
    if camera.film.settings().crop_size.max_element() > 64 {
        return false;
    }
    let control = Control::new().with_deadline(2.0);
    let budget = Budget::Samples(camera.sampler.round_spp(1));
    let mut context = RenderContext::new(&scene, camera, budget, 0, &control, integrator.aov_names());
    let rendered = integrator.render(&mut context).is_ok();
    if rendered {
        context.store.develop(&context.film);
    }
    rendered
}

/// What the last panics said, as the hook heard it.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

thread_local! {
    /// Whether this thread is inside of a step.
    static LISTENING: Cell<bool> = const { Cell::new(false) };
}

/// Runs `step`; says what it panicked with.
fn panic_of(step: impl FnOnce()) -> Option<String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            // Panics of the test itself come from its own thread, outside of a step.
            if std::thread::current().name().is_some() && !LISTENING.get() {
                usual(panic);
            } else if let Ok(mut heard) = PANICS.lock() {
                heard.push(panic.to_string());
            }
        }));
    });
    LISTENING.set(true);
    let result = catch_unwind(AssertUnwindSafe(step));
    LISTENING.set(false);
    result.err().map(|_| {
        let heard = PANICS.lock().map(|mut heard| std::mem::take(&mut *heard)).unwrap_or_default();
        heard.join("; ").replace('\n', " ")
    })
}

/// Fails if anything panicked, or if the damage was too great or too small to say much.
fn conclude(rendered: usize, all: usize, panics: &[String]) {
    eprintln!("{rendered} of {all} rendered, {} panicked", panics.len());
    assert!(panics.is_empty(), "{}", panics.join("\n"));
    assert!(rendered > all / 10 && rendered < all);
}

/// Test scenes, good and bad, in order.
fn scenes() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let folders = ["tests", "bad"].into_iter().flat_map(|kind| fs::read_dir(root.join(kind)).unwrap());
    let files = folders
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .flat_map(|folder| fs::read_dir(folder).unwrap());
    let mut paths: Vec<PathBuf> = files.map(|entry| entry.unwrap().path()).collect();
    paths.push(root.join("cornell-box.xml"));
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "xml"));
    paths.sort();
    paths.into_iter().filter_map(|path| fs::read_to_string(&path).ok().map(|text| (path, text))).collect()
}

#[test]
fn damaged_scenes_never_panic() {
    let registry = lucerna::builtin();
    let plugins: Vec<&str> = registry.all().map(|plugin| plugin.name).collect();
    let scenes = scenes();
    let (mut rendered, mut panics) = (0, Vec::new());
    for (number, (path, original)) in scenes.iter().enumerate() {
        for version in 0..VERSIONS {
            let mut random = Random((number * VERSIONS + version) as u64);
            let mut text = original.clone();
            (0..=version % 2).for_each(|_| damage_scene(&mut text, &plugins, &mut random));
            let folder = path.parent().unwrap();
            let panic = panic_of(|| rendered += usize::from(render(&text, folder, &registry, version % 4 == 0)));
            panics.extend(panic.map(|said| format!("{} version {version}: {said}", path.display())));
        }
    }
    conclude(rendered, scenes.len() * VERSIONS, &panics);
}

#[test]
fn damaged_meshes_and_pictures_never_panic() {
    let registry = lucerna::builtin();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/assets");
    let temporary = std::env::temp_dir().join(format!("lucerna-robustness-{}", std::process::id()));
    fs::create_dir_all(&temporary).unwrap();
    let files = ["meshes", "textures"].into_iter().flat_map(|kind| fs::read_dir(assets.join(kind)).unwrap());
    let mut paths: Vec<PathBuf> = files.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let (mut rendered, mut panics) = (0, Vec::new());
    for path in &paths {
        let original = fs::read(path).unwrap();
        let extension = path.extension().unwrap().to_str().unwrap();
        let name = format!("damaged.{extension}");
        let text = scene_with(extension, &name);
        for version in 0..FILE_VERSIONS {
            let mut random = Random((original.len() + version) as u64);
            let mut bytes = original.clone();
            (0..=version % 2).for_each(|_| damage_bytes(&mut bytes, &mut random));
            fs::write(temporary.join(&name), &bytes).unwrap();
            let panic = panic_of(|| rendered += usize::from(render(&text, &temporary, &registry, version % 4 == 0)));
            panics.extend(panic.map(|said| format!("{} version {version}: {said}", path.display())));
        }
    }
    fs::remove_dir_all(&temporary).unwrap();
    conclude(rendered, paths.len() * FILE_VERSIONS, &panics);
}

/// A scene that uses the file as a shining mesh, or as a reflectance, a roughness and a sky.
fn scene_with(extension: &str, name: &str) -> String {
    let file = format!("<string name=\"filename\" value=\"{name}\"/>");
    let body = match extension {
        "obj" | "ply" | "serialized" => {
            format!("<shape type=\"{extension}\">{file}<emitter type=\"area\"/></shape>")
        }
        _ => format!(
            "<shape type=\"sphere\"><bsdf type=\"roughplastic\">\
             <texture name=\"diffuse_reflectance\" type=\"bitmap\">{file}</texture></bsdf></shape>\
             <shape type=\"rectangle\"><bsdf type=\"roughconductor\">\
             <texture name=\"alpha\" type=\"bitmap\">{file}</texture></bsdf></shape>\
             <emitter type=\"envmap\">{file}</emitter>"
        ),
    };
    format!(
        "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"4\"/></integrator>\
         <sensor type=\"perspective\"><transform name=\"to_world\">\
         <lookat origin=\"0, 1, 4\" target=\"0, 0, 0\" up=\"0, 1, 0\"/></transform><film type=\"hdrfilm\">\
         <integer name=\"width\" value=\"4\"/><integer name=\"height\" value=\"4\"/></film></sensor>{body}</scene>"
    )
}
