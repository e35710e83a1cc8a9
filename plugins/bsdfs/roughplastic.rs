//! `roughplastic`: a matte base under a rough clear coat.
//!
//! As `plastic`, with the reflection off the coat spread by microfacets and both passages through the coat weighted
//! by the transmittance of a rough interface, which is integrated at load. Light that is scattered several times
//! inside the coat's surface is lost: very rough plastics get dark. One-sided: black from behind, see `twosided`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `diffuse_reflectance` | colour or texture | 0.5 | albedo of the base |
//! | `specular_reflectance` | colour or texture | 1 | factor on the reflection off the coat; 1 is physical |
//! | `int_ior` | float or material name | polypropylene | index of refraction of the coat; must differ from `ext_ior` |
//! | `ext_ior` | float or material name | air | index of refraction outside |
//! | `nonlinear` | boolean | false | whether internal reflection saturates colours |
//! | `distribution` | string | beckmann | distribution of microfacet normals: `beckmann` or `ggx` |
//! | `alpha` | float | 0.1 | roughness, the same everywhere and in all directions |
//! | `sample_visible` | boolean | true | sample only normals that are seen from the incident direction |
//!
//! ```xml
//! <bsdf type="roughplastic">
//!     <string name="distribution" value="ggx"/>
//!     <float name="alpha" value="0.2"/>
//!     <rgb name="diffuse_reflectance" value="0.6, 0.1, 0.05"/>
//! </bsdf>
//! ```

use super::form::{Recipe, bsdf};
use super::fresnel::{dielectric, reflect_at};
use super::microfacet::{DISTRIBUTION, Microfacets, SAMPLE_VISIBLE, Shape};
use super::plastic::{Base, Colors, PARAMS};
use super::rough_interface::RoughInterface;
use super::{fresnel, ior};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "roughplastic",
    aliases: &[],
    summary: "matte base under a rough clear coat",
    params: &[
        PARAMS,
        &[DISTRIBUTION, Param::float("alpha", 0.1, "roughness, the same everywhere").at_least(0.0), SAMPLE_VISIBLE],
    ],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    let eta = ior::relative_differing(p)?;
    let (shape, alpha) = (Shape::from(p), p.float("alpha"));
    let interface = RoughInterface::of(shape, alpha, eta);
    Ok(bsdf(RoughPlastic {
        base: Base::from(p, eta, interface.internal_reflectance),
        facets: Microfacets::new(shape, alpha, alpha, p.bool("sample_visible")),
        interface,
        eta,
    }))
}

struct RoughPlastic {
    base: Base,
    facets: Microfacets,
    interface: &'static RoughInterface,
    eta: f32,
}

impl Recipe for RoughPlastic {
    type Form = RoughCoated;

    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION | Lobes::DIFFUSE_REFLECTION
    }

    fn is_constant(&self) -> bool {
        self.base.is_constant()
    }

    fn at(&self, hit: &SurfaceHit) -> RoughCoated {
        RoughCoated { colors: self.base.at(hit), facets: self.facets, interface: self.interface, eta: self.eta }
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit) -> Option<Rgb> {
        Some(self.base.diffuse_at(hit))
    }
}

#[derive(Clone, Copy)]
struct RoughCoated {
    colors: Colors,
    facets: Microfacets,
    interface: &'static RoughInterface,
    eta: f32,
}

impl RoughCoated {
    /// Probability of sampling the reflection off the coat.
    fn p_specular(&self, cos_theta_i: f32) -> f32 {
        self.colors.p_specular(1.0 - self.interface.transmittance(cos_theta_i))
    }
}

impl Bxdf for RoughCoated {
    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION | Lobes::DIFFUSE_REFLECTION
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let (wo, lobe) = if u1 < self.p_specular(wi.z) {
            (reflect_at(wi, self.facets.sample(wi, u2).0), Lobes::GLOSSY_REFLECTION)
        } else {
            (warp::square_to_cosine_hemisphere(u2), Lobes::DIFFUSE_REFLECTION)
        };
        let (value, pdf) = self.eval_pdf(wi, wo, mode);
        (pdf > 0.0 && pdf < f32::INFINITY).then(|| BxdfSample { wo, weight: value / pdf, pdf, eta: 1.0, lobe })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        // Written so that NaN is turned away too.
        if !(wi.z > 0.0 && wo.z > 0.0) {
            return (Rgb::BLACK, 0.0);
        }
        let Some(h) = (wi + wo).try_normalize() else { return (Rgb::BLACK, 0.0) };
        let d = self.facets.eval(h);
        let g1 = self.facets.smith_g1(wi, h);
        let p_specular = self.p_specular(wi.z);
        let pdf_specular = if self.facets.samples_visible() {
            d * g1 / (4.0 * wi.z)
        } else {
            self.facets.pdf(wi, h) / (4.0 * wo.dot(h))
        };
        let pdf = p_specular * pdf_specular + (1.0 - p_specular) * warp::cosine_hemisphere_pdf(wo);

        let f = dielectric(wi.dot(h), self.eta).reflectance;
        let specular = f * d * (g1 * self.facets.smith_g1(wo, h)) / (4.0 * wi.z);
        let passes = self.interface.transmittance(wi.z) * self.interface.transmittance(wo.z);
        let diffuse = warp::cosine_hemisphere_pdf(wo) * passes;
        (self.colors.specular * specular + self.colors.scattered * diffuse, pdf)
    }

    /// The smooth plastic's with the rough coat's transmittance on the way in.
    fn albedo(&self, wi: Vec3) -> Rgb {
        if wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        let t = self.interface.transmittance(wi.z);
        let leaves = 1.0 - fresnel::diffuse_reflectance(self.eta);
        self.colors.specular * (1.0 - t) + self.colors.scattered * (t * leaves)
    }

    fn roughness(&self) -> f32 {
        self.facets.mean_alpha()
    }
}
