//! `blackbody`: the light of a hot black body (Planck 1901).
//!
//! Spectral radiance in W·m⁻²·sr⁻¹·nm⁻¹, integrated against the eye's curves: about 10⁴ at 5000 K, so scale it down.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `temperature` | float | required | temperature in kelvin |
//! | `scale` | float | 1 | factor on the radiance |
//! | `wavelength_min`, `wavelength_max` | float | 360, 830 | zero outside, in nm |
//!
//! ```xml
//! <spectrum type="blackbody" name="radiance">
//!     <float name="temperature" value="3200"/>
//!     <float name="scale" value="0.001"/>
//! </spectrum>
//! ```

use super::Spectrum;
use lucerna_core::color::{cie, spectrum};
use lucerna_core::interfaces::Texture;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, SpectrumValue};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "blackbody",
    aliases: &[],
    summary: "the light of a hot black body",
    params: &[&[
        Param::float("temperature", 0.0, "temperature in kelvin").range(1.0, 1e9).required(),
        Param::float("scale", 1.0, "factor on the radiance").at_least(0.0),
        Param::float("wavelength_min", 360.0, "zero below, in nm").at_least(1.0),
        Param::float("wavelength_max", 830.0, "zero above, in nm").at_least(1.0),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let [temperature, scale, min, max] =
        ["temperature", "scale", "wavelength_min", "wavelength_max"].map(|n| p.double(n));
    if min >= max {
        return Err(p.error("wavelength_max", "\"wavelength_max\" must be greater than \"wavelength_min\""));
    }
    let spectrum = if min <= cie::FIRST && max >= cie::LAST {
        SpectrumValue::Blackbody { temperature, scale }
    } else {
        let wavelength = |i| min + (max - min) * f64::from(i) / 1000.0;
        SpectrumValue::Table(
            (0..=1000).map(wavelength).map(|w| (w, scale * spectrum::planck(temperature, w))).collect(),
        )
    };
    Ok(Arc::new(Spectrum::new(spectrum)))
}
