//! `thinlens`: a camera with a round aperture, so that only one distance is sharp.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `aperture_radius` | float | required | radius of the aperture in scene units; 0 makes it a pinhole |
//! | `focus_distance` | float | `far_clip` | distance of the plane in focus, along z |
//! | `fov`, `focal_length`, `fov_axis` | | unset, 50mm, x | as for `perspective` |
//! | `near_clip`, `far_clip` | float | 0.01, 10000 | what lies between is seen |
//! | `to_world` | transform | identity | placement |
//! | `shutter_open`, `shutter_close` | float | 0, 0 | exposure |
//! | nested `film`, `sampler` | | `hdrfilm`, `sobol` | |
//!
//! ```xml
//! <sensor type="thinlens">
//!     <float name="aperture_radius" value="0.1"/>
//!     <float name="focus_distance" value="4"/>
//! </sensor>
//! ```

use super::{COMMON, Camera, FOCUS, VIEW, half_width};
use lucerna_core::interfaces::{CameraRay, Sensor};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "thinlens",
    aliases: &[],
    summary: "camera with a round aperture and depth of field",
    params: &[
        COMMON,
        VIEW,
        &[FOCUS, Param::float("aperture_radius", 0.0, "radius of the aperture").required().at_least(0.0)],
    ],
    build: Constructor::Sensor(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sensor> {
    let camera = Camera::with_angle(p)?;
    let half = half_width(p, camera.aspect)?;
    Ok(Arc::new(ThinLens {
        half: Vec2::new(half, half / camera.aspect),
        radius: p.float("aperture_radius"),
        focus: p.float_opt("focus_distance").unwrap_or(camera.far),
        camera,
    }))
}

struct ThinLens {
    camera: Camera,
    /// Half the size of the picture at distance 1.
    half: Vec2,
    radius: f32,
    focus: f32,
}

impl Sensor for ThinLens {
    fn needs_lens(&self) -> bool {
        true
    }

    fn shutter(&self) -> (f32, f32) {
        self.camera.shutter
    }

    fn ray(&self, film: Vec2, lens: Vec2) -> CameraRay {
        let in_focus = ((Vec2::ONE - 2.0 * film) * self.half).extend(1.0) * self.focus;
        let on_lens: Vec3 = (warp::square_to_disk_concentric(lens) * self.radius).extend(0.0);
        self.camera.ray(on_lens, (in_focus - on_lens).normalize())
    }
}
