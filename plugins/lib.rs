//! Everything a scene can choose.
//!
//! One folder per kind, one file per plugin, named after its XML `type`. The head of the file is its manual. To add
//! one, see `README.md` beside this file.
#![forbid(unsafe_code)]

pub mod bsdfs;
pub mod emitters;
pub mod films;
pub mod guides;
pub mod integrators;
pub mod light_samplers;
pub mod rfilters;
pub mod roulettes;
pub mod samplers;
pub mod sensors;
pub mod shapes;
pub mod textures;

#[cfg(test)]
mod testing;

use lucerna_core::scene::Registry;

/// All plugins of this package.
pub fn builtin() -> Registry {
    let mut registry = Registry::new();
    registry
        .add_all(integrators::PLUGINS)
        .add_all(sensors::PLUGINS)
        .add_all(films::PLUGINS)
        .add_all(guides::PLUGINS)
        .add_all(roulettes::PLUGINS)
        .add_all(rfilters::PLUGINS)
        .add_all(samplers::PLUGINS)
        .add_all(light_samplers::PLUGINS)
        .add_all(emitters::PLUGINS)
        .add_all(shapes::PLUGINS)
        .add_all(bsdfs::PLUGINS)
        .add_all(textures::PLUGINS);
    registry
}
