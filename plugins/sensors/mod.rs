//! All sensors: one file each, one line each in [`PLUGINS`].
//!
//! Camera space: z points into the scene, x to the left and y up in the picture.

mod orthographic;
mod perspective;
mod thinlens;

use lucerna_core::accel::Ray;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::CameraRay;
use lucerna_core::math::{Transform, Vec3};
use lucerna_core::scene::description::ObjectKind;
use lucerna_core::scene::{Failed, Param, Plugin, Properties};

/// The table of all sensors.
pub const PLUGINS: &[Plugin] = &[orthographic::PLUGIN, perspective::PLUGIN, thinlens::PLUGIN];

/// What every camera accepts.
const COMMON: &[Param] = &[
    Param::transform("to_world", "placement"),
    Param::float("near_clip", 0.01, "nearer surfaces are not seen, and distances count from here")
        .between(0.0, f64::INFINITY),
    Param::float("far_clip", 10000.0, "farther surfaces are not seen").between(0.0, f64::INFINITY),
    Param::float("shutter_open", 0.0, "when the exposure starts"),
    Param::float("shutter_close", 0.0, "when the exposure ends"),
    Param::child(ObjectKind::Film, 0, 1, "the picture; by default `hdrfilm`"),
    Param::child(ObjectKind::Sampler, 0, 1, "random numbers; by default `sobol`"),
    Param::child(ObjectKind::Medium, 0, 1, "what surrounds the camera"),
];

/// Where a focus can be set.
const FOCUS: Param = Param::float_opt("focus_distance", "distance of the plane in focus; by default `far_clip`")
    .between(0.0, f64::INFINITY);

/// The same where everything is in focus.
const FOCUS_IGNORED: Param = Param::ignored("focus_distance", "of no effect: everything is in focus");

/// How a lens draws: the angle of view.
const VIEW: &[Param] = &[
    Param::float_opt("fov", "angle of view in degrees, along `fov_axis`").between(0.0, 180.0),
    Param::string_opt("focal_length", "focal length as on 35 mm film, such as 50mm; instead of `fov`"),
    Param::choice("fov_axis", &["x", "y", "diagonal", "smaller", "larger"], "x", "which angle `fov` is"),
];

/// What all cameras share.
struct Camera {
    to_world: Transform,
    near: f32,
    far: f32,
    shutter: (f32, f32),
    /// Width over height of the full film.
    aspect: f32,
}

impl Camera {
    fn new(p: &Properties<'_>) -> Result<Self, Failed> {
        let to_world = p.transform("to_world")?;
        let (near, far) = (p.float("near_clip"), p.float("far_clip"));
        if near >= far {
            return Err(p.error("near_clip", format!("\"near_clip\" ({near}) must be less than \"far_clip\" ({far})")));
        }
        let shutter = (p.float("shutter_open"), p.float("shutter_close"));
        if shutter.0 > shutter.1 {
            return Err(p.error("shutter_close", "the shutter must not close before it opens"));
        }
        let size = p.film().ok_or(Failed)?.settings().size;
        Ok(Camera { to_world, near, far, shutter, aspect: size.x as f32 / size.y as f32 })
    }

    /// A camera whose lens sees an angle: a scale in its placement would change it unseen.
    fn with_angle(p: &Properties<'_>) -> Result<Self, Failed> {
        let camera = Camera::new(p)?;
        let m = camera.to_world.matrix;
        let rigid = camera.to_world.is_similarity() && (m.x_axis.truncate().length() - 1.0).abs() <= 1e-3;
        if !rigid {
            return Err(p.error("to_world", "scale or shear in the placement of a camera is not allowed"));
        }
        Ok(camera)
    }

    /// The ray from a point of camera space in a unit direction, from the near to the far plane.
    fn ray(&self, o: Vec3, d: Vec3) -> CameraRay {
        let (near, far) = (self.near / d.z, self.far / d.z);
        let d_world = self.to_world.vector(d).normalize();
        let o = self.to_world.point(o + d * near);
        CameraRay { ray: Ray { t_max: far - near, ..Ray::new(o, d_world) }, weight: Rgb::WHITE, offsets: None }
    }
}

/// Half the width of the picture at distance 1, from `fov` or `focal_length`.
fn half_width(p: &Properties<'_>, aspect: f32) -> Result<f32, Failed> {
    p.exclusive("fov", "focal_length")?;
    let aspect = f64::from(aspect);
    // Half the diagonal of 35 mm film over the focal length is the tangent of half the diagonal angle.
    let (half, axis) = match p.string_opt("focal_length") {
        None if p.has("fov") => ((0.5 * p.double("fov").to_radians()).tan(), p.choice("fov_axis")),
        length => {
            let millimetres = focal_length(length.unwrap_or("50mm")).ok_or_else(|| {
                p.error("focal_length", "\"focal_length\" must be a positive number of mm, as in 50mm")
            })?;
            (0.5 * 36.0f64.hypot(24.0) / millimetres, "diagonal")
        }
    };
    let wide = aspect > 1.0;
    let half_width = match axis {
        "y" => half * aspect,
        "smaller" if wide => half * aspect,
        "larger" if !wide => half * aspect,
        "diagonal" => half / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        _ => half,
    };
    Ok(half_width as f32)
}

fn focal_length(text: &str) -> Option<f64> {
    let number = text.trim();
    let number = number.strip_suffix("mm").unwrap_or(number).trim_end();
    number.parse::<f64>().ok().filter(|mm| *mm > 0.0 && mm.is_finite())
}

#[cfg(test)]
mod tests;
