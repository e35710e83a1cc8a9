//! Surface materials.

use super::super::description::{NodeId, ObjectKind, Value};
use super::{Editor, colour, media, number, scaled};

/// Materials whose colour is all that can be kept.
pub(super) fn to_diffuse(editor: &mut Editor, node: NodeId) -> Option<String> {
    let old = editor.plugin(node).to_owned();
    let names = ["reflectance", "diffuse_reflectance", "transmittance", "albedo", "kd_multiplier"];
    let colour = names.iter().find_map(|name| editor.take(node, name));
    become_plugin(editor, node, "diffuse");
    if let Some(colour) = colour {
        editor.set(node, "reflectance", colour);
    }
    Some(format!("bsdf \"{old}\" is read as \"diffuse\""))
}

/// The width of the lobe of exponent n is that of Beckmann with α = √(2 / (n + 2)) (Walter et al. 2007).
pub(super) fn phong(editor: &mut Editor, node: NodeId) -> Option<String> {
    let exponent = editor.take_number(node, "exponent").unwrap_or(30.0);
    glossy(editor, node, (2.0 / (exponent.max(0.0) + 2.0)).sqrt())
}

/// An anisotropic lobe becomes one of the mean width.
pub(super) fn ward(editor: &mut Editor, node: NodeId) -> Option<String> {
    let [alpha_u, alpha_v] = ["alpha_u", "alpha_v"].map(|name| editor.take_number(node, name).unwrap_or(0.1));
    glossy(editor, node, (alpha_u * alpha_v).max(0.0).sqrt())
}

/// A diffuse base with a glossy lobe. With plain colours that leave room for it, a blend of the two reflects as much as
/// the original did; otherwise rough plastic has to do.
fn glossy(editor: &mut Editor, node: NodeId, alpha: f64) -> Option<String> {
    let old = editor.plugin(node).to_owned();
    let alpha = alpha.clamp(1e-3, 1.0);
    let diffuse = editor.take(node, "diffuse_reflectance").unwrap_or(Value::Float(0.5));
    let specular = editor.take(node, "specular_reflectance").unwrap_or(Value::Float(0.2));
    let brightest = |value: &Value| colour(value).map(|c| c.into_iter().fold(0.0, f64::max));
    if let (Some(below), Some(above)) = (brightest(&diffuse), brightest(&specular))
        && above > 0.0
        && above + below <= 1.0
    {
        let weight = above / (above + below);
        let parts = [
            ("diffuse", "reflectance", &diffuse, 1.0 - weight),
            ("roughconductor", "specular_reflectance", &specular, weight),
        ];
        become_plugin(editor, node, "blendbsdf");
        editor.set(node, "weight", Value::Float(weight));
        for (name, (plugin, slot, value, share)) in ["_arg_0", "_arg_1"].into_iter().zip(parts) {
            let part = editor.add_beside(node, ObjectKind::Bsdf, plugin);
            let value = if share > 0.0 { scaled(value, 1.0 / share) } else { None };
            editor.set(part, slot, value.unwrap_or(Value::Float(0.0)));
            if plugin == "roughconductor" {
                editor.set(part, "material", Value::String("none".to_owned()));
                editor.set(part, "alpha", Value::Float(alpha));
            }
            editor.set(node, name, Value::Object(part));
        }
        return Some(format!("bsdf \"{old}\" is read as \"diffuse\" and \"roughconductor\" in \"blendbsdf\""));
    }
    become_plugin(editor, node, "roughplastic");
    editor.set(node, "diffuse_reflectance", diffuse);
    editor.set(node, "specular_reflectance", specular);
    editor.set(node, "alpha", Value::Float(alpha));
    Some(format!("bsdf \"{old}\" is read as \"roughplastic\""))
}

/// A coat over a diffuse base is plastic; over anything else only the base is kept.
pub(super) fn coating(editor: &mut Editor, node: NodeId) -> Option<String> {
    let old = editor.plugin(node).to_owned();
    let (_, base) = editor.children(node, ObjectKind::Bsdf).into_iter().next()?;
    if editor.plugin(base) != "diffuse" {
        return editor.unwrap_child(node);
    }
    let plastic = if old == "coating" { "plastic" } else { "roughplastic" };
    let base = editor.scene.node(base);
    let colour = ["reflectance", "diffuse_reflectance"].iter().find_map(|name| base.parameter(name));
    let colour = colour.map(|p| p.value.clone());
    let coat = editor.scene.node_mut(node);
    coat.plugin = plastic.to_owned();
    let kept = ["int_ior", "ext_ior", "specular_reflectance", "alpha", "distribution"];
    coat.parameters.retain(|p| kept.contains(&p.name.as_str()) && (plastic == "roughplastic" || p.name != "alpha"));
    if let Some(colour) = colour {
        editor.set(node, "diffuse_reflectance", colour);
    }
    Some(format!("bsdf \"{old}\" over \"diffuse\" is read as \"{plastic}\""))
}

/// A weighted sum of materials becomes nested blends; what is missing to one is black.
pub(super) fn mixture(editor: &mut Editor, node: NodeId) -> Option<String> {
    media::blend(editor, node, ObjectKind::Bsdf, "blendbsdf")
}

/// The factor of a texture around the height map goes into the `scale` of the bump map.
pub(super) fn bump_scale(editor: &mut Editor, node: NodeId) -> Option<String> {
    let (name, texture) = editor.children(node, ObjectKind::Texture).into_iter().next()?;
    if editor.plugin(texture) != "scale" {
        return None;
    }
    let factor = editor.scene.node(texture).parameter("scale").map_or(Some(1.0), |p| number(&p.value))?;
    let (_, height) = editor.children(texture, ObjectKind::Texture).into_iter().next()?;
    let own = editor.take_number(node, "scale").unwrap_or(1.0);
    editor.set(node, "scale", Value::Float(own * factor));
    editor.set(node, &name, Value::Object(height));
    Some("texture \"scale\" in bsdf \"bumpmap\" is read as the \"scale\" of the bump map".to_owned())
}

/// The picture of a normal map has a name today, and holds plain numbers.
pub(super) fn normal_map(editor: &mut Editor, node: NodeId) -> Option<String> {
    let (old, texture) = editor.children(node, ObjectKind::Texture).into_iter().next()?;
    let is_bitmap = editor.plugin(texture) == "bitmap";
    if is_bitmap && editor.is_old(texture) {
        editor.take(texture, "gamma");
        editor.set(texture, "raw", Value::Boolean(true));
    }
    if old == "normalmap" {
        return None;
    }
    let picture = editor.take(node, &old)?;
    editor.set(node, "normalmap", picture);
    Some("the texture of bsdf \"normalmap\" is read as its \"normalmap\"".to_owned())
}

/// `ext_eta`, the index outside of a conductor, divides `eta` and `k`.
pub(super) fn outer_index(editor: &mut Editor, node: NodeId) -> Option<String> {
    let outer = editor.take(node, "ext_eta")?;
    // A name means a gas, near enough to vacuum; a metal by name keeps its own index.
    let index = colour(&outer).map_or(1.0, |c| c[0]);
    if index > 0.0 && index != 1.0 {
        for name in ["eta", "k"] {
            let divided = editor.scene.node(node).parameter(name).and_then(|p| scaled(&p.value, 1.0 / index));
            if let Some(value) = divided {
                editor.set(node, name, value);
            }
        }
    }
    Some("\"ext_eta\" of conductors is divided into \"eta\" and \"k\"".to_owned())
}

/// A conductor without parameters was copper; today it is a perfect mirror.
pub(super) fn copper(editor: &mut Editor, node: NodeId) -> Option<String> {
    let conductor = editor.scene.node(node);
    let given = ["material", "eta", "k"].iter().any(|name| conductor.parameter(name).is_some());
    if given || !editor.is_ancient(node) {
        return None;
    }
    let note = format!("bsdf \"{}\" without a material gets \"Cu\"", conductor.plugin);
    editor.set(node, "material", Value::String("Cu".to_owned()));
    Some(note)
}

/// A textured roughness of `roughplastic` becomes the usual one.
pub(super) fn plain_alpha(editor: &mut Editor, node: NodeId) -> Option<String> {
    let alpha = editor.scene.node(node).parameter("alpha")?;
    if number(&alpha.value).is_some() {
        return None;
    }
    editor.set(node, "alpha", Value::Float(0.1));
    Some("a textured \"alpha\" of bsdf \"roughplastic\" is read as 0.1".to_owned())
}

/// Changes the plugin and drops all parameters.
fn become_plugin(editor: &mut Editor, node: NodeId, plugin: &str) {
    let bsdf = editor.scene.node_mut(node);
    bsdf.plugin = plugin.to_owned();
    bsdf.parameters.clear();
}
