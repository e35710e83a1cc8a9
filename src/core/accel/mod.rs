//! Ray acceleration (types only).
use crate::math::{Aabb, Vec3};
use std::sync::Arc;

/// A ray.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Direction.
    pub d: Vec3,
    /// Hits at or before this parameter do not count.
    pub t_min: f32,
    /// Hits beyond this parameter do not count.
    pub t_max: f32,
}
/// Hit.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Hit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub shape: u32,
    pub prim: u32,
    pub instance: u32,
}
/// None.
pub const NO_INSTANCE: u32 = u32::MAX;
/// What an analytic shape answers.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct PrimHit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub shape: u32,
    pub prim: u32,
}
/// Analytic.
pub trait Primitive: Send + Sync {
    /// Bounds.
    fn bounds(&self) -> Aabb;
    /// Nearest.
    fn intersect(&self, ray: &Ray) -> Option<PrimHit>;
}
/// Geometry.
#[allow(missing_docs)]
pub enum Geometry<'a> {
    Mesh { positions: &'a [Vec3], triangles: &'a [[u32; 3]] },
    Analytic(Arc<dyn Primitive>),
}
/// Accel.
pub struct Accel;
/// Options.
#[derive(Default)]
pub struct BuildOptions;
#[allow(missing_docs)]
impl Accel {
    pub fn build(_: &[(u32, Geometry<'_>)], _: &BuildOptions) -> Result<Accel, String> {
        Ok(Accel)
    }
    pub fn intersect(&self, _: &Ray) -> Option<Hit> {
        None
    }
    pub fn occluded(&self, _: &Ray) -> bool {
        false
    }
    pub fn bounds(&self) -> Aabb {
        Aabb::EMPTY
    }
}
