//! `ply`: a mesh from a Stanford PLY file, text or binary.
//!
//! Reads `x y z`, normals `nx ny nz`, texture coordinates `u v`, `s t` or `texture_u texture_v`, and faces; polygons
//! become fans. Further properties can be looked up by textures as `vertex_…` and `face_…`. A file without normals is
//! shaded smoothly by normals averaged from its faces unless `face_normals` is set.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `filename` | file | required | the file |
//! | `flip_tex_coords` | boolean | false | v counts from the top: v → 1 − v |
//! | `face_normals` | boolean | false | shade flat |
//! | `flip_normals` | boolean | false | turn the surface inside out |
//! | `to_world` | transform | identity | placement |
//!
//! ```xml
//! <shape type="ply">
//!     <string name="filename" value="meshes/bunny.ply"/>
//!     <boolean name="face_normals" value="true"/>
//! </shape>
//! ```

use super::mesh::{Mesh, flip_v, read_file};
use super::{COMMON, MESH, ORIENTED};
use lucerna_core::interfaces::Shape;
use lucerna_core::io::ply;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "ply",
    aliases: &[],
    summary: "mesh from a Stanford PLY file",
    params: &[
        COMMON,
        MESH,
        ORIENTED,
        &[
            Param::file("filename", "the file"),
            Param::bool("flip_tex_coords", false, "v counts from the top: v becomes 1 - v"),
        ],
    ],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let mut mesh = read_file(p, ply::read)?;
    if p.bool("flip_tex_coords") {
        flip_v(&mut mesh);
    }
    Ok(Arc::new(Mesh::new(p, mesh)?))
}
