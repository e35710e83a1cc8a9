//! `spot`: light from a point into a cone about +z.
//!
//! At full strength inside `beam_width`, then falling off in proportion to the angle until `cutoff_angle`. A texture
//! is projected through the square around the cone at distance 1; its `u` grows with x and its `v` with y.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `intensity` | colour | 1 | radiant intensity in W·sr⁻¹ on the axis |
//! | `cutoff_angle` | float | 20 | angle between axis and border of the cone in degrees, above 0 to 180 |
//! | `beam_width` | float | ¾ of `cutoff_angle` | angle from the axis up to which the light has full strength, in degrees |
//! | `texture` | texture | unset | multiplies the intensity; must vary |
//! | `to_world` | transform | identity | where it is and where it points |
//! | `sampling_weight` | float | 1 | relative chance of being sampled for direct light |
//!
//! ```xml
//! <emitter type="spot">
//!     <transform name="to_world">
//!         <lookat origin="1, 1, 1" target="1, 2, 1" up="0, 0, 1"/>
//!     </transform>
//!     <float name="cutoff_angle" value="30"/>
//! </emitter>
//! ```

use super::{COMMON, point};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    ColorSource, Emitter, EmitterFlags, LightBounds, LightPoint, LightSample, SurfaceHit, Texture,
};
use lucerna_core::math::{Aabb, Transform, Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::TAU;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "spot",
    aliases: &[],
    summary: "light from a point into a cone",
    params: &[
        COMMON,
        &[
            Param::rgb("intensity", Slot::Emissive, 1.0, "radiant intensity on the axis in W/sr"),
            Param::float("cutoff_angle", 20.0, "angle from the axis to the border of the cone in degrees")
                .range(1e-3, 180.0),
            Param::float_opt("beam_width", "angle of full strength in degrees; 3/4 of cutoff_angle").at_least(0.0),
            Param::color_opt("texture", Slot::Unbounded, "multiplies the intensity; must vary"),
            Param::transform("to_world", "where it is and where it points"),
        ],
    ],
    build: Constructor::Emitter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    let degrees = p.float("cutoff_angle");
    let beam = p.float_opt("beam_width").unwrap_or(0.75 * degrees);
    if beam > degrees {
        p.warn(
            "beam_width",
            "\"beam_width\" is greater than \"cutoff_angle\": the light has full strength up to there",
        );
    }
    let texture = match p.color_opt("texture") {
        Some(ColorSource::Constant(_)) => {
            return Err(p.error("texture", "\"texture\" must vary: set \"intensity\" for a colour"));
        }
        Some(ColorSource::Textured(texture)) => Some(texture),
        None => None,
    };
    let (cutoff, beam) = (degrees.to_radians(), beam.min(degrees).to_radians());
    Ok(Arc::new(Spot {
        to_world: p.transform("to_world")?,
        intensity: p.rgb("intensity"),
        texture,
        cutoff,
        beam,
        cos_cutoff: cutoff.cos(),
        cos_beam: beam.cos(),
        tan_cutoff: cutoff.tan(),
        sampling_weight: p.float("sampling_weight"),
    }))
}

struct Spot {
    to_world: Transform,
    intensity: Rgb,
    texture: Option<Arc<dyn Texture>>,
    /// Angles in radians.
    cutoff: f32,
    beam: f32,
    cos_cutoff: f32,
    cos_beam: f32,
    tan_cutoff: f32,
    sampling_weight: f32,
}

impl Spot {
    /// Share of the full strength in a direction with this cosine to the axis.
    fn falloff(&self, cos: f32) -> f32 {
        if cos <= self.cos_cutoff {
            0.0
        } else if cos >= self.cos_beam {
            1.0
        } else {
            ((self.cutoff - cos.acos()) / (self.cutoff - self.beam)).clamp(0.0, 1.0)
        }
    }

    /// Intensity in a local direction of unit length.
    fn intensity(&self, d: Vec3) -> Rgb {
        let falloff = self.falloff(d.z);
        if falloff == 0.0 {
            return Rgb::BLACK;
        }
        let slide = self.texture.as_ref().map_or(Rgb::WHITE, |texture| {
            let uv = Vec2::splat(0.5) + 0.5 * d.truncate() / (d.z * self.tan_cutoff);
            texture.color(&SurfaceHit { p: self.to_world.point(Vec3::ZERO), uv, ..SurfaceHit::default() })
        });
        self.intensity * slide * falloff
    }
}

impl Emitter for Spot {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::DELTA
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, from: Vec3, _u2: Vec2) -> Option<LightSample> {
        let (point, inverse_square) = point::towards(from, self.to_world.point(Vec3::ZERO))?;
        let local = self.to_world.inverse_vector(-point.d).try_normalize()?;
        let weight = self.intensity(local) * inverse_square;
        (!weight.is_black() && weight.is_finite()).then_some(LightSample {
            point,
            p_error: Vec3::ZERO,
            pdf: 1.0,
            weight,
            delta: true,
        })
    }

    fn pdf_direct(&self, _from: Vec3, _point: &LightPoint) -> f32 {
        0.0
    }

    fn part_bounds(&self, _part: u32) -> Option<LightBounds> {
        let slide = self.texture.as_ref().map_or(1.0, |texture| texture.mean());
        Some(LightBounds {
            bounds: Aabb::of_points([self.to_world.point(Vec3::ZERO)]),
            axis: self.to_world.vector(Vec3::Z).normalize_or_zero(),
            theta_o: self.beam,
            theta_e: self.cutoff - self.beam,
            intensity: self.intensity.luminance() * slide,
        })
    }

    fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
        // The falloff integrated over the sphere; the quotient is a slope of the sine.
        let (width, sines) = (self.cutoff - self.beam, self.cutoff.sin() - self.beam.sin());
        let slope = if width > 1e-3 { sines / width } else { (0.5 * (self.cutoff + self.beam)).cos() };
        let slide = self.texture.as_ref().map_or(1.0, |texture| texture.mean());
        TAU * (1.0 - slope) * self.intensity.luminance() * slide
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{self, float, matrix, rgb};
    use lucerna_core::math::{DMat4, DVec3, Vec2, Vec3};
    use lucerna_core::sampling::{Pcg32, warp};

    fn placed() -> lucerna_core::scene::Parameter {
        let forward = DVec3::new(-0.7, -2.1, -1.5).normalize();
        let left = DVec3::Y.cross(forward).normalize();
        let columns = [left, forward.cross(left), forward, DVec3::new(1.0, 2.0, 3.0)];
        let [x, y, z, w] = columns;
        matrix("to_world", DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), w.extend(1.0)))
    }

    #[test]
    fn samples_as_the_reference() {
        let intensity = rgb("intensity", [3.0, 2.0, 1.0]);
        let wide = vec![intensity, placed(), float("cutoff_angle", 60.0), float("beam_width", 10.0)];
        testing::assert_golden(&*testing::emitter("spot", wide).unwrap(), "spot");
        testing::assert_golden(&*testing::emitter("spot", vec![placed()]).unwrap(), "spot_default");
    }

    #[test]
    fn hc_e04_odd_cones() {
        assert!(testing::errors("spot", vec![float("cutoff_angle", 0.0)]).contains("cutoff_angle"));
        let mut rng = Pcg32::new(3, 1);
        for (cutoff, beam) in [(30.0, 30.0), (90.0, 67.5), (180.0, 135.0), (180.0, 180.0), (20.0, 25.0)] {
            let light =
                testing::emitter("spot", vec![float("cutoff_angle", cutoff), float("beam_width", beam)]).unwrap();
            // The mean over all directions times 4π is the power.
            let mut sum = 0.0;
            const N: usize = 100_000;
            for _ in 0..N {
                let from = warp::square_to_sphere(Vec2::new(rng.next_f32(), rng.next_f32()));
                if let Some(sample) = light.sample_direct(from, Vec2::ZERO) {
                    assert!(sample.weight.is_finite());
                    sum += sample.weight.luminance();
                }
            }
            let power = light.power(Vec3::ZERO, 1.0);
            let estimate = sum / N as f32 * 4.0 * std::f32::consts::PI;
            assert!((estimate / power - 1.0).abs() < 0.03, "{cutoff} {beam}: {estimate} against {power}");
        }
    }
}
