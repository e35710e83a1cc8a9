//! Directions of a guide together with some towards the environment.
//!
//! What is bright and far away, such as the sun, takes up few directions. Where glass lies before it emitter sampling does not
//! see it, and a guide knows of it only where a path has met it by chance: one in a hundred thousand, each of which then counts
//! as much as all others. But panes and thin glass hardly turn the light, and the environment knows where it is bright. So a
//! part of the guide's directions is drawn as emitter sampling would draw them, without asking what is in the way; where
//! something is learnt of that, the guide knows more from then on. There is no published source for
//! this rule.

use lucerna_core::interfaces::{Emitter, GuidedDirections, LightPoint};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};

/// The mixture, at a vertex.
pub(super) struct WithEnvironment<'g> {
    pub learnt: &'g dyn GuidedDirections,
    pub environment: &'g dyn Emitter,
    /// Its part in the mixture, in (0, 1).
    pub part: f32,
    /// The vertex.
    pub p: Vec3,
}

impl WithEnvironment<'_> {
    /// The density of a direction in which the guide has this one.
    #[inline]
    fn mixed(&self, d: Vec3, pdf_learnt: f32) -> f32 {
        let pdf_environment = self.environment.pdf_direct(self.p, &LightPoint::of_environment(d));
        self.part * pdf_environment + (1.0 - self.part) * pdf_learnt
    }
}

impl GuidedDirections for WithEnvironment<'_> {
    fn p_guide(&self) -> f32 {
        self.learnt.p_guide()
    }

    fn sample(&self, u2: Vec2) -> (Vec3, f32) {
        let within = |x: f32| Vec2::new(x.min(ONE_MINUS_EPSILON), u2.y);
        if u2.x >= self.part {
            let (d, pdf) = self.learnt.sample(within((u2.x - self.part) / (1.0 - self.part)));
            return (d, self.mixed(d, pdf));
        }
        match self.environment.sample_direct(self.p, within(u2.x / self.part)) {
            Some(light) => (light.point.d, self.pdf(light.point.d)),
            // The environment has chosen nothing: whatever this is, it counts nothing.
            None => (Vec3::Z, f32::INFINITY),
        }
    }

    fn pdf(&self, d: Vec3) -> f32 {
        self.mixed(d, self.learnt.pdf(d))
    }

    fn pdf_sets(&self, d: Vec3) -> [f32; 2] {
        self.learnt.pdf_sets(d).map(|pdf| self.mixed(d, pdf))
    }

    fn light(&self, d: Vec3) -> f32 {
        self.learnt.light(d)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use lucerna_core::interfaces::{EmitterFlags, LightSample};
    use lucerna_core::math::Frame;
    use lucerna_core::sampling::{Pcg32, warp};
    use lucerna_core::stats::chi2::SphereGrid;
    use std::f32::consts::PI;

    /// Knows nothing but that light comes from above.
    pub struct Above;

    impl GuidedDirections for Above {
        fn p_guide(&self) -> f32 {
            0.5
        }

        fn sample(&self, u2: Vec2) -> (Vec3, f32) {
            let d = warp::square_to_cosine_hemisphere(u2);
            (d, self.pdf(d))
        }

        fn pdf(&self, d: Vec3) -> f32 {
            d.z.max(0.0) / PI
        }
    }

    /// A sun of this cosine of its radius around an axis, that is behind a cloud every fourth time.
    struct Sun(Vec3, f32);

    impl Emitter for Sun {
        fn flags(&self) -> EmitterFlags {
            EmitterFlags::ENVIRONMENT
        }

        fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<LightSample> {
            let clear = (u2.x - 0.25) / 0.75;
            let z = 1.0 - clear * (1.0 - self.1);
            let d = Frame::from_normal(self.0)
                .to_world((Vec2::from_angle(2.0 * PI * u2.y) * (1.0 - z * z).max(0.0).sqrt()).extend(z));
            let point = LightPoint::of_environment(d);
            let pdf = self.pdf_direct(from, &point);
            let light = LightSample { point, p_error: Vec3::ZERO, pdf, weight: Default::default(), delta: false };
            (clear >= 0.0).then_some(light)
        }

        fn pdf_direct(&self, _from: Vec3, point: &LightPoint) -> f32 {
            if point.d.dot(self.0) >= self.1 { 0.75 / (2.0 * PI * (1.0 - self.1)) } else { 0.0 }
        }

        fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
            1.0
        }
    }

    #[test]
    fn samples_have_the_density_of_the_mixture() {
        let mut pcg = Pcg32::new(5, 5);
        for (axis, cos_radius) in [(Vec3::Z, 0.9), (Vec3::new(0.6, 0.0, 0.8), 0.99), (Vec3::NEG_Y, 0.5)] {
            for part in [0.1, 0.5] {
                let mixture =
                    WithEnvironment { learnt: &Above, environment: &Sun(axis, cos_radius), part, p: Vec3::ZERO };
                let sample = || {
                    let (d, pdf) = mixture.sample(Vec2::new(pcg.next_f32(), pcg.next_f32()));
                    let is_one = pdf.is_finite();
                    assert!(!is_one || (pdf / mixture.pdf(d) - 1.0).abs() < 1e-4, "{d}: {pdf}");
                    is_one.then_some(d)
                };
                let found = SphereGrid { rings: 16, spokes: 32 }.test(100_000, sample, |d| mixture.pdf(d));
                assert!(found.accepts(1e-3), "{axis} {cos_radius} {part}: {found:?}");
            }
        }
    }
}
