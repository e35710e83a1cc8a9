//! One group of shapes, placed many times.

use super::{Accel, NO_TRIANGLE, PrimHit, Primitive, Ray};
use crate::math::Aabb;
use glam::{Affine3A, DAffine3, DVec3};
use std::sync::Arc;

/// A group placed in the world by a transform.
///
/// The ray is taken to the group's frame in `f64` and rounded to `f32` there, once; distances along it stay the same.
/// A hit is as accurate as any of the group for that rounded ray, whose points are off by at most
/// 2⁻²⁴ (|o| + t |d|) in the units of the group.
pub struct Instance {
    group: Arc<Accel>,
    to_group: DAffine3,
    bounds: Aabb,
}

impl Instance {
    /// Places `group` by `to_world`.
    ///
    /// # Errors
    /// If the transform is not finite or not invertible, if the placed group is too large for `f32`, or if the group
    /// contains instances itself. A mirroring transform is fine.
    pub fn new(group: Arc<Accel>, to_world: Affine3A) -> Result<Self, String> {
        if group.has_instances() {
            return Err("an instance of a group that contains instances is not supported".into());
        }
        let matrix = to_world.to_cols_array().map(f64::from);
        let to_world = DAffine3::from_cols_array(&matrix);
        let to_group = to_world.inverse();
        if !to_world.is_finite() || to_world.matrix3.determinant() == 0.0 || !to_group.is_finite() {
            return Err("the transform of an instance must be invertible".into());
        }
        let bounds = transformed(&group.bounds(), &to_world);
        if !bounds.is_empty() && !bounds.is_finite() {
            return Err("the transform of an instance moves it out of the range of numbers".into());
        }
        Ok(Self { group, to_group, bounds })
    }

    fn local(&self, ray: &Ray) -> Ray {
        let o = self.to_group.transform_point3(ray.o.as_dvec3()).as_vec3();
        let d = self.to_group.transform_vector3(ray.d.as_dvec3()).as_vec3();
        Ray { o, d, ends: [NO_TRIANGLE; 2], ..*ray }
    }
}

/// A box around the transformed box, rounded outwards.
fn transformed(bounds: &Aabb, to_world: &DAffine3) -> Aabb {
    if bounds.is_empty() {
        return Aabb::EMPTY;
    }
    let [lo, hi] = [bounds.min.as_dvec3(), bounds.max.as_dvec3()];
    let corners = (0..8).map(|i| {
        let pick = DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        to_world.transform_point3(lo * (1.0 - pick) + hi * pick)
    });
    let (min, max) =
        corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max): (DVec3, DVec3), p| (min.min(p), max.max(p)));
    Aabb { min: min.as_vec3().map(f32::next_down), max: max.as_vec3().map(f32::next_up) }
}

impl Primitive for Instance {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        let hit = self.group.intersect(&self.local(ray))?;
        Some(PrimHit { t: hit.t, u: hit.u, v: hit.v, shape: Some(hit.shape), prim: hit.prim })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.group.occluded(&self.local(ray))
    }

    fn is_instance(&self) -> bool {
        true
    }
}
