//! `rawconstant`: one number or three, never converted.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `value` | float or vector | required | the value |
//!
//! ```xml
//! <texture type="rawconstant" name="normalmap">
//!     <vector name="value" x="0.5" y="0.5" z="1"/>
//! </texture>
//! ```

use super::Constant;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::Texture;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "rawconstant",
    aliases: &[],
    summary: "one number or three, never converted",
    params: &[&[Param::ignored("value", "one number or a vector of three").required()]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let value = match (p.vector_opt("value"), p.float_opt("value")) {
        (Some(v), _) => Rgb::new(v.x, v.y, v.z),
        (None, Some(v)) => Rgb::splat(v),
        (None, None) => return Err(p.error("value", "\"value\" must be a float or a vector")),
    };
    if !value.is_finite() {
        return Err(p.error("value", "\"value\" must be finite in single precision"));
    }
    Ok(Arc::new(Constant(value)))
}
