//! `principled`: one material for most things, with parameters made for artists.
//!
//! The model of Burley (2012, "Physically based shading at Disney"; 2015, "Extending the Disney BRDF to a BSDF with
//! integrated subsurface scattering") in the form of the reference renderer 3.9: a diffuse lobe with retro-reflection,
//! sheen and a flat subsurface look; a GGX lobe that is metallic, dielectric or a blend; rough transmission; and a
//! clear coat. Lobes are added without regard to each other, so the model *gains* energy at grazing angles: up to
//! 5 % at 60° and 59 % at 89° for a white base. One-sided unless `spec_trans` is above 0.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `base_color` | colour or texture | 0.5 | colour of diffuse, metallic and (as its square root) transmitted light |
//! | `roughness` | float or texture | 0.5 | the GGX lobe's alpha is its square |
//! | `anisotropic` | float or texture | 0 | stretches the highlight along the tangent |
//! | `metallic` | float or texture | 0 | from dielectric to metal |
//! | `spec_trans` | float or texture | 0 | from diffuse to rough glass |
//! | `eta` | float | unset | relative index of refraction; excludes `specular` |
//! | `specular` | float | 0.5 | `eta` by its reflectance: 2/(1 − √(0.08 specular)) − 1 |
//! | `spec_tint` | float or texture | 0 | tints the dielectric highlight with `base_color` |
//! | `sheen`, `sheen_tint` | float or texture | 0 | cloth-like light at grazing angles, and its tint |
//! | `flatness` | float or texture | 0 | from diffuse to a look of subsurface scattering |
//! | `clearcoat`, `clearcoat_gloss` | float or texture | 0 | strength of a second highlight, and how sharp it is |
//! | `main_specular_sampling_rate` | float | 1 | share of samples for the GGX lobe; no effect on the picture but noise |
//! | `clearcoat_sampling_rate` | float | 1 | share of samples for the clear coat |
//! | `diffuse_reflectance_sampling_rate` | float | 1 | share of samples for the diffuse lobe |
//!
//! ```xml
//! <bsdf type="principled">
//!     <rgb name="base_color" value="0.8, 0.3, 0.1"/>
//!     <float name="metallic" value="0.7"/>
//!     <float name="roughness" value="0.2"/>
//!     <float name="clearcoat" value="0.6"/>
//! </bsdf>
//! ```

mod lobes;

use super::form::{Recipe, all_constant, all_constant_scalars, bsdf};
use super::microfacet::{Microfacets, Shape};
use lobes::Surface;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, ColorSource, Lobes, ScalarSource, SurfaceHit};
use lucerna_core::math::sqr;
use lucerna_core::scene::{Built, Constructor, Failed, Param, Plugin, Properties, Slot};

const fn share(name: &'static str, doc: &'static str) -> Param {
    Param::scalar(name, Slot::Reflectance, 0.0, doc)
}

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "principled",
    aliases: &[],
    summary: "one material for most things (Disney)",
    params: &[&[
        Param::color("base_color", Slot::Reflectance, 0.5, "colour of diffuse, metallic and transmitted light"),
        Param::scalar("roughness", Slot::Reflectance, 0.5, "the main lobe's alpha is its square"),
        share("anisotropic", "stretches the highlight along the tangent"),
        share("metallic", "from dielectric to metal"),
        share("spec_trans", "from diffuse to rough glass"),
        Param::float_opt("eta", "relative index of refraction; excludes specular").between(0.0, f64::INFINITY),
        Param::float("specular", 0.5, "eta by its reflectance; excludes eta").range(0.0, 12.0),
        share("spec_tint", "tints the dielectric highlight with base_color"),
        share("sheen", "cloth-like light at grazing angles"),
        share("sheen_tint", "tints the sheen with base_color"),
        share("flatness", "from diffuse to a look of subsurface scattering"),
        share("clearcoat", "strength of a second highlight"),
        share("clearcoat_gloss", "sharpness of the second highlight"),
        Param::float("main_specular_sampling_rate", 1.0, "share of samples for the main lobe").at_least(0.0),
        Param::float("clearcoat_sampling_rate", 1.0, "share of samples for the clear coat").at_least(0.0),
        Param::float("diffuse_reflectance_sampling_rate", 1.0, "share of samples for diffuse").at_least(0.0),
    ]],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(Principled::from(p)?))
}

struct Principled {
    base_color: ColorSource,
    roughness: ScalarSource,
    anisotropic: ScalarSource,
    metallic: ScalarSource,
    spec_trans: ScalarSource,
    spec_tint: ScalarSource,
    sheen: ScalarSource,
    sheen_tint: ScalarSource,
    flatness: ScalarSource,
    clearcoat: ScalarSource,
    clearcoat_gloss: ScalarSource,
    eta: f32,
    rates: Rates,
}

/// How often each lobe is sampled, relative to its energy.
#[derive(Clone, Copy)]
struct Rates {
    specular: f32,
    clearcoat: f32,
    diffuse: f32,
}

impl Principled {
    fn from(p: &Properties<'_>) -> Result<Self, Failed> {
        p.exclusive("eta", "specular")?;
        let spec_trans = p.scalar("spec_trans");
        let transmits = spec_trans.constant() != Some(0.0);
        // Index-matched glass would refract without a half vector.
        let eta = match p.float_opt("eta") {
            Some(1.0) if transmits => 1.001,
            Some(eta) => eta,
            None => {
                let specular = p.float("specular");
                let specular = if transmits && specular == 0.0 { 1e-3 } else { specular };
                2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
            }
        };
        Ok(Principled {
            base_color: p.color("base_color"),
            roughness: p.scalar("roughness"),
            anisotropic: p.scalar("anisotropic"),
            metallic: p.scalar("metallic"),
            spec_trans,
            spec_tint: p.scalar("spec_tint"),
            sheen: p.scalar("sheen"),
            sheen_tint: p.scalar("sheen_tint"),
            flatness: p.scalar("flatness"),
            clearcoat: p.scalar("clearcoat"),
            clearcoat_gloss: p.scalar("clearcoat_gloss"),
            eta,
            rates: Rates {
                specular: p.float("main_specular_sampling_rate"),
                clearcoat: p.float("clearcoat_sampling_rate"),
                diffuse: p.float("diffuse_reflectance_sampling_rate"),
            },
        })
    }

    /// The main lobe's distribution (Burley 2012, section 5.4).
    fn facets(&self, hit: &SurfaceHit) -> Microfacets {
        let alpha = sqr(self.roughness.at(hit));
        let aspect = (1.0 - 0.9 * self.anisotropic.at(hit)).sqrt();
        Microfacets::new(Shape::Ggx, (alpha / aspect).max(1e-3), (alpha * aspect).max(1e-3), true)
    }
}

impl Recipe for Principled {
    type Form = Surface;

    fn lobes(&self) -> Lobes {
        let reflection = Lobes::DIFFUSE_REFLECTION | Lobes::GLOSSY_REFLECTION;
        if self.spec_trans.constant() == Some(0.0) { reflection } else { reflection | Lobes::GLOSSY_TRANSMISSION }
    }

    fn is_constant(&self) -> bool {
        all_constant(&[&self.base_color])
            && all_constant_scalars(&[
                &self.roughness,
                &self.anisotropic,
                &self.metallic,
                &self.spec_trans,
                &self.spec_tint,
                &self.sheen,
                &self.sheen_tint,
                &self.flatness,
                &self.clearcoat,
                &self.clearcoat_gloss,
            ])
    }

    fn at(&self, hit: &SurfaceHit) -> Surface {
        Surface {
            base_color: self.base_color.at(hit),
            roughness: self.roughness.at(hit),
            facets: self.facets(hit),
            metallic: self.metallic.at(hit),
            spec_trans: self.spec_trans.at(hit),
            spec_tint: self.spec_tint.at(hit),
            sheen: self.sheen.at(hit),
            sheen_tint: self.sheen_tint.at(hit),
            flatness: self.flatness.at(hit),
            clearcoat: self.clearcoat.at(hit),
            clearcoat_gloss: self.clearcoat_gloss.at(hit),
            eta: self.eta,
            rates: self.rates,
        }
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit) -> Option<Rgb> {
        Some(self.base_color.at(hit))
    }
}
