//! Media, phase functions, and the surfaces that bound a medium.

use super::super::description::{NodeId, ObjectKind, Parameter, Value};
use super::{Editor, colour, colour_value};

/// `sigma_s` and `sigma_a` become `sigma_t` and `albedo`. A coloured extinction beyond 1 is not allowed, so its
/// magnitude goes into `scale`.
pub(super) fn extinction(editor: &mut Editor, node: NodeId) -> Option<String> {
    let medium = editor.scene.node(node);
    let given = |name| medium.parameter(name).map(|p| p.value.clone());
    let note = match (given("sigma_s"), given("sigma_a")) {
        (None, None) => None,
        (scattering, absorption) => {
            let scattering = colour(&scattering.unwrap_or(Value::Float(0.0)))?;
            let absorption = colour(&absorption.unwrap_or(Value::Float(0.0)))?;
            let extinction = [0, 1, 2].map(|i| scattering[i] + absorption[i]);
            let albedo = [0, 1, 2].map(|i| if extinction[i] > 0.0 { scattering[i] / extinction[i] } else { 0.0 });
            editor.take(node, "sigma_s");
            editor.take(node, "sigma_a");
            editor.set(node, "sigma_t", colour_value(extinction));
            editor.set(node, "albedo", colour_value(albedo));
            Some("\"sigma_s\" and \"sigma_a\" are read as \"sigma_t\" and \"albedo\"".to_owned())
        }
    };
    let extinction = editor.scene.node(node).parameter("sigma_t").map(|p| p.value.clone());
    if let Some(Value::Rgb(extinction)) = extinction {
        let most = extinction.into_iter().fold(0.0, f64::max);
        if most > 1.0 {
            let scale = editor.take_number(node, "scale").unwrap_or(1.0);
            editor.set(node, "sigma_t", colour_value(extinction.map(|s| s / most)));
            editor.set(node, "scale", Value::Float(scale * most));
        }
    }
    note
}

/// `g` on the medium itself is the phase function `hg`.
pub(super) fn henyey_greenstein(editor: &mut Editor, node: NodeId) -> Option<String> {
    let g = editor.take_number(node, "g")?;
    if editor.children(node, ObjectKind::Phase).is_empty() && g != 0.0 {
        let phase = editor.add_beside(node, ObjectKind::Phase, "hg");
        editor.set(phase, "g", Value::Float(g));
        editor.set(node, "phase", Value::Object(phase));
    }
    Some("\"g\" of the medium is read as phase \"hg\"".to_owned())
}

/// Phase functions of fibres become isotropic.
pub(super) fn isotropic(editor: &mut Editor, node: NodeId) -> Option<String> {
    let phase = editor.scene.node_mut(node);
    phase.parameters.clear();
    let old = std::mem::replace(&mut phase.plugin, "isotropic".to_owned());
    Some(format!("phase \"{old}\" is read as \"isotropic\""))
}

/// A weighted sum of phase functions becomes nested blends of two.
pub(super) fn mixture(editor: &mut Editor, node: NodeId) -> Option<String> {
    blend(editor, node, ObjectKind::Phase, "blendphase")
}

/// Rewrites a sum with `weights` into nested blends of two. Weights are made to add up to one.
pub(super) fn blend(editor: &mut Editor, node: NodeId, kind: ObjectKind, plugin: &str) -> Option<String> {
    let children = editor.children(node, kind);
    let old = editor.plugin(node).to_owned();
    let weights: Vec<f64> = match &editor.scene.node(node).parameter("weights")?.value {
        Value::String(text) => text
            .split([',', ' ', '\t', '\n'])
            .filter(|item| !item.is_empty())
            .map(|item| item.parse().ok().filter(|weight: &f64| weight.is_finite() && *weight >= 0.0))
            .collect::<Option<_>>()?,
        value => vec![super::number(value)?],
    };
    if weights.len() != children.len() || children.is_empty() {
        return None;
    }
    if let [(_, only)] = children[..] {
        editor.become_copy_of(node, only);
        return Some(format!("{} \"{old}\" of one gives way to it", kind.tag()));
    }
    let mut parts: Vec<_> = weights.into_iter().zip(children.into_iter().map(|(_, child)| child)).collect();
    let sum: f64 = parts.iter().map(|part| part.0).sum();
    if kind == ObjectKind::Bsdf && sum < 1.0 - 1e-6 {
        let black = editor.add_beside(node, ObjectKind::Bsdf, "diffuse");
        editor.set(black, "reflectance", Value::Float(0.0));
        parts.push((1.0 - sum, black));
    }
    // From the back: the last two make a blend, which is one part beside the part before them, and so on.
    let mut rest = parts.pop()?;
    while let Some((weight, child)) = parts.pop() {
        let target = if parts.is_empty() { node } else { editor.add_beside(node, kind, plugin) };
        let sum = weight + rest.0;
        let second = if sum > 0.0 { rest.0 / sum } else { 0.5 };
        let at = editor.scene.node(node).at.clone();
        let parameter = |name: &str, value| Parameter { name: name.to_owned(), value, at: at.clone() };
        let blend = editor.scene.node_mut(target);
        blend.plugin = plugin.to_owned();
        blend.parameters = vec![
            parameter("weight", Value::Float(second)),
            parameter("_arg_0", Value::Object(child)),
            parameter("_arg_1", Value::Object(rest.1)),
        ];
        rest = (sum, target);
    }
    Some(format!("{} \"{old}\" is read as nested \"{plugin}\"", kind.tag()))
}

/// A surface that bounds a medium and has no material let light through unchanged; today it would be grey.
pub(super) fn invisible_boundary(editor: &mut Editor, node: NodeId) -> Option<String> {
    let has = |kind| !editor.children(node, kind).is_empty();
    if !has(ObjectKind::Medium) || has(ObjectKind::Bsdf) || has(ObjectKind::Emitter) || has(ObjectKind::Sensor) {
        return None;
    }
    let boundary = editor.add_beside(node, ObjectKind::Bsdf, "null");
    editor.set(node, "bsdf", Value::Object(boundary));
    Some("a shape with a medium and no material gets bsdf \"null\"".to_owned())
}
