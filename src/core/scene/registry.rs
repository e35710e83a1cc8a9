//! Explicit tables of all plugins, one per kind.
//!
//! No link-time magic: what is in the tables is what exists, and a program that wants its own plugins adds them to
//! a registry before it starts.

use super::description::ObjectKind;
use super::param::Param;
use super::properties::Properties;
use crate::interfaces::{
    Bsdf, Emitter, Film, Guide, Integrator, LightSampler, Rfilter, Roulette, Sampler, Sensor, Shape, Texture,
};
use std::sync::Arc;

/// Returned by a constructor that could not go on. What was wrong has been told to [`Properties`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failed;

/// What a constructor gives.
pub type Built<T> = Result<Arc<T>, Failed>;

/// How a plugin of each kind is made.
#[derive(Clone, Copy)]
#[allow(missing_docs)]
pub enum Constructor {
    Integrator(fn(&Properties<'_>) -> Built<dyn Integrator>),
    Sensor(fn(&Properties<'_>) -> Built<dyn Sensor>),
    Film(fn(&Properties<'_>) -> Built<dyn Film>),
    Rfilter(fn(&Properties<'_>) -> Built<dyn Rfilter>),
    Sampler(fn(&Properties<'_>) -> Built<dyn Sampler>),
    Emitter(fn(&Properties<'_>) -> Built<dyn Emitter>),
    Shape(fn(&Properties<'_>) -> Built<dyn Shape>),
    Bsdf(fn(&Properties<'_>) -> Built<dyn Bsdf>),
    LightSampler(fn(&Properties<'_>) -> Built<dyn LightSampler>),
    Texture(fn(&Properties<'_>) -> Built<dyn Texture>),
    Guide(fn(&Properties<'_>) -> Built<dyn Guide>),
    Roulette(fn(&Properties<'_>) -> Built<dyn Roulette>),
}

impl Constructor {
    /// The kind of object it makes.
    pub fn kind(&self) -> ObjectKind {
        match self {
            Constructor::Integrator(_) => ObjectKind::Integrator,
            Constructor::Sensor(_) => ObjectKind::Sensor,
            Constructor::Film(_) => ObjectKind::Film,
            Constructor::Rfilter(_) => ObjectKind::Rfilter,
            Constructor::Sampler(_) => ObjectKind::Sampler,
            Constructor::Emitter(_) => ObjectKind::Emitter,
            Constructor::Shape(_) => ObjectKind::Shape,
            Constructor::Bsdf(_) => ObjectKind::Bsdf,
            Constructor::LightSampler(_) => ObjectKind::LightSampler,
            Constructor::Texture(_) => ObjectKind::Texture,
            Constructor::Guide(_) => ObjectKind::Guide,
            Constructor::Roulette(_) => ObjectKind::Roulette,
        }
    }
}

/// One plugin.
#[derive(Clone, Copy)]
pub struct Plugin {
    /// The XML `type`.
    pub name: &'static str,
    /// Other names it goes by.
    pub aliases: &'static [&'static str],
    /// What it is, in one line.
    pub summary: &'static str,
    /// Its parameters: groups shared with others first, its own last.
    pub params: &'static [&'static [Param]],
    /// How it is made.
    pub build: Constructor,
}

impl Plugin {
    /// All parameters in order.
    pub fn all_params(&self) -> impl Iterator<Item = &'static Param> {
        self.params.iter().flat_map(|group| group.iter())
    }

    /// The parameter of that name.
    pub fn param(&self, name: &str) -> Option<&'static Param> {
        self.all_params().find(|p| p.name == name)
    }
}

/// All plugins a program knows.
#[derive(Clone, Default)]
pub struct Registry {
    plugins: Vec<Plugin>,
}

impl Registry {
    /// An empty one.
    pub fn new() -> Self {
        Registry::default()
    }

    /// Adds a plugin. A later one of the same kind and name replaces an earlier one.
    pub fn add(&mut self, plugin: Plugin) -> &mut Self {
        self.plugins.retain(|p| (p.build.kind(), p.name) != (plugin.build.kind(), plugin.name));
        self.plugins.push(plugin);
        self
    }

    /// Adds several.
    pub fn add_all(&mut self, plugins: &[Plugin]) -> &mut Self {
        for plugin in plugins {
            self.add(*plugin);
        }
        self
    }

    /// The plugin of a kind that goes by a name.
    pub fn find(&self, kind: ObjectKind, name: &str) -> Option<&Plugin> {
        self.of_kind(kind).find(|p| p.name == name || p.aliases.contains(&name))
    }

    /// All plugins of a kind, in the order they were added.
    pub fn of_kind(&self, kind: ObjectKind) -> impl Iterator<Item = &Plugin> {
        self.plugins.iter().filter(move |p| p.build.kind() == kind)
    }

    /// All plugins.
    pub fn all(&self) -> impl Iterator<Item = &Plugin> {
        self.plugins.iter()
    }
}
