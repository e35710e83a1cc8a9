//! Checks every object of a description against its plugin's table, before anything is built: all mistakes of a
//! scene are found in one run.

use super::description::{Description, Node, NodeId, ObjectKind, Parameter, Value};
use super::error::{Location, SceneError, did_you_mean};
use super::param::{Default, Param, ParamType, Slot};
use super::registry::{Plugin, Registry};
use std::collections::HashSet;

/// What `<scene>` itself accepts: speed hints of the reference renderer, without effect here.
const SCENE_PARAMS: &[Param] = &[
    Param::ignored("allow_thread_reordering", "hint for the reference renderer"),
    Param::ignored("compact_acceleration_structures", "hint for the reference renderer"),
    Param::ignored("embree_use_robust_intersections", "hint for the reference renderer"),
    Param::ignored("kd_intersection_cost", "hint for the reference renderer"),
    Param::ignored("kd_traversal_cost", "hint for the reference renderer"),
    Param::ignored("kd_empty_space_bonus", "hint for the reference renderer"),
    Param::ignored("kd_stop_prims", "hint for the reference renderer"),
    Param::ignored("kd_max_depth", "hint for the reference renderer"),
    Param::ignored("kd_min_max_bins", "hint for the reference renderer"),
    Param::ignored("kd_clip", "hint for the reference renderer"),
    Param::ignored("kd_retract_bad_splits", "hint for the reference renderer"),
    Param::ignored("kd_exact_primitive_threshold", "hint for the reference renderer"),
    Param::child(ObjectKind::Integrator, 0, 1, "how light is computed"),
    Param::child(ObjectKind::Sensor, 0, usize::MAX, "cameras"),
    Param::child(ObjectKind::Emitter, 0, usize::MAX, "lights on no shape"),
    Param::child(ObjectKind::Shape, 0, usize::MAX, "surfaces"),
    Param::child(ObjectKind::Bsdf, 0, usize::MAX, "materials to refer to"),
    Param::child(ObjectKind::Texture, 0, usize::MAX, "textures to refer to"),
    Param::child(ObjectKind::Scene, 0, usize::MAX, "skipped, as the reference renderer does"),
];

/// What a check found.
#[derive(Default)]
pub struct Findings {
    /// What is wrong.
    pub errors: Vec<SceneError>,
    /// Unread parameters of a lenient run.
    pub warnings: Vec<String>,
}

/// Checks every object that can be reached from the root. With `lenient`, unknown parameters are warnings.
pub fn check(registry: &Registry, description: &Description, lenient: bool) -> Findings {
    let mut checker = Checker { registry, description, lenient, seen: HashSet::new(), found: Findings::default() };
    checker.object(description.root);
    checker.found
}

struct Checker<'a> {
    registry: &'a Registry,
    description: &'a Description,
    lenient: bool,
    seen: HashSet<NodeId>,
    found: Findings,
}

/// The parameters an object accepts: those of its plugin, or of `<scene>`.
#[derive(Clone, Copy)]
enum Table<'a> {
    Scene,
    Plugin(&'a Plugin),
}

impl Table<'_> {
    fn params(&self) -> Box<dyn Iterator<Item = &'static Param>> {
        match self {
            Table::Scene => Box::new(SCENE_PARAMS.iter()),
            Table::Plugin(plugin) => Box::new(plugin.params.iter().flat_map(|group| group.iter())),
        }
    }

    fn named(&self, name: &str) -> Option<&'static Param> {
        self.params().find(|p| p.name == name)
    }

    fn child_slot(&self, kind: ObjectKind) -> Option<&'static Param> {
        self.params().find(|p| matches!(p.ty, ParamType::Child(k, ..) if k == kind))
    }
}

impl Checker<'_> {
    fn object(&mut self, id: NodeId) {
        if !self.seen.insert(id) {
            return;
        }
        let description = self.description;
        let node = description.node(id);
        let table = match node.kind {
            ObjectKind::Scene => Some(Table::Scene),
            kind => self.registry.find(kind, &node.plugin).map(Table::Plugin),
        };
        match table {
            Some(table) => {
                for parameter in &node.parameters {
                    self.parameter(node, table, parameter);
                }
                self.completeness(node, table);
            }
            None => self.unknown_plugin(node),
        }
        // What is in an object of a kind that is not built does not matter.
        if is_of_media(node.kind) && table.is_none() {
            return;
        }
        for (_, child) in description.children(id) {
            self.object(child);
        }
    }

    fn report(&mut self, node: &Node, mut error: SceneError) {
        error.chain.push(format!("in {}", node.title()));
        error.chain.extend(node.included_from.iter().cloned());
        self.found.errors.push(error);
    }

    fn unknown_plugin(&mut self, node: &Node) {
        let (kind, name) = (node.kind, node.plugin.as_str());
        if is_of_media(kind) && self.registry.of_kind(kind).next().is_none() {
            return self.report(node, no_media(kind, &node.at));
        }
        let mut error = SceneError::at(&node.at, format!("unknown {} plugin \"{name}\"", kind.tag()));
        let elsewhere = self.registry.all().find(|p| p.name == name).map(|p| p.build.kind());
        let names = self.registry.of_kind(kind).flat_map(|p| std::iter::once(p.name).chain(p.aliases.iter().copied()));
        if let Some(other) = elsewhere {
            error = error.hint(format!("\"{name}\" is of kind {}, not {}", other.tag(), kind.tag()));
        } else if let Some(meant) = did_you_mean(name, names) {
            error = error.hint(format!("did you mean \"{meant}\"?"));
        } else {
            error = error.hint(format!("`lucerna plugins {}` lists what there is", kind.tag()));
        }
        error.chain.extend(node.included_from.iter().cloned());
        self.found.errors.push(error);
    }

    /// Complains about a file that is not there, so that all of them are told in one run.
    fn file(&mut self, node: &Node, parameter: &Parameter) {
        let Value::String(name) = &parameter.value else { return };
        let error = match self.description.locate(name) {
            Ok(path) if path.is_dir() => SceneError::at(&parameter.at, format!("\"{name}\" is a folder, not a file")),
            Ok(_) => return,
            Err(why) => SceneError::at(&parameter.at, format!("could not open the file \"{name}\"")).hint(why),
        };
        self.report(node, error);
    }

    fn parameter(&mut self, node: &Node, table: Table<'_>, parameter: &Parameter) {
        let named = table.named(&parameter.name);
        if let Value::Object(child) = parameter.value {
            return self.child(node, table, parameter, named, child);
        }
        let Some(spec) = named else {
            return self.unknown_parameter(node, table, parameter);
        };
        if let Some(message) = mismatch(spec, &parameter.value) {
            self.report(node, SceneError::at(&parameter.at, message));
        } else if spec.ty == ParamType::File && !self.lenient {
            self.file(node, parameter);
        }
    }

    fn child(&mut self, node: &Node, table: Table<'_>, parameter: &Parameter, named: Option<&Param>, child: NodeId) {
        let kind = self.description.node(child).kind;
        let fits = match named.map(|p| p.ty) {
            Some(ParamType::Color(_) | ParamType::Scalar(_) | ParamType::Rgb(_)) => kind == ObjectKind::Texture,
            Some(ParamType::Any) => true,
            Some(ParamType::Child(..)) | None => match table.child_slot(kind) {
                Some(_) => true,
                None if named.is_none() && !parameter.name.starts_with("_arg_") => {
                    return self.unknown_parameter(node, table, parameter);
                }
                None => false,
            },
            Some(_) => false,
        };
        // Media are complained about once, where they stand.
        if fits || (is_of_media(kind) && self.registry.of_kind(kind).next().is_none()) {
            return;
        }
        let is_slot = named.is_some_and(|spec| !matches!(spec.ty, ParamType::Child(..)));
        let message = match named {
            Some(spec) if is_slot => {
                format!(
                    "\"{}\" must be {}, not {}",
                    spec.name,
                    with_article(&spec.type_text()),
                    with_article(kind.tag())
                )
            }
            _ => format!("{} has no place here", with_article(kind.tag())),
        };
        let error = SceneError::at(&parameter.at, message);
        self.report(node, if is_slot { error } else { error.hint(accepted_children(self.registry, table)) });
    }

    fn unknown_parameter(&mut self, node: &Node, table: Table<'_>, parameter: &Parameter) {
        let names = table.params().filter(|p| !matches!(p.ty, ParamType::Child(..))).map(|p| p.name);
        let meant = did_you_mean(&parameter.name, names);
        let message = format!("unknown parameter \"{}\"", parameter.name);
        if self.lenient {
            return self.found.warnings.push(format!("{}: {message} of {} is ignored", parameter.at, node.title()));
        }
        let error = SceneError::at(&parameter.at, message);
        let error = match (meant, table) {
            (Some(meant), _) => error.hint(format!("did you mean \"{meant}\"?")),
            (None, Table::Plugin(plugin)) => {
                error.hint(format!("`lucerna plugins {} {}` lists what it accepts", node.kind.tag(), plugin.name))
            }
            (None, Table::Scene) => error,
        };
        self.report(node, error);
    }

    /// Required parameters are there, and the number of children is right.
    fn completeness(&mut self, node: &Node, table: Table<'_>) {
        for spec in table.params() {
            match spec.ty {
                ParamType::Child(kind, min, max) => {
                    let children: Vec<&Parameter> = node
                        .parameters
                        .iter()
                        .filter(|p| {
                            let slotted = table.named(&p.name).is_some_and(|s| !matches!(s.ty, ParamType::Child(..)));
                            matches!(p.value, Value::Object(c) if self.description.node(c).kind == kind) && !slotted
                        })
                        .collect();
                    if children.len() < min {
                        let few = if min == 1 { "one".to_owned() } else { min.to_string() };
                        let s = if min == 1 { "" } else { "s" };
                        let message = format!("needs {few} nested {}{s}, found {}", kind.tag(), children.len());
                        self.report(node, SceneError::at(&node.at, message));
                    } else if children.len() > max {
                        let s = if max == 1 { "" } else { "s" };
                        let message =
                            format!("at most {max} nested {}{s} allowed, found {}", kind.tag(), children.len());
                        self.report(node, SceneError::at(&children[max].at, message));
                    }
                }
                _ if spec.default == Default::Required && node.parameter(spec.name).is_none() => {
                    let message = format!("missing parameter \"{}\" ({})", spec.name, spec.type_text());
                    self.report(node, SceneError::at(&node.at, message));
                }
                _ => {}
            }
        }
    }
}

/// Kinds that belong to participating media.
fn is_of_media(kind: ObjectKind) -> bool {
    matches!(kind, ObjectKind::Medium | ObjectKind::Phase | ObjectKind::Volume)
}

fn no_media(kind: ObjectKind, at: &Location) -> SceneError {
    SceneError::at(at, "participating media are not built yet").hint(format!("remove the <{}>", kind.tag()))
}

/// `an emitter`, `a shape`; words such as `one of …` need no article.
fn with_article(noun: &str) -> String {
    match noun.chars().next() {
        _ if noun.starts_with("one ") || noun.starts_with("anything") => noun.to_owned(),
        Some('a' | 'e' | 'i' | 'o') => format!("an {noun}"),
        _ => format!("a {noun}"),
    }
}

fn accepted_children(registry: &Registry, table: Table<'_>) -> String {
    let kinds: Vec<&str> = table
        .params()
        .filter_map(|p| if let ParamType::Child(kind, ..) = p.ty { Some(kind) } else { None })
        .filter(|kind| *kind == ObjectKind::Scene || registry.of_kind(*kind).next().is_some())
        .map(ObjectKind::tag)
        .collect();
    match kinds.as_slice() {
        [] => "nothing can be nested here".to_owned(),
        kinds => format!("what can be nested here: {}", kinds.join(", ")),
    }
}

/// What is wrong with a value, if anything.
fn mismatch(spec: &Param, value: &Value) -> Option<String> {
    let name = spec.name;
    let number = match value {
        Value::Float(v) => Some(*v),
        Value::Integer(v) => Some(*v as f64),
        _ => None,
    };
    let right_type = match spec.ty {
        ParamType::Float => number.is_some(),
        ParamType::Integer => matches!(value, Value::Integer(_)),
        ParamType::Boolean => matches!(value, Value::Boolean(_)),
        ParamType::String | ParamType::Choice(_) | ParamType::File => matches!(value, Value::String(_)),
        ParamType::Vector => matches!(value, Value::Vector(_)),
        ParamType::Transform => matches!(value, Value::Transform(_)),
        ParamType::Rgb(_) | ParamType::Color(_) | ParamType::Scalar(_) => {
            number.is_some() || matches!(value, Value::Rgb(_) | Value::Spectrum(_))
        }
        ParamType::Ior => number.is_some() || matches!(value, Value::String(_)),
        ParamType::Any => true,
        ParamType::Child(..) => false,
    };
    if !right_type {
        return Some(format!(
            "\"{name}\" has the wrong type: expected {}, got {}",
            spec.type_text(),
            value.type_name()
        ));
    }
    if let (ParamType::Choice(words), Value::String(word)) = (spec.ty, value) {
        if words.iter().any(|w| w.eq_ignore_ascii_case(word)) {
            return None;
        }
        let hint = did_you_mean(word, words.iter().copied())
            .map_or_else(|| format!("one of {}", words.join(", ")), |meant| format!("did you mean \"{meant}\"?"));
        return Some(format!("\"{name}\" cannot be \"{word}\" ({hint})"));
    }
    let components: Vec<f64> = match (value, number) {
        (_, Some(v)) => vec![v],
        (Value::Vector(v) | Value::Rgb(v), _) => v.to_vec(),
        _ => Vec::new(),
    };
    // Single precision is what is rendered with: a number it cannot hold is as bad as infinity.
    if components.iter().any(|v| !(*v as f32).is_finite()) {
        return Some(format!("\"{name}\" must be finite in single precision"));
    }
    if let (ParamType::Rgb(slot) | ParamType::Color(slot) | ParamType::Scalar(slot), true) =
        (spec.ty, spec.min == f64::NEG_INFINITY)
    {
        return match slot {
            Slot::Reflectance if components.iter().any(|v| !(0.0..=1.0).contains(v)) => {
                Some(format!("\"{name}\" must be from 0 to 1, got {}", join(&components)))
            }
            // Indices of refraction fitted to RGB may be negative in a channel; real scenes have such metals.
            Slot::Emissive if components.iter().any(|v| *v < 0.0) => {
                Some(format!("\"{name}\" must not be negative, got {}", join(&components)))
            }
            _ => None,
        };
    }
    components.iter().find(|v| !spec.allows(**v)).map(|v| format!("\"{name}\" must be {}, got {v}", spec.range_text()))
}

fn join(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
}
