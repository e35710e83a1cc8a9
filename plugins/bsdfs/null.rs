//! `null`: a surface that is not there.
//!
//! Light passes unchanged. Its use is to bound a medium whose index of refraction is that of its surroundings.
//!
//! It has no parameters.
//!
//! ```xml
//! <bsdf type="null"/>
//! ```

use super::form::{Recipe, bsdf};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "null",
    aliases: &[],
    summary: "surface that is not there; bounds media",
    params: &[],
    build: Constructor::Bsdf(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(Null))
}

/// Light that passes a surface unchanged, with a given chance of choosing it.
pub fn pass(wi: Vec3, pdf: f32) -> BxdfSample {
    BxdfSample { wo: -wi, weight: Rgb::WHITE, pdf, eta: 1.0, lobe: Lobes::NULL }
}

#[derive(Clone, Copy)]
struct Null;

impl Recipe for Null {
    type Form = Null;

    fn lobes(&self) -> Lobes {
        Lobes::NULL
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn at(&self, _hit: &SurfaceHit) -> Null {
        Null
    }

    fn null_transmission(&self, _hit: &SurfaceHit) -> Rgb {
        Rgb::WHITE
    }
}

impl Bxdf for Null {
    fn lobes(&self) -> Lobes {
        Lobes::NULL
    }

    fn sample(&self, wi: Vec3, _u1: f32, _u2: Vec2, _mode: Transport) -> Option<BxdfSample> {
        Some(pass(wi, 1.0))
    }

    fn eval_pdf(&self, _wi: Vec3, _wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    /// Exact.
    fn albedo(&self, _wi: Vec3) -> Rgb {
        Rgb::WHITE
    }

    fn roughness(&self) -> f32 {
        0.0
    }
}
