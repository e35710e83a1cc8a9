//! `depth`: the distance to the first hit.
//!
//! Measured along the camera ray from where it starts (the near plane of a perspective camera), in scene units; 0
//! where nothing is hit.
//!
//! ```xml
//! <integrator type="depth"/>
//! ```

use super::common::{COMMON, HIDE_IGNORED, forward_integrator, timeout};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, CameraRay, Integrator, Radiance, RadianceEstimator};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "depth",
    aliases: &[],
    summary: "distance to the first hit",
    params: &[COMMON, HIDE_IGNORED],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(Depth { timeout: timeout(p) }))
}

struct Depth {
    timeout: Option<f64>,
}

forward_integrator!(Depth);

impl RadianceEstimator for Depth {
    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        _: &mut Stream<'_>,
        _: &mut Arena,
        _: &mut [f32],
    ) -> Radiance {
        match scene.intersect(&camera.ray) {
            Some(hit) => Radiance { rgb: Rgb::splat(hit.t), alpha: 1.0, rays: 1 },
            None => Radiance { rays: 1, ..Radiance::default() },
        }
    }
}
