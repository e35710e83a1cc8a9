//! What tests that render share: scenes, renders in memory, references and their manifest.
#![allow(dead_code)] // Each test binary uses its part.

pub mod damage;
pub mod program;

use lucerna::check::stored::{self, Entry};
use lucerna::core::image::Image;
use lucerna::core::render::{Budget, Control, RenderContext, Report, SampleOrder};
use lucerna::core::scene::{Description, ObjectKind, Parameter, Scene, Value, instantiate, xml};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A file of the repository.
pub fn repository(path: impl AsRef<Path>) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The tables of a section of the repository's manifest: `image` or `exact`.
pub fn manifest(section: &str) -> Vec<Entry> {
    stored::manifest(&repository(""), section).expect("manifest")
}

/// Why a scene or an exact image of it is left apart, if it is.
pub fn apart(section: &str, name: &str) -> Option<String> {
    static LISTS: LazyLock<[Vec<(String, String)>; 2]> =
        LazyLock::new(|| [false, true].map(|exact| stored::apart(&repository(""), exact).expect("list")));
    let list = &LISTS[usize::from(section == "exact")];
    list.iter().find(|(pattern, _)| stored::is_named(pattern, name)).map(|(_, reason)| reason.clone())
}

/// Loads and builds a scene; panics with the scene's own messages if it cannot.
pub fn load(path: &Path, defines: &[(String, String)], change: impl FnOnce(&mut Description)) -> Scene {
    let options = xml::LoadOptions { defines: defines.to_vec(), ..xml::LoadOptions::default() };
    let mut description = xml::load_upgraded(path, &options).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    change(&mut description);
    let built = instantiate(&lucerna::builtin(), description, false);
    built.unwrap_or_else(|e| panic!("{}: {e}", path.display())).scene
}

/// Builds a scene from text; the files it names are looked for in `folder`.
pub fn load_text(text: &str, folder: &Path) -> Scene {
    let options = xml::LoadOptions { search_path: vec![folder.to_owned()], ..xml::LoadOptions::default() };
    let built = xml::load_str(text, "scene.xml", &options)
        .and_then(xml::upgraded)
        .and_then(|description| instantiate(&lucerna::builtin(), description, false));
    built.unwrap_or_else(|e| panic!("{e}")).scene
}

/// The scene of a manifest entry, at the entry's size.
pub fn load_entry(entry: &Entry) -> Scene {
    load(&repository(&entry.scene), &entry.defines, |description| resize(description, entry.size))
}

/// Gives films another size, unless they have a crop window (whose size is the picture's).
fn resize(description: &mut Description, size: [u32; 2]) {
    for node in description.nodes.iter_mut().filter(|n| n.kind == ObjectKind::Film) {
        if node.parameter("crop_width").is_some() {
            continue;
        }
        for (name, value) in [("width", size[0]), ("height", size[1])] {
            node.take(name);
            let (name, at) = (name.to_owned(), node.at.clone());
            node.parameters.push(Parameter { name, value: Value::Integer(value.into()), at });
        }
    }
}

/// Renders the first sensor.
pub fn render(scene: &Scene, spp: u32, seed: u32, order: SampleOrder) -> (Image, Report) {
    render_with(scene, spp, seed, |cx| cx.order = order)
}

/// Renders the first sensor with changed settings.
pub fn render_with(scene: &Scene, spp: u32, seed: u32, change: impl FnOnce(&mut RenderContext<'_>)) -> (Image, Report) {
    let control = Control::new();
    let integrator = scene.integrator().expect("an integrator").clone();
    let budget = Budget::Samples(spp);
    let mut cx = RenderContext::new(scene, &scene.sensors()[0], budget, seed, &control, integrator.aov_names());
    change(&mut cx);
    let report = integrator.render(&mut cx).expect("a picture");
    (cx.picture(), report)
}
