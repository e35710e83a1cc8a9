//! All BSDFs: one file each, one line each in [`PLUGINS`].

mod diffuse;

use lucerna_core::scene::Plugin;

/// The table of all BSDFs.
pub const PLUGINS: &[Plugin] = &[diffuse::PLUGIN];
