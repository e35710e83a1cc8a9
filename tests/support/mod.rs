//! What tests that render share: scenes, renders in memory, references and their manifest.
#![allow(dead_code)] // Each test binary uses its part.

pub mod damage;

use lucerna::core::image::{Image, ReadLimits, exr};
use lucerna::core::interfaces::Rfilter;
use lucerna::core::render::{Budget, Control, RenderContext, Report, SampleOrder};
use lucerna::core::scene::{Description, ObjectKind, Parameter, Scene, Value, instantiate, resolve, upgrade, xml};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of the repository.
pub fn repository(path: impl AsRef<Path>) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// One table of `reference/manifest.toml`.
#[derive(Clone, Debug)]
pub struct Entry {
    /// `topic/name`, for exact images with `-seedS-sppN`.
    pub name: String,
    /// Scene file, relative to the repository.
    pub scene: String,
    /// Values for the scene's `$name`.
    pub defines: Vec<(String, String)>,
    /// Size of the picture.
    pub size: [u32; 2],
    /// Seed.
    pub seed: u32,
    /// Samples per pixel of one pass.
    pub spp: u32,
    /// Independent passes.
    pub passes: u32,
    /// Rendered by `scalar_rgb`, which looks filters up in a table.
    pub scalar: bool,
}

/// The tables of a section of the manifest: `image` or `exact`.
pub fn manifest(section: &str) -> Vec<Entry> {
    let text = std::fs::read_to_string(repository("reference/manifest.toml")).expect("manifest");
    let manifest: toml::Table = text.parse().unwrap_or_else(|e| panic!("manifest: {}", toml::de::Error::message(&e)));
    let number = |t: &toml::Table, key: &str| t[key].as_integer().unwrap_or_default() as u32;
    manifest[section]
        .as_table()
        .expect("section")
        .iter()
        .map(|(name, entry)| {
            let t = entry.as_table().expect("table");
            let defines = t.get("define").and_then(|d| d.as_table()).map_or_else(Vec::new, |d| {
                d.iter().map(|(k, v)| (k.clone(), v.as_str().map_or_else(|| v.to_string(), str::to_owned))).collect()
            });
            Entry {
                name: name.clone(),
                scene: t["scene"].as_str().unwrap_or_default().to_owned(),
                defines,
                size: [number(t, "width"), number(t, "height")],
                seed: number(t, "seed"),
                spp: number(t, "spp"),
                passes: number(t, "passes"),
                scalar: t["variant"].as_str() == Some("scalar_rgb"),
            }
        })
        .collect()
}

/// Loads and builds a scene; panics with the scene's own messages if it cannot.
pub fn load(path: &Path, defines: &[(String, String)], change: impl FnOnce(&mut Description)) -> Scene {
    let options = xml::LoadOptions { defines: defines.to_vec(), ..xml::LoadOptions::default() };
    let mut description = xml::load(path, &options).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    resolve::resolve(&mut description).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    upgrade::upgrade(&mut description);
    change(&mut description);
    let built = instantiate(&lucerna::builtin(), description, false);
    built.unwrap_or_else(|e| panic!("{}: {e}", path.display())).scene
}

/// Builds a scene from text; the files it names are looked for in `folder`.
pub fn load_text(text: &str, folder: &Path) -> Scene {
    let options = xml::LoadOptions { search_path: vec![folder.to_owned()], ..xml::LoadOptions::default() };
    let mut description = xml::load_str(text, "scene.xml", &options).unwrap_or_else(|e| panic!("{e}"));
    resolve::resolve(&mut description).unwrap_or_else(|e| panic!("{e}"));
    upgrade::upgrade(&mut description);
    instantiate(&lucerna::builtin(), description, false).unwrap_or_else(|e| panic!("{e}")).scene
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
    let (channels, data) = cx.store.develop(&cx.film);
    let size = cx.store.size();
    (Image { width: size.x, height: size.y, channels, data }, report)
}

/// Reads all channels of an EXR file of the repository.
pub fn read_exr(path: &str) -> Image {
    exr::read(&repository(path), &ReadLimits::default()).unwrap_or_else(|e| panic!("{path}: {e}")).image
}

/// A filter as the reference's scalar variants look it up: 31 values over the radius, the nearest lower one counts.
struct Tabulated {
    radius: f32,
    values: [f32; Tabulated::STEPS + 1],
}

impl Tabulated {
    const STEPS: usize = 31;

    fn new(filter: &dyn Rfilter) -> Self {
        let radius = filter.radius();
        let mut values = [0.0; Self::STEPS + 1];
        for (i, value) in values.iter_mut().take(Self::STEPS).enumerate() {
            *value = filter.eval(radius * i as f32 / Self::STEPS as f32);
        }
        Tabulated { radius, values }
    }
}

impl Rfilter for Tabulated {
    fn radius(&self) -> f32 {
        self.radius
    }

    fn eval(&self, x: f32) -> f32 {
        self.values[((x.abs() * Self::STEPS as f32 / self.radius) as usize).min(Self::STEPS)]
    }
}

/// Looks a filter that is wider than a pixel up as the reference's scalar variants do.
pub fn tabulate_filter(cx: &mut RenderContext<'_>) {
    if !cx.film.filter.is_box() {
        cx.film.filter = Arc::new(Tabulated::new(&*cx.film.filter));
    }
}
