//! The tests find errors that are planted into right BSDFs.

use super::*;
use crate::support::assert_found;
use lucerna::core::interfaces::BxdfSample;

/// A right BSDF that is made wrong in one way.
struct Wrong<'a> {
    right: &'a dyn Bxdf,
    error: Error,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Error {
    None,
    /// The density is told 2 % too high, with samples and without, and the weight to match.
    DensityScaled,
    /// As before, but only where it is asked for.
    DensityScaledInEval,
    /// One of two lobes is sampled 2 % more often than told.
    LobeTooOften,
    /// The density leans 3 % to one side.
    DensityTilted,
    /// Weights are 0.1 % too high.
    WeightScaled,
    /// Values depend on the direction the path came from as they should not.
    NotReciprocal,
    /// Negative at grazing exits.
    Negative,
    /// Not a number straight up.
    NotANumber,
}

impl Bxdf for Wrong<'_> {
    fn lobes(&self) -> Lobes {
        self.right.lobes()
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        let u1 = if self.error == Error::LobeTooOften { (u1 * 0.98).min(ONE_MINUS_EPSILON) } else { u1 };
        let s = self.right.sample(wi, u1, u2, mode)?;
        Some(match self.error {
            Error::DensityScaled => BxdfSample { pdf: s.pdf * 1.02, weight: s.weight / 1.02, ..s },
            Error::DensityTilted => {
                let (value, pdf) = self.eval_pdf(wi, s.wo, mode);
                BxdfSample { pdf, weight: value / pdf, ..s }
            }
            Error::WeightScaled => BxdfSample { weight: s.weight * 1.001, ..s },
            _ => s,
        })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        let (value, pdf) = self.right.eval_pdf(wi, wo, mode);
        match self.error {
            Error::DensityScaled | Error::DensityScaledInEval => (value, pdf * 1.02),
            Error::DensityTilted => (value, pdf * (1.0 + 0.03 * wo.x)),
            Error::NotReciprocal => (value * (1.0 + 0.01 * wi.z), pdf),
            Error::Negative if wo.z.abs() < 1e-6 => (value - Rgb::splat(1e-9), pdf),
            Error::NotANumber if wo.z == 1.0 => (value * f32::NAN, pdf),
            _ => (value, pdf),
        }
    }

    fn albedo(&self, wi: Vec3) -> Rgb {
        self.right.albedo(wi)
    }

    fn roughness(&self) -> f32 {
        self.right.roughness()
    }
}

/// Whether an error is found: by χ², agreement, extremes, reciprocity.
fn found(error: Error) -> [bool; 4] {
    let subject = "<bsdf type='blendbsdf'><float name='weight' value='0.4'/><bsdf type='diffuse'/>\
        <bsdf type='roughconductor'><string name='distribution' value='ggx'/>\
        <float name='alpha' value='0.3'/></bsdf></bsdf>";
    let (bsdf, arena, wi) = (bsdf(subject), Arena::new(), direction(0.5));
    let wrong = Wrong { right: bsdf.resolve(&hit(wi), &arena), error };
    // The level of some 400 tests.
    let level = lucerna::core::stats::chi2::sidak(crate::support::SIGNIFICANCE, 400);
    [
        !chi_square(&wrong, wi, Transport::Radiance, GRID, 1.0).accepts(level),
        disagreement(&wrong, wi, 3).is_some(),
        first_extreme(&wrong, wi).is_some(),
        asymmetry(&wrong).0 > 1e-3,
    ]
}

#[test]
fn planted_errors_are_found() {
    let planted: &[(Error, &[usize])] = &[
        (Error::DensityScaled, &[0]),
        (Error::DensityScaledInEval, &[0, 1]),
        (Error::LobeTooOften, &[0]),
        (Error::DensityTilted, &[0]),
        (Error::WeightScaled, &[1]),
        (Error::NotReciprocal, &[3]),
        (Error::Negative, &[2]),
        (Error::NotANumber, &[2]),
    ];
    assert_found(found, Error::None, planted);
}
