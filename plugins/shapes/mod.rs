//! All shapes: one file each, one line each in [`PLUGINS`].
//!
//! Every hit carries a bound on the error of its point (Pharr, Jakob, Humphreys 2023, section 6.8), so that a ray
//! leaves the surface without a constant that depends on the size of the scene. Analytic shapes find their hits in
//! double precision and project them onto the surface.

mod cube;
mod cylinder;
mod disk;
mod instance;
mod mesh;
mod obj;
mod plane;
mod ply;
mod rectangle;
mod serialized;
mod shapegroup;
mod sphere;

use lucerna_core::accel::{Hit, PrimHit, Ray};
use lucerna_core::math::error_bounds::gamma;
use lucerna_core::math::{Aabb, Vec3};
use lucerna_core::scene::description::ObjectKind;
use lucerna_core::scene::{Param, Plugin};

/// The table of all shapes.
pub const PLUGINS: &[Plugin] = &[
    cube::PLUGIN,
    cylinder::PLUGIN,
    disk::PLUGIN,
    instance::PLUGIN,
    obj::PLUGIN,
    ply::PLUGIN,
    rectangle::PLUGIN,
    serialized::PLUGIN,
    shapegroup::PLUGIN,
    sphere::PLUGIN,
];

/// What every shape accepts. Material, light and media are hung on the shape by the scene, not by the constructor.
const COMMON: &[Param] = &[
    Param::transform("to_world", "placement; baked into meshes"),
    Param::ignored("silhouette_sampling_weight", "for differentiable rendering only"),
    Param::child(ObjectKind::Bsdf, 0, 1, "material; by default grey `diffuse`, black if the shape is a light"),
    Param::child(ObjectKind::Emitter, 0, 1, "light that the surface gives off"),
    Param::child(ObjectKind::Medium, 0, 2, "what is inside and outside"),
    Param::child(ObjectKind::Texture, 0, usize::MAX, "named attributes of the surface"),
];

/// What shapes with an orientation accept.
const ORIENTED: &[Param] = &[Param::bool("flip_normals", false, "turn the surface inside out")];

/// What meshes accept.
const MESH: &[Param] = &[Param::bool("face_normals", false, "shade flat, without normals per vertex")];

/// The first of two ordered roots that lies on the ray and is part of the surface. [`Hit::u`] says which one it was,
/// because rounded distances may not: see [`taken_root`].
///
/// [`Hit::u`]: lucerna_core::accel::Hit::u
#[inline]
fn nearest_root(ray: &Ray, roots: [f64; 2], on_surface: impl Fn(f64) -> bool) -> Option<PrimHit> {
    let hit = |index: usize| {
        let t = roots[index] as f32;
        let found = ray.t_min < t && t < ray.t_max && on_surface(roots[index]);
        found.then_some(PrimHit { t, u: index as f32, v: 0.0, shape: None, prim: 0 })
    };
    hit(0).or_else(|| hit(1))
}

/// The distance of a hit that [`nearest_root`] gave, in double precision.
#[inline]
fn taken_root(hit: &Hit, roots: Option<[f64; 2]>) -> f64 {
    roots.map_or(f64::from(hit.t), |roots| roots[usize::from(hit.u > 0.0)])
}

/// Bound on the error of a point of a plane or triangle: the sum of terms of the given `size` after some roundings.
///
/// Where a coordinate is 0 it has no relative error, but the double-precision distance to the plane still has one, of
/// the order of the other coordinates. Without the last term a ray could meet the floor y = 0 that it starts on.
#[inline]
fn point_error(size: Vec3, roundings: u32) -> Vec3 {
    const DOUBLE: f32 = 1.0 / (1u64 << 40) as f32;
    size * gamma(roundings) + Vec3::splat(size.max_element() * DOUBLE)
}

/// A box around points that are known to an error on each axis.
fn enclose<const N: usize>(points: [Vec3; N], error: Vec3) -> Aabb {
    let Aabb { min, max } = Aabb::of_points(points);
    Aabb { min: (min - error).map(f32::next_down), max: (max + error).map(f32::next_up) }
}

#[cfg(test)]
mod tests;
