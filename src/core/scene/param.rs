//! What a plugin says about its parameters: the one place for names, types, defaults, limits and meaning.
//!
//! The table of a plugin feeds the typed getters of [`Properties`](super::Properties) (they look defaults up here),
//! the checks of a scene before anything is built, "did you mean", and the manual that `lucerna plugins` prints.

use super::description::ObjectKind;
use std::borrow::Cow;

/// How a colour is reduced to RGB: the slot decides what a number or spectrum means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// Bounded to [0, 1]; spectra are seen under D65.
    Reflectance,
    /// Any non-negative value, such as eta, k or a roughness; spectra are seen under D65.
    Unbounded,
    /// Light: spectra are integrated as they are.
    Emissive,
}

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamType {
    /// A number.
    Float,
    /// A whole number.
    Integer,
    /// `true` or `false`.
    Boolean,
    /// Text.
    String,
    /// One of these words, letter case ignored.
    Choice(&'static [&'static str]),
    /// The name of an existing file.
    File,
    /// Three numbers: a point or a direction.
    Vector,
    /// A transform.
    Transform,
    /// A colour, the same everywhere.
    Rgb(Slot),
    /// A colour that a texture may vary.
    Color(Slot),
    /// A scalar that a texture may vary.
    Scalar(Slot),
    /// An index of refraction: a number or the name of a material.
    Ior,
    /// Anything; read and ignored.
    Any,
    /// A nested object of a kind: at least and at most so many.
    Child(ObjectKind, usize, usize),
}

/// The value of a parameter that a scene does not set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// It must be set.
    Required,
    /// It may stay unset, and the plugin does without.
    Unset,
    /// A number; also the grey of a colour.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// A truth value.
    Boolean(bool),
    /// A word.
    Text(&'static str),
    /// Three numbers.
    Vector([f64; 3]),
}

/// One parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param {
    /// Its name in the scene file. For children without a fixed name, the kind's tag.
    pub name: &'static str,
    /// Its type.
    pub ty: ParamType,
    /// What holds if it is not set.
    pub default: Default,
    /// Smallest allowed number.
    pub min: f64,
    /// Largest allowed number.
    pub max: f64,
    /// Whether `min` and `max` themselves are excluded.
    pub open: bool,
    /// Its meaning, in one line.
    pub doc: &'static str,
}

impl Param {
    const fn new(name: &'static str, ty: ParamType, default: Default, doc: &'static str) -> Self {
        Param { name, ty, default, min: f64::NEG_INFINITY, max: f64::INFINITY, open: false, doc }
    }

    /// A number with a default.
    pub const fn float(name: &'static str, default: f64, doc: &'static str) -> Self {
        Self::new(name, ParamType::Float, Default::Number(default), doc)
    }

    /// A number that may stay unset.
    pub const fn float_opt(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::Float, Default::Unset, doc)
    }

    /// A whole number with a default.
    pub const fn int(name: &'static str, default: i64, doc: &'static str) -> Self {
        Self::new(name, ParamType::Integer, Default::Integer(default), doc)
    }

    /// A whole number that may stay unset.
    pub const fn int_opt(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::Integer, Default::Unset, doc)
    }

    /// A truth value with a default.
    pub const fn bool(name: &'static str, default: bool, doc: &'static str) -> Self {
        Self::new(name, ParamType::Boolean, Default::Boolean(default), doc)
    }

    /// Text that may stay unset.
    pub const fn string_opt(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::String, Default::Unset, doc)
    }

    /// Text with a default.
    pub const fn string(name: &'static str, default: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::String, Default::Text(default), doc)
    }

    /// One of several words, with a default.
    pub const fn choice(
        name: &'static str,
        words: &'static [&'static str],
        default: &'static str,
        doc: &'static str,
    ) -> Self {
        Self::new(name, ParamType::Choice(words), Default::Text(default), doc)
    }

    /// A file that must be named.
    pub const fn file(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::File, Default::Required, doc)
    }

    /// Three numbers with a default.
    pub const fn vector(name: &'static str, default: [f64; 3], doc: &'static str) -> Self {
        Self::new(name, ParamType::Vector, Default::Vector(default), doc)
    }

    /// Three numbers that may stay unset.
    pub const fn vector_opt(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::Vector, Default::Unset, doc)
    }

    /// A transform; unset means identity.
    pub const fn transform(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::Transform, Default::Unset, doc)
    }

    /// A constant colour with a grey default.
    pub const fn rgb(name: &'static str, slot: Slot, default: f64, doc: &'static str) -> Self {
        Self::new(name, ParamType::Rgb(slot), Default::Number(default), doc)
    }

    /// A constant colour that may stay unset.
    pub const fn rgb_opt(name: &'static str, slot: Slot, doc: &'static str) -> Self {
        Self::new(name, ParamType::Rgb(slot), Default::Unset, doc)
    }

    /// A colour or texture with a grey default.
    pub const fn color(name: &'static str, slot: Slot, default: f64, doc: &'static str) -> Self {
        Self::new(name, ParamType::Color(slot), Default::Number(default), doc)
    }

    /// A colour or texture that may stay unset.
    pub const fn color_opt(name: &'static str, slot: Slot, doc: &'static str) -> Self {
        Self::new(name, ParamType::Color(slot), Default::Unset, doc)
    }

    /// A scalar or texture with a default.
    pub const fn scalar(name: &'static str, slot: Slot, default: f64, doc: &'static str) -> Self {
        Self::new(name, ParamType::Scalar(slot), Default::Number(default), doc)
    }

    /// A scalar or texture that may stay unset.
    pub const fn scalar_opt(name: &'static str, slot: Slot, doc: &'static str) -> Self {
        Self::new(name, ParamType::Scalar(slot), Default::Unset, doc)
    }

    /// An index of refraction with the name of a default material.
    pub const fn ior(name: &'static str, default: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::Ior, Default::Text(default), doc)
    }

    /// A parameter that is accepted and has no effect.
    pub const fn ignored(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, ParamType::Any, Default::Unset, doc)
    }

    /// Nested objects of a kind, at least `min` and at most `max`, whatever name they have.
    pub const fn child(kind: ObjectKind, min: usize, max: usize, doc: &'static str) -> Self {
        Self::new(kind.tag(), ParamType::Child(kind, min, max), Default::Unset, doc)
    }

    /// Makes it required.
    pub const fn required(mut self) -> Self {
        self.default = Default::Required;
        self
    }

    /// Allows numbers from `min` to `max`, both included.
    pub const fn range(mut self, min: f64, max: f64) -> Self {
        (self.min, self.max, self.open) = (min, max, false);
        self
    }

    /// Allows numbers between `min` and `max`, both excluded.
    pub const fn between(mut self, min: f64, max: f64) -> Self {
        (self.min, self.max, self.open) = (min, max, true);
        self
    }

    /// Allows numbers from `min` on.
    pub const fn at_least(self, min: f64) -> Self {
        self.range(min, f64::INFINITY)
    }

    /// Whether a number is allowed.
    pub fn allows(&self, v: f64) -> bool {
        if self.open { v > self.min && v < self.max } else { v >= self.min && v <= self.max }
    }

    /// The allowed numbers in words: `at least 0`, `between 0 and 180`.
    pub fn range_text(&self) -> String {
        match (self.min.is_finite(), self.max.is_finite(), self.open) {
            (true, true, true) => format!("between {} and {}, both excluded", self.min, self.max),
            (true, true, false) => format!("from {} to {}", self.min, self.max),
            (true, false, true) => format!("greater than {}", self.min),
            (true, false, false) => format!("at least {}", self.min),
            (false, true, true) => format!("less than {}", self.max),
            (false, true, false) => format!("at most {}", self.max),
            (false, false, _) => "any finite number".to_owned(),
        }
    }

    /// The type in words, for messages and the manual.
    pub fn type_text(&self) -> Cow<'static, str> {
        match self.ty {
            ParamType::Float => "float".into(),
            ParamType::Integer => "integer".into(),
            ParamType::Boolean => "boolean".into(),
            ParamType::String => "string".into(),
            ParamType::Choice(words) => format!("one of {}", words.join(", ")).into(),
            ParamType::File => "file name".into(),
            ParamType::Vector => "point or vector".into(),
            ParamType::Transform => "transform".into(),
            ParamType::Rgb(_) => "colour".into(),
            ParamType::Color(_) => "colour or texture".into(),
            ParamType::Scalar(_) => "float or texture".into(),
            ParamType::Ior => "float or material name".into(),
            ParamType::Any => "anything (ignored)".into(),
            ParamType::Child(kind, 1, 1) => format!("one nested {}", kind.tag()).into(),
            ParamType::Child(kind, 0, 1) => format!("a nested {}", kind.tag()).into(),
            ParamType::Child(kind, _, usize::MAX) => format!("nested {}s", kind.tag()).into(),
            ParamType::Child(kind, min, max) => format!("{min} to {max} nested {}s", kind.tag()).into(),
        }
    }

    /// The default in words, for the manual.
    pub fn default_text(&self) -> String {
        match self.default {
            Default::Required => "required".to_owned(),
            Default::Unset => match self.ty {
                ParamType::Transform => "identity".to_owned(),
                ParamType::Child(_, min, _) if min > 0 => "required".to_owned(),
                _ => "unset".to_owned(),
            },
            Default::Number(v) => v.to_string(),
            Default::Integer(v) => v.to_string(),
            Default::Boolean(v) => v.to_string(),
            Default::Text(v) => v.to_owned(),
            Default::Vector([x, y, z]) => format!("{x}, {y}, {z}"),
        }
    }
}
