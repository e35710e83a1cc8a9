//! A point of a surface that a ray has hit.

use crate::accel::{NO_INSTANCE, NO_TRIANGLE, Ray};
use crate::math::{Frame, Vec2, Vec3, error_bounds};

/// Everything known about a hit before the material is asked. World space.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    /// Distance along the ray in units of its direction's length.
    pub t: f32,
    /// The point.
    pub p: Vec3,
    /// Bound on the absolute error of `p` on each axis (see [`error_bounds`]).
    pub p_error: Vec3,
    /// Geometric unit normal; never turned towards the ray.
    pub n: Vec3,
    /// Shading frame: its `n` is the interpolated normal, its `s` follows `dp_du`.
    pub frame: Frame,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Change of the point with u; finite, but zero where the surface has no usable parametrisation.
    pub dp_du: Vec3,
    /// Change of the point with v.
    pub dp_dv: Vec3,
    /// Direction back along the ray, in the local shading frame.
    pub wi: Vec3,
    /// Index of the shape in the scene (of the shape inside the group, for an instance).
    pub shape: u32,
    /// Index of the primitive in the shape: the triangle of a mesh, 0 for others.
    pub prim: u32,
    /// Barycentric coordinates of the second and third vertex on a triangle.
    pub barycentric: Vec2,
    /// Index of the instance in the scene, or [`NO_INSTANCE`].
    pub instance: u32,
    /// The triangle's number for [`Ray::ends`], or [`NO_TRIANGLE`].
    pub triangle: u32,
}

impl Default for SurfaceHit {
    fn default() -> Self {
        SurfaceHit {
            t: 0.0,
            p: Vec3::ZERO,
            p_error: Vec3::ZERO,
            n: Vec3::Z,
            frame: Frame::default(),
            uv: Vec2::ZERO,
            dp_du: Vec3::X,
            dp_dv: Vec3::Y,
            wi: Vec3::Z,
            shape: 0,
            prim: 0,
            barycentric: Vec2::ZERO,
            instance: NO_INSTANCE,
            triangle: NO_TRIANGLE,
        }
    }
}

impl SurfaceHit {
    /// A local direction in world space.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.frame.to_world(v)
    }

    /// A world direction in the local shading frame.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        self.frame.to_local(v)
    }

    /// The ray that leaves in world direction `d`, without an end.
    #[inline]
    pub fn leave(&self, d: Vec3) -> Ray {
        Ray { ends: [self.triangle, NO_TRIANGLE], ..Ray::new(self.origin_towards(d), d) }
    }

    /// Where a ray that leaves in world direction `d` starts.
    #[inline]
    pub fn origin_towards(&self, d: Vec3) -> Vec3 {
        error_bounds::offset_origin(self.p, self.p_error, self.n, d)
    }
}
