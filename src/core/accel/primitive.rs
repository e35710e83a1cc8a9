//! What a leaf of the tree can hold besides triangles.

use super::Ray;
use crate::math::Aabb;

/// A hit on one [`Primitive`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimHit {
    /// Distance in multiples of the ray's direction.
    pub t: f32,
    /// First surface coordinate, handed on in [`Hit::u`](super::Hit::u).
    pub u: f32,
    /// Second surface coordinate, handed on in [`Hit::v`](super::Hit::v).
    pub v: f32,
    /// For an instance: which shape of its group. `None` for every other primitive.
    pub shape: Option<u32>,
    /// Which part of the shape; 0 when it has one part.
    pub prim: u32,
}

/// A shape that finds its own intersections: a sphere, a disk, an instance of a group.
///
/// Called once per leaf that a ray enters, so a call through a pointer does not matter. Never used for triangles.
pub trait Primitive: Send + Sync {
    /// A finite box that holds every point of the surface, *with* the error of the points that [`Primitive::intersect`]
    /// computes.
    fn bounds(&self) -> Aabb;

    /// The nearest hit with `ray.t_min < t < ray.t_max`. `ray` is finite and its direction is not 0.
    ///
    /// `t` must be a function of `o` and `d` alone, not of the limits: equal distances are decided by shape index.
    fn intersect(&self, ray: &Ray) -> Option<PrimHit>;

    /// Whether there is any hit with `ray.t_min < t < ray.t_max`.
    fn occluded(&self, ray: &Ray) -> bool {
        self.intersect(ray).is_some()
    }

    /// Whether hits carry [`PrimHit::shape`].
    fn is_instance(&self) -> bool {
        false
    }
}
