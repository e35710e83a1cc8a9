//! The tests find errors that are planted into a right shape.

use super::*;
use crate::support::assert_found;
use lucerna::core::accel::{Geometry, Hit};
use lucerna::core::interfaces::{AreaSample, LightPoint};
use lucerna::core::math::Aabb;
use lucerna::core::stats::chi2::sidak;

/// A right shape that is made wrong in one way.
struct Wrong {
    right: Arc<dyn Shape>,
    error: Error,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Error {
    None,
    /// Area and density of area samples are 2 % off, and agree.
    Area,
    /// Samples lean a little to one side.
    Samples,
    /// The density as a light is 1 % off where it is asked for.
    Density,
    /// 5 % too long.
    Tangent,
    /// Turned by a degree.
    Normal,
    /// Coordinates of samples.
    Coordinates,
}

impl Shape for Wrong {
    fn geometry(&self) -> Geometry<'_> {
        self.right.geometry()
    }

    fn bounds(&self) -> Aabb {
        self.right.bounds()
    }

    fn area(&self) -> f32 {
        self.right.area() * if self.error == Error::Area { 1.02 } else { 1.0 }
    }

    fn surface(&self, ray: &Ray, hit: &Hit, into: &mut SurfaceHit) {
        self.right.surface(ray, hit, into);
        match self.error {
            Error::Tangent => into.dp_du *= 1.05,
            Error::Normal => into.n = (into.n + 0.0175 * into.frame.s).normalize(),
            _ => {}
        }
    }

    fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
        let u2 = if self.error == Error::Samples { Vec2::new(u2.x.powf(1.06), u2.y) } else { u2 };
        let sample = self.right.sample_area(u2)?;
        Some(match self.error {
            Error::Area => AreaSample { pdf: sample.pdf / 1.02, ..sample },
            Error::Coordinates => AreaSample { uv: sample.uv + 0.01, ..sample },
            _ => sample,
        })
    }

    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<(LightPoint, Vec3, f32)> {
        self.right.sample_direct(from, u2)
    }

    fn pdf_direct(&self, from: Vec3, point: &LightPoint) -> f32 {
        self.right.pdf_direct(from, point) * if self.error == Error::Density { 1.01 } else { 1.0 }
    }
}

#[test]
fn planted_errors_are_found() {
    let sphere = || match build(&format!("<shape type='sphere'><transform name='to_world'>{EVEN}</transform></shape>"))
    {
        Object::Shape(built) => built,
        _ => unreachable!("a shape was asked for"),
    };
    let level = sidak(crate::support::SIGNIFICANCE, 30);
    let found = |error| {
        let right = sphere();
        let traced = Traced::of(BuiltShape { shape: Arc::new(Wrong { right: right.shape.clone(), error }), ..right });
        let [area, samples] = area_tests(&traced);
        [
            misplaced(&traced).is_some(),
            !area.accepts(level),
            !samples.accepts(level),
            disagreement(&*traced.shape).is_some(),
            misfit(&traced).is_some(),
        ]
    };
    let planted: &[(Error, &[usize])] = &[
        (Error::Coordinates, &[0]),
        (Error::Area, &[1]),
        (Error::Samples, &[2]),
        (Error::Density, &[3]),
        (Error::Tangent, &[4]),
        (Error::Normal, &[4]),
    ];
    assert_found(found, Error::None, planted);
}
