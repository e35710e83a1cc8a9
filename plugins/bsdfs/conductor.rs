//! `conductor`: a perfectly smooth metal.
//!
//! A mirror whose reflectance follows Fresnel's equations for a complex index of refraction, per channel. One-sided:
//! black from behind, see `twosided`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `material` | string | none | name of a measured metal such as `Au`, `Cu`, `Al` (letter case counts); `none` is a perfect mirror |
//! | `eta`, `k` | colour or texture | 0, 1 | real and imaginary part of the relative index of refraction; exclude `material` |
//! | `specular_reflectance` | colour or texture | 1 | factor on the reflection; 1 is physical |
//!
//! ```xml
//! <bsdf type="conductor">
//!     <string name="material" value="Au"/>
//! </bsdf>
//! ```

use super::conductor_materials::METALS;
use super::form::{Recipe, all_constant, bsdf};
use super::fresnel;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, ColorSource, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Failed, Param, Plugin, Properties, Slot, did_you_mean};

/// Parameters shared with `roughconductor`.
pub const PARAMS: &[Param] = &[
    Param::string("material", "none", "name of a measured metal; excludes eta and k"),
    Param::color("eta", Slot::Unbounded, 0.0, "real part of the relative index of refraction"),
    Param::color("k", Slot::Unbounded, 1.0, "imaginary part of the relative index of refraction"),
    Param::color("specular_reflectance", Slot::Reflectance, 1.0, "factor on the reflection; 1 is physical"),
];

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "conductor",
    aliases: &[],
    summary: "perfectly smooth metal",
    params: &[PARAMS],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(bsdf(Metal::from(p)?))
}

/// What light a metal reflects off a flat facet.
pub struct Metal {
    eta: ColorSource,
    k: ColorSource,
    specular_reflectance: ColorSource,
}

impl Metal {
    /// Reads [`PARAMS`].
    pub fn from(p: &Properties<'_>) -> Result<Self, Failed> {
        let name = p.string("material");
        let specular_reflectance = p.color("specular_reflectance");
        if name == "none" {
            return Ok(Metal { eta: p.color("eta"), k: p.color("k"), specular_reflectance });
        }
        p.exclusive("material", "eta")?;
        p.exclusive("material", "k")?;
        let Some(metal) = METALS.iter().find(|m| m.name == name) else {
            let mut message = format!("unknown metal \"{name}\"");
            if let Some(meant) = did_you_mean(name, METALS.iter().map(|m| m.name)) {
                message += &format!(" (did you mean \"{meant}\"?)");
            }
            return Err(p.error("material", message));
        };
        let constant = |[r, g, b]: [f32; 3]| ColorSource::Constant(Rgb::new(r, g, b));
        Ok(Metal { eta: constant(metal.eta), k: constant(metal.k), specular_reflectance })
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        all_constant(&[&self.eta, &self.k, &self.specular_reflectance])
    }

    /// The metal at a hit.
    pub fn facet_at(&self, hit: &SurfaceHit) -> Facet {
        Facet { eta: self.eta.at(hit), k: self.k.at(hit), specular_reflectance: self.specular_reflectance.at(hit) }
    }
}

impl Recipe for Metal {
    type Form = Facet;

    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION
    }

    fn is_constant(&self) -> bool {
        Metal::is_constant(self)
    }

    fn at(&self, hit: &SurfaceHit) -> Facet {
        self.facet_at(hit)
    }
}

/// A flat facet of known metal.
#[derive(Clone, Copy)]
pub struct Facet {
    eta: Rgb,
    k: Rgb,
    specular_reflectance: Rgb,
}

impl Facet {
    /// Part of the light that comes back from a direction of the given cosine with the facet's normal.
    #[inline]
    pub fn reflectance(&self, cos_theta_i: f32) -> Rgb {
        self.specular_reflectance * fresnel::conductor(cos_theta_i, self.eta, self.k)
    }
}

impl Bxdf for Facet {
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION
    }

    fn sample(&self, wi: Vec3, _u1: f32, _u2: Vec2, _mode: Transport) -> Option<BxdfSample> {
        (wi.z > 0.0).then(|| BxdfSample {
            wo: fresnel::reflect(wi),
            weight: self.reflectance(wi.z),
            pdf: 1.0,
            eta: 1.0,
            lobe: Lobes::DELTA_REFLECTION,
        })
    }

    fn eval_pdf(&self, _wi: Vec3, _wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        (Rgb::BLACK, 0.0)
    }

    /// Exact.
    fn albedo(&self, wi: Vec3) -> Rgb {
        if wi.z > 0.0 { self.reflectance(wi.z) } else { Rgb::BLACK }
    }

    fn roughness(&self) -> f32 {
        0.0
    }
}
