//! Triangles as a file gives them, before any transform.

use glam::{Vec2, Vec3};

use super::{IoError, Result};

/// A further quantity that a mesh file stores per vertex or per face.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshAttribute {
    /// The name by which textures refer to it; starts with `vertex_` or `face_`.
    pub name: String,
    /// Numbers per vertex or face.
    pub channels: u32,
    /// `channels` numbers for each vertex or triangle, as stored (bytes stay in 0 to 255).
    pub data: Vec<f32>,
}

/// An indexed triangle mesh.
///
/// Every reader guarantees: at least one vertex and one triangle, positions and texture coordinates finite, indices in
/// range, optional arrays empty or of the right length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions in object space.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals; empty if the file has none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates exactly as in the file (no flip of v); empty if the file has none.
    pub uvs: Vec<Vec2>,
    /// Three vertex indices per triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Further quantities per vertex or per triangle.
    pub attributes: Vec<MeshAttribute>,
}

impl TriangleMesh {
    /// Checks what all readers promise and repairs what may be repaired: normals are normalised, and one that is zero
    /// or not finite, which would shade as a black dot or as NaN, becomes the mean of the normals of its faces.
    pub(super) fn finish(mut self) -> Result<Self> {
        if self.positions.is_empty() {
            return Err(IoError::new("the mesh has no vertices"));
        }
        if self.triangles.is_empty() {
            return Err(IoError::new("the mesh has no faces"));
        }
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(IoError::new(format!("vertex {vertex} (from 0): the position is not finite")));
        }
        if let Some(vertex) = self.uvs.iter().position(|uv| !uv.is_finite()) {
            return Err(IoError::new(format!("vertex {vertex} (from 0): the texture coordinate is not finite")));
        }
        let mut complete = true;
        for normal in &mut self.normals {
            *normal = normal.normalize_or_zero();
            complete &= *normal != Vec3::ZERO;
        }
        if !complete {
            self.fill_missing_normals();
        }
        Ok(self)
    }

    fn fill_missing_normals(&mut self) {
        let missing: Vec<bool> = self.normals.iter().map(|&normal| normal == Vec3::ZERO).collect();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize]);
            let weighted_by_area = (b - a).cross(c - a);
            for &vertex in triangle {
                if missing[vertex as usize] {
                    self.normals[vertex as usize] += weighted_by_area;
                }
            }
        }
        for (normal, missing) in self.normals.iter_mut().zip(missing) {
            if missing {
                // A vertex of degenerate faces only is never shaded; any unit vector will do.
                *normal = normal.normalize_or(Vec3::Z);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        }
    }

    #[test]
    fn empty_and_non_finite_meshes_are_refused() {
        assert!(TriangleMesh::default().finish().unwrap_err().message.contains("no vertices"));
        assert!(TriangleMesh { triangles: vec![], ..triangle() }.finish().unwrap_err().message.contains("no faces"));
        let mut mesh = triangle();
        mesh.positions[2].y = f32::NAN;
        assert!(mesh.finish().unwrap_err().message.starts_with("vertex 2"));
        let uvs = vec![Vec2::ZERO, Vec2::INFINITY, Vec2::ZERO];
        assert!(TriangleMesh { uvs, ..triangle() }.finish().unwrap_err().message.starts_with("vertex 1"));
    }

    #[test]
    fn missing_normals_come_from_the_faces() {
        let normals = vec![Vec3::new(0.0, 5.0, 0.0), Vec3::ZERO, Vec3::splat(f32::NAN)];
        let mesh = TriangleMesh { normals, ..triangle() }.finish().unwrap();
        assert_eq!(mesh.normals, [Vec3::Y, Vec3::Z, Vec3::Z]);
    }
}
