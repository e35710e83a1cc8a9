//! Affine transforms with their inverse.

use super::{Aabb, Mat4, Vec3};
use glam::DMat4;

/// An affine transform and its inverse, kept in single precision. Made from a double-precision matrix, so that long
/// chains in a scene file and the inverse lose nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Local to world.
    pub matrix: Mat4,
    /// World to local.
    pub inverse: Mat4,
}

impl Default for Transform {
    fn default() -> Self {
        Transform { matrix: Mat4::IDENTITY, inverse: Mat4::IDENTITY }
    }
}

impl Transform {
    /// From a matrix. `None` if it is singular, not affine or not finite.
    pub fn new(matrix: DMat4) -> Option<Self> {
        let inverse = matrix.inverse();
        let affine = matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0];
        let (single, single_inverse) = (matrix.as_mat4(), inverse.as_mat4());
        // A scale of 0 or one that makes the volume vanish in double precision has no use.
        let volume = matrix.x_axis.truncate().dot(matrix.y_axis.truncate().cross(matrix.z_axis.truncate()));
        (affine && volume != 0.0 && single.is_finite() && single_inverse.is_finite())
            .then_some(Transform { matrix: single, inverse: single_inverse })
    }

    /// A point to world space.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.matrix.transform_point3(p)
    }

    /// A vector to world space.
    #[inline]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.matrix.transform_vector3(v)
    }

    /// A normal to world space (inverse transpose; not normalised).
    #[inline]
    pub fn normal(&self, n: Vec3) -> Vec3 {
        Vec3::new(
            n.dot(self.inverse.x_axis.truncate()),
            n.dot(self.inverse.y_axis.truncate()),
            n.dot(self.inverse.z_axis.truncate()),
        )
    }

    /// A point to local space.
    #[inline]
    pub fn inverse_point(&self, p: Vec3) -> Vec3 {
        self.inverse.transform_point3(p)
    }

    /// A vector to local space.
    #[inline]
    pub fn inverse_vector(&self, v: Vec3) -> Vec3 {
        self.inverse.transform_vector3(v)
    }

    /// The box around a transformed box.
    pub fn bounds(&self, b: Aabb) -> Aabb {
        if b.is_empty() { b } else { Aabb::of_points(b.corners().map(|p| self.point(p))) }
    }

    /// Whether it turns a right hand into a left one.
    pub fn mirrors(&self) -> bool {
        self.matrix.determinant() < 0.0
    }

    /// Whether it leaves everything where it is.
    pub fn is_identity(&self) -> bool {
        self.matrix == Mat4::IDENTITY
    }

    /// Whether all three axes are scaled alike and stay perpendicular, to 1e-4.
    pub fn is_similarity(&self) -> bool {
        let axes = [self.matrix.x_axis, self.matrix.y_axis, self.matrix.z_axis].map(|a| a.truncate());
        let scale = axes[0].length();
        let alike = axes.iter().all(|a| (a.length() - scale).abs() <= 1e-4 * scale);
        let perpendicular = [(0, 1), (0, 2), (1, 2)].iter().all(|&(i, j)| {
            let (a, b): (Vec3, Vec3) = (axes[i], axes[j]);
            a.dot(b).abs() <= 1e-4 * a.length() * b.length()
        });
        alike && perpendicular
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn inverse_and_normals() {
        let t = Transform::new(DMat4::from_scale(DVec3::new(2.0, 1.0, -4.0))).unwrap();
        assert!(t.mirrors() && !t.is_similarity());
        assert_eq!(t.inverse_point(t.point(Vec3::new(1.0, 2.0, 3.0))), Vec3::new(1.0, 2.0, 3.0));
        // A plane x + y = 0 scaled by 2 in x is x/2 + y = 0.
        let n = t.normal(Vec3::new(1.0, 1.0, 0.0));
        assert!((n - Vec3::new(0.5, 1.0, 0.0)).length() < 1e-6);
    }

    #[test]
    fn singular_is_refused() {
        assert!(Transform::new(DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(Transform::new(DMat4::from_scale(DVec3::splat(f64::NAN))).is_none());
    }
}
