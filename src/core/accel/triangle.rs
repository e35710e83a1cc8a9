//! Where a ray meets a triangle, decided so that no ray slips between two triangles that share an edge.
//!
//! Woop, Benthin and Wald 2013, *Watertight ray/triangle intersection*: the triangle is moved to the ray's origin and
//! sheared so that the ray becomes an axis; three edge functions then tell whether the origin of the plane is inside.
//! Two triangles round a shared vertex to the same point, and the sign of an edge function of rounded points is exact, so
//! the two agree about their shared edge.
//!
//! | Step | Woop et al. | here |
//! |---|---|---|
//! | shear | `f32` | the same, without fused operations, so that every machine rounds alike |
//! | edge functions | `f32`; `f64` if one is 0 | the same, after a filter for eight triangles at once |
//! | distance, weights | `f32` | `f64` from unrounded points, with weights clamped into the triangle: one final rounding |

use glam::Vec3;
use std::ops::{Mul, Sub};

/// The part of a ray that the triangle test needs.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// The ray's origin, by permuted axis.
    pub o: [f32; 3],
    /// Permutation: the last is the axis along which the direction is longest.
    pub axes: [usize; 3],
    /// Shear constants `d_x / d_z` and `d_y / d_z` of the permuted direction.
    pub s: [f32; 2],
    /// The ray's direction, by permuted axis.
    pub d: [f32; 3],
}

/// A point of a triangle on a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance in multiples of the direction.
    pub t: f32,
    /// Weight of the second vertex.
    pub u: f32,
    /// Weight of the third vertex.
    pub v: f32,
}

impl Shear {
    /// Permutations that put the first, second or third axis last.
    const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

    /// `d` must be finite and not 0.
    #[inline(always)]
    #[must_use]
    pub fn new(o: Vec3, d: Vec3) -> Self {
        // Without branches, which no processor could foresee: the longest axis changes from ray to ray.
        let [x, y, z] = d.abs().to_array();
        let longest = if x.max(y) > z { usize::from(x <= y) } else { 2 };
        let axes = Self::AXES[longest];
        // Indexing a `Vec3` would compare, indexing an array looks up.
        let [o, d] = [o, d].map(|v| v.to_array());
        let d = axes.map(|a| d[a]);
        Self { o: axes.map(|a| o[a]), axes, s: [d[0] / d[2], d[1] / d[2]], d }
    }

    /// The corners of a triangle with their coordinates in the order of [`axes`](Self::axes).
    #[cfg(test)]
    #[must_use]
    pub fn permuted(&self, triangle: [Vec3; 3]) -> [[f32; 3]; 3] {
        triangle.map(|p| self.axes.map(|axis| p[axis]))
    }

    /// The intersection with a triangle, whatever its distance; `None` if the ray passes beside it or in its plane.
    /// Coordinates of the corners are in the order of [`axes`](Self::axes).
    #[inline(always)]
    #[must_use]
    pub fn intersect(&self, points: [[f32; 3]; 3]) -> Option<TriangleHit> {
        let rounded = points.map(|p| {
            let [px, py, pz] = [p[0] - self.o[0], p[1] - self.o[1], p[2] - self.o[2]];
            [px - self.s[0] * pz, py - self.s[1] * pz]
        });
        // Rounding products keeps their order, so the sign of a difference is exact unless it is 0 (or overflows).
        let edges = edge_functions(rounded);
        let [mut any_positive, mut any_negative] = [edges.iter().any(|&e| e > 0.0), edges.iter().any(|&e| e < 0.0)];
        if !edges.iter().all(|e| e.abs() > 0.0) {
            [any_positive, any_negative] = exact_signs(rounded);
        }
        if any_positive == any_negative {
            return None;
        }

        let d = self.d.map(f64::from);
        let mut heights = [0.0; 3];
        let mut sheared = [[0.0; 2]; 3];
        for ((p, height), s) in points.iter().zip(&mut heights).zip(&mut sheared) {
            let [px, py, pz]: [f64; 3] = std::array::from_fn(|i| f64::from(p[i]) - f64::from(self.o[i]));
            *height = pz;
            // Not divided by d_z: the division below takes care of it.
            *s = [px * d[2] - d[0] * pz, py * d[2] - d[1] * pz];
        }
        let sign = if any_positive { 1.0 } else { -1.0 };
        let mut weights = edge_functions(sheared).map(|e| (e * sign).max(0.0));
        let mut sum = weights[0] + weights[1] + weights[2];
        if sum.is_nan() || sum <= 0.0 {
            // Seen edge-on up to the precision of f64, but not once rounded: the ray must not slip through here.
            weights = exact_edge_functions(rounded).map(f64::abs);
            sum = weights[0] + weights[1] + weights[2];
        }
        let inverse = 1.0 / (sum * d[2]);
        let scale = inverse * d[2];
        let t = ((weights[0] * heights[0] + weights[1] * heights[1] + weights[2] * heights[2]) * inverse) as f32;
        t.is_finite().then_some(TriangleHit { t, u: (weights[1] * scale) as f32, v: (weights[2] * scale) as f32 })
    }
}

/// Whether any edge function is positive, and whether any is negative.
#[cold]
fn exact_signs(rounded: [[f32; 2]; 3]) -> [bool; 2] {
    let edges = exact_edge_functions(rounded);
    [edges.iter().any(|&e| e > 0.0), edges.iter().any(|&e| e < 0.0)]
}

/// Products of two `f32` are exact in `f64`, and so is the sign of their difference.
#[cold]
fn exact_edge_functions(rounded: [[f32; 2]; 3]) -> [f64; 3] {
    edge_functions(rounded.map(|p| p.map(f64::from)))
}

/// Twice the signed areas that the origin spans with the edges opposite each vertex.
#[inline(always)]
fn edge_functions<F: Copy + Mul<Output = F> + Sub<Output = F>>([a, b, c]: [[F; 2]; 3]) -> [F; 3] {
    [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]]
}

/// Whether a triangle has an area that `f32` can express and finite vertices: others cannot be hit.
#[must_use]
pub fn is_hittable([a, b, c]: [Vec3; 3]) -> bool {
    let [a, e1, e2] = [a.as_dvec3(), b.as_dvec3(), c.as_dvec3()];
    let normal = (e1 - a).cross(e2 - a);
    normal.is_finite() && normal.length_squared().sqrt() >= f64::from(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_and_weights_of_a_known_hit() {
        let shear = Shear::new(Vec3::new(0.25, 0.5, -3.0), Vec3::new(0.0, 0.0, 2.0));
        let triangle = [Vec3::Z, Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0)];
        let hit = shear.intersect(shear.permuted(triangle));
        assert_eq!(hit, Some(TriangleHit { t: 2.0, u: 0.25, v: 0.5 }));
        let beside = Shear::new(Vec3::new(0.6, 0.5, -3.0), Vec3::Z);
        assert_eq!(beside.intersect(beside.permuted(triangle)), None);
    }

    #[test]
    fn distance_is_rounded_once_for_ordinary_triangles() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let mut hits = 0;
        while hits < 2000 {
            let mut point = || Vec3::new(next(), next(), next()) * 100.0;
            let [o, a, b, c] = [point(), point(), point(), point()];
            let d = (a + b + c) / 3.0 - o;
            let shear = Shear::new(o, d);
            let Some(hit) = shear.intersect(shear.permuted([a, b, c])) else { continue };
            let [o, d, a, b, c] = [o, d, a, b, c].map(|p| p.as_dvec3());
            let n = (b - a).cross(c - a);
            let exact = n.dot(a - o) / n.dot(d);
            assert!((f64::from(hit.t) - exact).abs() <= exact.abs() * 6.0e-8, "{hit:?} {exact}");
            hits += 1;
        }
    }

    #[test]
    fn hc_g06_degenerate_and_non_finite_triangles_are_recognised() {
        let [o, x, y] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        assert!(is_hittable([o, x, y]));
        assert!(is_hittable([o, x * 1e-11, y * 1e-11]));
        for bad in [
            [o, x, x],
            [o, x, x * 3.0],
            [o, o, o],
            [o, x * 1e-20, y * 1e-20],
            [o, x, y * f32::NAN],
            [o, x, y * f32::INFINITY],
        ] {
            assert!(!is_hittable(bad), "{bad:?}");
        }
    }
}
