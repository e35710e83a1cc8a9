//! What the tests of emitters and textures share.

use lucerna_core::interfaces::Emitter;
use lucerna_core::math::{DMat4, Vec2, Vec3};
use lucerna_core::scene::{
    Description, Location, Node, NodeId, Object, ObjectKind, Parameter, SceneErrors, Value, build_one,
};
use std::path::PathBuf;
use std::sync::Arc;

fn parameter(name: &str, value: Value) -> Parameter {
    Parameter { name: name.to_owned(), value, at: Location::file("test.xml") }
}

pub(crate) fn float(name: &str, value: f64) -> Parameter {
    parameter(name, Value::Float(value))
}

pub(crate) fn rgb(name: &str, value: [f64; 3]) -> Parameter {
    parameter(name, Value::Rgb(value))
}

pub(crate) fn vector(name: &str, value: [f64; 3]) -> Parameter {
    parameter(name, Value::Vector(value))
}

pub(crate) fn matrix(name: &str, value: DMat4) -> Parameter {
    parameter(name, Value::Transform(value))
}

pub(crate) fn text(name: &str, value: &str) -> Parameter {
    parameter(name, Value::String(value.to_owned()))
}

/// An object of a plugin of this package.
pub(crate) fn build(kind: ObjectKind, plugin: &str, parameters: Vec<Parameter>) -> Result<Object, SceneErrors> {
    build_nested(vec![node(kind, plugin, parameters)])
}

/// The light of a shape, made of both their parameters; the light may have a texture.
pub(crate) fn light_of(
    shape: (&str, Vec<Parameter>),
    mut light: Vec<Parameter>,
    texture: Option<Vec<Parameter>>,
) -> Arc<dyn Emitter> {
    let child = |name: &str, index| parameter(name, Value::Object(NodeId(index)));
    let mut nodes = vec![node(ObjectKind::Shape, shape.0, shape.1), node(ObjectKind::Emitter, "area", Vec::new())];
    nodes[0].parameters.push(child("_arg_0", 1));
    if let Some(texture) = texture {
        light.push(child("radiance", 2));
        nodes.push(node(ObjectKind::Texture, "bitmap", texture));
    }
    nodes[1].parameters = light;
    match build_nested(nodes) {
        Ok(Object::Shape(built)) => built.emitter.expect("the shape has a light"),
        Ok(_) => unreachable!("a shape was asked for"),
        Err(errors) => panic!("{errors}"),
    }
}

fn node(kind: ObjectKind, plugin: &str, parameters: Vec<Parameter>) -> Node {
    Node {
        kind,
        plugin: plugin.to_owned(),
        id: None,
        parameters,
        at: Location::file("test.xml"),
        included_from: Vec::new(),
    }
}

/// The first node, which nests the others.
fn build_nested(nodes: Vec<Node>) -> Result<Object, SceneErrors> {
    let description = Description {
        nodes,
        root: NodeId(0),
        version: [3, 0, 0],
        search_path: vec![PathBuf::from(".")],
        notes: Vec::new(),
        warnings: Vec::new(),
        confined_to: None,
        file_versions: Vec::new(),
        sources: Vec::new(),
    };
    build_one(&crate::builtin(), &description)
}

pub(crate) fn emitter(plugin: &str, parameters: Vec<Parameter>) -> Result<Arc<dyn Emitter>, SceneErrors> {
    match build(ObjectKind::Emitter, plugin, parameters)? {
        Object::Emitter(emitter) => Ok(emitter),
        _ => unreachable!("an emitter was asked for"),
    }
}

/// What is said about a wrong emitter.
pub(crate) fn errors(plugin: &str, parameters: Vec<Parameter>) -> String {
    emitter(plugin, parameters).err().expect("the parameters are wrong").to_string()
}

/// The values of the test pictures of reference/golden_lights.py, exact in single precision.
pub(crate) fn pattern(width: u32, height: u32, channels: u32) -> Vec<f32> {
    let [width, height, channels] = [width, height, channels].map(u64::from);
    (0..width * height * channels)
        .map(|i| {
            let (x, y, c) = (i / channels % width, i / channels / width, i % channels);
            ((7 * x * x + 13 * y + 5 * c + x * y) % 11) as f32 / 4.0
        })
        .collect()
}

/// The lines of a golden table for one case: the numbers after the name.
pub(crate) fn golden(table: &'static str, case: &str) -> impl Iterator<Item = Vec<f32>> {
    let lines: Vec<_> = table
        .lines()
        .filter_map(|line| line.strip_prefix(case)?.strip_prefix(' '))
        .map(|line| line.split(' ').map(|v| v.parse().expect("a number")).collect::<Vec<f32>>())
        .collect();
    assert!(!lines.is_empty(), "no golden values of {case}");
    lines.into_iter()
}

/// Equal to 2e-5, relatively or absolutely.
pub(crate) fn assert_close(a: &[f32], b: &[f32], what: &str) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= 2e-5 * b.abs().max(1.0), "{what}: {a} is not {b}");
    }
}

/// `sample_direct` gives what reference/golden_lights.py got: point, two numbers → direction, distance (0 if
/// infinite), density, weight.
pub(crate) fn assert_golden(light: &dyn Emitter, case: &str) {
    for line in golden(include_str!("golden.txt"), case) {
        let (input, expected) = line.split_at(5);
        let (from, u2) = (Vec3::from_slice(input), Vec2::from_slice(&input[3..]));
        let got = light.sample_direct(from, u2).map_or([0.0; 8], |s| {
            let distance = if s.point.distance.is_finite() { s.point.distance } else { 0.0 };
            let (d, w) = (s.point.d, s.weight);
            [d.x, d.y, d.z, distance, s.pdf, w.r, w.g, w.b]
        });
        assert_close(&got[5..], &expected[5..], case);
        if got[5..] != [0.0; 3] {
            assert_close(&got[..5], &expected[..5], case);
        }
    }
}
