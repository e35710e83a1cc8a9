//! `directional`: parallel light from infinitely far away.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `irradiance` | colour | 1 | irradiance in W·m⁻² of a surface that faces the light |
//! | `direction` | vector | +z of `to_world` | the way the light travels; any length but 0 |
//! | `to_world` | transform | identity | excludes `direction` |
//! | `sampling_weight` | float | 1 | relative chance of being sampled for direct light |
//!
//! ```xml
//! <emitter type="directional">
//!     <vector name="direction" x="1" y="-2" z="0"/>
//!     <rgb name="irradiance" value="3, 3, 2.7"/>
//! </emitter>
//! ```

use super::COMMON;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Emitter, EmitterFlags, LightPoint, LightSample};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::PI;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "directional",
    aliases: &[],
    summary: "parallel light from infinitely far away",
    params: &[
        COMMON,
        &[
            Param::rgb("irradiance", Slot::Emissive, 1.0, "irradiance of a surface that faces it, in W/m²"),
            Param::vector_opt("direction", "the way the light travels; excludes to_world"),
            Param::transform("to_world", "the light travels along its z axis"),
        ],
    ],
    build: Constructor::Emitter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    p.exclusive("to_world", "direction")?;
    let direction = p.vector_opt("direction").unwrap_or(p.matrix("to_world").z_axis.truncate().as_vec3());
    let name = if p.has("to_world") { "to_world" } else { "direction" };
    let direction =
        direction.try_normalize().ok_or_else(|| p.error(name, "the direction of the light has no length"))?;
    Ok(Arc::new(Directional {
        direction,
        irradiance: p.rgb("irradiance"),
        sampling_weight: p.float("sampling_weight"),
    }))
}

struct Directional {
    /// The way the light travels, of unit length.
    direction: Vec3,
    irradiance: Rgb,
    sampling_weight: f32,
}

impl Emitter for Directional {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::DELTA
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, _from: Vec3, _u2: Vec2) -> Option<LightSample> {
        let point = LightPoint::of_environment(-self.direction);
        Some(LightSample { point, p_error: Vec3::ZERO, pdf: 1.0, weight: self.irradiance, delta: true })
    }

    fn pdf_direct(&self, _from: Vec3, _point: &LightPoint) -> f32 {
        0.0
    }

    fn power(&self, _scene_center: Vec3, scene_radius: f32) -> f32 {
        PI * scene_radius * scene_radius * self.irradiance.luminance()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{self, matrix, rgb, vector};
    use lucerna_core::math::{DMat4, Vec2, Vec3};
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn samples_as_the_reference() {
        let irradiance = rgb("irradiance", [3.0, 2.0, 1.0]);
        let direction = vector("direction", [1.0, 2.0, 3.0]);
        let light = testing::emitter("directional", vec![irradiance, direction.clone()]).unwrap();
        testing::assert_golden(&*light, "directional");
        let turn = matrix("to_world", DMat4::from_rotation_x(FRAC_PI_2) * DMat4::from_scale([2.0; 3].into()));
        assert!(testing::errors("directional", vec![direction, turn.clone()]).contains("exclude each other"));
        let light = testing::emitter("directional", vec![turn]).unwrap();
        let d = light.sample_direct(Vec3::ZERO, Vec2::ZERO).unwrap().point.d;
        assert!((d - Vec3::Y).length() < 1e-6);
    }

    #[test]
    fn a_direction_without_length_is_an_error() {
        assert!(testing::errors("directional", vec![vector("direction", [0.0; 3])]).contains("no length"));
    }
}
