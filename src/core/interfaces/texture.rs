//! Values that vary over a surface.

use super::SurfaceHit;
use crate::color::Rgb;
use crate::math::Vec2;
use crate::scene::SpectrumValue;
use std::sync::Arc;

/// A texture.
pub trait Texture: Send + Sync {
    /// Colour at a hit; a single-channel texture gives it in all channels.
    fn color(&self, hit: &SurfaceHit) -> Rgb;

    /// Scalar at a hit; a colour texture that varies gives its luminance, a constant the mean of its channels.
    fn scalar(&self, hit: &SurfaceHit) -> f32;

    /// Derivative of the scalar with respect to the surface's u and v.
    fn gradient(&self, _hit: &SurfaceHit) -> Vec2 {
        Vec2::ZERO
    }

    /// Mean over the texture; decides sampling weights only.
    fn mean(&self) -> f32;

    /// The value if it is the same everywhere.
    fn constant(&self) -> Option<Rgb> {
        None
    }

    /// The spectrum, if it is one that the slot reduces to a colour, the same everywhere.
    fn spectrum(&self) -> Option<&SpectrumValue> {
        None
    }

    /// Largest value over the texture in any channel, if known.
    fn maximum(&self) -> Option<f32> {
        self.constant().map(Rgb::max_component)
    }

    /// Smallest value over the texture in any channel, if known.
    fn minimum(&self) -> Option<f32> {
        self.constant().map(Rgb::min_component)
    }

    /// Samples texture coordinates in proportion to luminance: `(uv, density per unit area of uv space)`.
    fn sample_position(&self, u2: Vec2) -> Option<(Vec2, f32)> {
        Some((u2, 1.0))
    }

    /// Density of [`sample_position`](Self::sample_position).
    fn pdf_position(&self, _uv: Vec2) -> f32 {
        1.0
    }
}

/// A colour parameter: a constant costs nothing, a texture one virtual call.
#[derive(Clone)]
pub enum ColorSource {
    /// The same everywhere.
    Constant(Rgb),
    /// Looked up at the hit.
    Textured(Arc<dyn Texture>),
}

impl ColorSource {
    /// Value at a hit.
    #[inline]
    pub fn at(&self, hit: &SurfaceHit) -> Rgb {
        match self {
            ColorSource::Constant(value) => *value,
            ColorSource::Textured(texture) => texture.color(hit),
        }
    }

    /// The value if it is the same everywhere.
    #[inline]
    pub fn constant(&self) -> Option<Rgb> {
        match self {
            ColorSource::Constant(value) => Some(*value),
            ColorSource::Textured(_) => None,
        }
    }

    /// Mean over the surface, for sampling weights.
    pub fn mean(&self) -> f32 {
        match self {
            ColorSource::Constant(value) => value.mean(),
            ColorSource::Textured(texture) => texture.mean(),
        }
    }
}

/// A scalar parameter: a constant costs nothing, a texture one virtual call.
#[derive(Clone)]
pub enum ScalarSource {
    /// The same everywhere.
    Constant(f32),
    /// Looked up at the hit.
    Textured(Arc<dyn Texture>),
}

impl ScalarSource {
    /// Value at a hit.
    #[inline]
    pub fn at(&self, hit: &SurfaceHit) -> f32 {
        match self {
            ScalarSource::Constant(value) => *value,
            ScalarSource::Textured(texture) => texture.scalar(hit),
        }
    }

    /// The value if it is the same everywhere.
    #[inline]
    pub fn constant(&self) -> Option<f32> {
        match self {
            ScalarSource::Constant(value) => Some(*value),
            ScalarSource::Textured(_) => None,
        }
    }

    /// Mean over the surface, for sampling weights.
    pub fn mean(&self) -> f32 {
        match self {
            ScalarSource::Constant(value) => *value,
            ScalarSource::Textured(texture) => texture.mean(),
        }
    }
}
