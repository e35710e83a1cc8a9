//! `regular`: a spectrum given at evenly spaced wavelengths.
//!
//! Interpolated linearly, zero outside. The slot decides about its colour: light is integrated as it is, a
//! reflectance is seen under D65.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `values` | string | required | two numbers or more |
//! | `wavelength_min`, `wavelength_max` | float | required | wavelengths of the first and last number in nm |
//!
//! ```xml
//! <spectrum type="regular" name="reflectance">
//!     <string name="values" value="0.1, 0.3, 0.5, 0.4"/>
//!     <float name="wavelength_min" value="400"/>
//!     <float name="wavelength_max" value="700"/>
//! </spectrum>
//! ```

use super::{Spectrum, numbers};
use lucerna_core::interfaces::Texture;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, SpectrumValue};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "regular",
    aliases: &[],
    summary: "a spectrum at evenly spaced wavelengths",
    params: &[&[
        Param::string_opt("values", "two numbers or more").required(),
        Param::float("wavelength_min", 0.0, "wavelength of the first number in nm").at_least(0.0).required(),
        Param::float("wavelength_max", 0.0, "wavelength of the last number in nm").at_least(0.0).required(),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let values = numbers(p, "values")?;
    let (min, max) = (p.double("wavelength_min"), p.double("wavelength_max"));
    if values.len() < 2 {
        return Err(p.error("values", format!("a spectrum needs two values or more, found {}", values.len())));
    }
    if min >= max {
        return Err(p.error("wavelength_max", "\"wavelength_max\" must be greater than \"wavelength_min\""));
    }
    let step = (max - min) / (values.len() - 1) as f64;
    let table = values.iter().enumerate().map(|(i, v)| (min + step * i as f64, *v)).collect();
    Ok(Arc::new(Spectrum::new(SpectrumValue::Table(table))))
}
