//! How far a computed point can be from the true one, and how far to step away from a surface.
//!
//! A hit point carries a bound on its absolute error on each axis (Pharr, Jakob, Humphreys, "Physically Based
//! Rendering", 4th ed. 2023, section 6.8). A ray that leaves the point starts just outside the box of that size, so
//! it neither hits the surface it leaves nor skips a gap wider than the rounding error. No constant depends on the
//! size of the scene.

use super::Vec3;
use glam::Vec3A;

/// Unit roundoff of `f32`.
const UNIT: f32 = f32::EPSILON * 0.5;

/// `γ(n) = n u / (1 − n u)`: bound on the relative error of `n` operations in a row.
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * UNIT;
    nu / (1.0 - nu)
}

/// The start of a ray that leaves `p` in direction `d`: `p` moved along the geometric normal `n`, to the side `d`
/// points to, out of the box of half size `p_error`, then rounded away from the surface.
#[inline]
pub fn offset_origin(p: Vec3, p_error: Vec3, n: Vec3, d: Vec3) -> Vec3 {
    let [p, p_error, n, d] = [p, p_error, n, d].map(Vec3A::from);
    let offset = n * n.abs().dot(p_error).copysign(d.dot(n));
    Vec3::from(round_away(p + offset, offset))
}

/// On each axis a number beyond `x` towards `direction`, by a few roundings at most; `x` itself where that is 0.
#[inline]
fn round_away(x: Vec3A, direction: Vec3A) -> Vec3A {
    // Half an ulp would do for all but powers of two, and the smallest number for those too small for a relative step.
    let step = (x.abs() * f32::EPSILON).max(Vec3A::splat(f32::from_bits(1)));
    Vec3A::select(direction.cmpeq(Vec3A::ZERO), x, x + step.copysign(direction))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_beyond_the_number_but_not_far() {
        for x in [0.0, -0.0, 1.0, -1.0, 1e-45, -1e-45, 1e10, -3.3e-39] {
            let away = |direction: f32| {
                let moved = round_away(Vec3A::splat(x), Vec3A::splat(direction));
                assert!(moved == Vec3A::splat(moved.x));
                moved.x
            };
            let limit = x.abs() * 2.5e-7;
            assert!(away(2.0) >= x.next_up() && away(2.0) - x <= limit.max(2e-45), "{x}");
            assert!(away(-1e-30) <= x.next_down() && x - away(-1e-30) <= limit.max(2e-45), "{x}");
            assert_eq!(away(0.0), x);
            assert_eq!(away(-0.0), x);
        }
    }

    #[test]
    fn leaves_on_the_right_side() {
        let p = Vec3::new(1e5, -3.0, 2.0);
        let e = p.abs() * gamma(5);
        let up = offset_origin(p, e, Vec3::Y, Vec3::new(0.1, 0.9, 0.0));
        let down = offset_origin(p, e, Vec3::Y, Vec3::new(0.1, -0.9, 0.0));
        assert!(up.y > p.y + e.y && down.y < p.y - e.y && up.x == p.x);
    }
}
