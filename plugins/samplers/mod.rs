//! All samplers: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all samplers.
pub const PLUGINS: &[Plugin] = &[];
