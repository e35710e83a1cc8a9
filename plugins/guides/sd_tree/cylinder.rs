//! The sphere of directions as a square: u is (z + 1)/2, v the angle about z over 2π. Areas are kept, so a density on
//! the square is 4π times the density per solid angle.

use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::sampling::warp::azimuth;
use std::f32::consts::TAU;

/// The point of a direction, in [0, 1)².
#[inline]
pub fn of_direction(d: Vec3) -> Vec2 {
    let u = 0.5 * d.z + 0.5;
    let v = azimuth(d.x, d.y) * (1.0 / TAU);
    // Taken as vectors, what is not a number becomes 0.
    Vec2::new(u, v).max(Vec2::ZERO).min(Vec2::splat(ONE_MINUS_EPSILON))
}

/// The unit direction of a point.
#[inline]
pub fn to_direction(p: Vec2) -> Vec3 {
    let z = 2.0 * p.x - 1.0;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * p.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        for i in 0..32 {
            for j in 0..32 {
                let p = Vec2::new((i as f32 + 0.5) / 32.0, (j as f32 + 0.25) / 32.0);
                let d = to_direction(p);
                assert!((d.length() - 1.0).abs() < 1e-6);
                assert!((of_direction(d) - p).abs().max_element() < 1e-5, "{p}");
            }
        }
    }

    #[test]
    fn any_direction_is_inside() {
        for d in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(1.0, -1e-30, 0.0), Vec3::NAN, Vec3::ZERO, Vec3::splat(1e30)] {
            let p = of_direction(d);
            assert!(p.cmpge(Vec2::ZERO).all() && p.cmplt(Vec2::ONE).all(), "{d}: {p}");
        }
    }
}
