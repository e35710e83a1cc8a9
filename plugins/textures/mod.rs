//! All textures and spectra: one file each, one line each in [`PLUGINS`].

mod bitmap;
mod blackbody;
mod checkerboard;
mod constant;
mod d65;
mod irregular;
mod rawconstant;
mod regular;
mod srgb;
mod uniform;
mod uv;

use constant::{Constant, Spectrum, numbers};
use lucerna_core::scene::Plugin;
use uv::UvTransform;

/// The table of all textures.
pub const PLUGINS: &[Plugin] = &[
    bitmap::PLUGIN,
    blackbody::PLUGIN,
    checkerboard::PLUGIN,
    d65::PLUGIN,
    irregular::PLUGIN,
    rawconstant::PLUGIN,
    regular::PLUGIN,
    srgb::PLUGIN,
    uniform::PLUGIN,
];

#[cfg(test)]
pub(crate) use bitmap::tests::slide;
