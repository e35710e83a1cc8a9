//! `cylinder`: an open tube between two points.
//!
//! There are no caps. Texture coordinates are (φ/2π, position along the axis from 0 to 1). Normals point away from the
//! axis, also under a mirroring `to_world`; one that makes the cross-section an ellipse is an error.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `p0` | point | 0, 0, 0 | start of the axis, before `to_world` |
//! | `p1` | point | 0, 0, 1 | end of the axis, before `to_world` |
//! | `radius` | float | 1 | radius, before `to_world` |
//! | `to_world` | transform | identity | placement |
//! | `flip_normals` | boolean | false | normals point to the axis |
//!
//! ```xml
//! <shape type="cylinder">
//!     <point name="p1" x="0" y="2" z="0"/>
//!     <float name="radius" value="0.1"/>
//! </shape>
//! ```

use super::{COMMON, ORIENTED, enclose, nearest_root, taken_root};
use lucerna_core::accel::{Geometry, Hit, NO_TRIANGLE, PrimHit, Primitive, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::math::error_bounds::gamma;
use lucerna_core::math::{Aabb, DMat4, DVec3, Frame, Vec2, Vec3, coordinate_system};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::f32::consts::TAU;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "cylinder",
    aliases: &[],
    summary: "open tube between two points",
    params: &[
        COMMON,
        ORIENTED,
        &[
            Param::vector("p0", [0.0; 3], "start of the axis, before `to_world`"),
            Param::vector("p1", [0.0, 0.0, 1.0], "end of the axis, before `to_world`"),
            Param::float("radius", 1.0, "radius, before `to_world`").between(0.0, f64::INFINITY),
        ],
    ],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    p.transform("to_world")?;
    let (p0, p1) = (p.vector("p0").as_dvec3(), p.vector("p1").as_dvec3());
    let axis = p1 - p0;
    let Some(direction) = axis.try_normalize() else {
        return Err(p.error("p1", "\"p0\" and \"p1\" are the same point"));
    };
    let (s, t) = coordinate_system(direction.as_vec3());
    let radius = p.double("radius");
    let [s, t] = [s, t].map(|v| v.as_dvec3() * radius);
    let to_world =
        p.matrix("to_world") * DMat4::from_cols(s.extend(0.0), t.extend(0.0), axis.extend(0.0), p0.extend(1.0));
    let [x, y, z] = [to_world.x_axis, to_world.y_axis, to_world.z_axis].map(|axis| axis.truncate());
    let skew = |a: DVec3, b: DVec3| a.dot(b).abs() > 1e-4 * a.length() * b.length();
    if (x.length() - y.length()).abs() > 1e-4 * x.length() || skew(x, y) || skew(x, z) || skew(y, z) {
        return Err(p.error("to_world", "a cylinder cannot be sheared, nor have two radii"));
    }
    let tube = Tube { to_world, to_local: to_world.inverse(), radius: x.length() as f32, length: z.length() as f32 };
    if !(tube.to_local.is_finite() && tube.radius.is_normal() && tube.length.is_normal()) {
        return Err(p.error("radius", "the cylinder is too small or too large for single precision"));
    }
    Ok(Arc::new(Cylinder { tube: Arc::new(tube), flip_normals: p.bool("flip_normals") }))
}

/// What rays meet: locally the tube of radius 1 about the z axis from 0 to 1.
struct Tube {
    to_world: DMat4,
    to_local: DMat4,
    /// In world units.
    radius: f32,
    length: f32,
}

impl Tube {
    fn local_ray(&self, ray: &Ray) -> (DVec3, DVec3) {
        let from = ray.o.as_dvec3() - self.to_world.w_axis.truncate();
        (self.to_local.transform_vector3(from), self.to_local.transform_vector3(ray.d.as_dvec3()))
    }

    /// Both distances at which a local ray meets the endless tube, in order; as for a sphere, in the plane.
    fn roots((o, d): (DVec3, DVec3)) -> Option<[f64; 2]> {
        let (o, d) = (o.truncate(), d.truncate());
        let dd = d.length_squared();
        let middle = -o.dot(d) / dd;
        let discriminant = 1.0 - (o + d * middle).length_squared();
        // Also false for a ray along the axis, where `middle` is not finite.
        if !(discriminant > 0.0 && dd > 0.0) {
            return None;
        }
        let half = (discriminant / dd).sqrt();
        let distance = o.length();
        let product = (distance - 1.0) * (distance + 1.0) / dd;
        Some(if middle >= 0.0 {
            [product / (middle + half), middle + half]
        } else {
            [middle - half, product / (middle - half)]
        })
    }

    fn error(&self, p: Vec3) -> Vec3 {
        // The rounding of the point, and what the rounding of the normal adds to the way off the surface.
        p.abs() * gamma(2) + Vec3::splat(self.radius * gamma(6))
    }
}

impl Primitive for Tube {
    fn bounds(&self) -> Aabb {
        let [x, y] = [self.to_world.x_axis, self.to_world.y_axis].map(|a| a.truncate());
        let reach = (x * x + y * y).map(f64::sqrt).as_vec3();
        let [p0, p1] = [DVec3::ZERO, DVec3::Z].map(|p| self.to_world.transform_point3(p).as_vec3());
        let size = p0.abs().max(p1.abs()) + reach;
        enclose([p0 - reach, p0 + reach, p1 - reach, p1 + reach], self.error(size))
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        let local @ (o, d) = self.local_ray(ray);
        nearest_root(ray, Self::roots(local)?, |t| (0.0..=1.0).contains(&(o.z + d.z * t)))
    }
}

struct Cylinder {
    tube: Arc<Tube>,
    flip_normals: bool,
}

impl Cylinder {
    /// The hit at a local point with x² + y² = 1.
    fn hit_at(&self, t: f32, local: DVec3) -> SurfaceHit {
        let m = &self.tube.to_world;
        let p = m.transform_point3(local).as_vec3();
        let dp_du = (m.transform_vector3(DVec3::new(-local.y, local.x, 0.0)) * std::f64::consts::TAU).as_vec3();
        let n = self.normal(local);
        SurfaceHit {
            t,
            p,
            p_error: self.tube.error(p),
            n,
            frame: Frame::from_tangent(n, dp_du),
            uv: Vec2::new(warp::azimuth(local.x as f32, local.y as f32) / TAU, local.z as f32),
            dp_du,
            dp_dv: m.z_axis.truncate().as_vec3(),
            ..SurfaceHit::default()
        }
    }

    fn normal(&self, local: DVec3) -> Vec3 {
        let away = self.tube.to_world.transform_vector3(DVec3::new(local.x, local.y, 0.0));
        let n = away.normalize_or_zero().as_vec3();
        if self.flip_normals { -n } else { n }
    }
}

impl Shape for Cylinder {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Analytic(self.tube.clone())
    }

    fn bounds(&self) -> Aabb {
        self.tube.bounds()
    }

    fn area(&self) -> f32 {
        TAU * self.tube.radius * self.tube.length
    }

    fn surface(&self, ray: &Ray, hit: &Hit, into: &mut SurfaceHit) {
        let local @ (o, d) = self.tube.local_ray(ray);
        let t = taken_root(hit, Tube::roots(local));
        let p = o + d * t;
        let on_circle = p.truncate().normalize_or(glam::DVec2::X);
        *into = self.hit_at(hit.t, on_circle.extend(p.z.clamp(0.0, 1.0)));
    }

    fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(u2.y)).sin_cos();
        let local = DVec3::new(cos, sin, f64::from(u2.x));
        let p = self.tube.to_world.transform_point3(local).as_vec3();
        let uv = Vec2::new(u2.y, u2.x);
        Some(AreaSample {
            p,
            p_error: self.tube.error(p),
            n: self.normal(local),
            uv,
            pdf: 1.0 / self.area(),
            triangle: NO_TRIANGLE,
        })
    }

    fn at_uv(&self, uv: Vec2) -> Option<SurfaceHit> {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(uv.x)).sin_cos();
        (0.0..=1.0).contains(&uv.y).then(|| self.hit_at(0.0, DVec3::new(cos, sin, f64::from(uv.y))))
    }
}
