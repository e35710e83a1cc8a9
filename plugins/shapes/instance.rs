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

use lucerna_core::accel::{Geometry, Hit, NO_TRIANGLE, PrimHit, Primitive, Ray};
use lucerna_core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna_core::math::{Aabb, DVec3, Mat4, Vec2};
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, ShapeGroup};
use std::sync::Arc;

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
    let placement = Placement { group: group.clone(), matrix: p.transform("to_world")?.matrix };
    let bounds = placement.bounds();
    if !bounds.is_empty() && !bounds.is_finite() {
        return Err(p.error("to_world", "the instance leaves the range of single precision"));
    }
    Ok(Arc::new(Instance(Arc::new(placement))))
}

/// What rays meet. Kept small, for there may be millions: the inverse is made when it is needed.
struct Placement {
    group: Arc<ShapeGroup>,
    /// From the group to the world.
    matrix: Mat4,
}

impl Placement {
    /// The ray in the group's space; distances along it stay the same. In double precision and rounded once, so that
    /// only the rounding of the ray itself adds to the error of a hit.
    fn local(&self, ray: &Ray) -> Ray {
        let to_group = self.matrix.as_dmat4().inverse();
        let o = to_group.transform_point3(ray.o.as_dvec3()).as_vec3();
        let d = to_group.transform_vector3(ray.d.as_dvec3()).as_vec3();
        Ray { o, d, ends: [NO_TRIANGLE; 2], ..*ray }
    }
}

impl Primitive for Placement {
    fn bounds(&self) -> Aabb {
        let inner = self.group.accel().bounds();
        if inner.is_empty() {
            return inner;
        }
        let matrix = self.matrix.as_dmat4();
        let corners = inner.corners().map(|p| matrix.transform_point3(p.as_dvec3()));
        let min = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
        let max = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        Aabb { min: min.as_vec3().map(f32::next_down), max: max.as_vec3().map(f32::next_up) }
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        let hit = self.group.accel().intersect(&self.local(ray))?;
        Some(PrimHit { t: hit.t, u: hit.u, v: hit.v, shape: Some(hit.shape), prim: hit.prim })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.group.accel().occluded(&self.local(ray))
    }

    fn is_instance(&self) -> bool {
        true
    }
}

struct Instance(Arc<Placement>);

impl Shape for Instance {
    fn geometry(&self) -> Geometry<'_> {
        Geometry::Analytic(self.0.clone())
    }

    fn bounds(&self) -> Aabb {
        self.0.bounds()
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

    fn instance(&self) -> Option<(&ShapeGroup, &Mat4)> {
        Some((&self.0.group, &self.0.matrix))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Placement and handle with their counters, the entry in the scene, and those in the tree.
    #[test]
    fn hc_g17_an_instance_is_small() {
        let counters = 2 * 2 * size_of::<usize>();
        let scene = size_of::<lucerna_core::scene::BuiltShape>();
        let tree = size_of::<(u32, Arc<dyn Primitive>)>() + size_of::<(u32, u32)>() + size_of::<[f32; 6]>();
        let bytes = size_of::<Placement>() + size_of::<Instance>() + counters + scene + tree;
        lucerna_core::stats::figures::measured(
            "hc_g17_an_instance_is_small",
            format!("{bytes} bytes without the tree's nodes"),
        );
        assert!(bytes <= 300);
    }
}
