//! `irregular`: a spectrum given at any wavelengths.
//!
//! Interpolated linearly, zero outside. The slot decides about its colour: light is integrated as it is, a
//! reflectance is seen under D65.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `wavelengths` | string | required | two increasing numbers or more, in nm |
//! | `values` | string | required | as many numbers |
//!
//! ```xml
//! <spectrum type="irregular" name="reflectance">
//!     <string name="wavelengths" value="400, 520, 700"/>
//!     <string name="values" value="0.1, 0.3, 0.5"/>
//! </spectrum>
//! ```

use super::{Spectrum, numbers};
use lucerna_core::interfaces::Texture;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, SpectrumValue};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "irregular",
    aliases: &[],
    summary: "a spectrum at any wavelengths",
    params: &[&[
        Param::string_opt("wavelengths", "two increasing numbers or more, in nm").required(),
        Param::string_opt("values", "as many numbers").required(),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let (wavelengths, values) = (numbers(p, "wavelengths")?, numbers(p, "values")?);
    if values.len() < 2 || values.len() != wavelengths.len() {
        let message = format!(
            "a spectrum needs two values or more and as many wavelengths, found {} and {}",
            values.len(),
            wavelengths.len()
        );
        return Err(p.error("values", message));
    }
    if wavelengths.windows(2).any(|w| w[0] >= w[1]) {
        return Err(p.error("wavelengths", "wavelengths must increase"));
    }
    let table = wavelengths.into_iter().zip(values).collect();
    Ok(Arc::new(Spectrum::new(SpectrumValue::Table(table))))
}
