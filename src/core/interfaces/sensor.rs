//! Cameras.

use crate::accel::Ray;
use crate::color::Rgb;
use crate::math::Vec2;

/// A ray that starts at the camera.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// The ray in world space, direction of unit length.
    pub ray: Ray,
    /// What the radiance along it counts for.
    pub weight: Rgb,
    /// Rays through the film a little to the right and a little below, for those who ask
    /// ([`wants_differentials`](super::RadianceEstimator::wants_differentials)): one pixel over the square root of
    /// the samples per pixel away.
    pub offsets: Option<[Ray; 2]>,
}

/// A sensor plugin. Film positions are in [0, 1)² of the *full* film, (0, 0) at the top left.
pub trait Sensor: Send + Sync {
    /// Whether the lens position matters; if not, no number is drawn for it.
    fn needs_lens(&self) -> bool {
        false
    }

    /// When the shutter opens and closes.
    fn shutter(&self) -> (f32, f32) {
        (0.0, 0.0)
    }

    /// The ray through a film position and a lens position in [0, 1)².
    fn ray(&self, film: Vec2, lens: Vec2) -> CameraRay;
}
