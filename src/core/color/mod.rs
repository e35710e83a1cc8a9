//! Colour: linear RGB, and spectra reduced to it as the reference renderer does.

pub mod cie;
pub mod ior;
mod rgb;
pub mod spectrum;

pub use rgb::Rgb;
