//! How far a computed point can be from the true one, and how far to step away from a surface.
//!
//! A hit point carries a bound on its absolute error on each axis (Pharr, Jakob, Humphreys, "Physically Based
//! Rendering", 4th ed. 2023, section 6.8). A ray that leaves the point starts just outside the box of that size, so
//! it neither hits the surface it leaves nor skips a gap wider than the rounding error. No constant depends on the
//! size of the scene.

use super::Vec3;

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
    let offset = n * n.abs().dot(p_error).copysign(d.dot(n));
    let start = p + offset;
    Vec3::new(round_away(start.x, offset.x), round_away(start.y, offset.y), round_away(start.z, offset.z))
}

/// The next number towards `direction`, or `x` itself where that is 0. Both are finite. Without branches.
#[inline]
fn round_away(x: f32, direction: f32) -> f32 {
    let x = if x == 0.0 { 0_f32.copysign(direction) } else { x };
    // Bits of positive numbers grow with the number, those of negative ones shrink.
    let outwards = i32::from((x > 0.0) == (direction > 0.0) || x == 0.0) * 2 - 1;
    let step = if direction == 0.0 { 0 } else { outwards };
    f32::from_bits(x.to_bits().wrapping_add_signed(step))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_to_the_next_number() {
        for x in [0.0, -0.0, 1.0, -1.0, 1e-45, -1e-45, 1e10, -3.3e-39] {
            assert_eq!(round_away(x, 2.0), x.next_up(), "{x}");
            assert_eq!(round_away(x, -1e-30), x.next_down(), "{x}");
            assert_eq!(round_away(x, 0.0), x);
            assert_eq!(round_away(x, -0.0), x);
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
