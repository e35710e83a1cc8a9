//! `roughconductor`: a metal with a rough surface.
//!
//! Single scattering off microfacets (Walter et al. 2007): the value is `F D G / 4 cos θi`. There is no compensation
//! for light that is scattered several times, so very rough metals get dark. One-sided: black from behind, see
//! `twosided`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `material` | string | none | name of a measured metal such as `Au`, `Cu`, `Al` (letter case counts); `none` reflects everything |
//! | `eta`, `k` | colour or texture | 0, 1 | real and imaginary part of the relative index of refraction; exclude `material` |
//! | `specular_reflectance` | colour or texture | 1 | factor on the reflection; 1 is physical |
//! | `distribution` | string | beckmann | distribution of microfacet normals: `beckmann` or `ggx` |
//! | `alpha` | float or texture | 0.1 | roughness in both directions; values below 1e-4 act as 1e-4 |
//! | `alpha_u`, `alpha_v` | float or texture | unset | roughness along tangent and bitangent; both or neither; exclude `alpha` |
//! | `sample_visible` | boolean | true | sample only normals that are seen from the incident direction |
//!
//! ```xml
//! <bsdf type="roughconductor">
//!     <string name="material" value="Al"/>
//!     <string name="distribution" value="ggx"/>
//!     <float name="alpha_u" value="0.05"/>
//!     <float name="alpha_v" value="0.3"/>
//! </bsdf>
//! ```

use super::conductor::{self, Facet, Metal};
use super::form::{Recipe, bsdf};
use super::fresnel::reflect_at;
use super::microfacet::{self, Microfacets, Roughness};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "roughconductor",
    aliases: &[],
    summary: "metal with a rough surface",
    params: &[conductor::PARAMS, microfacet::PARAMS],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(RoughConductor { metal: Metal::from(p)?, roughness: Roughness::from(p)? }))
}

struct RoughConductor {
    metal: Metal,
    roughness: Roughness,
}

impl Recipe for RoughConductor {
    type Form = RoughMetal;

    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION
    }

    fn is_constant(&self) -> bool {
        self.metal.is_constant() && self.roughness.is_constant()
    }

    fn at(&self, hit: &SurfaceHit) -> RoughMetal {
        RoughMetal { facet: self.metal.facet_at(hit), facets: self.roughness.at(hit) }
    }
}

#[derive(Clone, Copy)]
struct RoughMetal {
    facet: Facet,
    facets: Microfacets,
}

impl Bxdf for RoughMetal {
    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION
    }

    fn sample(&self, wi: Vec3, _u1: f32, u2: Vec2, _mode: Transport) -> Option<BxdfSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let (m, pdf_m) = self.facets.sample(wi, u2);
        let wo = reflect_at(wi, m);
        let cos_m = wi.dot(m);
        let pdf = pdf_m / (4.0 * wo.dot(m));
        let seen = if self.facets.samples_visible() {
            self.facets.smith_g1(wo, m)
        } else {
            self.facets.g(wi, wo, m) * cos_m / (wi.z * m.z)
        };
        // Also turns away what rounding has made infinite or NaN.
        (wo.z > 0.0 && seen > 0.0 && pdf > 0.0 && pdf < f32::INFINITY).then(|| BxdfSample {
            wo,
            weight: self.facet.reflectance(cos_m) * seen,
            pdf,
            eta: 1.0,
            lobe: Lobes::GLOSSY_REFLECTION,
        })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let Some(h) = (wi + wo).try_normalize() else { return (Rgb::BLACK, 0.0) };
        let cos_h = wi.dot(h);
        let d = self.facets.eval(h);
        if d == 0.0 || cos_h <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let g1 = self.facets.smith_g1(wi, h);
        let pdf = if self.facets.samples_visible() {
            d * g1 / (4.0 * wi.z)
        } else {
            self.facets.pdf(wi, h) / (4.0 * wo.dot(h))
        };
        let value = d * g1 * self.facets.smith_g1(wo, h) / (4.0 * wi.z);
        (self.facet.reflectance(cos_h) * value, pdf)
    }

    /// That of the smooth metal: too much by what several bounces between facets would have lost.
    fn albedo(&self, wi: Vec3) -> Rgb {
        self.facet.albedo(wi)
    }

    fn roughness(&self) -> f32 {
        self.facets.mean_alpha()
    }
}
