//! All reconstruction filters: one file each, one line each in [`PLUGINS`].

mod r#box;
mod catmullrom;
mod gaussian;
mod lanczos;
mod mitchell;
mod tent;

use lucerna_core::scene::Plugin;

/// The table of all reconstruction filters.
pub const PLUGINS: &[Plugin] =
    &[r#box::PLUGIN, catmullrom::PLUGIN, gaussian::PLUGIN, lanczos::PLUGIN, mitchell::PLUGIN, tent::PLUGIN];

#[cfg(test)]
mod tests;
