//! All integrators: one file each, one line each in [`PLUGINS`].

mod ahead;
mod aov;
mod common;
mod decides;
mod depth;
mod direct;
mod directions;
mod guided;
mod lights;
mod moment;
mod path;
mod path_kernel;
mod volpath;
mod volpathmis;
mod with_environment;

use lucerna_core::scene::Plugin;

/// The table of all integrators.
pub const PLUGINS: &[Plugin] =
    &[path::PLUGIN, direct::PLUGIN, volpath::PLUGIN, volpathmis::PLUGIN, depth::PLUGIN, aov::PLUGIN, moment::PLUGIN];
