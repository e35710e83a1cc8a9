//! All integrators: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all integrators.
pub const PLUGINS: &[Plugin] = &[];
