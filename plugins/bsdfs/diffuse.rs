//! `diffuse`: an ideally matte surface.
//!
//! Light is scattered evenly over the hemisphere it came from (Lambert 1760): the value is `ρ/π · cos θo`. One-sided:
//! black from behind, see `twosided`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `reflectance` | colour or texture | 0.5 | albedo ρ, in [0, 1] |
//!
//! ```xml
//! <bsdf type="diffuse">
//!     <rgb name="reflectance" value="0.2, 0.25, 0.7"/>
//! </bsdf>
//! ```

use super::form::{Recipe, bsdf};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, ColorSource, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::FRAC_1_PI;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "diffuse",
    aliases: &[],
    summary: "ideally matte surface (Lambert)",
    params: &[&[Param::color("reflectance", Slot::Reflectance, 0.5, "albedo")]],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(Matte { reflectance: p.color("reflectance") }))
}

struct Matte {
    reflectance: ColorSource,
}

impl Recipe for Matte {
    type Form = Diffuse;

    fn lobes(&self) -> Lobes {
        Lobes::DIFFUSE_REFLECTION
    }

    fn is_constant(&self) -> bool {
        self.reflectance.constant().is_some()
    }

    fn at(&self, hit: &SurfaceHit) -> Diffuse {
        Diffuse { reflectance: self.reflectance.at(hit) }
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit) -> Option<Rgb> {
        Some(self.reflectance.at(hit))
    }
}

/// Lambertian reflection with a known albedo.
#[derive(Clone, Copy)]
struct Diffuse {
    reflectance: Rgb,
}

impl Bxdf for Diffuse {
    fn lobes(&self) -> Lobes {
        Lobes::DIFFUSE_REFLECTION
    }

    fn sample(&self, wi: Vec3, _u1: f32, u2: Vec2, _mode: Transport) -> Option<BxdfSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let wo = warp::square_to_cosine_hemisphere(u2);
        let pdf = warp::cosine_hemisphere_pdf(wo);
        (pdf > 0.0).then_some(BxdfSample {
            wo,
            weight: self.reflectance,
            pdf,
            eta: 1.0,
            lobe: Lobes::DIFFUSE_REFLECTION,
        })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        (self.reflectance * (FRAC_1_PI * wo.z), warp::cosine_hemisphere_pdf(wo))
    }

    fn albedo(&self, _wi: Vec3) -> Rgb {
        self.reflectance
    }

    fn roughness(&self) -> f32 {
        1.0
    }
}
