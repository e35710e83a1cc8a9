//! `serialized`: a mesh from a `.serialized` file of Mitsuba 0.x, format versions 3 and 4.
//!
//! A shape without normals is shaded smoothly by normals averaged from its faces, unless `face_normals` is set here.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `filename` | file | required | the file |
//! | `shape_index` | integer | 0 | which of the file's shapes, from 0 |
//! | `face_normals` | boolean | false | shade flat |
//! | `flip_normals` | boolean | false | turn the surface inside out |
//! | `to_world` | transform | identity | placement |
//!
//! ```xml
//! <shape type="serialized">
//!     <string name="filename" value="room.serialized"/>
//!     <integer name="shape_index" value="1"/>
//! </shape>
//! ```

use super::mesh::{Mesh, read_file};
use super::{COMMON, MESH, ORIENTED};
use lucerna_core::interfaces::Shape;
use lucerna_core::io::serialized;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "serialized",
    aliases: &[],
    summary: "mesh from a .serialized file of Mitsuba 0.x",
    params: &[
        COMMON,
        MESH,
        ORIENTED,
        &[
            Param::file("filename", "the file"),
            Param::int("shape_index", 0, "which of the file's shapes, from 0").at_least(0.0),
        ],
    ],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let index = usize::try_from(p.int("shape_index")).unwrap_or(usize::MAX);
    let found = read_file(p, |bytes| serialized::read(bytes, index))?;
    Ok(Arc::new(Mesh::new(p, found.mesh)?))
}
