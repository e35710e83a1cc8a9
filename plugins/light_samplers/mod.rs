//! All decisions which light a vertex samples: one file each, one line each in [`PLUGINS`].
//!
//! They are nested in an integrator, or named with `--light-sampler`. Without one an integrator picks lights by the
//! scene's weights, as `uniform` does.

mod light_tree;
mod power;
mod ris;
mod uniform;

use lucerna_core::scene::Plugin;

/// The table of all light samplers.
pub const PLUGINS: &[Plugin] = &[uniform::PLUGIN, power::PLUGIN, light_tree::PLUGIN, ris::PLUGIN];
