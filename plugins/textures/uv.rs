//! Transforms of texture coordinates.

use lucerna_core::math::{DMat4, Vec2};

/// An affine transform of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UvTransform {
    /// Images of the two axes.
    u: Vec2,
    v: Vec2,
    origin: Vec2,
}

impl UvTransform {
    /// From the x and y part of a transform in space.
    pub fn new(m: DMat4) -> Self {
        let xy = |column: glam::DVec4| column.truncate().truncate().as_vec2();
        UvTransform { u: xy(m.x_axis), v: xy(m.y_axis), origin: xy(m.w_axis) }
    }

    /// Transformed coordinates.
    #[inline]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.u * uv.x + self.v * uv.y + self.origin
    }

    /// A gradient with respect to transformed coordinates as one with respect to the original ones.
    #[inline]
    pub fn pull_back(&self, gradient: Vec2) -> Vec2 {
        Vec2::new(gradient.dot(self.u), gradient.dot(self.v))
    }

    /// Whether it changes nothing.
    pub fn is_identity(&self) -> bool {
        (self.u, self.v, self.origin) == (Vec2::X, Vec2::Y, Vec2::ZERO)
    }
}
