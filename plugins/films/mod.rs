//! All films: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all films.
pub const PLUGINS: &[Plugin] = &[];
