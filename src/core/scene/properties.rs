//! What a constructor reads its parameters from.
//!
//! Types, ranges, unknown names and children have been checked against the plugin's table before a constructor runs
//! ([`super::check`]), so the getters here are total: they give the value, or the table's default. What only the
//! constructor can find out (a damaged file, two parameters that exclude each other) it tells with
//! [`Properties::error`].

use super::clamped::Clamped;
use super::description::{Description, Node, ObjectKind, SpectrumValue, Value};
use super::error::{Location, SceneError};
use super::object::{BuiltShape, Object};
use super::param::{Default, Param, ParamType, Slot};
use super::registry::{Failed, Plugin};
use crate::color::{Rgb, ior, spectrum};
use crate::interfaces::{
    Bsdf, ColorSource, Film, Guide, Integrator, LightSampler, Rfilter, Roulette, Sampler, ScalarSource, Shape, Texture,
};
use crate::math::{Transform, Vec3};
use glam::DMat4;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The parameters and built children of one object.
pub struct Properties<'a> {
    pub(super) node: &'a Node,
    pub(super) plugin: &'a Plugin,
    /// Built children: name of the slot, object.
    pub(super) children: Vec<(&'a str, Object)>,
    pub(super) description: &'a Description,
    /// The shape an emitter sits on.
    pub(super) parent_shape: Option<Arc<dyn Shape>>,
    /// Errors the constructor has told.
    pub(super) errors: RefCell<Vec<SceneError>>,
    /// Warnings the constructor has told.
    pub(super) warnings: RefCell<Vec<String>>,
    /// Whether one of the errors is a missing file.
    pub(super) missing_file: Cell<bool>,
    /// Where a test wants to see what the constructor reads.
    pub(super) trace: Option<&'a Trace>,
}

/// Parameters that constructors have asked for, whether a scene sets them or not: kind, plugin, parameter.
pub type Reads = BTreeSet<(ObjectKind, &'static str, &'static str)>;

/// [`Reads`] that objects built in parallel share.
pub(super) type Trace = Mutex<Reads>;

impl<'a> Properties<'a> {
    fn spec(&self, name: &str) -> &'static Param {
        self.plugin.param(name).unwrap_or_else(|| {
            // A mistake in the plugin, found by the test that builds every plugin; never caused by a scene.
            unreachable!("plugin \"{}\" reads \"{name}\", which is not in its table", self.plugin.name)
        })
    }

    fn value(&self, name: &str) -> Option<&Value> {
        self.trace(name);
        self.node.parameter(name).map(|p| &p.value)
    }

    fn trace(&self, name: &str) {
        if let Some(trace) = self.trace {
            let read = (self.node.kind, self.plugin.name, self.spec(name).name);
            trace.lock().unwrap_or_else(PoisonError::into_inner).insert(read);
        }
    }

    /// Whether the scene sets the parameter.
    pub fn has(&self, name: &str) -> bool {
        self.value(name).is_some()
    }

    /// The XML `type` as written, for plugins with several names.
    pub fn plugin_name(&self) -> &str {
        &self.node.plugin
    }

    /// Where the object stands.
    pub fn location(&self) -> &Location {
        &self.node.at
    }

    /// The object's id, or an empty string.
    pub fn id(&self) -> &str {
        self.node.id.as_deref().unwrap_or("")
    }

    /// Tells an error about a parameter (at its position, or the object's if it is not set).
    pub fn error(&self, name: &str, message: impl Into<String>) -> Failed {
        let at = self.node.parameter(name).map_or(&self.node.at, |p| &p.at);
        let error = SceneError::at(at, message);
        let mut errors = self.errors.borrow_mut();
        // A constructor may read a parameter twice.
        if !errors.contains(&error) {
            errors.push(error);
        }
        Failed
    }

    /// Tells the user about something odd that does not stop the render.
    pub fn warn(&self, name: &str, message: impl Into<String>) {
        let at = self.node.parameter(name).map_or(&self.node.at, |p| &p.at);
        let warning = format!("{at}: {}", message.into());
        let mut warnings = self.warnings.borrow_mut();
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }

    /// Two parameters of which at most one may be set.
    pub fn exclusive(&self, a: &str, b: &str) -> Result<(), Failed> {
        if self.has(a) && self.has(b) {
            return Err(self.error(b, format!("\"{a}\" and \"{b}\" exclude each other")));
        }
        Ok(())
    }

    /// A number, if set or with a default.
    pub fn float_opt(&self, name: &str) -> Option<f32> {
        match (self.value(name), self.spec(name).default) {
            (Some(Value::Float(v)), _) => Some(*v as f32),
            (Some(Value::Integer(v)), _) => Some(*v as f32),
            (_, Default::Number(v)) => Some(v as f32),
            _ => None,
        }
    }

    /// A number with a default (0 if the table has none).
    pub fn float(&self, name: &str) -> f32 {
        self.float_opt(name).unwrap_or(0.0)
    }

    /// A number in double precision.
    pub fn double(&self, name: &str) -> f64 {
        match (self.value(name), self.spec(name).default) {
            (Some(Value::Float(v)), _) => *v,
            (Some(Value::Integer(v)), _) => *v as f64,
            (_, Default::Number(v)) => v,
            _ => 0.0,
        }
    }

    /// A whole number, if set or with a default.
    pub fn int_opt(&self, name: &str) -> Option<i64> {
        match (self.value(name), self.spec(name).default) {
            (Some(Value::Integer(v)), _) => Some(*v),
            (_, Default::Integer(v)) => Some(v),
            _ => None,
        }
    }

    /// A whole number with a default.
    pub fn int(&self, name: &str) -> i64 {
        self.int_opt(name).unwrap_or(0)
    }

    /// A truth value.
    pub fn bool(&self, name: &str) -> bool {
        match (self.value(name), self.spec(name).default) {
            (Some(Value::Boolean(v)), _) => *v,
            (_, Default::Boolean(v)) => v,
            _ => false,
        }
    }

    /// Text, if set or with a default.
    pub fn string_opt(&self, name: &str) -> Option<&str> {
        match (self.value(name), self.spec(name).default) {
            (Some(Value::String(v)), _) => Some(v),
            (_, Default::Text(v)) => Some(v),
            _ => None,
        }
    }

    /// Text with a default.
    pub fn string(&self, name: &str) -> &str {
        self.string_opt(name).unwrap_or("")
    }

    /// One of the table's words, as the table spells it.
    pub fn choice(&self, name: &str) -> &'static str {
        let ParamType::Choice(words) = self.spec(name).ty else {
            unreachable!("\"{name}\" of plugin \"{}\" is no choice", self.plugin.name)
        };
        let text = self.string(name);
        words.iter().find(|w| w.eq_ignore_ascii_case(text)).copied().unwrap_or(words[0])
    }

    /// An existing file.
    pub fn file(&self, name: &str) -> Result<PathBuf, Failed> {
        let text = self.string(name);
        match self.description.locate(text) {
            Ok(path) if path.is_dir() => Err(self.error(name, format!("\"{text}\" is a folder, not a file"))),
            Ok(path) => Ok(path),
            Err(why) => {
                self.missing_file.set(true);
                let failed = self.error(name, format!("could not open the file \"{text}\""));
                if let Some(error) = self.errors.borrow_mut().last_mut() {
                    error.hint = Some(why);
                }
                Err(failed)
            }
        }
    }

    /// A file that may be written: the existing one that is found under this name, or a new one, in the folder where files
    /// are searched first if the name is relative.
    pub fn file_to_write(&self, name: &str) -> Result<PathBuf, Failed> {
        let text = self.string(name);
        if self.description.find_file(text).is_some() {
            return self.file(name);
        }
        let folder = self.description.search_path.first().map_or(Path::new("."), |folder| folder);
        let path = folder.join(text);
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let usable = match path.file_name() {
            None => Err("the name is not that of a file".to_owned()),
            Some(_) if !parent.is_dir() => Err("its folder does not exist".to_owned()),
            Some(_) => self.description.check_confinement(parent),
        };
        usable.map(|()| path).map_err(|why| self.error(name, format!("the file \"{text}\" cannot be written: {why}")))
    }

    /// A point or direction, if set or with a default.
    pub fn vector_opt(&self, name: &str) -> Option<Vec3> {
        let [x, y, z] = match (self.value(name), self.spec(name).default) {
            (Some(Value::Vector(v)), _) => *v,
            (_, Default::Vector(v)) => v,
            _ => return None,
        };
        Some(Vec3::new(x as f32, y as f32, z as f32))
    }

    /// A point or direction with a default.
    pub fn vector(&self, name: &str) -> Vec3 {
        self.vector_opt(name).unwrap_or(Vec3::ZERO)
    }

    /// A transform as a double-precision matrix; identity if not set.
    pub fn matrix(&self, name: &str) -> DMat4 {
        match self.value(name) {
            Some(Value::Transform(m)) => *m,
            _ => DMat4::IDENTITY,
        }
    }

    /// A transform with its inverse; identity if not set. A singular one is an error.
    pub fn transform(&self, name: &str) -> Result<Transform, Failed> {
        Transform::new(self.matrix(name))
            .ok_or_else(|| self.error(name, format!("\"{name}\" is singular: it flattens the object or is not affine")))
    }

    /// A constant colour, if set or with a default.
    pub fn rgb_opt(&self, name: &str) -> Option<Rgb> {
        match self.color_opt(name)? {
            ColorSource::Constant(color) => Some(color),
            ColorSource::Textured(texture) => {
                self.error(name, format!("\"{name}\" must be the same everywhere, but the texture varies"));
                Some(Rgb::splat(texture.mean()))
            }
        }
    }

    /// A constant colour with a default.
    pub fn rgb(&self, name: &str) -> Rgb {
        self.rgb_opt(name).unwrap_or(Rgb::BLACK)
    }

    /// A colour or texture, if set or with a default.
    pub fn color_opt(&self, name: &str) -> Option<ColorSource> {
        let spec = self.spec(name);
        let (ParamType::Color(slot) | ParamType::Rgb(slot) | ParamType::Scalar(slot)) = spec.ty else {
            unreachable!("\"{name}\" of plugin \"{}\" is no colour", self.plugin.name)
        };
        if let Some(texture) = self.texture_in(name) {
            return Some(match (texture.spectrum(), texture.constant()) {
                (Some(spectrum), _) => ColorSource::Constant(self.spectrum_color(name, spectrum, slot)),
                (None, constant) => match (self.bounded(name, texture, slot), constant) {
                    (texture, Some(_)) => ColorSource::Constant(texture.constant().unwrap_or_default()),
                    (texture, None) => ColorSource::Textured(texture),
                },
            });
        }
        let constant = match (self.value(name), spec.default) {
            (Some(value), _) if !matches!(value, Value::Object(_)) => self.constant_color(name, value, slot),
            // An unbuilt child (a missing file in a lenient run) falls back to the default, or mid-grey.
            (Some(_), Default::Number(v)) | (None, Default::Number(v)) => Rgb::splat(v as f32),
            (Some(_), _) => Rgb::splat(0.5),
            (None, _) => return None,
        };
        Some(ColorSource::Constant(constant))
    }

    /// A colour or texture with a default.
    pub fn color(&self, name: &str) -> ColorSource {
        self.color_opt(name).unwrap_or(ColorSource::Constant(Rgb::BLACK))
    }

    /// A scalar or texture, if set or with a default.
    pub fn scalar_opt(&self, name: &str) -> Option<ScalarSource> {
        Some(match self.color_opt(name)? {
            ColorSource::Constant(color) if color.r == color.g && color.g == color.b => ScalarSource::Constant(color.r),
            // The mean, as in the reference renderer; a texture that varies gives its luminance.
            ColorSource::Constant(color) => ScalarSource::Constant(color.mean()),
            ColorSource::Textured(texture) => ScalarSource::Textured(texture),
        })
    }

    /// A scalar or texture with a default.
    pub fn scalar(&self, name: &str) -> ScalarSource {
        self.scalar_opt(name).unwrap_or(ScalarSource::Constant(0.0))
    }

    fn constant_color(&self, name: &str, value: &Value, slot: Slot) -> Rgb {
        match value {
            Value::Float(v) => Rgb::splat(*v as f32),
            Value::Integer(v) => Rgb::splat(*v as f32),
            Value::Rgb(c) => Rgb::from_f64(*c),
            Value::Spectrum(s) => self.spectrum_color(name, s, slot),
            _ => Rgb::BLACK,
        }
    }

    fn spectrum_color(&self, name: &str, spectrum: &SpectrumValue, slot: Slot) -> Rgb {
        let (color, clipped) = spectrum::to_rgb(spectrum, slot);
        if clipped {
            self.warn(name, "the spectrum is outside the RGB gamut of the slot and was clipped");
        }
        color
    }

    /// A reflectance above 1 would make light out of nothing: it is clamped. Nothing may be negative.
    fn bounded(&self, name: &str, texture: Arc<dyn Texture>, slot: Slot) -> Arc<dyn Texture> {
        if let Some(min) = texture.minimum().filter(|min| *min < 0.0) {
            self.error(name, format!("the texture of \"{name}\" falls to {min}, but must not be negative"));
        }
        match texture.maximum() {
            Some(max) if max > 1.0 && slot == Slot::Reflectance => {
                self.warn(name, format!("the texture of \"{name}\" reaches {max} and is clamped to 1"));
                Arc::new(Clamped(texture))
            }
            _ => texture,
        }
    }

    /// An index of refraction: a number or the name of a material.
    pub fn ior(&self, name: &str) -> Result<f32, Failed> {
        match self.value(name) {
            Some(Value::Float(v)) => Ok(*v as f32),
            Some(Value::Integer(v)) => Ok(*v as f32),
            _ => ior::by_name(self.string(name)).map_err(|message| self.error(name, message)),
        }
    }

    fn texture_in(&self, name: &str) -> Option<Arc<dyn Texture>> {
        self.trace(name);
        self.children.iter().find(|(slot, _)| *slot == name).and_then(|(_, object)| match object {
            Object::Texture(texture) => Some(texture.clone()),
            _ => None,
        })
    }

    /// Nested textures that fill no slot of the table, in the order of the file, with the names they were given.
    pub fn free_textures(&self) -> Vec<(&str, Arc<dyn Texture>)> {
        self.children
            .iter()
            .filter(|(slot, _)| self.plugin.param(slot).is_none())
            .filter_map(|(slot, object)| match object {
                Object::Texture(texture) => Some((*slot, texture.clone())),
                _ => None,
            })
            .collect()
    }

    fn of_kind<T>(&self, pick: impl Fn(&Object) -> Option<T>) -> Vec<T> {
        self.children.iter().filter_map(|(_, object)| pick(object)).collect()
    }

    /// Nested BSDFs in the order of the file.
    pub fn bsdfs(&self) -> Vec<Arc<dyn Bsdf>> {
        self.of_kind(|o| if let Object::Bsdf(x) = o { Some(x.clone()) } else { None })
    }

    /// Nested shapes in the order of the file, with their materials.
    pub fn shapes(&self) -> Vec<BuiltShape> {
        self.of_kind(|o| if let Object::Shape(x) = o { Some(x.clone()) } else { None })
    }

    /// Nested integrators in the order of the file, with the name each was given.
    pub fn integrators(&self) -> Vec<(&str, Arc<dyn Integrator>)> {
        self.children
            .iter()
            .filter_map(|(name, o)| if let Object::Integrator(x) = o { Some((*name, x.clone())) } else { None })
            .collect()
    }

    /// The nested reconstruction filter.
    pub fn rfilter(&self) -> Option<Arc<dyn Rfilter>> {
        self.of_kind(|o| if let Object::Rfilter(x) = o { Some(x.clone()) } else { None }).pop()
    }

    /// The nested guide.
    pub fn guide(&self) -> Option<Arc<dyn Guide>> {
        self.of_kind(|o| if let Object::Guide(x) = o { Some(x.clone()) } else { None }).pop()
    }

    /// The nested decision whether paths go on.
    pub fn roulette(&self) -> Option<Arc<dyn Roulette>> {
        self.of_kind(|o| if let Object::Roulette(x) = o { Some(x.clone()) } else { None }).pop()
    }

    /// The nested film.
    pub fn film(&self) -> Option<Arc<dyn Film>> {
        self.of_kind(|o| if let Object::Film(x) = o { Some(x.clone()) } else { None }).pop()
    }

    /// The nested sampler.
    pub fn sampler(&self) -> Option<Arc<dyn Sampler>> {
        self.of_kind(|o| if let Object::Sampler(x) = o { Some(x.clone()) } else { None }).pop()
    }

    /// The nested decision which light to sample.
    pub fn light_sampler(&self) -> Option<Arc<dyn LightSampler>> {
        self.of_kind(|o| if let Object::LightSampler(x) = o { Some(x.clone()) } else { None }).pop()
    }

    /// The shape an emitter sits on.
    pub fn parent_shape(&self) -> Option<&Arc<dyn Shape>> {
        self.parent_shape.as_ref()
    }

    /// The kind of object being built.
    pub fn kind(&self) -> ObjectKind {
        self.node.kind
    }
}
