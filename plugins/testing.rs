//! Descriptions written by hand, for tests.

use lucerna_core::math::DMat4;
use lucerna_core::scene::{
    Description, Location, Node, NodeId, Object, ObjectKind, Parameter, SceneErrors, Value, build_one,
};

/// A description under construction; the node added last is the root.
pub struct Draft(Description);

impl Draft {
    pub fn new(kind: ObjectKind, plugin: &str) -> Self {
        let empty = Description {
            nodes: Vec::new(),
            root: NodeId(0),
            version: [3, 9, 1],
            search_path: vec![concat!(env!("CARGO_MANIFEST_DIR"), "/shapes/golden").into()],
            notes: Vec::new(),
            warnings: Vec::new(),
            confined_to: None,
            file_versions: Vec::new(),
            sources: Vec::new(),
        };
        Draft(empty).node(kind, plugin)
    }

    fn node(mut self, kind: ObjectKind, plugin: &str) -> Self {
        let node = Node {
            kind,
            plugin: plugin.to_owned(),
            id: None,
            parameters: Vec::new(),
            at: Location::default(),
            included_from: Vec::new(),
        };
        self.0.root = self.0.add(node);
        self
    }

    pub fn set(mut self, name: &str, value: Value) -> Self {
        let parameter = Parameter { name: name.to_owned(), value, at: Location::default() };
        let root = self.0.root;
        self.0.node_mut(root).parameters.push(parameter);
        self
    }

    pub fn float(self, name: &str, value: f64) -> Self {
        self.set(name, Value::Float(value))
    }

    pub fn int(self, name: &str, value: i64) -> Self {
        self.set(name, Value::Integer(value))
    }

    pub fn bool(self, name: &str, value: bool) -> Self {
        self.set(name, Value::Boolean(value))
    }

    pub fn string(self, name: &str, value: &str) -> Self {
        self.set(name, Value::String(value.to_owned()))
    }

    #[expect(clippy::wrong_self_convention, reason = "named after the parameter it sets")]
    pub fn to_world(self, matrix: DMat4) -> Self {
        self.set("to_world", Value::Transform(matrix))
    }

    /// Nests another draft's root.
    pub fn child(mut self, mut other: Draft) -> Self {
        let shift = self.0.nodes.len() as u32;
        for node in &mut other.0.nodes {
            for parameter in &mut node.parameters {
                if let Value::Object(id) = &mut parameter.value {
                    id.0 += shift;
                }
            }
        }
        let child = NodeId(other.0.root.0 + shift);
        self.0.nodes.extend(other.0.nodes);
        let name = format!("_arg_{}", self.0.nodes.len());
        self.set(&name, Value::Object(child))
    }

    pub fn build(&self) -> Result<Object, SceneErrors> {
        build_one(&crate::builtin(), &self.0)
    }

    /// The one-line errors of something that must not build.
    pub fn errors(&self) -> String {
        self.build().err().expect("must not build").to_string()
    }
}
