//! Vectors (from `glam`), frames, transforms, bounds and rounding-error bounds.
//!
//! Stored vectors are `glam::Vec3` (12 bytes); transforms keep single precision for use and are composed in double.

mod bounds;
pub mod error_bounds;
mod frame;
mod transform;

pub use bounds::Aabb;
pub use frame::Frame;
pub use glam::{DMat4, DVec3, IVec2, Mat4, UVec2, Vec2, Vec3};
pub use transform::Transform;

/// The largest `f32` below 1, for clamping random numbers.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// `x²`.
#[inline]
pub fn sqr(x: f32) -> f32 {
    x * x
}

/// `√max(x, 0)`: for radicands that rounding may push below zero.
#[inline]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

/// Linear interpolation, exact at both ends.
#[inline]
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// Two unit vectors perpendicular to the unit vector `n` and to each other (Duff et al. 2017, "Building an
/// orthonormal basis, revisited"). `(s, t, n)` is right-handed and has no singularity.
#[inline]
pub fn coordinate_system(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}
