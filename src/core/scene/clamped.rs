//! A texture kept in the range of a reflectance.

use crate::color::Rgb;
use crate::interfaces::{SurfaceHit, Texture};
use crate::math::Vec2;
use std::sync::Arc;

/// A texture clamped to [0, 1].
pub(super) struct Clamped(pub Arc<dyn Texture>);

impl Texture for Clamped {
    fn color(&self, hit: &SurfaceHit) -> Rgb {
        self.0.color(hit).map(|v| v.clamp(0.0, 1.0))
    }

    fn scalar(&self, hit: &SurfaceHit) -> f32 {
        self.0.scalar(hit).clamp(0.0, 1.0)
    }

    fn gradient(&self, hit: &SurfaceHit) -> Vec2 {
        self.0.gradient(hit)
    }

    fn mean(&self) -> f32 {
        self.0.mean().clamp(0.0, 1.0)
    }

    fn constant(&self) -> Option<Rgb> {
        self.0.constant().map(|color| color.map(|v| v.clamp(0.0, 1.0)))
    }

    fn minimum(&self) -> Option<f32> {
        self.0.minimum().map(|v| v.clamp(0.0, 1.0))
    }

    fn maximum(&self) -> Option<f32> {
        Some(1.0)
    }

    fn sample_position(&self, u2: Vec2) -> Option<(Vec2, f32)> {
        self.0.sample_position(u2)
    }

    fn pdf_position(&self, uv: Vec2) -> f32 {
        self.0.pdf_position(uv)
    }
}
