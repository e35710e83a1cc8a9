//! All guides: one file or folder each, one line each in [`PLUGINS`].

mod sd_tree;

use lucerna_core::scene::Plugin;
pub(crate) use sd_tree::outlook_alone;

/// The table of all guides.
pub const PLUGINS: &[Plugin] = &[sd_tree::PLUGIN];
