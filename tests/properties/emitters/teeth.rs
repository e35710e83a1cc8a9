//! The tests find errors that are planted into right emitters.

use super::*;
use crate::support::{SIGNIFICANCE, assert_found};
use lucerna::core::interfaces::{LightSample, SurfaceHit};
use lucerna::core::stats::chi2::sidak;

/// A right emitter that is made wrong in one way.
struct Wrong<'a> {
    right: &'a dyn Emitter,
    error: Error,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Error {
    None,
    /// The density is 1 % off where it is asked for.
    Density,
    /// The density is 1 % off, with samples and without.
    BothDensities,
    /// Samples lean a little to one side.
    Samples,
    /// Weights are 0.1 % off.
    Weight,
    /// A light at a point falls off with the power 1.98.
    Falloff,
}

impl Emitter for Wrong<'_> {
    fn flags(&self) -> EmitterFlags {
        self.right.flags()
    }

    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<LightSample> {
        let u2 = if self.error == Error::Samples { Vec2::new(u2.x.powf(1.04), u2.y) } else { u2 };
        let s = self.right.sample_direct(from, u2)?;
        Some(match self.error {
            Error::BothDensities => LightSample { pdf: s.pdf * 1.01, weight: s.weight / 1.01, ..s },
            Error::Weight => LightSample { weight: s.weight * 1.001, ..s },
            Error::Falloff => LightSample { weight: s.weight * s.point.distance.powf(0.02), ..s },
            _ => s,
        })
    }

    fn pdf_direct(&self, from: Vec3, point: &LightPoint) -> f32 {
        let wrong = matches!(self.error, Error::Density | Error::BothDensities);
        self.right.pdf_direct(from, point) * if wrong { 1.01 } else { 1.0 }
    }

    fn radiance(&self, hit: &SurfaceHit) -> Rgb {
        self.right.radiance(hit)
    }

    fn background(&self, d: Vec3) -> Rgb {
        self.right.background(d)
    }

    fn power(&self, center: Vec3, radius: f32) -> f32 {
        self.right.power(center, radius)
    }
}

/// Whether χ² and agreement find an error in a lamp, in an environment, and that in a light at a point.
fn found(error: Error) -> [bool; 5] {
    let level = sidak(SIGNIFICANCE, 100);
    let lamp = built_shape("<shape type='rectangle'><emitter type='area'/></shape>");
    let right = &**lamp.emitter.as_ref().expect("a lamp");
    let on_shape = Wrong { right, error };
    let from = Vec3::new(1.0, 0.7, 1.3);
    let sky = emitter("<emitter type='envmap'><string name='filename' value='textures/sky.exr'/></emitter>");
    let around = Wrong { right: &*sky, error };
    let point = emitter("<emitter type='point'/>");
    [
        !surfaces::chi_square(&on_shape, &*lamp.shape, &|u2| lamp.shape.sample_area(u2), from).accepts(level),
        disagreement(&on_shape, from, |p| surfaces::sent(&on_shape, p)).is_some(),
        !surroundings::chi_square(&around).accepts(level),
        disagreement(&around, from, |p| around.background(p.d)).is_some(),
        wrong_delta(&Wrong { right: &*point, error }).is_some(),
    ]
}

#[test]
fn planted_errors_are_found() {
    let planted: &[(Error, &[usize])] = &[
        (Error::Density, &[1, 3]),
        (Error::BothDensities, &[0, 2]),
        (Error::Samples, &[0, 2]),
        (Error::Weight, &[1, 3]),
        (Error::Falloff, &[4]),
    ];
    assert_found(found, Error::None, planted);
}
