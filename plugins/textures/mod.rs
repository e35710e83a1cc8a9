//! All textures: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all textures.
pub const PLUGINS: &[Plugin] = &[];
