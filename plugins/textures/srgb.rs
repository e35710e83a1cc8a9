//! `srgb`: a colour in linear sRGB primaries.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `color` | colour | required | the colour, in [0, 1] unless `unbounded` |
//! | `unbounded` | boolean | false | allow more than 1 |
//!
//! ```xml
//! <spectrum type="srgb" name="reflectance">
//!     <rgb name="color" value="0.2, 0.5, 0.1"/>
//! </spectrum>
//! ```

use super::Constant;
use lucerna_core::interfaces::Texture;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "srgb",
    aliases: &[],
    summary: "a colour in linear sRGB primaries",
    params: &[&[
        Param::rgb("color", Slot::Unbounded, 0.0, "the colour, in [0, 1] unless unbounded").required(),
        Param::bool("unbounded", false, "allow more than 1"),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let (color, unbounded) = (p.rgb("color"), p.bool("unbounded"));
    if color.max_component() > 1.0 && !unbounded {
        return Err(p.error("color", "\"color\" must be in [0, 1] unless \"unbounded\" is true"));
    }
    Ok(Arc::new(Constant(color)))
}
