//! Integrators and films.

use super::super::description::{NodeId, ObjectKind, Value};
use super::{Editor, number};

/// The integrators that both times have.
const KNOWN: [&str; 9] = ["path", "direct", "volpath", "volpathmis", "ptracer", "depth", "aov", "moment", "stokes"];

/// Integrators of 0.x that today has no plugin for. In files of 0.x private ones are treated in the same way.
const GONE: [&str; 16] = [
    "ao",
    "bdpt",
    "erpt",
    "field",
    "guided_path",
    "mlt",
    "photonmapper",
    "ppm",
    "progressive_photon_mapping",
    "pssmlt",
    "sppm",
    "vpl",
    "vcm",
    "pmlt",
    "mmlt",
    "upm",
];

/// Reads an integrator that is gone as `path`, or `volpath` if the scene has a medium.
pub(super) fn unknown_integrator(editor: &mut Editor, node: NodeId) -> Option<String> {
    let old = editor.plugin(node).to_owned();
    let private = editor.is_ancient(node) && !KNOWN.contains(&old.as_str());
    if !private && !GONE.contains(&old.as_str()) {
        return None;
    }
    let has_medium = editor.scene.nodes.iter().any(|node| node.kind == ObjectKind::Medium);
    let new = if has_medium { "volpath" } else { "path" };
    editor.scene.node_mut(node).plugin = new.to_owned();
    Some(format!("integrator \"{old}\" is read as \"{new}\""))
}

/// `shading_samples` sets both other counts and excludes them.
pub(super) fn shading_samples(editor: &mut Editor, node: NodeId) -> Option<String> {
    let integrator = editor.scene.node(node);
    let given = ["emitter_samples", "bsdf_samples"].iter().any(|name| integrator.parameter(name).is_some());
    let both = given && integrator.parameter("shading_samples").is_some();
    both.then(|| {
        editor.take(node, "shading_samples");
        "\"shading_samples\" is left out beside emitter_samples and bsdf_samples".to_owned()
    })
}

/// Roulette from depth 0 on was allowed; today it begins at 1, which is the same: the camera ray is never stopped.
pub(super) fn positive_rr_depth(editor: &mut Editor, node: NodeId) -> Option<String> {
    let depth = number(&editor.scene.node(node).parameter("rr_depth")?.value)?;
    (depth < 1.0).then(|| {
        editor.set(node, "rr_depth", Value::Integer(1));
        format!("rr_depth {depth} is read as 1")
    })
}

/// Drops file formats that hold no linear values, and lists of pixel formats but for their first item.
pub(super) fn file_format(editor: &mut Editor, node: NodeId) -> Option<String> {
    let text = |editor: &Editor, name| match editor.scene.node(node).parameter(name).map(|p| p.value.clone()) {
        Some(Value::String(text)) => Some(text),
        _ => None,
    };
    if let Some(formats) = text(editor, "pixel_format")
        && let Some((first, _)) = formats.split_once(',')
    {
        editor.set(node, "pixel_format", Value::String(first.trim().to_owned()));
        editor.take(node, "channel_names");
    }
    let format = text(editor, "file_format")?;
    if ["openexr", "exr", "rgbe", "pfm"].iter().any(|good| format.eq_ignore_ascii_case(good)) {
        return None;
    }
    editor.take(node, "file_format");
    Some(format!("file_format \"{format}\" is left out"))
}

/// Integrators that ran another one give way to it.
pub(super) fn unwrap_integrator(editor: &mut Editor, node: NodeId) -> Option<String> {
    editor.unwrap_child(node)
}
