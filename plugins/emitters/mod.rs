//! All emitters: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all emitters.
pub const PLUGINS: &[Plugin] = &[];
