//! `shapegroup`: shapes that are kept once and placed many times by `instance`.
//!
//! Not rendered itself. Lights, instances and other groups cannot be in it.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | nested shapes | | | at least one, with their materials |
//!
//! ```xml
//! <shape type="shapegroup" id="tree">
//!     <shape type="ply"> <string name="filename" value="tree.ply"/> </shape>
//! </shape>
//! <shape type="instance">
//!     <ref id="tree"/>
//!     <transform name="to_world"> <translate x="5"/> </transform>
//! </shape>
//! ```

use lucerna_core::accel::{Geometry, Hit, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::math::{Aabb, Vec2};
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, ShapeGroup};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "shapegroup",
    aliases: &[],
    summary: "shapes to be placed by instances",
    params: &[&[
        Param::child(ObjectKind::Shape, 1, usize::MAX, "what is placed"),
        Param::child(ObjectKind::Bsdf, 0, 1, "without effect: the shapes have their own"),
    ]],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let shapes = p.shapes();
    for built in &shapes {
        if built.emitter.is_some() {
            return Err(p.error("", "a shapegroup cannot contain a light: place it beside the group"));
        }
        if built.shape.group().is_some() || built.shape.instance().is_some() {
            return Err(p.error("", "a shapegroup cannot contain groups or instances: groups do not nest"));
        }
    }
    let group = ShapeGroup::new(shapes).map_err(|message| p.error("", message))?;
    Ok(Arc::new(Group(Arc::new(group))))
}

/// Has no surface of its own.
struct Group(Arc<ShapeGroup>);

impl Shape for Group {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Mesh { positions: &[], triangles: &[] }
    }

    fn bounds(&self) -> Aabb {
        self.0.accel().bounds()
    }

    fn primitive_count(&self) -> usize {
        self.0.shapes().iter().map(|built| built.shape.primitive_count()).sum()
    }

    fn area(&self) -> f32 {
        0.0
    }

    fn surface(&self, _ray: &Ray, _hit: &Hit, into: &mut SurfaceHit) {
        *into = SurfaceHit::default();
    }

    fn sample_area(&self, _u2: Vec2) -> Option<AreaSample> {
        None
    }

    fn group(&self) -> Option<&Arc<ShapeGroup>> {
        Some(&self.0)
    }
}
