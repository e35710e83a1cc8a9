//! Light sources.

use super::SurfaceHit;
use crate::accel::NO_TRIANGLE;
use crate::color::Rgb;
use crate::math::{Aabb, Vec2, Vec3};
use std::ops::BitOr;

/// What an emitter is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct EmitterFlags(u32);

impl EmitterFlags {
    /// Sits on a shape.
    pub const SURFACE: EmitterFlags = EmitterFlags(1);
    /// Surrounds the scene.
    pub const ENVIRONMENT: EmitterFlags = EmitterFlags(2);
    /// Only reachable by sampling it: a point or a single direction.
    pub const DELTA: EmitterFlags = EmitterFlags(4);

    /// Whether any flag is in both.
    #[inline]
    pub const fn has(self, other: EmitterFlags) -> bool {
        self.0 & other.0 != 0
    }
}

impl BitOr for EmitterFlags {
    type Output = EmitterFlags;
    fn bitor(self, o: EmitterFlags) -> EmitterFlags {
        EmitterFlags(self.0 | o.0)
    }
}

/// A point of a light as seen from a reference point: what a density is asked about.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// The point; meaningless for an environment.
    pub p: Vec3,
    /// Geometric normal of the light there.
    pub n: Vec3,
    /// Texture coordinates of the light there.
    pub uv: Vec2,
    /// Unit direction from the reference point to the light.
    pub d: Vec3,
    /// Distance; infinite for an environment.
    pub distance: f32,
    /// The triangle it lies on: as a light gives it the index in its shape, from the scene the number for
    /// [`Ray::ends`](crate::accel::Ray::ends); [`NO_TRIANGLE`] where there is none.
    pub triangle: u32,
}

impl LightPoint {
    /// The light hit by a ray that left the reference point in unit direction `d`.
    #[inline]
    pub fn of_hit(from: Vec3, hit: &SurfaceHit, d: Vec3) -> Self {
        LightPoint { p: hit.p, n: hit.n, uv: hit.uv, d, distance: (hit.p - from).length(), triangle: hit.triangle }
    }

    /// The environment in unit direction `d`.
    #[inline]
    pub fn of_environment(d: Vec3) -> Self {
        LightPoint { p: Vec3::ZERO, n: -d, uv: Vec2::ZERO, d, distance: f32::INFINITY, triangle: NO_TRIANGLE }
    }
}

/// A sampled connection to a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// The point on the light.
    pub point: LightPoint,
    /// Bound on the absolute error of `point.p` on each axis.
    pub p_error: Vec3,
    /// Density per solid angle at the reference point; 1 for a delta light.
    pub pdf: f32,
    /// Radiance over density (for a delta light, the irradiance-like factor that arrives).
    pub weight: Rgb,
    /// The light cannot be hit by chance.
    pub delta: bool,
}

/// Where the light of an emitter, or of a part of it, starts and goes: what a choice among many lights is made by (Conty
/// Estevez and Kulla 2018, "Importance sampling of many lights with adaptive tree splitting", section 4.1).
#[derive(Clone, Copy, Debug)]
pub struct LightBounds {
    /// The box around it.
    pub bounds: Aabb,
    /// Unit middle of the cone of its normals.
    pub axis: Vec3,
    /// Half opening angle of the cone of normals: 0 for a flat light, π if they point everywhere.
    pub theta_o: f32,
    /// Angle to the normal beyond which no light goes: π/2 for a surface.
    pub theta_e: f32,
    /// Luminous intensity in the direction of most of it, in W·sr⁻¹, about.
    pub intensity: f32,
}

/// A light source. Reference points are in world space.
pub trait Emitter: Send + Sync {
    /// What it is like.
    fn flags(&self) -> EmitterFlags;

    /// Relative chance of being picked where lights are picked by the scene's weights.
    fn sampling_weight(&self) -> f32 {
        1.0
    }

    /// Samples a point of the light that may light `from`; visibility is not tested.
    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<LightSample>;

    /// Density with which [`sample_direct`](Self::sample_direct) gives this point; 0 for a delta light.
    fn pdf_direct(&self, from: Vec3, point: &LightPoint) -> f32;

    /// Number of parts that can be sampled apart: triangles, numbered as in its shape.
    fn part_count(&self) -> u32 {
        1
    }

    /// Where the light of a part starts and goes. `None` if it comes from infinitely far, or nobody knows.
    fn part_bounds(&self, _part: u32) -> Option<LightBounds> {
        None
    }

    /// As [`sample_direct`](Self::sample_direct), of one part.
    fn sample_part(&self, _part: u32, from: Vec3, u2: Vec2) -> Option<LightSample> {
        self.sample_direct(from, u2)
    }

    /// Density with which [`sample_part`](Self::sample_part) gives this point, which is on the part.
    fn pdf_part(&self, _part: u32, from: Vec3, point: &LightPoint) -> f32 {
        self.pdf_direct(from, point)
    }

    /// Radiance that leaves a hit on the emitter's shape along `hit.wi`.
    fn radiance(&self, _hit: &SurfaceHit) -> Rgb {
        Rgb::BLACK
    }

    /// Radiance that arrives from unit world direction `d`, for an environment.
    fn background(&self, _d: Vec3) -> Rgb {
        Rgb::BLACK
    }

    /// Emitted power in W summed over channels (luminance), given the sphere around the scene; only for choosing lights.
    fn power(&self, scene_center: Vec3, scene_radius: f32) -> f32;
}
