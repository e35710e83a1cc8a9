//! All sensors: one file each, one line each in [`PLUGINS`].

use lucerna_core::scene::Plugin;

/// The table of all sensors.
pub const PLUGINS: &[Plugin] = &[];
