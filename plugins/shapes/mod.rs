//! All shapes: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all shapes.
pub const PLUGINS: &[Plugin] = &[];
