//! A scene as written: a tree of objects with parameters, each of which knows where it stands.
//!
//! Everything that makes a scene (the XML parser, the upgrade of old files, `convert`, tests) meets in this type,
//! and [`instantiate`](super::instantiate) is the only way on. Nodes live in one table and refer to each other by
//! [`NodeId`], so that a material used by a thousand shapes is one node.

use super::error::Location;
use crate::io::plain_io_error;
use glam::DMat4;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What an object is for: the XML tag of an object, and the registry table its `type` is looked up in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ObjectKind {
    /// `<scene>`
    Scene,
    /// `<integrator>`
    Integrator,
    /// `<sensor>`
    Sensor,
    /// `<film>`
    Film,
    /// `<rfilter>`: a reconstruction filter
    Rfilter,
    /// `<sampler>`
    Sampler,
    /// `<emitter>`
    Emitter,
    /// `<shape>`
    Shape,
    /// `<bsdf>`
    Bsdf,
    /// `<texture>`, and `<spectrum type="…">`
    Texture,
    /// `<volume>`
    Volume,
    /// `<medium>`
    Medium,
    /// `<phase>`
    Phase,
    /// `<guide>`: which direction a path takes
    Guide,
    /// `<light_sampler>`: which light a vertex connects to
    LightSampler,
    /// `<roulette>`: whether a path goes on, stops or splits
    Roulette,
    /// `<cache>`: where a path ends in stored radiance
    Cache,
}

impl ObjectKind {
    /// All kinds, in the order of the manual.
    pub const ALL: [ObjectKind; 17] = [
        ObjectKind::Scene,
        ObjectKind::Integrator,
        ObjectKind::Sensor,
        ObjectKind::Film,
        ObjectKind::Rfilter,
        ObjectKind::Sampler,
        ObjectKind::Emitter,
        ObjectKind::Shape,
        ObjectKind::Bsdf,
        ObjectKind::Texture,
        ObjectKind::Volume,
        ObjectKind::Medium,
        ObjectKind::Phase,
        ObjectKind::Guide,
        ObjectKind::LightSampler,
        ObjectKind::Roulette,
        ObjectKind::Cache,
    ];

    /// The XML tag.
    pub const fn tag(self) -> &'static str {
        match self {
            ObjectKind::Scene => "scene",
            ObjectKind::Integrator => "integrator",
            ObjectKind::Sensor => "sensor",
            ObjectKind::Film => "film",
            ObjectKind::Rfilter => "rfilter",
            ObjectKind::Sampler => "sampler",
            ObjectKind::Emitter => "emitter",
            ObjectKind::Shape => "shape",
            ObjectKind::Bsdf => "bsdf",
            ObjectKind::Texture => "texture",
            ObjectKind::Volume => "volume",
            ObjectKind::Medium => "medium",
            ObjectKind::Phase => "phase",
            ObjectKind::Guide => "guide",
            ObjectKind::LightSampler => "light_sampler",
            ObjectKind::Roulette => "roulette",
            ObjectKind::Cache => "cache",
        }
    }

    /// The kind of an XML tag, if the tag names an object. `<spectrum>` is an object only when it has a `type`;
    /// the parser decides that.
    pub fn from_tag(tag: &str) -> Option<ObjectKind> {
        Self::ALL.into_iter().find(|kind| kind.tag() == tag)
    }
}

/// Index of a node in its [`Description`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub u32);

/// A spectrum as written.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumValue {
    /// The same value at every wavelength (equal energy; *not* white in RGB).
    Uniform(f64),
    /// `(wavelength in nm, value)`, strictly increasing, at least two. Files are read when they are parsed.
    Table(Vec<(f64, f64)>),
    /// Black-body radiation at a temperature in kelvin, times a scale (0.x scenes' `<blackbody>`).
    Blackbody {
        /// Kelvin.
        temperature: f64,
        /// Factor on the radiance.
        scale: f64,
    },
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `<float>`; always finite
    Float(f64),
    /// `<integer>`
    Integer(i64),
    /// `<boolean>`
    Boolean(bool),
    /// `<string>`
    String(String),
    /// `<point>` and `<vector>`
    Vector([f64; 3]),
    /// `<rgb>`: linear sRGB primaries
    Rgb([f64; 3]),
    /// `<spectrum>` without a `type`
    Spectrum(SpectrumValue),
    /// `<transform>`, composed in double precision
    Transform(DMat4),
    /// `<ref>` before resolution
    Reference(String),
    /// A nested object, or a reference after resolution
    Object(NodeId),
}

impl Value {
    /// The type as error messages name it.
    pub fn type_name(&self) -> &'static str {
        match self {
            Value::Float(_) => "float",
            Value::Integer(_) => "integer",
            Value::Boolean(_) => "boolean",
            Value::String(_) => "string",
            Value::Vector(_) => "vector",
            Value::Rgb(_) => "rgb",
            Value::Spectrum(_) => "spectrum",
            Value::Transform(_) => "transform",
            Value::Reference(_) => "reference",
            Value::Object(_) => "object",
        }
    }
}

/// One named parameter of an object, or one nested object.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// The name; nested objects without one are called `_arg_0`, `_arg_1`, … in the order of the file.
    pub name: String,
    /// The value.
    pub value: Value,
    /// Where it stands.
    pub at: Location,
}

/// One object of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its XML tag.
    pub kind: ObjectKind,
    /// Its `type`: the plugin. Empty on `<scene>`.
    pub plugin: String,
    /// Its `id`, if it has one.
    pub id: Option<String>,
    /// Parameters and nested objects in the order of the file.
    pub parameters: Vec<Parameter>,
    /// Where it stands.
    pub at: Location,
    /// The includes that led here, innermost first, as `included from top.xml:3:3`. Empty in the main file.
    pub included_from: Vec<String>,
}

impl Node {
    /// The parameter of that name.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// Takes the parameter of that name out of the node.
    pub fn take(&mut self, name: &str) -> Option<Parameter> {
        let index = self.parameters.iter().position(|p| p.name == name)?;
        Some(self.parameters.remove(index))
    }

    /// The node as error messages name it: `bsdf "wood"`, or `bsdf of type "diffuse"` if it has no id.
    pub fn title(&self) -> String {
        match (&self.id, self.plugin.as_str()) {
            (Some(id), _) => format!("{} \"{id}\"", self.kind.tag()),
            (None, "") => self.kind.tag().to_owned(),
            (None, plugin) => format!("{} of type \"{plugin}\"", self.kind.tag()),
        }
    }
}

/// A whole scene as written.
#[derive(Clone, Debug)]
pub struct Description {
    /// All nodes; order is of no meaning, parents hold the order of their children.
    pub nodes: Vec<Node>,
    /// The root, normally a `<scene>`.
    pub root: NodeId,
    /// The `version` of the main file: major, minor, patch.
    pub version: [u32; 3],
    /// The folders in which relative file names are looked up, first match wins.
    pub search_path: Vec<PathBuf>,
    /// What was rewritten or should be looked at, one line each; shown under `-v`.
    pub notes: Vec<String>,
    /// What the user should see in any case, one line each.
    pub warnings: Vec<String>,
    /// Files outside this folder are refused, however they are named.
    pub confined_to: Option<PathBuf>,
    /// The `version` of each included file where it differs from that of the main file, by the file's name as in
    /// [`Location`].
    pub file_versions: Vec<(Arc<str>, [u32; 3])>,
    /// The files this was read from: the scene, what it includes, and spectra. A file may occur several times.
    pub sources: Vec<PathBuf>,
}

impl Description {
    /// A description of one object alone.
    pub fn of(node: Node) -> Self {
        Description {
            nodes: vec![node],
            root: NodeId(0),
            version: [3, 0, 0],
            search_path: Vec::new(),
            notes: Vec::new(),
            warnings: Vec::new(),
            confined_to: None,
            file_versions: Vec::new(),
            sources: Vec::new(),
        }
    }

    /// Gives every film another size; a crop window is dropped. `option` is what messages name as its place.
    pub fn resize_films(&mut self, size: [u32; 2], option: &str) {
        for node in self.nodes.iter_mut().filter(|node| node.kind == ObjectKind::Film) {
            for name in ["width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y"] {
                node.take(name);
            }
            for (name, value) in [("width", size[0]), ("height", size[1])] {
                let (name, at) = (name.to_owned(), Location::file(option));
                node.parameters.push(Parameter { name, value: Value::Integer(value.into()), at });
            }
        }
    }

    /// Every existing file the scene depends on: its [`sources`](Self::sources), and what its objects name as
    /// `filename`. Complete only before [`resolve`](super::resolve) drops what is not used.
    pub fn files(&self) -> Vec<PathBuf> {
        let named = self.nodes.iter().flat_map(|node| &node.parameters).filter_map(|p| match &p.value {
            Value::String(name) if p.name == "filename" => self.find_file(name),
            _ => None,
        });
        let files: BTreeSet<PathBuf> = self.sources.iter().cloned().chain(named).collect();
        files.into_iter().collect()
    }

    /// A node.
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.0 as usize]
    }

    /// A node, to be changed.
    pub fn node_mut(&mut self, id: NodeId) -> &mut Node {
        &mut self.nodes[id.0 as usize]
    }

    /// Adds a node and says under which number.
    pub fn add(&mut self, node: Node) -> NodeId {
        self.nodes.push(node);
        NodeId(self.nodes.len() as u32 - 1)
    }

    /// The nested objects of a node, in the order of the file, with the name each one fills.
    pub fn children(&self, id: NodeId) -> impl Iterator<Item = (&Parameter, NodeId)> {
        self.node(id).parameters.iter().filter_map(|p| match p.value {
            Value::Object(child) => Some((p, child)),
            _ => None,
        })
    }

    /// The version of the file that `at` lies in.
    pub fn version_at(&self, at: &Location) -> [u32; 3] {
        let other = self.file_versions.iter().find(|(file, _)| *file == at.file);
        other.map_or(self.version, |(_, version)| *version)
    }

    /// Finds an existing file: absolute names as they are, relative ones along the search path.
    pub fn find_file(&self, name: &str) -> Option<PathBuf> {
        self.locate(name).ok()
    }

    /// Finds an existing file as [`find_file`](Self::find_file) does, or says why there is none to be had: a hint
    /// for an error message.
    pub fn locate(&self, name: &str) -> Result<PathBuf, String> {
        if name.is_empty() {
            return Err("the file name is empty".to_owned());
        }
        let path = Path::new(name);
        let found = if path.is_absolute() {
            path.exists().then(|| path.to_owned())
        } else {
            self.search_path.iter().map(|folder| folder.join(path)).find(|p| p.exists())
        };
        match found {
            Some(found) => self.check_confinement(&found).map(|()| found),
            None if path.is_absolute() => Err("no such file".to_owned()),
            None => {
                let folders: Vec<_> =
                    self.search_path.iter().map(|folder| format!("\"{}\"", folder.display())).collect();
                Err(format!("no such file in {}", folders.join(", ")))
            }
        }
    }

    /// Refuses a path that leads out of [`confined_to`](Self::confined_to), links followed.
    pub fn check_confinement(&self, path: &Path) -> Result<(), String> {
        let Some(root) = &self.confined_to else { return Ok(()) };
        let real = |path: &Path| path.canonicalize().map_err(|error| plain_io_error(&error));
        if real(path)?.starts_with(real(root)?) {
            Ok(())
        } else {
            Err(format!("files outside of \"{}\" are refused", root.display()))
        }
    }
}
