//! Directions that all lie in a cone about +z.

use lucerna::core::math::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A uniform one, for the cosine of the half angle.
pub fn sample(u2: Vec2, cosine: f32) -> Vec3 {
    let z = 1.0 - u2.x * (1.0 - cosine);
    let (sin, cos) = (TAU * u2.y).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Its density per solid angle.
pub fn pdf(cosine: f32) -> f32 {
    1.0 / (TAU * (1.0 - cosine))
}
