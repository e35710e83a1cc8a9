//! Geometry.

use super::{LightPoint, SurfaceHit};
use crate::accel::{Geometry, Hit, Instance, Ray};
use crate::math::{Aabb, Vec2, Vec3};
use crate::scene::ShapeGroup;
use std::f32::consts::PI;
use std::sync::Arc;

/// A point sampled on a surface.
#[derive(Clone, Copy, Debug)]
pub struct AreaSample {
    /// The point.
    pub p: Vec3,
    /// Bound on its absolute error on each axis.
    pub p_error: Vec3,
    /// Geometric unit normal.
    pub n: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Density: per unit area, or per solid angle where the method says so.
    pub pdf: f32,
    /// The triangle of a mesh, [`NO_TRIANGLE`](crate::accel::NO_TRIANGLE) on anything else.
    pub triangle: u32,
}

impl AreaSample {
    /// The same point as seen from `from`: with direction and distance, and the density per solid angle there.
    /// `None` where the surface is edge-on or the points coincide.
    pub fn as_seen_from(&self, from: Vec3) -> Option<(LightPoint, f32)> {
        let d = self.p - from;
        let distance_squared = d.length_squared();
        let distance = distance_squared.sqrt();
        let d = d / distance;
        let cos = d.dot(self.n).abs();
        let pdf = self.pdf * distance_squared / cos;
        let AreaSample { p, n, uv, triangle, .. } = *self;
        (pdf.is_finite() && pdf > 0.0).then_some((LightPoint { p, n, uv, d, distance, triangle }, pdf))
    }
}

/// A shape in world space.
pub trait Shape: Send + Sync {
    /// What the acceleration structure is to hold.
    fn geometry(&self) -> Geometry<'_>;

    /// The box around it.
    fn bounds(&self) -> Aabb;

    /// Number of primitives.
    fn primitive_count(&self) -> usize {
        1
    }

    /// Surface area in square scene units.
    fn area(&self) -> f32;

    /// Writes the hit in full: all of [`SurfaceHit`] but what the scene fills in, namely `wi` and the numbers from `shape` on.
    /// In place, since copying it would cost more than most shapes need to find it.
    fn surface(&self, ray: &Ray, hit: &Hit, into: &mut SurfaceHit);

    /// A point uniform in area; `pdf` per unit area.
    fn sample_area(&self, u2: Vec2) -> Option<AreaSample>;

    /// A point uniform in area on one triangle; `pdf` per unit area of it. `None` if the triangle has no area, and on what
    /// is no mesh.
    fn sample_triangle(&self, _triangle: u32, _u2: Vec2) -> Option<AreaSample> {
        None
    }

    /// A cone around the normals of all that [`sample_area`](Self::sample_area) gives: unit axis, and half the opening
    /// angle in radians. All directions unless the shape knows better.
    fn normal_cone(&self) -> (Vec3, f32) {
        (Vec3::Z, PI)
    }

    /// A point as a light for `from`, with its density per solid angle there. By area unless the shape knows better.
    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<(LightPoint, Vec3, f32)> {
        let sample = self.sample_area(u2)?;
        let (point, pdf) = sample.as_seen_from(from)?;
        Some((point, sample.p_error, pdf))
    }

    /// Density of [`sample_direct`](Self::sample_direct).
    fn pdf_direct(&self, _from: Vec3, point: &LightPoint) -> f32 {
        let pdf = point.distance * point.distance / (self.area() * point.d.dot(point.n).abs());
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// The surface point at texture coordinates: the hit (with `p`, `n`, `uv`, `dp_du`, `dp_dv`, and as `triangle` the
    /// index of the triangle), if the parametrisation can be inverted there.
    fn at_uv(&self, _uv: Vec2) -> Option<SurfaceHit> {
        None
    }

    /// Interpolated mesh attribute (`vertex_…` or `face_…`) at a hit, up to three channels.
    fn attribute(&self, _name: &str, _hit: &SurfaceHit) -> Option<[f32; 3]> {
        None
    }

    /// The group, if this shape is one: it is not rendered itself.
    fn group(&self) -> Option<&Arc<ShapeGroup>> {
        None
    }

    /// What is placed and where, if this shape is an instance.
    fn instance(&self) -> Option<&Instance<ShapeGroup>> {
        None
    }
}
