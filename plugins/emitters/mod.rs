//! All emitters: one file each, one line each in [`PLUGINS`].

mod area;
mod constant;
mod directional;
mod envmap;
mod point;
mod spot;
mod sunsky;
#[cfg(test)]
pub(crate) mod testing;

use lucerna_core::scene::{Param, Plugin};

/// The table of all emitters.
pub const PLUGINS: &[Plugin] =
    &[area::PLUGIN, constant::PLUGIN, directional::PLUGIN, envmap::PLUGIN, point::PLUGIN, spot::PLUGIN, sunsky::PLUGIN];

/// What all emitters accept.
const COMMON: &[Param] =
    &[Param::float("sampling_weight", 1.0, "relative chance of being sampled for direct light").at_least(0.0)];
