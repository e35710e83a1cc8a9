//! One group of shapes, placed many times.

use super::{Accel, NO_TRIANGLE, PrimHit, Primitive, Ray};
use crate::math::{Aabb, Mat4, Transform};
use glam::{Affine3, DMat3, DVec3};
use std::sync::Arc;

/// A group placed in the world by a transform. Kept small, for there may be millions.
///
/// The ray is taken to the group's frame in `f64` and rounded to `f32` there, once; distances along it stay the same.
/// A hit is as accurate as any of the group for that rounded ray, whose points are off by at most
/// 2⁻²⁴ (|o| + t |d|) in the units of the group.
///
/// `G` is the tree, or what holds it along with more.
pub struct Instance<G> {
    group: Arc<G>,
    to_world: Affine3,
    /// The inverse of its matrix. Its translation is taken off before.
    to_group: DMat3,
}

impl AsRef<Accel> for Accel {
    fn as_ref(&self) -> &Accel {
        self
    }
}

impl<G: AsRef<Accel> + Send + Sync> Instance<G> {
    /// Places `group` by an affine matrix.
    ///
    /// # Errors
    /// If the transform is not finite or not invertible, if the placed group is too large for `f32`, or if the group
    /// contains instances itself. A mirroring transform is fine.
    pub fn new(group: Arc<G>, to_world: Mat4) -> Result<Self, String> {
        if (*group).as_ref().has_instances() {
            return Err("an instance of a group that contains instances is not supported".into());
        }
        let to_world = Affine3::from_mat4(to_world);
        let matrix = to_world.matrix3.as_dmat3();
        let to_group = matrix.inverse();
        if !to_world.is_finite() || matrix.determinant() == 0.0 || !to_group.is_finite() {
            return Err("the transform of an instance must be invertible".into());
        }
        let instance = Self { group, to_world, to_group };
        let bounds = instance.bounds();
        if !bounds.is_empty() && !bounds.is_finite() {
            return Err("the instance leaves the range of single precision".into());
        }
        Ok(instance)
    }

    /// What is placed.
    pub fn group(&self) -> &Arc<G> {
        &self.group
    }

    /// Where it is placed.
    pub fn to_world(&self) -> Transform {
        let (matrix, inverse) = (self.to_world, self.to_group);
        let back = inverse * -matrix.translation.as_dvec3();
        let inverse = Affine3::from_mat3_translation(inverse.as_mat3(), back.as_vec3());
        Transform { matrix: matrix.into(), inverse: inverse.into() }
    }

    /// The ray in the group's space; distances along it stay the same.
    pub fn local(&self, ray: &Ray) -> Ray {
        let o = self.to_group * (ray.o.as_dvec3() - self.to_world.translation.as_dvec3());
        let d = self.to_group * ray.d.as_dvec3();
        Ray { o: o.as_vec3(), d: d.as_vec3(), ends: [NO_TRIANGLE; 2], ..*ray }
    }

    fn accel(&self) -> &Accel {
        (*self.group).as_ref()
    }
}

impl<G: AsRef<Accel> + Send + Sync> Primitive for Instance<G> {
    /// A box around the transformed box, rounded outwards.
    fn bounds(&self) -> Aabb {
        let inner = self.accel().bounds();
        if inner.is_empty() {
            return inner;
        }
        let (matrix, translation) = (self.to_world.matrix3.as_dmat3(), self.to_world.translation.as_dvec3());
        let corners = inner.corners().map(|p| matrix * p.as_dvec3() + translation);
        let min = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
        let max = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
        Aabb { min: min.as_vec3().map(f32::next_down), max: max.as_vec3().map(f32::next_up) }
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        let hit = self.accel().intersect(&self.local(ray))?;
        Some(PrimHit { t: hit.t, u: hit.u, v: hit.v, shape: Some(hit.shape), prim: hit.prim })
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.accel().occluded(&self.local(ray))
    }

    fn is_instance(&self) -> bool {
        true
    }
}
