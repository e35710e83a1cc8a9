//! `cube`: the box [−1, 1]³ as a mesh of twelve triangles.
//!
//! Each face has texture coordinates from 0 to 1. Use `to_world` to make any box of it.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `to_world` | transform | identity | placement |
//! | `face_normals` | boolean | false | without effect on a cube |
//! | `flip_normals` | boolean | false | normals point inwards |
//!
//! ```xml
//! <shape type="cube">
//!     <transform name="to_world"> <scale x="2" y="1" z="0.5"/> </transform>
//! </shape>
//! ```

use super::mesh::Mesh;
use super::{COMMON, MESH, ORIENTED};
use lucerna_core::interfaces::Shape;
use lucerna_core::io::TriangleMesh;
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "cube",
    aliases: &[],
    summary: "box from -1 to 1 on each axis",
    params: &[COMMON, MESH, ORIENTED],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    Ok(Arc::new(Mesh::new(p, cube())?))
}

/// Normal, direction of u and direction of v of each face, laid out as in the reference renderer.
const FACES: [[Vec3; 3]; 6] = [
    [Vec3::NEG_Y, Vec3::Z, Vec3::X],
    [Vec3::Y, Vec3::NEG_X, Vec3::NEG_Z],
    [Vec3::X, Vec3::Y, Vec3::NEG_Z],
    [Vec3::Z, Vec3::Y, Vec3::X],
    [Vec3::NEG_X, Vec3::Y, Vec3::Z],
    [Vec3::NEG_Z, Vec3::NEG_Y, Vec3::X],
];

fn cube() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for [n, u, v] in FACES {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([n - u + v, n + u + v, n + u - v, n - u - v]);
        mesh.normals.extend([n; 4]);
        mesh.uvs.extend([Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first + 3, first, first + 2]]);
    }
    mesh
}
