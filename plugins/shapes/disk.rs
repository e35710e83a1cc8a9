//! `disk`: the unit disk in the xy plane, facing +z.
//!
//! Texture coordinates are (r, φ/2π). `to_world` makes any ellipse of it.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `to_world` | transform | identity | placement |
//! | `flip_normals` | boolean | false | face −z |
//!
//! ```xml
//! <shape type="disk">
//!     <transform name="to_world"> <scale value="0.2"/> <translate z="3"/> </transform>
//!     <emitter type="area"> <rgb name="radiance" value="10"/> </emitter>
//! </shape>
//! ```

use super::plane::Plane;
use super::{COMMON, ORIENTED, enclose};
use lucerna_core::accel::{Geometry, Hit, NO_TRIANGLE, PrimHit, Primitive, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::math::{Aabb, Frame, Vec2, Vec3};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "disk",
    aliases: &[],
    summary: "disk of radius 1 in the xy plane",
    params: &[COMMON, ORIENTED],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    Ok(Arc::new(Disk(Arc::new(Plane::new(p)?))))
}

impl Primitive for Plane {
    fn bounds(&self) -> Aabb {
        // An ellipse with half axes x and y reaches √(x² + y²) along each axis of the world.
        let reach = (self.x * self.x + self.y * self.y).map(f32::sqrt);
        enclose([self.center - reach, self.center + reach], self.error)
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        let (x, y) = (self.x.as_dvec3(), self.y.as_dvec3());
        let normal = x.cross(y);
        let from = ray.o.as_dvec3() - self.center.as_dvec3();
        let t = -from.dot(normal) / ray.d.as_dvec3().dot(normal);
        let p = from + ray.d.as_dvec3() * t;
        let scale = 1.0 / normal.length_squared();
        let (u, v) = (p.cross(y).dot(normal) * scale, x.cross(p).dot(normal) * scale);
        let t = t as f32;
        (u * u + v * v <= 1.0 && ray.t_min < t && t < ray.t_max).then_some(PrimHit {
            t,
            u: u as f32,
            v: v as f32,
            shape: None,
            prim: 0,
        })
    }
}

struct Disk(Arc<Plane>);

impl Disk {
    fn uv(local: Vec2) -> Vec2 {
        Vec2::new(local.length(), warp::azimuth(local.x, local.y) / TAU)
    }

    fn hit_at(&self, t: f32, local: Vec2) -> SurfaceHit {
        let plane = &self.0;
        let uv = Self::uv(local);
        let (cos, sin) = if uv.x > 0.0 { (local.x / uv.x, local.y / uv.x) } else { (1.0, 0.0) };
        let dp_du = plane.x * cos + plane.y * sin;
        let dp_dv = (plane.y * local.x - plane.x * local.y) * TAU;
        let p = plane.point(local);
        let frame = Frame::from_tangent(plane.n, dp_du);
        SurfaceHit { t, p, p_error: plane.error, n: plane.n, frame, uv, dp_du, dp_dv, ..SurfaceHit::default() }
    }
}

impl Shape for Disk {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Analytic(self.0.clone())
    }

    fn bounds(&self) -> Aabb {
        self.0.bounds()
    }

    fn area(&self) -> f32 {
        PI * self.0.area
    }

    fn surface(&self, _ray: &Ray, hit: &Hit, into: &mut SurfaceHit) {
        *into = self.hit_at(hit.t, Vec2::new(hit.u, hit.v));
    }

    fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
        let local = warp::square_to_disk_concentric(u2);
        let p = self.0.point(local);
        Some(AreaSample {
            p,
            p_error: self.0.error,
            n: self.0.n,
            uv: Self::uv(local),
            pdf: 1.0 / self.area(),
            triangle: NO_TRIANGLE,
        })
    }

    fn normal_cone(&self) -> (Vec3, f32) {
        (self.0.n, 0.0)
    }

    fn at_uv(&self, uv: Vec2) -> Option<SurfaceHit> {
        let (sin, cos) = (TAU * uv.y).sin_cos();
        (0.0..=1.0).contains(&uv.x).then(|| self.hit_at(0.0, uv.x * Vec2::new(cos, sin)))
    }
}
