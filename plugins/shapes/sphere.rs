//! `sphere`: a ball of any centre and radius.
//!
//! Texture coordinates are (φ/2π, θ/π) about the local z axis. Hits are found in double precision and projected onto
//! the sphere, so that one of radius 1 seen from 10⁶ away is still round. As a light it is sampled by the cone of
//! directions in which it is seen. A mirroring `to_world` turns the normals inwards; one that shears or scales the
//! axes differently is an error, since the result is no sphere.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `center` | point | 0, 0, 0 | centre, before `to_world` |
//! | `radius` | float | 1 | radius, before `to_world` |
//! | `to_world` | transform | identity | placement |
//! | `flip_normals` | boolean | false | normals point inwards |
//!
//! ```xml
//! <shape type="sphere">
//!     <point name="center" x="0" y="1" z="0"/>
//!     <float name="radius" value="0.5"/>
//! </shape>
//! ```

use super::{COMMON, ORIENTED, enclose, nearest_root, taken_root};
use lucerna_core::accel::{Geometry, Hit, NO_TRIANGLE, PrimHit, Primitive, Ray};
use lucerna_core::interfaces::{AreaSample, LightPoint, Shape, SurfaceHit};
use lucerna_core::math::error_bounds::gamma;
use lucerna_core::math::{Aabb, DMat4, DVec3, Frame, Vec2, Vec3, coordinate_system};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "sphere",
    aliases: &[],
    summary: "ball of any centre and radius",
    params: &[
        COMMON,
        ORIENTED,
        &[
            Param::vector("center", [0.0; 3], "centre, before `to_world`"),
            Param::float("radius", 1.0, "radius, before `to_world`").between(0.0, f64::INFINITY),
        ],
    ],
    build: Constructor::Shape(build),
};

/// How close to the surface, relative to the radius, a point counts as lying on its lit side (as the reference).
const SHELL: f64 = 8.940_697e-5;

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let to_world = p.transform("to_world")?;
    if !to_world.is_similarity() {
        return Err(p.error("to_world", "a sphere cannot be sheared or scaled differently along its axes"));
    }
    let center = p.vector("center").as_dvec3();
    let matrix =
        p.matrix("to_world") * DMat4::from_translation(center) * DMat4::from_scale(DVec3::splat(p.double("radius")));
    let radius = matrix.x_axis.truncate().length();
    let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| (axis.truncate() / radius).as_vec3());
    let inwards = to_world.mirrors() != p.bool("flip_normals");
    let ball = Ball { center: matrix.w_axis.truncate().as_vec3(), radius: radius as f32 };
    if !(ball.center.is_finite() && ball.radius.is_normal()) {
        return Err(p.error("radius", "the sphere is too small or too large for single precision"));
    }
    Ok(Arc::new(Sphere { ball: Arc::new(ball), axes, inwards }))
}

/// What rays meet.
#[derive(Clone, Copy)]
struct Ball {
    center: Vec3,
    radius: f32,
}

impl Ball {
    /// Both distances at which a ray meets the sphere, in order.
    ///
    /// The discriminant comes from the point of the ray nearest to the centre (Haines et al. 2019, "Precision
    /// improvements for ray/sphere intersection", Ray Tracing Gems ch. 7), and the root near 0 from the product of both.
    #[inline]
    fn roots(&self, ray: &Ray) -> Option<[f64; 2]> {
        let radius = f64::from(self.radius);
        let (from, d) = (ray.o.as_dvec3() - self.center.as_dvec3(), ray.d.as_dvec3());
        let dd = d.length_squared();
        let middle = -from.dot(d) / dd;
        let discriminant = radius * radius - (from + d * middle).length_squared();
        if discriminant < 0.0 {
            return None;
        }
        let half = (discriminant / dd).sqrt();
        let distance = from.length();
        let product = (distance - radius) * (distance + radius) / dd;
        Some(if half == 0.0 {
            [middle; 2]
        } else if middle >= 0.0 {
            [product / (middle + half), middle + half]
        } else {
            [middle - half, product / (middle - half)]
        })
    }

    /// Bound on the error of a point of the sphere that was computed in double precision and rounded.
    fn error(&self, p: Vec3) -> Vec3 {
        // The rounding of the point, and what the rounding of the normal adds to the way off the surface.
        p.abs() * gamma(2) + Vec3::splat(self.radius * gamma(6))
    }
}

impl Primitive for Ball {
    fn bounds(&self) -> Aabb {
        let (c, r) = (self.center, Vec3::splat(self.radius));
        enclose([c - r, c + r], self.error(c.abs() + r))
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        nearest_root(ray, self.roots(ray)?, |_| true)
    }
}

struct Sphere {
    ball: Arc<Ball>,
    /// World directions of the local axes, of unit length.
    axes: [Vec3; 3],
    inwards: bool,
}

/// A sphere seen from a point outside of it.
struct View {
    /// Unit direction from the centre to the viewer.
    to_viewer: DVec3,
    distance: f64,
    /// `1 − cos` of the half angle under which the sphere is seen.
    one_minus_cos: f64,
}

impl View {
    fn pdf(&self) -> f32 {
        (1.0 / (std::f64::consts::TAU * self.one_minus_cos)) as f32
    }
}

impl Sphere {
    fn area(&self) -> f32 {
        4.0 * PI * self.ball.radius * self.ball.radius
    }

    fn orient(&self, outwards: Vec3) -> Vec3 {
        if self.inwards { -outwards } else { outwards }
    }

    fn to_local(&self, n: Vec3) -> Vec3 {
        Vec3::new(n.dot(self.axes[0]), n.dot(self.axes[1]), n.dot(self.axes[2]))
    }

    fn to_world(&self, v: Vec3) -> Vec3 {
        self.axes[0] * v.x + self.axes[1] * v.y + self.axes[2] * v.z
    }

    /// Texture coordinates of a local direction.
    fn uv(local: Vec3) -> Vec2 {
        let theta = local.truncate().length().atan2(local.z);
        Vec2::new(warp::azimuth(local.x, local.y) / TAU, theta * FRAC_1_PI)
    }

    fn hit_at(&self, t: f32, p: Vec3, outwards: Vec3) -> SurfaceHit {
        let radius = self.ball.radius;
        let local = self.to_local(outwards);
        let rho = local.truncate().length();
        let dp_du = self.to_world(Vec3::new(-local.y, local.x, 0.0)) * (TAU * radius);
        let (cos, sin) = if rho > 0.0 { (local.x / rho, local.y / rho) } else { (1.0, 0.0) };
        let dp_dv = self.to_world(Vec3::new(local.z * cos, local.z * sin, -rho)) * (PI * radius);
        let n = self.orient(outwards);
        SurfaceHit {
            t,
            p,
            p_error: self.ball.error(p),
            n,
            frame: Frame::from_tangent(n, dp_du),
            uv: Self::uv(local),
            dp_du,
            dp_dv,
            ..SurfaceHit::default()
        }
    }

    /// A sample of uniform area density at a point of the unit sphere.
    fn sample_at(&self, outwards: Vec3) -> AreaSample {
        let p = self.ball.center + outwards * self.ball.radius;
        let uv = Self::uv(self.to_local(outwards));
        AreaSample {
            p,
            p_error: self.ball.error(p),
            n: self.orient(outwards),
            uv,
            pdf: 1.0 / self.area(),
            triangle: NO_TRIANGLE,
        }
    }

    /// How the sphere is seen from outside; `None` from inside. The side the surface lies on is the one it shines to.
    fn view(&self, from: Vec3) -> Option<View> {
        let radius = f64::from(self.ball.radius);
        let to_viewer = from.as_dvec3() - self.ball.center.as_dvec3();
        let distance = to_viewer.length();
        if distance <= radius * if self.inwards { 1.0 + SHELL } else { 1.0 - SHELL } {
            return None;
        }
        let sin = (radius / distance).min(1.0);
        let one_minus_cos = sin * sin / (1.0 + (1.0 - sin * sin).sqrt());
        Some(View { to_viewer: to_viewer / distance, distance, one_minus_cos })
    }
}

impl Shape for Sphere {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Analytic(self.ball.clone())
    }

    fn bounds(&self) -> Aabb {
        self.ball.bounds()
    }

    fn area(&self) -> f32 {
        self.area()
    }

    fn surface(&self, ray: &Ray, hit: &Hit, into: &mut SurfaceHit) {
        let Ball { center, radius } = *self.ball;
        // Found once more in double precision: from far away, `t` in single precision is off by more than the radius.
        let t = taken_root(hit, self.ball.roots(ray));
        let center = center.as_dvec3();
        let outwards = (ray.o.as_dvec3() - center + ray.d.as_dvec3() * t).normalize_or(DVec3::Z);
        *into = self.hit_at(hit.t, (center + outwards * f64::from(radius)).as_vec3(), outwards.as_vec3());
    }

    fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
        Some(self.sample_at(self.to_world(warp::square_to_sphere(u2))))
    }

    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<(LightPoint, Vec3, f32)> {
        let Some(view) = self.view(from) else {
            // By area, about the axes of the world as the reference does.
            let sample = self.sample_at(warp::square_to_sphere(u2));
            let (point, pdf) = sample.as_seen_from(from)?;
            return Some((point, sample.p_error, pdf));
        };
        let radius = f64::from(self.ball.radius);
        // Uniform in the cone, then the first of both points the direction meets (Pharr, Jakob, Humphreys 2023,
        // section 6.2.4); written so that nothing cancels when the sphere is far away or almost touched.
        let down = view.one_minus_cos * f64::from(u2.x);
        let (cos, sin2) = (1.0 - down, down * (2.0 - down));
        let chord = (radius * radius - view.distance * view.distance * sin2).max(0.0).sqrt();
        let distance = (view.distance - radius) * (view.distance + radius) / (view.distance * cos + chord);
        let (sin_phi, cos_phi) = (std::f64::consts::TAU * f64::from(u2.y)).sin_cos();
        let (s, t) = coordinate_system(view.to_viewer.as_vec3());
        let across = (s.as_dvec3() * cos_phi + t.as_dvec3() * sin_phi) * sin2.sqrt();
        let d = across - view.to_viewer * cos;
        let outwards = ((view.to_viewer * view.distance + d * distance) / radius).normalize_or_zero();
        if distance.is_nan() || distance <= 0.0 {
            return None;
        }
        let p = (self.ball.center.as_dvec3() + outwards * radius).as_vec3();
        let outwards = outwards.as_vec3();
        let point = LightPoint {
            p,
            n: self.orient(outwards),
            uv: Self::uv(self.to_local(outwards)),
            d: d.normalize().as_vec3(),
            distance: distance as f32,
            triangle: NO_TRIANGLE,
        };
        Some((point, self.ball.error(p), view.pdf()))
    }

    fn pdf_direct(&self, from: Vec3, point: &LightPoint) -> f32 {
        let pdf = match self.view(from) {
            // Only the near side is sampled; the far one may be seen through it.
            Some(_) if self.orient(point.n).dot(point.d) > 0.0 => 0.0,
            Some(view) => view.pdf(),
            None => point.distance * point.distance / (self.area() * point.d.dot(point.n).abs()),
        };
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    fn at_uv(&self, uv: Vec2) -> Option<SurfaceHit> {
        let (sin_phi, cos_phi) = (TAU * uv.x).sin_cos();
        let (sin_theta, cos_theta) = (PI * uv.y).sin_cos();
        let outwards = self.to_world(Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta));
        Some(self.hit_at(0.0, self.ball.center + outwards * self.ball.radius, outwards))
    }
}
