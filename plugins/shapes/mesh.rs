//! Triangle meshes in world space: what all mesh plugins share.

use super::point_error;
use lucerna_core::accel::{Accel, BuildOptions, Geometry, Hit, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::io::{self, MeshAttribute, TriangleMesh};
use lucerna_core::math::{Aabb, DMat4, DVec3, Frame, Vec2, Vec3, coordinate_system};
use lucerna_core::sampling::{Discrete, warp};
use lucerna_core::scene::{Failed, Properties};
use rayon::prelude::*;
use std::sync::OnceLock;

/// A mesh with its transform baked in.
pub struct Mesh {
    positions: Vec<Vec3>,
    /// Unit shading normals; empty where the mesh is shaded flat.
    normals: Vec<Vec3>,
    /// The side of most triangles that the shading normals are on: 1 for that of the winding, -1 for the other.
    facing: f32,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    attributes: Vec<MeshAttribute>,
    flip_normals: bool,
    bounds: Aabb,
    area: f32,
    /// Chance of each triangle in area sampling; made when first asked for: lights need it, and what photons begin at.
    /// 12 to 16 bytes each.
    choice: OnceLock<Option<Discrete>>,
    /// The mesh flattened to the uv plane, for [`Shape::at_uv`]; made when first asked for.
    chart: OnceLock<Option<Accel>>,
}

/// One triangle as it is hit or sampled.
struct Corner {
    indices: [usize; 3],
    p: [Vec3; 3],
    /// Weights of the corners.
    b: [f32; 3],
}

impl Corner {
    /// The point and its error. Along the edges from the first corner, so that far from the origin only one rounding is
    /// of the coordinates' size (as the weights, whatever their error, lead to some point of the triangle).
    #[inline]
    fn point(&self) -> (Vec3, Vec3) {
        let [e1, e2] = [(self.p[1] - self.p[0]) * self.b[1], (self.p[2] - self.p[0]) * self.b[2]];
        let p = self.p[0] + (e1 + e2);
        (p, point_error(p.abs(), 1) + point_error(e1.abs() + e2.abs(), 4))
    }

    /// Unit normal by winding; zero for a triangle without area.
    #[inline]
    fn normal(&self) -> Vec3 {
        let [e1, e2] = [self.p[1] - self.p[0], self.p[2] - self.p[0]];
        let n = e1.cross(e2);
        let (squared, largest) = (n.length_squared(), e1.length_squared() * e2.length_squared());
        // Single precision will do unless the triangle is a sliver, or leaves the range of numbers.
        if squared > 1e-3 * largest && squared > 1e-25 && largest < 1e30 {
            return n / squared.sqrt();
        }
        area_normal(self.p).normalize_or_zero().as_vec3()
    }
}

/// Twice the area, along the normal. In double precision, so that tiny and huge triangles have one.
fn area_normal([p0, p1, p2]: [Vec3; 3]) -> DVec3 {
    let [p0, p1, p2] = [p0.as_dvec3(), p1.as_dvec3(), p2.as_dvec3()];
    (p1 - p0).cross(p2 - p0)
}

impl Mesh {
    /// Takes a mesh to world space as the shape's parameters `to_world`, `face_normals` and `flip_normals` say.
    ///
    /// # Errors
    /// If `to_world` is singular or takes a vertex out of the range of single precision.
    pub fn new(p: &Properties<'_>, mesh: TriangleMesh) -> Result<Self, Failed> {
        let TriangleMesh { mut positions, mut normals, uvs, triangles, attributes } = mesh;
        let face_normals = p.bool("face_normals");
        if face_normals {
            normals.clear();
        }
        if p.has("to_world") {
            p.transform("to_world")?;
            let matrix = p.matrix("to_world");
            transform(&matrix, &mut positions, &mut normals);
            if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
                return Err(p.error("to_world", format!("vertex {vertex} leaves the range of single precision")));
            }
        }
        if normals.is_empty() && !face_normals {
            normals = smooth_normals(&positions, &triangles);
        }
        let corners = |t: &[u32; 3]| t.map(|i| positions[i as usize]);
        let area = triangles.iter().map(|t| 0.5 * area_normal(corners(t)).length()).sum::<f64>() as f32;
        let facing = facing(&positions, &normals, &triangles);
        Ok(Mesh {
            bounds: Aabb::of_points(triangles.iter().flat_map(corners)),
            positions,
            normals,
            facing,
            uvs,
            triangles,
            attributes,
            flip_normals: p.bool("flip_normals"),
            area,
            choice: OnceLock::new(),
            chart: OnceLock::new(),
        })
    }

    fn corner(&self, triangle: u32, b: Vec2) -> Corner {
        let indices = self.triangles[triangle as usize].map(|i| i as usize);
        Corner { indices, p: indices.map(|i| self.positions[i]), b: [1.0 - b.x - b.y, b.x, b.y] }
    }

    fn uv(&self, corner: &Corner) -> Vec2 {
        if self.uvs.is_empty() {
            return Vec2::new(corner.b[1], corner.b[2]);
        }
        let [uv0, uv1, uv2] = corner.indices.map(|i| self.uvs[i]);
        uv0 * corner.b[0] + uv1 * corner.b[1] + uv2 * corner.b[2]
    }

    /// Change of the point with u and v; perpendicular unit vectors where the texture coordinates are of no use.
    fn tangents(&self, corner: &Corner, n: Vec3) -> (Vec3, Vec3) {
        let (dp1, dp2) = (corner.p[1] - corner.p[0], corner.p[2] - corner.p[0]);
        if self.uvs.is_empty() {
            return (dp1, dp2);
        }
        let [uv0, uv1, uv2] = corner.indices.map(|i| self.uvs[i]);
        let (duv1, duv2) = (uv1 - uv0, uv2 - uv0);
        let inverse = 1.0 / duv1.perp_dot(duv2);
        let dp_du = (dp1 * duv2.y - dp2 * duv1.y) * inverse;
        let dp_dv = (dp2 * duv1.x - dp1 * duv2.x) * inverse;
        // A map that collapses the triangle to a line has no inverse.
        if dp_du.is_finite() && dp_dv.is_finite() { (dp_du, dp_dv) } else { coordinate_system(n) }
    }

    /// Interpolated unit normal; the geometric one where there is none to interpolate, or where it is on the other side
    /// than those of most of the mesh.
    fn shading_normal(&self, corner: &Corner, n: Vec3) -> Vec3 {
        if self.normals.is_empty() {
            return n;
        }
        let [n0, n1, n2] = corner.indices.map(|i| self.normals[i]);
        let n = n * self.facing;
        let interpolated = n0 * corner.b[0] + n1 * corner.b[1] + n2 * corner.b[2];
        interpolated.try_normalize().filter(|shading| shading.dot(n) > 0.0).unwrap_or(n)
    }

    #[inline(always)]
    fn hit_on(&self, t: f32, triangle: u32, barycentric: Vec2) -> SurfaceHit {
        let corner = self.corner(triangle, barycentric);
        let (p, p_error) = corner.point();
        let n = corner.normal();
        let (dp_du, dp_dv) = self.tangents(&corner, n);
        let side = if self.flip_normals { -1.0 } else { 1.0 };
        let frame = Frame::from_tangent(self.shading_normal(&corner, n) * side, dp_du);
        SurfaceHit {
            t,
            p,
            p_error,
            n: n * side,
            frame,
            uv: self.uv(&corner),
            dp_du,
            dp_dv,
            prim: triangle,
            barycentric,
            ..SurfaceHit::default()
        }
    }

    /// A point uniform on a triangle, with the geometric normal, which the density per solid angle needs; the reference
    /// takes the interpolated one. The density is the caller's.
    fn point_on(&self, triangle: u32, u2: Vec2) -> AreaSample {
        let corner = self.corner(triangle, warp::square_to_triangle(u2));
        let (p, p_error) = corner.point();
        let n = if self.flip_normals { -corner.normal() } else { corner.normal() };
        AreaSample { p, p_error, n, uv: self.uv(&corner), pdf: 0.0, triangle }
    }

    fn choice(&self) -> Option<&Discrete> {
        let areas = || {
            let corners = |t: &[u32; 3]| t.map(|i| self.positions[i as usize]);
            Discrete::new(self.triangles.iter().map(|t| area_normal(corners(t)).length()))
        };
        self.choice.get_or_init(areas).as_ref()
    }

    fn chart(&self) -> Option<&Accel> {
        let flatten = || {
            let positions: Vec<Vec3> = self.uvs.iter().map(|uv| uv.extend(0.0)).collect();
            let geometry = Geometry::Mesh { positions: &positions, triangles: &self.triangles };
            Accel::build(&[(0, geometry)], &BuildOptions::default()).ok()
        };
        if self.uvs.is_empty() { None } else { self.chart.get_or_init(flatten).as_ref() }
    }
}

impl Shape for Mesh {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Mesh { positions: &self.positions, triangles: &self.triangles }
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn primitive_count(&self) -> usize {
        self.triangles.len()
    }

    fn area(&self) -> f32 {
        self.area
    }

    fn surface(&self, _ray: &Ray, hit: &Hit, into: &mut SurfaceHit) {
        *into = self.hit_on(hit.t, hit.prim, Vec2::new(hit.u, hit.v));
    }

    fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
        let (triangle, rest) = self.choice()?.sample_reuse(u2.y);
        Some(AreaSample { pdf: 1.0 / self.area, ..self.point_on(triangle, Vec2::new(u2.x, rest)) })
    }

    fn sample_triangle(&self, triangle: u32, u2: Vec2) -> Option<AreaSample> {
        let corners = self.triangles.get(triangle as usize)?.map(|i| self.positions[i as usize]);
        let pdf = 2.0 / area_normal(corners).length() as f32;
        pdf.is_finite().then(|| AreaSample { pdf, ..self.point_on(triangle, u2) })
    }

    fn at_uv(&self, uv: Vec2) -> Option<SurfaceHit> {
        let ray = Ray::new(uv.extend(-1.0), Vec3::Z);
        let hit = self.chart()?.intersect(&ray)?;
        Some(SurfaceHit { triangle: hit.prim, ..self.hit_on(0.0, hit.prim, Vec2::new(hit.u, hit.v)) })
    }

    fn attribute(&self, name: &str, hit: &SurfaceHit) -> Option<[f32; 3]> {
        let attribute = self.attributes.iter().find(|a| a.name == name)?;
        let channels = attribute.channels as usize;
        let at = |row: usize| {
            let values = &attribute.data[row * channels..(row + 1) * channels];
            let value = |c: usize| values.get(c).copied().unwrap_or(0.0);
            // One channel is grey.
            if channels == 1 { Vec3::splat(value(0)) } else { Vec3::new(value(0), value(1), value(2)) }
        };
        if name.starts_with("face_") {
            return Some(at(hit.prim as usize).to_array());
        }
        let Corner { indices, b, .. } = self.corner(hit.prim, hit.barycentric);
        Some((at(indices[0]) * b[0] + at(indices[1]) * b[1] + at(indices[2]) * b[2]).to_array())
    }
}

/// Reads the file a mesh plugin names.
///
/// # Errors
/// If there is no such file, or the reader refuses it.
pub fn read_file<T>(p: &Properties<'_>, read: impl FnOnce(&[u8]) -> io::Result<T>) -> Result<T, Failed> {
    let path = p.file("filename")?;
    let mesh = io::read_bytes(&path).and_then(|bytes| read(&bytes));
    mesh.map_err(|error| p.error("filename", format!("\"{}\": {error}", p.string("filename"))))
}

/// Counts v from the other end.
pub fn flip_v(mesh: &mut TriangleMesh) {
    for uv in &mut mesh.uvs {
        uv.y = 1.0 - uv.y;
    }
}

/// The side on which most of the shading normals are, by area. Files with all triangles wound the wrong way are common,
/// and their normals must be believed; a few that disagree with the others must not.
fn facing(positions: &[Vec3], normals: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
    let agreement = |t: &[u32; 3]| {
        let sum: DVec3 = t.iter().filter_map(|&i| normals.get(i as usize)).map(|n| n.as_dvec3()).sum();
        area_normal(t.map(|i| positions[i as usize])).dot(sum)
    };
    if triangles.iter().map(agreement).sum::<f64>() < 0.0 { -1.0 } else { 1.0 }
}

/// Takes vertices to world space in double precision; normals by the inverse transpose.
fn transform(matrix: &DMat4, positions: &mut [Vec3], normals: &mut [Vec3]) {
    positions.par_iter_mut().for_each(|p| *p = matrix.transform_point3(p.as_dvec3()).as_vec3());
    let inverse_transpose = matrix.inverse().transpose();
    normals.par_iter_mut().for_each(|n| {
        *n = inverse_transpose.transform_vector3(n.as_dvec3()).normalize_or_zero().as_vec3();
    });
}

/// Vertex normals as means of the face normals, weighted by the faces' angles at the vertex (Thürmer and Wüthrich
/// 1998, "Computing vertex normals from polygonal facets"). Zero where all faces are degenerate.
fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for triangle in triangles {
        let p = triangle.map(|i| positions[i as usize]);
        let Some(n) = area_normal(p).try_normalize() else { continue };
        let p = p.map(|p| p.as_dvec3());
        for k in 0..3 {
            let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            let angle = a.cross(b).length().atan2(a.dot(b));
            sums[triangle[k] as usize] += n * angle;
        }
    }
    sums.into_iter().map(|n| n.normalize_or_zero().as_vec3()).collect()
}
