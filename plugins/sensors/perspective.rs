//! `perspective`: a pinhole camera.
//!
//! Looks along +z of its own space with y up; rays start on the near plane. Without `fov` and `focal_length` it has
//! a 50 mm lens. `to_world` may mirror but not scale.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `fov` | float | unset | angle of view in degrees, between 0 and 180 |
//! | `focal_length` | string | 50mm | as on 35 mm film, for the diagonal; instead of `fov` |
//! | `fov_axis` | x, y, diagonal, smaller, larger | x | which angle `fov` is |
//! | `principal_point_offset_x`, `principal_point_offset_y` | float | 0 | shifts the picture, in sizes of the film |
//! | `near_clip`, `far_clip` | float | 0.01, 10000 | what lies between is seen |
//! | `to_world` | transform | identity | placement |
//! | `shutter_open`, `shutter_close` | float | 0, 0 | exposure |
//! | nested `film`, `sampler` | | `hdrfilm`, `sobol` | |
//!
//! ```xml
//! <sensor type="perspective">
//!     <float name="fov" value="40"/>
//!     <transform name="to_world"> <lookat origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/> </transform>
//! </sensor>
//! ```

use super::{COMMON, Camera, FOCUS_IGNORED, VIEW, half_width};
use lucerna_core::interfaces::{CameraRay, Sensor};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "perspective",
    aliases: &[],
    summary: "pinhole camera",
    params: &[
        COMMON,
        VIEW,
        &[
            FOCUS_IGNORED,
            Param::float("principal_point_offset_x", 0.0, "shift of the picture in widths"),
            Param::float("principal_point_offset_y", 0.0, "shift of the picture in heights"),
        ],
    ],
    build: Constructor::Sensor(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sensor> {
    let camera = Camera::with_angle(p)?;
    let half = half_width(p, camera.aspect)?;
    Ok(Arc::new(Perspective {
        half: Vec2::new(half, half / camera.aspect),
        offset: Vec2::new(p.float("principal_point_offset_x"), p.float("principal_point_offset_y")),
        camera,
    }))
}

struct Perspective {
    camera: Camera,
    /// Half the size of the picture at distance 1.
    half: Vec2,
    offset: Vec2,
}

impl Sensor for Perspective {
    fn shutter(&self) -> (f32, f32) {
        self.camera.shutter
    }

    fn ray(&self, film: Vec2, _lens: Vec2) -> CameraRay {
        let at_one = (Vec2::ONE - 2.0 * (film + self.offset)) * self.half;
        self.camera.ray(Vec3::ZERO, at_one.extend(1.0).normalize())
    }
}
