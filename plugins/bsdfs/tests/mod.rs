//! Tests of several BSDFs together.

mod golden;
mod limits;

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, SurfaceHit, Texture};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{
    Built, Constructor, Description, Location, Node, NodeId, Object, ObjectKind, Param, Parameter, Plugin, Properties,
    Registry, SceneErrors, Slot, Value, build_one,
};
use std::sync::Arc;

/// A texture that has the same colour and slope wherever it is looked up, without admitting it.
const FIXED: Plugin = Plugin {
    name: "fixed",
    aliases: &[],
    summary: "test texture",
    params: &[&[
        Param::rgb("color", Slot::Unbounded, 0.5, "colour"),
        Param::rgb("gradient", Slot::Unbounded, 0.0, "slope along u and v").between(f64::MIN, f64::MAX),
    ]],
    build: Constructor::Texture(|p: &Properties<'_>| -> Built<dyn Texture> {
        let gradient = p.rgb("gradient");
        Ok(Arc::new(Fixed { color: p.rgb("color"), gradient: Vec2::new(gradient.r, gradient.g) }))
    }),
};

struct Fixed {
    color: Rgb,
    gradient: Vec2,
}

impl Texture for Fixed {
    fn color(&self, _hit: &SurfaceHit) -> Rgb {
        self.color
    }

    fn scalar(&self, _hit: &SurfaceHit) -> f32 {
        self.color.luminance()
    }

    fn gradient(&self, _hit: &SurfaceHit) -> Vec2 {
        self.gradient
    }

    fn mean(&self) -> f32 {
        self.color.mean()
    }
}

/// Builds a BSDF from the line notation of `golden.txt`; `;` may stand for a line break and `|` for a tab.
fn try_build(lines: &str) -> Result<Arc<dyn Bsdf>, SceneErrors> {
    let mut registry = Registry::new();
    registry.add_all(super::PLUGINS).add(FIXED);
    let at = || Location { file: "test".into(), line: 1, column: 1 };
    let mut description = Description {
        nodes: Vec::new(),
        root: NodeId(0),
        version: [3, 0, 0],
        search_path: Vec::new(),
        notes: Vec::new(),
        warnings: Vec::new(),
        confined_to: None,
        file_versions: Vec::new(),
        sources: Vec::new(),
    };
    let mut open: Vec<NodeId> = Vec::new();
    for line in lines.split(['\n', ';']).map(str::trim).filter(|l| !l.is_empty()) {
        let fields: Vec<&str> = line.split(['\t', '|']).collect();
        let parameter = match fields[..] {
            ["end"] => {
                open.pop();
                continue;
            }
            [kind, plugin] => {
                // `texture:slot` gives a texture a slot to fill.
                let (kind, slot) = kind.split_once(':').unwrap_or((kind, ""));
                let child = description.add(Node {
                    kind: ObjectKind::from_tag(kind).unwrap(),
                    plugin: plugin.to_owned(),
                    id: None,
                    parameters: Vec::new(),
                    at: at(),
                    included_from: Vec::new(),
                });
                let parent = open.last().copied();
                open.push(child);
                let Some(parent) = parent else { continue };
                let count = description.node(parent).parameters.len();
                let name = if slot.is_empty() { format!("_arg_{count}") } else { slot.to_owned() };
                description.node_mut(parent).parameters.push(Parameter { name, value: Value::Object(child), at: at() });
                continue;
            }
            [ty, name, text] => {
                let value = match ty {
                    "float" => Value::Float(text.parse().unwrap()),
                    "boolean" => Value::Boolean(text == "true"),
                    "string" => Value::String(text.to_owned()),
                    _ => Value::Rgb(<[f64; 3]>::try_from(numbers(text)).unwrap()),
                };
                Parameter { name: name.to_owned(), value, at: at() }
            }
            _ => panic!("cannot read {line:?}"),
        };
        description.node_mut(*open.last().unwrap()).parameters.push(parameter);
    }
    match build_one(&registry, &description)? {
        Object::Bsdf(bsdf) => Ok(bsdf),
        _ => panic!("not a BSDF: {lines}"),
    }
}

fn build(lines: &str) -> Arc<dyn Bsdf> {
    try_build(lines).unwrap_or_else(|errors| panic!("{lines}: {errors}"))
}

/// A direction of a given cosine with z, at an angle that is in no plane of symmetry.
fn direction(cos_theta: f32) -> Vec3 {
    let sin = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let (s, c) = 0.7f32.sin_cos();
    Vec3::new(sin * c, sin * s, cos_theta)
}

fn hit(wi: Vec3) -> SurfaceHit {
    SurfaceHit { wi, ..SurfaceHit::default() }
}

fn numbers(text: &str) -> Vec<f64> {
    text.split([' ', ',']).filter(|t| !t.is_empty()).map(|t| t.parse().unwrap()).collect()
}
