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
        Ok(Plane {
            center: center.as_vec3(),
            x: x.as_vec3(),
            y: y.as_vec3(),
            n: (cross.normalize_or_zero() * side).as_vec3(),
            area: cross.length() as f32,
        })
    }

    /// The point at local coordinates within [−1, 1]², and the bound on its error on each axis.
    #[inline]
    pub fn point(&self, local: Vec2) -> (Vec3, Vec3) {
        let (x, y) = (self.x * local.x, self.y * local.y);
        // Four roundings on the way, and one of each stored vector, whose size does not shrink with `local`.
        let size = self.center.abs() + self.x.abs() + self.y.abs();
        (self.center + x + y, point_error(size, 5))
    }

    /// The frame about the normal along a tangent.
    #[inline]
    pub fn frame(&self, tangent: Vec3) -> Frame {
        Frame::from_tangent(self.n, tangent)
    }
}
