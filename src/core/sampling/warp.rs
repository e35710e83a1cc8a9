//! Maps from the unit square to the domains light transport needs, and their densities.

use crate::math::{Vec2, Vec3, lerp, safe_sqrt, sqr};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI, TAU};

/// The unit square to the unit disk, area preserving up to a constant and continuous
/// (Shirley and Chiu 1997, "A low distortion map between disk and square").
#[inline]
pub fn square_to_disk_concentric(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    // The angle is counted from the nearer axis. Which one it is cannot be predicted: choices without jumps.
    let steep = p.x.abs() < p.y.abs();
    let (r, aside) = if steep { (p.y, p.x) } else { (p.x, p.y) };
    if r == 0.0 {
        return Vec2::ZERO;
    }
    let (sin, cos) = sin_cos_of_eighth(FRAC_PI_4 * (aside / r));
    let (along, across) = (r * cos, r * sin);
    Vec2::new(if steep { across } else { along }, if steep { along } else { across })
}

/// Sine and cosine on [−π/4, π/4], within 1.2e-7: the first terms of their power series.
#[inline]
fn sin_cos_of_eighth(x: f32) -> (f32, f32) {
    let z = x * x;
    let sin = z * (-1.0 / 6.0 + z * (1.0 / 120.0 + z * (-1.0 / 5040.0 + z * (1.0 / 362_880.0))));
    let cos = z * (-0.5 + z * (1.0 / 24.0 + z * (-1.0 / 720.0 + z * (1.0 / 40320.0 + z * (-1.0 / 3_628_800.0)))));
    (x + x * sin, 1.0 + cos)
}

/// Cosine-weighted direction about +z; density [`cosine_hemisphere_pdf`].
#[inline]
pub fn square_to_cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = square_to_disk_concentric(u);
    p.extend(safe_sqrt(1.0 - p.length_squared()))
}

/// `max(cos θ, 0) / π` per solid angle.
#[inline]
pub fn cosine_hemisphere_pdf(v: Vec3) -> f32 {
    v.z.max(0.0) * FRAC_1_PI
}

/// Uniform direction on the sphere; density `1/4π`.
#[inline]
pub fn square_to_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.y;
    let r = safe_sqrt(1.0 - z * z);
    let (sin, cos) = (TAU * u.x).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// `1/4π` per solid angle.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform point of a triangle as barycentric coordinates of its second and third vertex.
#[inline]
pub fn square_to_triangle(u: Vec2) -> Vec2 {
    let t = safe_sqrt(1.0 - u.x);
    Vec2::new(1.0 - t, t * u.y)
}

/// [0, 1] to [−1, 1] with density `1 − |x|`.
#[inline]
pub fn interval_to_tent(u: f32) -> f32 {
    let u = u - 0.5;
    (1.0 - safe_sqrt(1.0 - 2.0 * u.abs())).copysign(u)
}

/// [0, 1] to [0, 1] with a density in proportion to the line from `v0` at 0 to `v1` at 1.
#[inline]
pub fn interval_to_linear(v0: f32, v1: f32, u: f32) -> f32 {
    // Where the line is nearly level, the quotient is a difference of nearly equal numbers.
    if (v0 - v1).abs() > 1e-4 * (v0 + v1) { (v0 - safe_sqrt(lerp(sqr(v0), sqr(v1), u))) / (v0 - v1) } else { u }
}

/// The unit square to itself with a density in proportion to the bilinear interpolation of the values at its corners
/// (0, 0), (1, 0), (0, 1), (1, 1); and the interpolated value at the point.
#[inline]
pub fn square_to_bilinear([v00, v10, v01, v11]: [f32; 4], u: Vec2) -> (Vec2, f32) {
    let y = interval_to_linear(v00 + v10, v01 + v11, u.y);
    let (left, right) = (lerp(v00, v01, y), lerp(v10, v11, y));
    let x = interval_to_linear(left, right, u.x);
    (Vec2::new(x, y), lerp(left, right, x))
}

/// The angle of a direction about +z, in [0, 2π).
#[inline]
pub fn azimuth(x: f32, y: f32) -> f32 {
    let phi = y.atan2(x);
    if phi < 0.0 { phi + 2.0 * PI } else { phi }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_of_an_eighth() {
        for i in -1000..=1000 {
            let x = i as f32 * (FRAC_PI_4 / 1000.0);
            let (sin, cos) = sin_cos_of_eighth(x);
            let exact = f64::from(x).sin_cos();
            assert!((f64::from(sin) - exact.0).abs() < 1.2e-7 && (f64::from(cos) - exact.1).abs() < 1.2e-7, "{x}");
        }
    }

    #[test]
    fn concentric_disk() {
        let at = |x, y| square_to_disk_concentric(Vec2::new(x, y));
        let half = 0.5_f32.sqrt();
        let known = [
            ((0.5, 0.5), (0.0, 0.0)),
            ((1.0, 1.0), (half, half)),
            ((0.5, 0.0), (0.0, -1.0)),
            ((0.0, 0.5), (-1.0, 0.0)),
        ];
        for ((x, y), (px, py)) in known {
            assert!(at(x, y).distance(Vec2::new(px, py)) < 2e-7, "{x} {y}");
        }
    }
}
