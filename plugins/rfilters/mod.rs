//! All rfilters: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all rfilters.
pub const PLUGINS: &[Plugin] = &[];
