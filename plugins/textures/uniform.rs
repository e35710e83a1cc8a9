//! `uniform`: the same value at every wavelength.
//!
//! Rendered as the grey of that value, also as light: a light of equal energy that looks pinkish beside D65 is written
//! as a property, `<spectrum name="radiance" value="1"/>`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `value` | float | required | the value |
//! | `wavelength_min`, `wavelength_max` | anything | | accepted, without effect on RGB |
//!
//! ```xml
//! <spectrum type="uniform" name="reflectance">
//!     <float name="value" value="0.7"/>
//! </spectrum>
//! ```

use super::Constant;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::Texture;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "uniform",
    aliases: &[],
    summary: "the same value at every wavelength",
    params: &[&[
        Param::float("value", 0.0, "the value").at_least(0.0).required(),
        Param::ignored("wavelength_min", "without effect on RGB"),
        Param::ignored("wavelength_max", "without effect on RGB"),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    Ok(Arc::new(Constant(Rgb::splat(p.float("value")))))
}
