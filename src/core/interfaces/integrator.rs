//! Light transport.

use super::{Arena, CameraRay};
use crate::color::Rgb;
use crate::math::UVec2;
use crate::render::{FilmStore, RenderContext, RenderError, Report};
use crate::sampling::Stream;
use crate::scene::Scene;

/// Owns its passes: training, restarts, combination.
pub trait Integrator: Send + Sync {
    /// Renders into the context's film.
    fn render(&self, cx: &mut RenderContext<'_>) -> Result<Report, RenderError>;

    /// Names of the channels after colour and alpha, in order. Empty for most.
    fn aov_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// How many films' memory a run takes, at most: more than one where pictures are combined.
    fn films(&self) -> u64 {
        1
    }

    /// Bytes that a picture of this size takes while it is rendered.
    fn bytes(&self, size: UVec2) -> u64 {
        FilmStore::bytes(size, self.aov_names().len()) * self.films()
    }

    /// Seconds after which the scene wants rendering to stop.
    fn timeout(&self) -> Option<f64> {
        None
    }

    /// The integrator as a forward estimator, if it is one; only these can be nested.
    fn estimator(&self) -> Option<&dyn RadianceEstimator> {
        None
    }
}

/// What one camera path found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radiance {
    /// Incident radiance.
    pub rgb: Rgb,
    /// Alpha: 1 where the path met something that is not transparent, else 0.
    pub alpha: f32,
    /// Rays traced to find it.
    pub rays: u32,
}

/// A forward estimator without state between samples; the pass loop is shared
/// ([`crate::render::render_estimator`]).
pub trait RadianceEstimator: Send + Sync {
    /// Whether it reads [`CameraRay::offsets`]; nobody else pays for them.
    fn wants_differentials(&self) -> bool {
        false
    }

    /// The estimator with what it has to make for a scene before the first sample; `None` where that is nothing. Whoever
    /// renders asks first, and takes the samples from what it is given.
    fn prepare(&self, _scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        None
    }

    /// Unbiased estimate of the radiance along `camera.ray`, its weight left out. `aovs` has as many entries as
    /// [`Integrator::aov_names`] and is zero on entry.
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
    ) -> Radiance;
}
