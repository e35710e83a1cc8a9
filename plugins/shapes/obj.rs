//! `obj`: a mesh from a Wavefront OBJ file.
//!
//! Reads `v`, `vt`, `vn` and `f`; polygons become fans, everything else is passed over. A file without normals is
//! shaded smoothly by normals averaged from its faces unless `face_normals` is set.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `filename` | file | required | the file |
//! | `flip_tex_coords` | boolean | true | v counts from the top: v → 1 − v |
//! | `face_normals` | boolean | false | shade flat |
//! | `flip_normals` | boolean | false | turn the surface inside out |
//! | `to_world` | transform | identity | placement |
//!
//! ```xml
//! <shape type="obj">
//!     <string name="filename" value="meshes/teapot.obj"/>
//! </shape>
//! ```

use super::mesh::{Mesh, flip_v, read_file};
use super::{COMMON, MESH, ORIENTED};
use lucerna_core::interfaces::Shape;
use lucerna_core::io::obj;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "obj",
    aliases: &[],
    summary: "mesh from a Wavefront OBJ file",
    params: &[
        COMMON,
        MESH,
        ORIENTED,
        &[
            Param::file("filename", "the file"),
            Param::bool("flip_tex_coords", true, "v counts from the top: v becomes 1 - v"),
        ],
    ],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let mut mesh = read_file(p, obj::read)?;
    if p.bool("flip_tex_coords") {
        flip_v(&mut mesh);
    }
    Ok(Arc::new(Mesh::new(p, mesh)?))
}
