//! `thindielectric`: a thin sheet of a transparent material, such as a window pane made of one layer of triangles.
//!
//! Light goes through without a change of direction. All reflections between the two faces of the sheet are summed:
//! the reflectance is `R' = 2R / (1 + R)`. Transmission is a null event.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `int_ior` | float or material name | bk7 | index of refraction of the sheet |
//! | `ext_ior` | float or material name | air | index of refraction around it |
//! | `specular_reflectance` | colour or texture | 1 | factor on the reflection; 1 is physical |
//! | `specular_transmittance` | colour or texture | 1 | factor on the transmission; 1 is physical |
//!
//! ```xml
//! <bsdf type="thindielectric">
//!     <float name="int_ior" value="1.5"/>
//! </bsdf>
//! ```

use super::dielectric::{PARAMS, Tint};
use super::form::{Recipe, bsdf};
use super::{fresnel, ior};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "thindielectric",
    aliases: &[],
    summary: "thin sheet of glass that does not bend light",
    params: &[PARAMS],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(ThinDielectric { eta: ior::relative(p)?, tint: Tint::from(p) }))
}

struct ThinDielectric {
    eta: f32,
    tint: Tint,
}

impl Recipe for ThinDielectric {
    type Form = Sheet;

    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION | Lobes::NULL
    }

    fn is_constant(&self) -> bool {
        self.tint.is_constant()
    }

    fn at(&self, hit: &SurfaceHit) -> Sheet {
        let [reflectance, transmittance] = self.tint.at(hit);
        Sheet { eta: self.eta, reflectance, transmittance }
    }

    fn null_transmission(&self, hit: &SurfaceHit) -> Rgb {
        let sheet = self.at(hit);
        sheet.transmittance * (1.0 - sheet.fresnel(hit.wi))
    }
}

#[derive(Clone, Copy)]
struct Sheet {
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
}

impl Sheet {
    /// Reflectance with all reflections inside: R + T R T + T R³ T + …
    fn fresnel(&self, wi: Vec3) -> f32 {
        let r = fresnel::dielectric(wi.z.abs(), self.eta).reflectance;
        r * (2.0 / (1.0 + r))
    }
}

impl Bxdf for Sheet {
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION | Lobes::NULL
    }

    fn sample(&self, wi: Vec3, u1: f32, _u2: Vec2, _mode: Transport) -> Option<BxdfSample> {
        let r = self.fresnel(wi);
        let (wo, weight, pdf, lobe) = if u1 <= r && r > 0.0 {
            (fresnel::reflect(wi), self.reflectance, r, Lobes::DELTA_REFLECTION)
        } else {
            (-wi, self.transmittance, 1.0 - r, Lobes::NULL)
        };
        Some(BxdfSample { wo, weight, pdf, eta: 1.0, lobe })
    }

    fn eval_pdf(&self, _wi: Vec3, _wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    /// Exact.
    fn albedo(&self, wi: Vec3) -> Rgb {
        let r = self.fresnel(wi);
        self.reflectance * r + self.transmittance * (1.0 - r)
    }

    fn roughness(&self) -> f32 {
        0.0
    }
}
