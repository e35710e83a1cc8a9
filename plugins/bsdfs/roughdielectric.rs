//! `roughdielectric`: a rough interface between two transparent materials, such as ground glass.
//!
//! Microfacets that reflect and refract (Walter et al. 2007). The lobe is picked with the chance of its energy at
//! the sampled facet. Radiance that crosses the interface is scaled by 1/η². Light that is scattered several times by
//! the surface is lost.
//!
//! With `sample_visible` = false the weight of a sample is that of the reference renderer, which leaves out that the
//! normals were drawn from a wider distribution than the surface's: such pictures are a little too bright or dark.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `int_ior` | float or material name | bk7 | index of refraction inside; must differ from `ext_ior` |
//! | `ext_ior` | float or material name | air | index of refraction outside |
//! | `specular_reflectance` | colour or texture | 1 | factor on the reflection; 1 is physical |
//! | `specular_transmittance` | colour or texture | 1 | factor on the transmission; 1 is physical |
//! | `distribution` | string | beckmann | distribution of microfacet normals: `beckmann` or `ggx` |
//! | `alpha` | float or texture | 0.1 | roughness in both directions; values below 1e-4 act as 1e-4 |
//! | `alpha_u`, `alpha_v` | float or texture | unset | roughness along tangent and bitangent; both or neither; exclude `alpha` |
//! | `sample_visible` | boolean | true | sample only normals that are seen from the incident direction |
//!
//! ```xml
//! <bsdf type="roughdielectric">
//!     <string name="distribution" value="ggx"/>
//!     <float name="alpha" value="0.2"/>
//!     <string name="int_ior" value="bk7"/>
//! </bsdf>
//! ```

use super::dielectric::{PARAMS, Tint};
use super::form::{Recipe, bsdf};
use super::fresnel::{dielectric, reflect_at, refract_at};
use super::ior;
use super::microfacet::{self, Microfacets, Roughness};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3, sqr};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "roughdielectric",
    aliases: &[],
    summary: "ground glass and other rough transparent surfaces",
    params: &[PARAMS, microfacet::PARAMS],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    let eta = ior::relative_differing(p)?;
    Ok(bsdf(RoughDielectric { eta, tint: Tint::from(p), roughness: Roughness::from(p)? }))
}

struct RoughDielectric {
    eta: f32,
    tint: Tint,
    roughness: Roughness,
}

impl Recipe for RoughDielectric {
    type Form = RoughInterface;

    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION | Lobes::GLOSSY_TRANSMISSION
    }

    fn is_constant(&self) -> bool {
        self.tint.is_constant() && self.roughness.is_constant()
    }

    fn at(&self, hit: &SurfaceHit) -> RoughInterface {
        let [reflectance, transmittance] = self.tint.at(hit);
        RoughInterface { eta: self.eta, reflectance, transmittance, facets: self.roughness.at(hit) }
    }
}

#[derive(Clone, Copy)]
struct RoughInterface {
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
    facets: Microfacets,
}

/// The direction on the side of the normal.
fn upward(v: Vec3) -> Vec3 {
    if v.z.is_sign_negative() { -v } else { v }
}

impl RoughInterface {
    /// What facets are drawn from. All normals at once are drawn from a wider distribution, which keeps the weights
    /// bounded (Walter et al. 2007, section 5.3).
    fn sampled_facets(&self, cos_theta_i: f32) -> Microfacets {
        if self.facets.samples_visible() {
            self.facets
        } else {
            self.facets.scaled(1.2 - 0.2 * cos_theta_i.abs().sqrt())
        }
    }
}

impl Bxdf for RoughInterface {
    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION | Lobes::GLOSSY_TRANSMISSION
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        if wi.z == 0.0 {
            return None;
        }
        let (m, pdf_m) = self.sampled_facets(wi.z).sample(upward(wi), u2);
        let cos_m = wi.dot(m);
        let interface = dielectric(cos_m, self.eta);
        let f = interface.reflectance;

        let (wo, p_lobe, tint, eta, dm_dwo, lobe) = if u1 <= f {
            let wo = reflect_at(wi, m);
            (wo, f, self.reflectance, 1.0, 1.0 / (4.0 * wo.dot(m)), Lobes::GLOSSY_REFLECTION)
        } else {
            let wo = refract_at(wi, m, &interface);
            let (eta, cos_t) = (interface.eta_it, wo.dot(m));
            let scale = if mode == Transport::Radiance { sqr(interface.eta_ti) } else { 1.0 };
            let dm_dwo = sqr(eta) * cos_t / sqr(cos_m + eta * cos_t);
            (wo, 1.0 - f, self.transmittance * scale, eta, dm_dwo, Lobes::GLOSSY_TRANSMISSION)
        };
        // A facet may send light to the side of the surface that its lobe does not belong to.
        let reflected = lobe == Lobes::GLOSSY_REFLECTION;
        if (wo.z * wi.z > 0.0) != reflected || wo.z == 0.0 {
            return None;
        }
        let seen = if self.facets.samples_visible() {
            self.facets.smith_g1(wo, m)
        } else {
            (self.facets.g(wi, wo, m) * cos_m / (wi.z * m.z)).abs()
        };
        let pdf = pdf_m * p_lobe * dm_dwo.abs();
        (seen > 0.0 && pdf > 0.0 && pdf < f32::INFINITY).then(|| BxdfSample { wo, weight: tint * seen, pdf, eta, lobe })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        const NOTHING: (Rgb, f32) = (Rgb::BLACK, 0.0);
        if wi.z == 0.0 || wo.z == 0.0 {
            return NOTHING;
        }
        let reflected = wi.z * wo.z > 0.0;
        let eta = if wi.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let Some(m) = (wi + wo * if reflected { 1.0 } else { eta }).try_normalize() else {
            return NOTHING;
        };
        let m = upward(m);
        let (cos_i, cos_o) = (wi.dot(m), wo.dot(m));
        if cos_i * wi.z <= 0.0 || cos_o * wo.z <= 0.0 {
            return NOTHING;
        }

        let f = dielectric(cos_i, self.eta).reflectance;
        let dg = self.facets.eval(m) * self.facets.g(wi, wo, m);
        let pdf_m = self.sampled_facets(wi.z).pdf(upward(wi), m);
        if reflected {
            let value = f * dg / (4.0 * wi.z.abs());
            (self.reflectance * value, pdf_m * f * (1.0 / (4.0 * cos_o)).abs())
        } else {
            let scale = if mode == Transport::Radiance { 1.0 / sqr(eta) } else { 1.0 };
            let dm_dwo = (sqr(eta) * cos_o / sqr(cos_i + eta * cos_o)).abs();
            let value = scale * (1.0 - f) * dg * (cos_i / wi.z).abs() * dm_dwo;
            (self.transmittance * value, pdf_m * (1.0 - f) * dm_dwo)
        }
    }

    /// That of the smooth interface, without the change of radiance by 1/η²: too much by what several bounces
    /// between facets would have lost.
    fn albedo(&self, wi: Vec3) -> Rgb {
        let f = dielectric(wi.z, self.eta).reflectance;
        self.reflectance * f + self.transmittance * (1.0 - f)
    }

    fn roughness(&self) -> f32 {
        self.facets.mean_alpha()
    }
}
