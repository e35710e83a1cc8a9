//! From a scene file to a picture, and to a file that is kept: the steps that `check` and `compare` share.

use lucerna_core::image::{Image, exr};
use lucerna_core::render::{Budget, Control, RenderContext, RenderError};
use lucerna_core::scene::{Description, Scene, SceneErrors, xml};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A scene as it was read, in today's language.
pub(crate) struct Source {
    pub description: Description,
    /// All files it depends on.
    pub files: Vec<PathBuf>,
}

/// Reads a scene.
pub(crate) fn read(path: &Path, reading: &xml::LoadOptions) -> Result<Source, SceneErrors> {
    let description = xml::load(path, reading)?;
    // What is not used is dropped with the next step.
    let files = description.files();
    Ok(Source { description: xml::upgraded(description)?, files })
}

/// Errors of a scene as one line: what is not built, else the first, and how many there are.
pub(crate) fn one_line(errors: &SceneErrors) -> String {
    let first = errors.0.iter().find(|e| e.message.contains(NOT_BUILT)).or(errors.0.first());
    let text = first.map_or_else(|| "the scene cannot be read".to_owned(), ToString::to_string);
    match errors.0.len() {
        0 | 1 => text,
        count => format!("{text} (and {} more)", count - 1),
    }
}

/// In messages on plugins that are known but not built.
pub(crate) const NOT_BUILT: &str = "not built";

/// A picture in memory.
pub(crate) struct Rendered {
    pub image: Image,
    /// Seconds from the empty film to the last sample.
    pub seconds: f64,
    /// Samples that were dropped.
    pub bad: u64,
}

/// Renders the first sensor of a scene, which has one and an integrator. `change` sets what else a context has.
pub(crate) fn render(
    scene: &Scene,
    spp: u32,
    seed: u32,
    change: impl FnOnce(&mut RenderContext<'_>),
) -> Result<Rendered, RenderError> {
    let missing = |what: &str| RenderError(format!("the scene has no {what}"));
    let integrator = scene.integrator().ok_or_else(|| missing("integrator"))?;
    let camera = scene.sensors().first().ok_or_else(|| missing("sensor"))?;
    let control = Control::new();
    let started = Instant::now();
    let mut cx = RenderContext::new(scene, camera, Budget::Samples(spp), seed, &control, integrator.aov_names());
    change(&mut cx);
    let report = integrator.render(&mut cx)?;
    let seconds = started.elapsed().as_secs_f64();
    Ok(Rendered { image: cx.picture(), seconds, bad: report.bad.count })
}

/// Writes a picture, as a whole or not at all.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn write_exr(path: &Path, image: &Image) -> Result<(), String> {
    let part = path.with_extension("part.exr");
    exr::write(&part, image, &exr::ExrOptions::default()).map_err(|e| format!("{}: {e}", part.display()))?;
    std::fs::rename(&part, path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes a document, as a whole or not at all.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn write_json(path: &Path, value: &Value) -> Result<(), String> {
    let part = path.with_extension("part");
    std::fs::write(&part, format!("{value:#}\n")).map_err(|e| format!("{}: {e}", part.display()))?;
    std::fs::rename(&part, path).map_err(|e| format!("{}: {e}", path.display()))
}
