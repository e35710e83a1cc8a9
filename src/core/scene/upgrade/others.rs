//! Integrators and films.

use super::super::description::{NodeId, ObjectKind, Parameter, Value};
use super::{Editor, number};

/// The integrators that both times have.
const KNOWN: [&str; 9] = ["path", "direct", "volpath", "volpathmis", "ptracer", "depth", "aov", "moment", "stokes"];

/// Integrators of 0.x that today has no plugin for. In files of 0.x private ones are treated in the same way.
const GONE: [&str; 15] = [
    "ao",
    "bdpt",
    "erpt",
    "field",
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

/// Reads the public plugin `guided_path` as `path` with the guide `sd_tree`: its parameters, and its defaults where the scene
/// names none. What it has no parameter for (`prior`, `memory`, `environment`, roulette) is as anywhere else.
pub(super) fn guided_path(editor: &mut Editor, node: NodeId) -> Option<String> {
    let guide = editor.add_beside(node, ObjectKind::Guide, "sd_tree");
    let mut word = |name, fallback: &str| match editor.take(node, name) {
        Some(Value::String(text)) => text.to_lowercase(),
        _ => fallback.to_owned(),
    };
    let (nee, combination) = (word("nee", "never"), word("sample_combination", "automatic"));
    let (spatial, directional) = (word("spatial_filter", "nearest"), word("directional_filter", "nearest"));
    let (loss, budget_type) = (word("bsdf_sampling_fraction_loss", "none"), word("budget_type", "seconds"));
    let mut number = |name, fallback| editor.take_number(node, name).unwrap_or(fallback);
    let p_bsdf = number("bsdf_sampling_fraction", 0.5);
    let (spatial_threshold, directional_threshold) =
        (number("s_tree_threshold", 12000.0), number("d_tree_threshold", 0.01));
    let (memory, budget) = (number("sd_tree_max_memory", -1.0), number("budget", -1.0));
    let text = |text: &str| Value::String(text.to_owned());
    editor.set(guide, "nee", text(&nee));
    editor.set(guide, "spatial_filter", text(&spatial));
    editor.set(guide, "directional_filter", text(&directional));
    editor.set(guide, "combination", text(if combination == "inversevar" { "inverse_variance" } else { "last" }));
    if combination == "automatic" {
        editor.set(guide, "ending", text("variance"));
    }
    if loss == "none" {
        editor.set(guide, "p_guide", Value::Float(1.0 - p_bsdf));
    } else {
        editor.set(guide, "least_gain", Value::Float(0.0));
    }
    editor.set(guide, "learning", Value::Float(0.333));
    // It compares with the number times the square root of a quarter of the samples per pixel.
    editor.set(guide, "spatial_threshold", Value::Float(0.5 * spatial_threshold));
    editor.set(guide, "directional_threshold", Value::Float(directional_threshold));
    if memory > 0.0 {
        editor.set(guide, "max_memory", Value::Float(memory));
    }
    for (name, value) in [("direct", Value::Boolean(false)), ("startup", Value::Integer(0))] {
        editor.set(guide, name, value);
    }
    for (name, value) in [("product", text("none")), ("roughness_threshold", Value::Float(0.0))] {
        editor.set(guide, name, value);
    }
    match budget_type.as_str() {
        "spp" if budget >= 1.0 && budget < f64::from(u32::MAX) => {
            let samplers = editor.scene.nodes.iter().enumerate().filter(|(_, n)| n.kind == ObjectKind::Sampler);
            let samplers: Vec<NodeId> = samplers.map(|(index, _)| NodeId(index as u32)).collect();
            for sampler in samplers {
                editor.set(sampler, "sample_count", Value::Integer(budget as i64));
            }
        }
        "seconds" if budget > 0.0 => editor.set(node, "timeout", Value::Float(budget)),
        _ => {}
    }
    let at = editor.scene.node(node).at.clone();
    let integrator = editor.scene.node_mut(node);
    integrator.plugin = "path".to_owned();
    integrator.parameters.push(Parameter { name: "_guide".to_owned(), value: Value::Object(guide), at });
    Some("integrator \"guided_path\" is read as \"path\" with the guide \"sd_tree\"".to_owned())
}
