//! Textures.

use super::super::description::{NodeId, ObjectKind, Value};
use super::{Editor, number, scaled};
use glam::{DMat4, DVec3};

/// A texture that scales another one: the factor goes into the colours of the inner one where it has any.
pub(super) fn fold_scale(editor: &mut Editor, node: NodeId) -> Option<String> {
    let (_, inner) = editor.children(node, ObjectKind::Texture).into_iter().next()?;
    let factor = editor.take_number(node, "scale").unwrap_or(1.0);
    editor.become_copy_of(node, inner);
    let colours: &[(&str, f64)] = match editor.plugin(node) {
        "checkerboard" => &[("color0", 0.4), ("color1", 0.2)],
        "uniform" => &[("value", 1.0)],
        _ => &[],
    };
    let mut lost = colours.is_empty() && factor != 1.0;
    for (name, default) in colours {
        let value = editor.scene.node(node).parameter(name).map_or(Value::Float(*default), |p| p.value.clone());
        match scaled(&value, factor) {
            Some(value) => editor.set(node, name, value),
            None => lost = true,
        }
    }
    let plugin = editor.plugin(node);
    Some(match lost {
        true => format!("the factor {factor} of texture \"scale\" around \"{plugin}\" is lost"),
        false => format!("texture \"scale\" is multiplied into the \"{plugin}\" inside it"),
    })
}

/// `uscale`, `vscale`, `uoffset`, `voffset` become `to_uv` = scale · translate, as in the reference.
pub(super) fn uv_transform(editor: &mut Editor, node: NodeId) -> Option<String> {
    let both = editor.take_number(node, "uvscale");
    let [u_scale, v_scale] = ["uscale", "vscale"].map(|name| editor.take_number(node, name).or(both));
    let [u_offset, v_offset] = ["uoffset", "voffset"].map(|name| editor.take_number(node, name));
    if [u_scale, v_scale, u_offset, v_offset].iter().all(Option::is_none) {
        return None;
    }
    let scale = DMat4::from_scale(DVec3::new(u_scale.unwrap_or(1.0), v_scale.unwrap_or(1.0), 1.0));
    let translate = DMat4::from_translation(DVec3::new(u_offset.unwrap_or(0.0), v_offset.unwrap_or(0.0), 0.0));
    editor.set(node, "to_uv", Value::Transform(scale * translate));
    Some("\"uscale\", \"vscale\", \"uoffset\", \"voffset\" are read as \"to_uv\"".to_owned())
}

/// A picture with gamma 1 is taken as it is; −1, sRGB and 2.2 mean what happens anyway.
pub(super) fn gamma(editor: &mut Editor, node: NodeId) -> Option<String> {
    let gamma = number(&editor.scene.node(node).parameter("gamma")?.value)?;
    editor.take(node, "gamma");
    if gamma == 1.0 {
        editor.set(node, "raw", Value::Boolean(true));
        return Some("gamma 1 of texture \"bitmap\" is read as \"raw\"".to_owned());
    }
    Some(format!("gamma {gamma} of texture \"bitmap\" is read as sRGB"))
}

/// Colours at the vertices of a mesh.
pub(super) fn vertex_colours(editor: &mut Editor, node: NodeId) -> Option<String> {
    let texture = editor.scene.node_mut(node);
    texture.plugin = "mesh_attribute".to_owned();
    texture.parameters.clear();
    editor.set(node, "name", Value::String("vertex_color".to_owned()));
    Some("texture \"vertexcolors\" is read as \"mesh_attribute\"".to_owned())
}

/// Procedural textures that are gone become a board with fields of one colour.
pub(super) fn to_plain(editor: &mut Editor, node: NodeId) -> Option<String> {
    let old = editor.plugin(node).to_owned();
    let names = ["color0", "interior_color", "color1"];
    let colour = names.iter().find_map(|name| editor.take(node, name)).unwrap_or(Value::Float(0.5));
    let texture = editor.scene.node_mut(node);
    texture.plugin = "checkerboard".to_owned();
    texture.parameters.clear();
    editor.set(node, "color0", colour.clone());
    editor.set(node, "color1", colour);
    Some(format!("texture \"{old}\" is read as one colour"))
}
