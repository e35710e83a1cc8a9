//! Scattering at surfaces.

use super::SurfaceHit;
use crate::color::Rgb;
use crate::math::{Vec2, Vec3};
use std::ops::{BitOr, BitOrAssign};

/// Memory for closed forms that depend on the hit. Emptied between paths, never between the vertices of one.
pub type Arena = bumpalo::Bump;

/// What is carried along the path: it decides whether refraction scales the value by 1/η².
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Transport {
    /// Paths from the camera.
    #[default]
    Radiance,
    /// Paths from the lights.
    Importance,
}

/// The kinds of scattering a BSDF can do, or one sample has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Lobes(u32);

impl Lobes {
    /// Nothing.
    pub const NONE: Lobes = Lobes(0);
    /// Passes straight through, index-matched; counts as "nothing was there".
    pub const NULL: Lobes = Lobes(1);
    /// Cosine-like reflection.
    pub const DIFFUSE_REFLECTION: Lobes = Lobes(2);
    /// Cosine-like transmission.
    pub const DIFFUSE_TRANSMISSION: Lobes = Lobes(4);
    /// Reflection off a rough surface.
    pub const GLOSSY_REFLECTION: Lobes = Lobes(8);
    /// Transmission through a rough surface.
    pub const GLOSSY_TRANSMISSION: Lobes = Lobes(16);
    /// Mirror reflection.
    pub const DELTA_REFLECTION: Lobes = Lobes(32);
    /// Refraction into one direction.
    pub const DELTA_TRANSMISSION: Lobes = Lobes(64);
    /// All lobes with a density.
    pub const SMOOTH: Lobes = Lobes(2 | 4 | 8 | 16);
    /// All lobes without one.
    pub const DELTA: Lobes = Lobes(1 | 32 | 64);
    /// All lobes that cross the surface.
    pub const TRANSMISSION: Lobes = Lobes(1 | 4 | 16 | 64);

    /// Whether any lobe is in both sets.
    #[inline]
    pub const fn intersects(self, other: Lobes) -> bool {
        self.0 & other.0 != 0
    }

    /// The lobes that are in both sets.
    #[inline]
    pub const fn and(self, other: Lobes) -> Lobes {
        Lobes(self.0 & other.0)
    }

    /// Has a lobe with a density: emitter sampling is of use.
    #[inline]
    pub const fn is_smooth(self) -> bool {
        self.intersects(Lobes::SMOOTH)
    }

    /// No lobe with a density crosses the surface: emitters and guides need to know of one side only.
    #[inline]
    pub const fn is_one_sided(self) -> bool {
        !self.intersects(Lobes::SMOOTH.and(Lobes::TRANSMISSION))
    }

    /// Has a lobe without a density.
    #[inline]
    pub const fn has_delta(self) -> bool {
        self.intersects(Lobes::DELTA)
    }
}

impl BitOr for Lobes {
    type Output = Lobes;
    fn bitor(self, o: Lobes) -> Lobes {
        Lobes(self.0 | o.0)
    }
}

impl BitOrAssign for Lobes {
    fn bitor_assign(&mut self, o: Lobes) {
        self.0 |= o.0;
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BxdfSample {
    /// Where the path goes on, local.
    pub wo: Vec3,
    /// Value over density: `f · |cos θo| / pdf`, or the delta lobe's weight over the chance of choosing it.
    pub weight: Rgb,
    /// Density per solid angle; for a delta lobe the discrete probability of choosing it.
    pub pdf: f32,
    /// Index of refraction of the side gone to over the side come from; 1 on reflection.
    pub eta: f32,
    /// The one lobe that was sampled.
    pub lobe: Lobes,
}

/// A scattering plugin. It looks its textures up at a hit *once*…
pub trait Bsdf: Send + Sync {
    /// All lobes that can occur anywhere on the surface.
    fn lobes(&self) -> Lobes;

    /// The closed form at a hit. What does not depend on the hit should be made at load and returned by reference.
    fn resolve<'a>(&'a self, hit: &SurfaceHit, arena: &'a Arena) -> &'a dyn Bxdf;

    /// What a ray that goes straight through keeps: non-zero only for `null`, `mask` and what nests them.
    fn null_transmission(&self, _hit: &SurfaceHit) -> Rgb {
        Rgb::BLACK
    }

    /// The albedo that guides denoisers and the `albedo` AOV: by default π times the value straight up.
    fn diffuse_reflectance(&self, hit: &SurfaceHit, arena: &Arena) -> Rgb {
        // Safe to shorten the lifetime: the closed form is used and forgotten here.
        self.resolve(hit, arena).eval_pdf(hit.wi, Vec3::Z, Transport::Radiance).0 * std::f32::consts::PI
    }
}

/// …and gives a closed form which may then be evaluated many times: by emitter sampling, guiding, resampling, and
/// path reuse after the pass. Directions are local.
pub trait Bxdf: Send + Sync {
    /// The lobes present at this hit.
    fn lobes(&self) -> Lobes;

    /// Samples a direction. `u1` chooses the lobe, `u2` the direction.
    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample>;

    /// Value (with `|cos θo|`) and density of the smooth lobes; both zero for what only delta lobes can do.
    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32);

    /// The part of the energy that comes back from `wi`, roughly; for guides and roulette.
    fn albedo(&self, wi: Vec3) -> Rgb;

    /// Width of the narrowest smooth lobe, 1 where all are diffuse, 0 where only delta lobes exist.
    fn roughness(&self) -> f32;
}
