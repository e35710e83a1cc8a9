//! All emitters: one file each, one line each in [`PLUGINS`].

mod sunsky;

use lucerna_core::scene::Plugin;

/// The table of all emitters.
pub const PLUGINS: &[Plugin] = &[sunsky::PLUGIN];
