//! `constant`: the same light from all directions.
//!
//! Surrounds the scene; at most one environment emitter can be in a scene. Directions are sampled uniformly over the
//! sphere.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `radiance` | colour | 1 | radiance in W·m⁻²·sr⁻¹ |
//! | `to_world` | anything | | accepted, without effect |
//! | `sampling_weight` | float | 1 | relative chance of being sampled for direct light |
//!
//! ```xml
//! <emitter type="constant">
//!     <rgb name="radiance" value="0.6, 0.8, 1"/>
//! </emitter>
//! ```

use super::COMMON;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Emitter, EmitterFlags, LightPoint, LightSample};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::PI;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "constant",
    aliases: &[],
    summary: "the same light from all directions",
    params: &[
        COMMON,
        &[
            Param::rgb("radiance", Slot::Emissive, 1.0, "radiance in W/(m² sr)"),
            Param::ignored("to_world", "turning it changes nothing"),
        ],
    ],
    build: Constructor::Emitter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    Ok(Arc::new(Constant { radiance: p.rgb("radiance"), sampling_weight: p.float("sampling_weight") }))
}

struct Constant {
    radiance: Rgb,
    sampling_weight: f32,
}

impl Emitter for Constant {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::ENVIRONMENT
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, _from: Vec3, u2: Vec2) -> Option<LightSample> {
        let d = warp::square_to_sphere(u2);
        Some(LightSample {
            point: LightPoint::of_environment(d),
            p_error: Vec3::ZERO,
            pdf: warp::SPHERE_PDF,
            weight: self.radiance / warp::SPHERE_PDF,
            delta: false,
        })
    }

    fn pdf_direct(&self, _from: Vec3, _point: &LightPoint) -> f32 {
        warp::SPHERE_PDF
    }

    fn background(&self, _d: Vec3) -> Rgb {
        self.radiance
    }

    fn power(&self, _scene_center: Vec3, scene_radius: f32) -> f32 {
        // Through a sphere of area 4πr² from outside, π times the radiance per area.
        4.0 * PI * PI * scene_radius * scene_radius * self.radiance.luminance()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{self, rgb};

    #[test]
    fn samples_as_the_reference() {
        let light = testing::emitter("constant", vec![rgb("radiance", [3.0, 2.0, 1.0])]).unwrap();
        testing::assert_golden(&*light, "constant");
    }
}
