//! A plane patch in world space: what `rectangle` and `disk` share.

use super::point_error;
use lucerna_core::math::{Frame, Vec2, Vec3};
use lucerna_core::scene::{Failed, Properties};

/// The plane `center + u x + v y`.
pub struct Plane {
    /// World position of the origin.
    pub center: Vec3,
    /// World direction and length of the local x axis.
    pub x: Vec3,
    /// World direction and length of the local y axis.
    pub y: Vec3,
    /// Unit normal.
    pub n: Vec3,
    /// World area of a unit of local area.
    pub area: f32,
    /// Frame about the normal along the local x axis.
    pub frame: Frame,
    /// Bound on the error of [`point`](Self::point) on each axis.
    pub error: Vec3,
}

impl Plane {
    /// The local xy plane as the shape's `to_world` and `flip_normals` say.
    ///
    /// # Errors
    /// If `to_world` is singular.
    pub fn new(p: &Properties<'_>) -> Result<Self, Failed> {
        p.transform("to_world")?;
        let matrix = p.matrix("to_world");
        let [x, y, z, center] = [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis].map(|a| a.truncate());
        let cross = x.cross(y);
        // The normal stays on the side of the z axis, also of a mirrored or sheared one.
        let side = if (cross.dot(z) < 0.0) != p.bool("flip_normals") { -1.0 } else { 1.0 };
        let n = (cross.normalize_or_zero() * side).as_vec3();
        let area = cross.length() as f32;
        let [center, x, y] = [center, x, y].map(|v| v.as_vec3());
        // Four roundings on the way, and one of each stored vector, whose size does not shrink with the coordinates.
        let error = point_error(center.abs() + x.abs() + y.abs(), 5);
        Ok(Plane { center, x, y, n, area, frame: Frame::from_tangent(n, x), error })
    }

    /// The point at local coordinates within [−1, 1]².
    #[inline]
    pub fn point(&self, local: Vec2) -> Vec3 {
        self.center + self.x * local.x + self.y * local.y
    }
}
