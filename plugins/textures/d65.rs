//! `d65`: daylight, perhaps coloured or varied by a texture.
//!
//! D65 is white in RGB: the value is `color · scale`, times the nested texture if there is one.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `color` | colour | 1 | colour of the light |
//! | `scale` | float | 1 | factor |
//! | nested texture | texture | none | factor |
//!
//! ```xml
//! <spectrum type="d65" name="radiance">
//!     <float name="scale" value="12"/>
//! </spectrum>
//! ```

use super::Constant;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{SurfaceHit, Texture};
use lucerna_core::math::Vec2;
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Slot};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "d65",
    aliases: &[],
    summary: "daylight, perhaps coloured or varied by a texture",
    params: &[&[
        Param::rgb("color", Slot::Emissive, 1.0, "colour of the light"),
        Param::float("scale", 1.0, "factor").at_least(0.0),
        Param::child(ObjectKind::Texture, 0, 1, "factor"),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let color = p.rgb("color") * p.float("scale");
    Ok(match p.free_textures().pop() {
        None => Arc::new(Constant(color)),
        Some((_, texture)) => match texture.constant() {
            Some(factor) => Arc::new(Constant(color * factor)),
            None => Arc::new(Scaled { color, texture }),
        },
    })
}

struct Scaled {
    color: Rgb,
    texture: Arc<dyn Texture>,
}

impl Texture for Scaled {
    fn color(&self, hit: &SurfaceHit) -> Rgb {
        self.color * self.texture.color(hit)
    }

    fn scalar(&self, hit: &SurfaceHit) -> f32 {
        self.color(hit).luminance()
    }

    fn gradient(&self, hit: &SurfaceHit) -> Vec2 {
        self.texture.gradient(hit) * self.color.luminance()
    }

    fn mean(&self) -> f32 {
        self.color.luminance() * self.texture.mean()
    }

    fn maximum(&self) -> Option<f32> {
        self.texture.maximum().map(|v| v * self.color.max_component())
    }

    fn sample_position(&self, u2: Vec2) -> Option<(Vec2, f32)> {
        self.texture.sample_position(u2)
    }

    fn pdf_position(&self, uv: Vec2) -> f32 {
        self.texture.pdf_position(uv)
    }
}
