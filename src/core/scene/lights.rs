//! Lights one by one, for those who choose among them: emitters, or parts of emitters.

use super::world::{EmitterId, Scene};
use crate::accel::NO_TRIANGLE;
use crate::interfaces::{Light, LightPoint, LightSample};
use crate::math::{Vec2, Vec3};

impl Scene {
    /// The part of an emitter that a point in the scene's numbering lies on.
    #[inline]
    pub fn light_part(&self, emitter: EmitterId, point: &LightPoint) -> Option<u32> {
        match self.first_triangles[emitter.0 as usize] {
            NO_TRIANGLE => Some(0),
            _ if self.emitter(emitter).part_count() == 1 => Some(0),
            first => point.triangle.checked_sub(first),
        }
    }

    /// Samples a light that was chosen with chance `pmf`, which becomes part of density and weight. Visibility is not
    /// tested.
    #[inline(always)]
    pub fn sample_light(&self, light: Light, pmf: f32, from: Vec3, u2: Vec2) -> Option<LightSample> {
        let emitter = self.emitter(light.emitter);
        let mut sample = match light.part {
            None => emitter.sample_direct(from, u2)?,
            Some(part) => emitter.sample_part(part, from, u2)?,
        };
        sample.pdf *= pmf;
        sample.weight = sample.weight / pmf;
        let triangle = &mut sample.point.triangle;
        *triangle = triangle.saturating_add(self.first_triangles[light.emitter.0 as usize]);
        Some(sample)
    }

    /// Density with which a light, once chosen, is sampled at this point of it.
    #[inline]
    pub fn pdf_light(&self, light: Light, from: Vec3, point: &LightPoint) -> f32 {
        let emitter = self.emitter(light.emitter);
        match light.part {
            None => emitter.pdf_direct(from, point),
            Some(part) => emitter.pdf_part(part, from, point),
        }
    }
}
