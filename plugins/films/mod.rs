//! All films: one file each, one line each in [`PLUGINS`].

mod hdrfilm;

use lucerna_core::scene::Plugin;

/// The table of all films.
pub const PLUGINS: &[Plugin] = &[hdrfilm::PLUGIN];
