//! `checkerboard`: two colours in the squares of a board.
//!
//! The board repeats with the unit square, which it divides into 2 × 2 fields: `color0` is at (0, 0).
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `color0` | colour or texture | 0.4 | upper left and lower right fields |
//! | `color1` | colour or texture | 0.2 | upper right and lower left fields |
//! | `to_uv` | transform | identity | applied to texture coordinates; a scale by n gives 2n × 2n fields |
//!
//! In a scalar slot (weight, opacity, roughness) the reference renderer swaps the two colours, and so does this one,
//! so that scenes look the same.
//!
//! ```xml
//! <texture type="checkerboard">
//!     <rgb name="color0" value="0.1, 0.1, 0.1"/>
//!     <rgb name="color1" value="0.9, 0.9, 0.9"/>
//!     <transform name="to_uv"><scale value="10"/></transform>
//! </texture>
//! ```

use super::UvTransform;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{ColorSource, SurfaceHit, Texture};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "checkerboard",
    aliases: &[],
    summary: "two colours in the squares of a board",
    params: &[&[
        Param::color("color0", Slot::Unbounded, 0.4, "upper left and lower right fields"),
        Param::color("color1", Slot::Unbounded, 0.2, "upper right and lower left fields"),
        Param::transform("to_uv", "applied to texture coordinates"),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    Ok(Arc::new(Checkerboard {
        colors: [p.color("color0"), p.color("color1")],
        to_uv: UvTransform::new(p.matrix("to_uv")),
    }))
}

struct Checkerboard {
    colors: [ColorSource; 2],
    to_uv: UvTransform,
}

impl Checkerboard {
    /// Which of the colours is at a hit.
    fn field(&self, hit: &SurfaceHit) -> usize {
        let uv = self.to_uv.apply(hit.uv);
        let beyond = (uv - uv.floor()).cmpgt(lucerna_core::math::Vec2::splat(0.5));
        usize::from(beyond.test(0) != beyond.test(1))
    }
}

impl Texture for Checkerboard {
    fn color(&self, hit: &SurfaceHit) -> Rgb {
        self.colors[self.field(hit)].at(hit)
    }

    fn scalar(&self, hit: &SurfaceHit) -> f32 {
        match &self.colors[1 - self.field(hit)] {
            ColorSource::Constant(color) => color.mean(),
            ColorSource::Textured(texture) => texture.scalar(hit),
        }
    }

    fn mean(&self) -> f32 {
        0.5 * (self.colors[0].mean() + self.colors[1].mean())
    }

    fn maximum(&self) -> Option<f32> {
        let maximum = |source: &ColorSource| match source {
            ColorSource::Constant(color) => Some(color.max_component()),
            ColorSource::Textured(texture) => texture.maximum(),
        };
        Some(maximum(&self.colors[0])?.max(maximum(&self.colors[1])?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emitters::testing::{self, assert_close, golden, matrix, rgb};
    use lucerna_core::math::{DMat4, Vec2};
    use lucerna_core::scene::{Object, ObjectKind};

    #[test]
    fn looks_as_the_reference() {
        let to_uv = DMat4::from_cols_array_2d(&[
            [2.0, 0.3, 0.0, 0.0],
            [0.5, -1.5, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.1, 0.2, 0.0, 1.0],
        ]);
        for (case, to_uv) in [("checkerboard", DMat4::IDENTITY), ("checkerboard_transformed", to_uv)] {
            let colors = [rgb("color0", [0.1, 0.2, 0.3]), rgb("color1", [0.9, 0.6, 0.7])];
            let parameters = colors.into_iter().chain([matrix("to_uv", to_uv)]).collect();
            let Ok(Object::Texture(texture)) = testing::build(ObjectKind::Texture, "checkerboard", parameters) else {
                panic!("a checkerboard was asked for")
            };
            for line in golden(include_str!("golden.txt"), case) {
                let hit = SurfaceHit { uv: Vec2::from_slice(&line), ..SurfaceHit::default() };
                let [r, g, b] = texture.color(&hit).to_array();
                assert_close(&[r, g, b, texture.scalar(&hit)], &line[2..6], case);
            }
        }
    }
}
