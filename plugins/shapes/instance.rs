//! `instance`: places the shapes of a `shapegroup` once more, at the cost of a transform.
//!
//! `to_world` may stretch and mirror. Materials are those of the group's shapes; lights cannot be placed this way.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | nested `shapegroup` | | required | what is placed, usually by reference |
//! | `to_world` | transform | identity | placement |
//!
//! ```xml
//! <shape type="instance">
//!     <ref id="tree"/>
//!     <transform name="to_world"> <rotate y="1" angle="45"/> <translate x="5"/> </transform>
//! </shape>
//! ```

use lucerna_core::accel::{self, Geometry, Hit, PrimHit, Primitive, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::math::{Aabb, Vec2};
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, ShapeGroup};
use std::sync::{Arc, Weak};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "instance",
    aliases: &[],
    summary: "a shapegroup, placed once more",
    params: &[&[
        Param::transform("to_world", "placement"),
        Param::child(ObjectKind::Shape, 1, 1, "the shapegroup that is placed"),
        Param::child(ObjectKind::Bsdf, 0, 1, "without effect: the group's shapes have their own"),
    ]],
    build: Constructor::Shape(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Shape> {
    let nested = p.shapes();
    let Some(group) = nested.first().and_then(|built| built.shape.group()) else {
        return Err(p.error("", "an instance needs a shapegroup, not another shape"));
    };
    let placed = accel::Instance::new(group.clone(), p.transform("to_world")?.matrix);
    let placed = placed.map_err(|message| p.error("to_world", message))?;
    Ok(Arc::new_cyclic(|this| Instance { placed, this: this.clone() }))
}

/// One object for the scene and for the tree, since there may be millions.
struct Instance {
    placed: accel::Instance<ShapeGroup>,
    this: Weak<Instance>,
}

impl Primitive for Instance {
    fn bounds(&self) -> Aabb {
        self.placed.bounds()
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        self.placed.intersect(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.placed.occluded(ray)
    }

    fn is_instance(&self) -> bool {
        self.placed.is_instance()
    }
}

impl Shape for Instance {
    fn geometry(&self) -> Geometry<'_> {
        // Whoever asks holds it.
        self.this.upgrade().map_or(Geometry::Mesh { positions: &[], triangles: &[] }, |this| Geometry::Analytic(this))
    }

    fn bounds(&self) -> Aabb {
        self.placed.bounds()
    }

    fn area(&self) -> f32 {
        0.0
    }

    /// Never asked: the scene looks into the group.
    fn surface(&self, _ray: &Ray, _hit: &Hit, into: &mut SurfaceHit) {
        *into = SurfaceHit::default();
    }

    fn sample_area(&self, _u2: Vec2) -> Option<AreaSample> {
        None
    }

    fn instance(&self) -> Option<&accel::Instance<ShapeGroup>> {
        Some(&self.placed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The object with its counters, the entry in the scene, and those in the tree.
    #[test]
    fn hc_g17_an_instance_is_small() {
        let counters = 2 * size_of::<usize>();
        let scene = size_of::<lucerna_core::scene::BuiltShape>();
        let tree = size_of::<(u32, Arc<dyn Primitive>)>() + size_of::<(u32, u32)>() + size_of::<[f32; 6]>();
        let bytes = size_of::<Instance>() + counters + scene + tree;
        lucerna_core::stats::figures::measured(
            "hc_g17_an_instance_is_small",
            format!("{bytes} bytes without the tree's nodes"),
        );
        assert!(bytes <= 300);
    }
}
