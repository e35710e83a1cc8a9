//! An orthonormal frame: the local space in which scattering happens.

use super::{Vec3, coordinate_system};

/// Right-handed orthonormal frame with `n` as the local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x axis.
    pub s: Vec3,
    /// Local y axis.
    pub t: Vec3,
    /// Local z axis: the normal.
    pub n: Vec3,
}

impl Default for Frame {
    fn default() -> Self {
        Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z }
    }
}

impl Frame {
    /// Some frame about a unit normal.
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let (s, t) = coordinate_system(n);
        Frame { s, t, n }
    }

    /// The frame about unit `n` whose `s` is `tangent` made perpendicular to it (Gram–Schmidt); any frame if the
    /// tangent is parallel to `n`, zero or not finite.
    #[inline]
    pub fn from_tangent(n: Vec3, tangent: Vec3) -> Self {
        let s = tangent - n * n.dot(tangent);
        let length_squared = s.length_squared();
        if length_squared > 1e-12 * tangent.length_squared() && length_squared.is_finite() {
            let s = s / length_squared.sqrt();
            Frame { s, t: n.cross(s), n }
        } else {
            Frame::from_normal(n)
        }
    }

    /// World direction to local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local coordinates to world direction.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_there_and_back() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::new(0.6, 0.0, -0.8), Vec3::new(1.0, 2.0, 3.0).normalize()] {
            for frame in [Frame::from_normal(n), Frame::from_tangent(n, Vec3::new(1.0, 0.3, 0.1))] {
                let v = Vec3::new(0.3, -0.2, 0.9);
                assert!((frame.to_world(frame.to_local(v)) - v).length() < 1e-6);
                assert!((frame.s.cross(frame.t) - frame.n).length() < 1e-6);
            }
        }
    }

    #[test]
    fn a_useless_tangent_gives_some_frame() {
        for tangent in [Vec3::ZERO, Vec3::Z, Vec3::NAN, Vec3::splat(f32::INFINITY)] {
            let frame = Frame::from_tangent(Vec3::Z, tangent);
            assert!((frame.s.length() - 1.0).abs() < 1e-6 && frame.s.z.abs() < 1e-6);
        }
    }
}
