//! `point`: light from a single point, the same in all directions.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `intensity` | colour | 1 | radiant intensity in W·sr⁻¹ |
//! | `position` | point | that of `to_world` | where it is |
//! | `to_world` | transform | identity | only its translation counts; excludes `position` |
//! | `sampling_weight` | float | 1 | relative chance of being sampled for direct light |
//!
//! ```xml
//! <emitter type="point">
//!     <point name="position" x="0" y="5" z="1"/>
//!     <rgb name="intensity" value="10, 10, 8"/>
//! </emitter>
//! ```

use super::COMMON;
use lucerna_core::accel::NO_TRIANGLE;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Emitter, EmitterFlags, LightBounds, LightPoint, LightSample};
use lucerna_core::math::{Aabb, Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::PI;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "point",
    aliases: &[],
    summary: "light from a single point",
    params: &[
        COMMON,
        &[
            Param::rgb("intensity", Slot::Emissive, 1.0, "radiant intensity in W/sr"),
            Param::vector_opt("position", "where it is; excludes to_world"),
            Param::transform("to_world", "only its translation counts"),
        ],
    ],
    build: Constructor::Emitter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    p.exclusive("to_world", "position")?;
    let position = p.vector_opt("position").unwrap_or(p.matrix("to_world").w_axis.truncate().as_vec3());
    Ok(Arc::new(Point { position, intensity: p.rgb("intensity"), sampling_weight: p.float("sampling_weight") }))
}

/// The way from a reference point to a light at a point: the light point and one over the squared distance. `None`
/// where the points coincide, or nearly so that the inverse overflows.
pub(super) fn towards(from: Vec3, position: Vec3) -> Option<(LightPoint, f32)> {
    let d = position - from;
    let distance = d.length();
    let inverse = 1.0 / distance;
    let falloff = inverse * inverse;
    let point =
        LightPoint { p: position, n: Vec3::ZERO, uv: Vec2::ZERO, d: d * inverse, distance, triangle: NO_TRIANGLE };
    falloff.is_finite().then_some((point, falloff))
}

struct Point {
    position: Vec3,
    intensity: Rgb,
    sampling_weight: f32,
}

impl Emitter for Point {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::DELTA
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, from: Vec3, _u2: Vec2) -> Option<LightSample> {
        let (point, falloff) = towards(from, self.position)?;
        let weight = self.intensity * falloff;
        weight.is_finite().then_some(LightSample { point, p_error: Vec3::ZERO, pdf: 1.0, weight, delta: true })
    }

    fn pdf_direct(&self, _from: Vec3, _point: &LightPoint) -> f32 {
        0.0
    }

    fn part_bounds(&self, _part: u32) -> Option<LightBounds> {
        let bounds = Aabb::of_points([self.position]);
        Some(LightBounds { bounds, axis: Vec3::Z, theta_o: PI, theta_e: 0.0, intensity: self.intensity.luminance() })
    }

    fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
        4.0 * PI * self.intensity.luminance()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{self, matrix, rgb, vector};
    use lucerna_core::math::{DMat4, DVec3, Vec2, Vec3};

    #[test]
    fn samples_as_the_reference() {
        let intensity = rgb("intensity", [3.0, 2.0, 1.0]);
        let position = vector("position", [1.0, 2.0, 3.0]);
        let light = testing::emitter("point", vec![intensity.clone(), position.clone()]).unwrap();
        testing::assert_golden(&*light, "point");
        let to_world = matrix("to_world", DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)));
        let same = testing::emitter("point", vec![intensity, to_world.clone()]).unwrap();
        testing::assert_golden(&*same, "point");
        assert!(testing::errors("point", vec![position, to_world]).contains("exclude each other"));
    }

    #[test]
    fn hc_e05_at_the_reference_point_there_is_no_light() {
        let light = testing::emitter("point", vec![]).unwrap();
        assert!(light.sample_direct(Vec3::ZERO, Vec2::ZERO).is_none());
        assert!(light.sample_direct(Vec3::splat(1e-30), Vec2::ZERO).is_none());
        assert!(light.sample_direct(Vec3::splat(1e-10), Vec2::ZERO).unwrap().weight.is_finite());
    }
}
