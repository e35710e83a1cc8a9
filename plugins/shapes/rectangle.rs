//! `rectangle`: the square [−1, 1]² in the xy plane, facing +z.
//!
//! `to_world` makes any parallelogram of it. Texture coordinates run from 0 to 1 along x and y. The normal follows
//! the z axis, so that a mirrored rectangle faces where its z axis points.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `to_world` | transform | identity | placement |
//! | `flip_normals` | boolean | false | face −z |
//!
//! ```xml
//! <shape type="rectangle">
//!     <transform name="to_world">
//!         <rotate x="1" angle="-90"/>
//!         <translate y="-1"/>
//!     </transform>
//! </shape>
//! ```

use super::plane::Plane;
use super::{COMMON, ORIENTED};
use lucerna_core::accel::{Geometry, Hit, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::math::{Aabb, Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "rectangle",
    aliases: &[],
    summary: "square from -1 to 1 in the xy plane",
    params: &[COMMON, ORIENTED],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let plane = Plane::new(p)?;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| plane.point(Vec2::new(x, y)));
    Ok(Arc::new(Rectangle { corners, area: 4.0 * plane.area, plane }))
}

/// Cut and numbered as in the reference.
const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 3], [2, 3, 1]];

struct Rectangle {
    plane: Plane,
    /// Counter-clockwise seen from +z, at (−1, −1) first. Traced as two triangles: the fastest a ray can meet.
    corners: [Vec3; 4],
    area: f32,
}

impl Rectangle {
    #[inline]
    fn hit_at(&self, t: f32, uv: Vec2) -> SurfaceHit {
        let Plane { x, y, n, frame, error, .. } = self.plane;
        let p = self.plane.point(2.0 * uv - Vec2::ONE);
        SurfaceHit { t, p, p_error: error, n, frame, uv, dp_du: 2.0 * x, dp_dv: 2.0 * y, ..SurfaceHit::default() }
    }
}

impl Shape for Rectangle {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Mesh { positions: &self.corners, triangles: &TRIANGLES }
    }

    fn bounds(&self) -> Aabb {
        Aabb::of_points(self.corners)
    }

    fn primitive_count(&self) -> usize {
        2
    }

    fn area(&self) -> f32 {
        self.area
    }

    fn surface(&self, _ray: &Ray, hit: &Hit, into: &mut SurfaceHit) {
        let barycentric = Vec2::new(hit.u, hit.v);
        let uv = if hit.prim == 0 { barycentric } else { Vec2::ONE - barycentric };
        *into = self.hit_at(hit.t, uv.max(Vec2::ZERO));
        into.prim = hit.prim;
        into.barycentric = barycentric;
    }

    fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
        let p = self.plane.point(2.0 * u2 - Vec2::ONE);
        let triangle = u32::from(u2.x + u2.y > 1.0);
        Some(AreaSample { p, p_error: self.plane.error, n: self.plane.n, uv: u2, pdf: 1.0 / self.area, triangle })
    }

    fn normal_cone(&self) -> (Vec3, f32) {
        (self.plane.n, 0.0)
    }

    fn at_uv(&self, uv: Vec2) -> Option<SurfaceHit> {
        let within = uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
        within.then(|| SurfaceHit { triangle: u32::from(uv.x + uv.y > 1.0), ..self.hit_at(0.0, uv) })
    }
}
