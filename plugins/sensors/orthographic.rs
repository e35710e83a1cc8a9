//! `orthographic`: a camera with parallel rays.
//!
//! The picture shows the square from −1 to 1 of its own x axis, and as much of y as the film's shape asks for; use
//! `to_world` to scale it.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `near_clip`, `far_clip` | float | 0.01, 10000 | what lies between is seen |
//! | `to_world` | transform | identity | placement and size |
//! | `shutter_open`, `shutter_close` | float | 0, 0 | exposure |
//! | nested `film`, `sampler` | | `hdrfilm`, `sobol` | |
//!
//! ```xml
//! <sensor type="orthographic">
//!     <transform name="to_world"> <scale x="10" y="10"/> <translate z="-20"/> </transform>
//! </sensor>
//! ```

use super::{COMMON, Camera, FOCUS_IGNORED};
use lucerna_core::accel::Ray;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{CameraRay, Sensor};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "orthographic",
    aliases: &[],
    summary: "camera with parallel rays",
    params: &[COMMON, &[FOCUS_IGNORED]],
    build: Constructor::Sensor(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sensor> {
    Ok(Arc::new(Orthographic(Camera::new(p)?)))
}

struct Orthographic(Camera);

impl Sensor for Orthographic {
    fn shutter(&self) -> (f32, f32) {
        self.0.shutter
    }

    fn ray(&self, film: Vec2, _lens: Vec2) -> CameraRay {
        let camera = &self.0;
        let at = (Vec2::ONE - 2.0 * film) * Vec2::new(1.0, 1.0 / camera.aspect);
        let o = camera.to_world.point(at.extend(camera.near));
        let d = camera.to_world.vector(Vec3::Z).normalize();
        CameraRay { ray: Ray { t_max: camera.far - camera.near, ..Ray::new(o, d) }, weight: Rgb::WHITE, offsets: None }
    }
}
