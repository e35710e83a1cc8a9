//! `dielectric`: a perfectly smooth interface between two transparent materials, such as glass in air.
//!
//! Reflects and refracts by Fresnel's equations and Snell's law; the lobe is picked with the chance of its energy.
//! Radiance that crosses the interface is scaled by 1/η². The normal points to the exterior. Equal indices pass the
//! light unchanged.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `int_ior` | float or material name | bk7 | index of refraction inside |
//! | `ext_ior` | float or material name | air | index of refraction outside |
//! | `specular_reflectance` | colour or texture | 1 | factor on the reflection; 1 is physical |
//! | `specular_transmittance` | colour or texture | 1 | factor on the transmission; 1 is physical |
//!
//! ```xml
//! <bsdf type="dielectric">
//!     <string name="int_ior" value="water"/>
//!     <string name="ext_ior" value="air"/>
//! </bsdf>
//! ```

use super::form::{Recipe, all_constant, bsdf};
use super::{fresnel, ior};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, ColorSource, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3, sqr};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};

/// Parameters shared with `thindielectric` and `roughdielectric`.
pub const PARAMS: &[Param] = &[
    ior::interior("bk7"),
    ior::EXTERIOR,
    Param::color("specular_reflectance", Slot::Reflectance, 1.0, "factor on the reflection; 1 is physical"),
    Param::color("specular_transmittance", Slot::Reflectance, 1.0, "factor on the transmission; 1 is physical"),
];

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "dielectric",
    aliases: &[],
    summary: "perfectly smooth glass, water and the like",
    params: &[PARAMS],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(Dielectric { eta: ior::relative(p)?, tint: Tint::from(p) }))
}

/// Artistic factors on both lobes.
pub struct Tint {
    reflectance: ColorSource,
    transmittance: ColorSource,
}

impl Tint {
    /// Reads the last two of [`PARAMS`].
    pub fn from(p: &Properties<'_>) -> Self {
        Tint { reflectance: p.color("specular_reflectance"), transmittance: p.color("specular_transmittance") }
    }

    /// Whether they are the same everywhere.
    pub fn is_constant(&self) -> bool {
        all_constant(&[&self.reflectance, &self.transmittance])
    }

    /// Factors on reflection and transmission at a hit.
    pub fn at(&self, hit: &SurfaceHit) -> [Rgb; 2] {
        [self.reflectance.at(hit), self.transmittance.at(hit)]
    }
}

struct Dielectric {
    eta: f32,
    tint: Tint,
}

impl Recipe for Dielectric {
    type Form = Interface;

    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION | Lobes::DELTA_TRANSMISSION
    }

    fn is_constant(&self) -> bool {
        self.tint.is_constant()
    }

    fn at(&self, hit: &SurfaceHit) -> Interface {
        let [reflectance, transmittance] = self.tint.at(hit);
        Interface { eta: self.eta, reflectance, transmittance }
    }
}

#[derive(Clone, Copy)]
struct Interface {
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
}

impl Bxdf for Interface {
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION | Lobes::DELTA_TRANSMISSION
    }

    fn sample(&self, wi: Vec3, u1: f32, _u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        let interface = fresnel::dielectric(wi.z, self.eta);
        let f = interface.reflectance;
        // An index-matched interface reflects nothing, not even for u1 = 0.
        if u1 <= f && f > 0.0 {
            return Some(BxdfSample {
                wo: fresnel::reflect(wi),
                weight: self.reflectance,
                pdf: f,
                eta: 1.0,
                lobe: Lobes::DELTA_REFLECTION,
            });
        }
        let scale = if mode == Transport::Radiance { sqr(interface.eta_ti) } else { 1.0 };
        Some(BxdfSample {
            wo: fresnel::refract(wi, &interface),
            weight: self.transmittance * scale,
            pdf: 1.0 - f,
            eta: interface.eta_it,
            lobe: Lobes::DELTA_TRANSMISSION,
        })
    }

    fn eval_pdf(&self, _wi: Vec3, _wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    /// Energy of both lobes, without the change of radiance by 1/η².
    fn albedo(&self, wi: Vec3) -> Rgb {
        let f = fresnel::dielectric(wi.z, self.eta).reflectance;
        self.reflectance * f + self.transmittance * (1.0 - f)
    }

    fn roughness(&self) -> f32 {
        0.0
    }
}
