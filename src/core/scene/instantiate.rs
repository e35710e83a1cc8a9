//! Builds a scene from a checked description.
//!
//! Objects are built bottom-up, all of one height at the same time: meshes and textures load in parallel. What goes
//! wrong is collected from all of them and told together, in file order.

use super::check::check;
use super::description::{Description, Node, NodeId, ObjectKind, Parameter, Value};
use super::error::{SceneError, SceneErrors};
use super::object::{BuiltSensor, BuiltShape, Object};
use super::properties::{Properties, Reads, Trace};
use super::registry::{Built, Constructor, Failed, Plugin, Registry};
use super::world::{EmitterSource, Scene};
use crate::accel::Geometry;
use crate::interfaces::{Emitter, EmitterFlags, Shape};
use crate::math::Aabb;
use rayon::prelude::*;
use std::cell::{Cell, RefCell};
use std::sync::{Arc, Mutex, OnceLock};

/// A scene and what was odd about it.
pub struct Instantiated {
    /// The scene.
    pub scene: Scene,
    /// What the user should know, one line each.
    pub warnings: Vec<String>,
}

/// Builds the whole scene. With `lenient`, missing files and unknown parameters are warnings; a shape whose mesh is
/// missing is left out, a texture that is missing gives its parameter's default.
pub fn instantiate(
    registry: &Registry,
    mut description: Description,
    lenient: bool,
) -> Result<Instantiated, SceneErrors> {
    add_defaults(&mut description);
    let found = check(registry, &description, lenient);
    if !found.errors.is_empty() {
        return Err(SceneErrors(found.errors));
    }
    let builder = Builder::new(registry, &description, lenient);
    builder.build_all();
    let built = builder.assemble();
    let (errors, warnings) = builder.into_reports();
    if !errors.is_empty() {
        return Err(SceneErrors(errors));
    }
    let scene = built.ok_or_else(|| SceneError::anywhere("the scene could not be built"))?;
    Ok(Instantiated { scene, warnings: [description.warnings.clone(), found.warnings, warnings].concat() })
}

/// Builds the root object of a description that is not a whole scene: for tests and tools.
pub fn build_one(registry: &Registry, description: &Description) -> Result<Object, SceneErrors> {
    let mut description = description.clone();
    add_defaults(&mut description);
    let found = check(registry, &description, false);
    if !found.errors.is_empty() {
        return Err(SceneErrors(found.errors));
    }
    let builder = Builder::new(registry, &description, false);
    builder.build_all();
    let root = builder.built(description.root);
    let (errors, _) = builder.into_reports();
    match root {
        Some(object) if errors.is_empty() => Ok(object),
        _ if errors.is_empty() => Err(SceneError::anywhere("the object could not be built").into()),
        _ => Err(SceneErrors(errors)),
    }
}

/// The parameters that constructors ask for while a whole scene is built, even if it cannot be: for tests of plugin
/// tables.
///
/// # Panics
/// Where a constructor asks for a parameter that is not in its table.
///
/// # Errors
/// What keeps a scene from being built at all: the findings of [`check`].
#[doc(hidden)]
pub fn trace_reads(registry: &Registry, description: &Description) -> Result<Reads, SceneErrors> {
    let mut description = description.clone();
    add_defaults(&mut description);
    let found = check(registry, &description, false);
    if !found.errors.is_empty() {
        return Err(SceneErrors(found.errors));
    }
    let trace = Trace::default();
    let builder = Builder { trace: Some(&trace), ..Builder::new(registry, &description, false) };
    builder.build_all();
    drop(builder);
    Ok(trace.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner))
}

/// Adds what a scene may leave out: materials of shapes, film and sampler of sensors, the filter of films. Shapes
/// share their default materials, for there may be millions of shapes.
fn add_defaults(description: &mut Description) {
    let (mut of_lamps, mut of_others) = (None, None);
    let mut index = 0;
    while index < description.nodes.len() {
        let id = NodeId(index as u32);
        match description.node(id).kind {
            ObjectKind::Shape if !has_child(description, id, ObjectKind::Bsdf) => {
                // A lamp reflects nothing unless it says so.
                let is_lamp = has_child(description, id, ObjectKind::Emitter);
                let (shared, reflectance) = if is_lamp { (&mut of_lamps, 0.0) } else { (&mut of_others, 0.5) };
                match *shared {
                    Some(material) => attach(description, id, ObjectKind::Bsdf, material),
                    None => {
                        let material = add_plain_child(description, id, ObjectKind::Bsdf, "diffuse");
                        let at = description.node(id).at.clone();
                        let value = Value::Float(reflectance);
                        let parameter = Parameter { name: "reflectance".to_owned(), value, at };
                        description.node_mut(material).parameters.push(parameter);
                        *shared = Some(material);
                    }
                }
            }
            ObjectKind::Sensor => {
                for (kind, plugin) in [(ObjectKind::Film, "hdrfilm"), (ObjectKind::Sampler, "sobol")] {
                    if !has_child(description, id, kind) {
                        add_plain_child(description, id, kind, plugin);
                    }
                }
            }
            ObjectKind::Film if !has_child(description, id, ObjectKind::Rfilter) => {
                add_plain_child(description, id, ObjectKind::Rfilter, "gaussian");
            }
            _ => {}
        }
        index += 1;
    }
}

fn has_child(description: &Description, id: NodeId, kind: ObjectKind) -> bool {
    description.children(id).any(|(_, child)| description.node(child).kind == kind)
}

fn add_plain_child(description: &mut Description, parent: NodeId, kind: ObjectKind, plugin: &str) -> NodeId {
    let at = description.node(parent).at.clone();
    let child = description.add(Node {
        kind,
        plugin: plugin.to_owned(),
        id: None,
        parameters: Vec::new(),
        at,
        included_from: Vec::new(),
    });
    attach(description, parent, kind, child);
    child
}

fn attach(description: &mut Description, parent: NodeId, kind: ObjectKind, child: NodeId) {
    let name = format!("_default_{}", kind.tag());
    let at = description.node(parent).at.clone();
    description.node_mut(parent).parameters.push(Parameter { name, value: Value::Object(child), at });
}

/// How building an object ended.
#[derive(Clone)]
enum Outcome {
    Built(Object),
    /// A file is missing and the run is lenient.
    Omitted,
    /// Told already.
    Failed,
}

struct Builder<'a> {
    registry: &'a Registry,
    description: &'a Description,
    lenient: bool,
    outcomes: Vec<OnceLock<Outcome>>,
    errors: Mutex<Vec<SceneError>>,
    warnings: Mutex<Vec<String>>,
    trace: Option<&'a Trace>,
}

impl<'a> Builder<'a> {
    fn new(registry: &'a Registry, description: &'a Description, lenient: bool) -> Self {
        Builder {
            registry,
            description,
            lenient,
            outcomes: (0..description.nodes.len()).map(|_| OnceLock::new()).collect(),
            errors: Mutex::default(),
            warnings: Mutex::default(),
            trace: None,
        }
    }

    fn into_reports(self) -> (Vec<SceneError>, Vec<String>) {
        let lock = |poisoned: std::sync::PoisonError<_>| poisoned.into_inner();
        let mut errors = self.errors.into_inner().unwrap_or_else(lock);
        errors.sort_by_cached_key(|e| e.at.as_ref().map(|at| (at.file.clone(), at.line, at.column)));
        let mut warnings = self.warnings.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        warnings.sort();
        (errors, warnings)
    }

    fn built(&self, id: NodeId) -> Option<Object> {
        match self.outcomes[id.0 as usize].get() {
            Some(Outcome::Built(object)) => Some(object.clone()),
            _ => None,
        }
    }

    /// Everything but the scene itself and lights that sit on shapes, which are built with their shape.
    fn build_all(&self) {
        let mut heights = vec![None; self.description.nodes.len()];
        self.height(self.description.root, &mut heights);
        let tallest = heights.iter().flatten().copied().max().unwrap_or(0);
        let mut levels: Vec<Vec<NodeId>> = vec![Vec::new(); tallest as usize + 1];
        for (index, height) in heights.iter().enumerate() {
            let id = NodeId(index as u32);
            if let Some(height) = height
                && self.description.node(id).kind != ObjectKind::Scene
            {
                levels[*height as usize].push(id);
            }
        }
        for level in levels {
            level.into_par_iter().for_each(|id| {
                let outcome = self.build(id);
                // Each node is in one level once, so the cell is empty.
                let _ = self.outcomes[id.0 as usize].set(outcome);
            });
        }
    }

    /// Depth is bounded by the parser, and cycles have been rejected.
    fn height(&self, id: NodeId, heights: &mut [Option<u32>]) -> u32 {
        if let Some(height) = heights[id.0 as usize] {
            return height;
        }
        let is_shape = self.description.node(id).kind == ObjectKind::Shape;
        let mut height = 0;
        for (_, child) in self.description.children(id) {
            if is_shape && self.description.node(child).kind == ObjectKind::Emitter {
                // The light itself waits for its shape; its textures do not.
                for (_, grandchild) in self.description.children(child) {
                    height = height.max(1 + self.height(grandchild, heights));
                }
            } else {
                height = height.max(1 + self.height(child, heights));
            }
        }
        heights[id.0 as usize] = Some(height);
        height
    }

    fn build(&self, id: NodeId) -> Outcome {
        let node = self.description.node(id);
        let Some(plugin) = self.registry.find(node.kind, &node.plugin) else {
            return Outcome::Failed;
        };
        let Ok(properties) = self.properties(id, plugin, None) else {
            return Outcome::Failed;
        };
        let built: Result<Object, Failed> = match plugin.build {
            Constructor::Integrator(f) => f(&properties).map(Object::Integrator),
            Constructor::Film(f) => f(&properties).map(Object::Film),
            Constructor::Rfilter(f) => f(&properties).map(Object::Rfilter),
            Constructor::Sampler(f) => f(&properties).map(Object::Sampler),
            Constructor::Emitter(f) => f(&properties).map(Object::Emitter),
            Constructor::Bsdf(f) => f(&properties).map(Object::Bsdf),
            Constructor::LightSampler(f) => f(&properties).map(Object::LightSampler),
            Constructor::Texture(f) => f(&properties).map(Object::Texture),
            Constructor::Guide(f) => f(&properties).map(Object::Guide),
            Constructor::Roulette(f) => f(&properties).map(Object::Roulette),
            Constructor::Sensor(f) => {
                f(&properties).and_then(|sensor| match (properties.film(), properties.sampler()) {
                    (Some(film), Some(sampler)) => Ok(Object::Sensor(BuiltSensor { sensor, film, sampler })),
                    _ => Err(Failed),
                })
            }
            Constructor::Shape(f) => self.build_shape(id, f(&properties), &properties),
        };
        self.conclude(node, &properties, built)
    }

    /// A shape with its material and light.
    fn build_shape(&self, id: NodeId, shape: Built<dyn Shape>, properties: &Properties<'_>) -> Result<Object, Failed> {
        let shape = shape?;
        if let Geometry::Analytic(primitive) = shape.geometry()
            && primitive.bounds() != Aabb::EMPTY
            && !primitive.bounds().is_finite()
        {
            return Err(properties.error("", "the shape reaches beyond the largest number of single precision"));
        }
        let bsdf = properties.bsdfs().into_iter().next().ok_or(Failed)?;
        let emitter = self
            .description
            .children(id)
            .find(|(_, child)| self.description.node(*child).kind == ObjectKind::Emitter)
            .map(|(_, child)| self.build_light(child, &shape))
            .transpose()?;
        Ok(Object::Shape(BuiltShape { shape, bsdf, emitter }))
    }

    fn build_light(&self, id: NodeId, shape: &Arc<dyn Shape>) -> Built<dyn Emitter> {
        let node = self.description.node(id);
        let plugin = self.registry.find(ObjectKind::Emitter, &node.plugin).ok_or(Failed)?;
        let properties = self.properties(id, plugin, Some(shape.clone()))?;
        let Constructor::Emitter(construct) = plugin.build else { return Err(Failed) };
        let built = construct(&properties);
        if let Ok(emitter) = &built
            && !emitter.flags().has(EmitterFlags::SURFACE)
        {
            properties.error("", format!("emitter \"{}\" cannot sit on a shape", node.plugin));
        }
        match self.conclude(node, &properties, built.map(Object::Emitter)) {
            Outcome::Built(Object::Emitter(emitter)) => Ok(emitter),
            _ => Err(Failed),
        }
    }

    /// Children of the object that are built; `Err` if one of them failed.
    fn properties(
        &self,
        id: NodeId,
        plugin: &'a Plugin,
        parent_shape: Option<Arc<dyn Shape>>,
    ) -> Result<Properties<'a>, Failed> {
        let node = self.description.node(id);
        let mut children = Vec::new();
        for (parameter, child) in self.description.children(id) {
            match self.outcomes[child.0 as usize].get() {
                Some(Outcome::Built(object)) => children.push((parameter.name.as_str(), object.clone())),
                Some(Outcome::Failed) => return Err(Failed),
                // Omitted, or a light that waits for its shape.
                Some(Outcome::Omitted) | None => {}
            }
        }
        Ok(Properties {
            node,
            plugin,
            children,
            description: self.description,
            parent_shape,
            errors: RefCell::default(),
            warnings: RefCell::default(),
            missing_file: Cell::new(false),
            trace: self.trace,
        })
    }

    /// Takes over what the constructor told.
    fn conclude(&self, node: &Node, properties: &Properties<'_>, built: Result<Object, Failed>) -> Outcome {
        let errors = properties.errors.take();
        let failed = built.is_err() || !errors.is_empty();
        let omitted = failed && self.lenient && properties.missing_file.get();
        let in_object = |mut error: SceneError| {
            error.chain.push(format!("in {}", node.title()));
            error.chain.extend(node.included_from.iter().cloned());
            error
        };
        let mut warnings = properties.warnings.take();
        if omitted {
            warnings.extend(errors.into_iter().map(|e| format!("{}, left out", in_object(e))));
        } else {
            self.tell(|all| all.extend(errors.into_iter().map(in_object)));
        }
        if !warnings.is_empty() {
            self.warnings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).extend(warnings);
        }
        match built {
            Ok(object) if !failed => Outcome::Built(object),
            _ if omitted => Outcome::Omitted,
            _ => Outcome::Failed,
        }
    }

    fn tell(&self, add: impl FnOnce(&mut Vec<SceneError>)) {
        add(&mut self.errors.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
    }

    /// Puts the root's children together.
    fn assemble(&self) -> Option<Scene> {
        let root = self.description.root;
        let mut shapes = Vec::new();
        let mut lights = Vec::new();
        let mut sensors = Vec::new();
        let mut integrator = None;
        let mut environment = None;
        for (parameter, child) in self.description.children(root) {
            match self.built(child) {
                Some(Object::Shape(shape)) if shape.shape.group().is_some() => {}
                Some(Object::Shape(shape)) => {
                    if shape.emitter.is_some() {
                        lights.push(EmitterSource::Shape(shapes.len()));
                    }
                    shapes.push(shape);
                }
                Some(Object::Emitter(emitter)) => {
                    if emitter.flags().has(EmitterFlags::ENVIRONMENT) {
                        if let Some(first) = environment.replace(&parameter.at) {
                            let error = SceneError::at(&parameter.at, "only one environment emitter can be in a scene");
                            self.tell(|all| all.push(error.hint(format!("the first is at {first}"))));
                        }
                    } else if emitter.flags().has(EmitterFlags::SURFACE) {
                        let error = SceneError::at(&parameter.at, "this emitter must be nested in a shape");
                        self.tell(|all| all.push(error));
                    }
                    lights.push(EmitterSource::Free(emitter));
                }
                Some(Object::Sensor(sensor)) => sensors.push(sensor),
                Some(Object::Integrator(found)) => integrator = Some(found),
                _ => {}
            }
        }
        // The numbering decides which random number finds which light. The reference gathers meshes behind everything
        // else and lists them backwards (from five on, in an order that changes from run to run).
        let (meshes, mut lights): (Vec<_>, Vec<_>) = lights.into_iter().partition(|light| match light {
            EmitterSource::Shape(shape) => matches!(shapes[*shape].shape.geometry(), Geometry::Mesh { .. }),
            EmitterSource::Free(_) => false,
        });
        lights.extend(meshes.into_iter().rev());
        shapes.shrink_to_fit();
        match Scene::new(shapes, &lights, sensors, integrator) {
            Ok(scene) => Some(scene),
            Err(message) => {
                self.tell(|all| all.push(SceneError::at(&self.description.node(root).at, message)));
                None
            }
        }
    }
}
