//! Rays, and what they find.

use glam::Vec3;

/// [`Hit::instance`] of a hit that is on no instance.
pub const NO_INSTANCE: u32 = u32::MAX;

/// [`Hit::triangle`] of a hit on anything else.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// The points `o + t d` with `t_min < t < t_max`.
///
/// `d` need not have unit length: `t` counts multiples of `d`, so it is the same number in the frame of an instance.
/// A ray with a NaN or infinite component in `o` or `d`, with `d = 0`, with a NaN limit or with an empty interval
/// misses everything. A negative `t_min` counts as 0, and `t_max` may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin, in world units.
    pub o: Vec3,
    /// Direction, of any finite length but 0.
    pub d: Vec3,
    /// Hits at this distance or nearer are none. Normally 0, with the origin moved off its surface by its error bound.
    pub t_min: f32,
    /// Hits at this distance or farther are none.
    pub t_max: f32,
    /// Triangles by [`Hit::triangle`] that the ray is known to miss, so that nobody needs to find out: the one it begins
    /// on, once its origin has been moved off that, and the one it ends before. [`NO_TRIANGLE`] where there is none.
    pub ends: [u32; 2],
}

impl Ray {
    /// The ray from `o` along `d` without an end.
    #[must_use]
    pub const fn new(o: Vec3, d: Vec3) -> Self {
        Self { o, d, t_min: 0.0, t_max: f32::INFINITY, ends: [NO_TRIANGLE; 2] }
    }

    /// The open segment from `from` to `to`, for visibility tests. Both ends must have been moved off their surfaces.
    #[must_use]
    pub fn between(from: Vec3, to: Vec3) -> Self {
        Self { o: from, d: to - from, t_min: 0.0, t_max: 1.0, ends: [NO_TRIANGLE; 2] }
    }

    /// The point at `t`, rounded.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.o + self.d * t
    }

    /// Whether the ray can hit anything at all; see the type's description.
    #[must_use]
    pub fn is_traceable(&self) -> bool {
        self.o.is_finite() && self.d.is_finite() && self.d != Vec3::ZERO && self.t_min < self.t_max && self.t_max > 0.0
    }
}

/// The nearest hit of a ray.
///
/// # Accuracy
///
/// With u = 2⁻²⁴, the unit roundoff of `f32`: `t` of a triangle is evaluated in `f64` from the stored vertices and
/// rounded once, so it is within (1 + 2⁻²⁰ κ) u |t| of the exact intersection, where κ is the distance to the triangle
/// over the triangle's smallest height seen from the ray. κ stays below 2²⁰ but for triangles seen edge-on; there `t`
/// still lies between the nearest and farthest vertex. `u` and `v` are within u + 2⁻⁵⁰ κ of exact. The point
/// `(1 − u − v) p0 + u p1 + v p2`, evaluated in `f32`, is within 7u/(1 − 7u) · (|(1 − u − v) p0| + |u p1| + |v p2|) of the
/// triangle's plane in each component (Pharr, Jakob and Humphreys 2023, section 6.8.5): prefer it to `o + t d`.
///
/// A hit on an instance is that accurate relative to the ray that the instance was given, which is rounded to `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in multiples of the ray's direction.
    pub t: f32,
    /// Weight of the triangle's second vertex, or whatever the analytic shape returned.
    pub u: f32,
    /// Weight of the triangle's third vertex, or whatever the analytic shape returned.
    pub v: f32,
    /// The shape that was hit; inside an instance, its index within the group.
    pub shape: u32,
    /// The triangle of a mesh, or whatever the analytic shape returned.
    pub prim: u32,
    /// The shape that is the instance, [`NO_INSTANCE`] when there is none.
    pub instance: u32,
    /// The number of the triangle among all primitives, for [`Ray::ends`]; [`NO_TRIANGLE`] on anything else.
    pub triangle: u32,
}
