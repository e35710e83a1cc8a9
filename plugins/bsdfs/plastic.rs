//! `plastic`: a matte base under a perfectly smooth clear coat.
//!
//! The coat reflects like a dielectric; what enters is scattered evenly by the base and leaves after any number of
//! internal reflections, in closed form: `ρ (1 − F(θi)) (1 − F(θo)) / (η² (1 − F̄ ρ'))`, where F̄ is the mean
//! reflectance of the coat from inside. One-sided: black from behind, see `twosided`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `diffuse_reflectance` | colour or texture | 0.5 | albedo ρ of the base |
//! | `specular_reflectance` | colour or texture | 1 | factor on the mirror reflection; 1 is physical |
//! | `int_ior` | float or material name | polypropylene | index of refraction of the coat |
//! | `ext_ior` | float or material name | air | index of refraction outside |
//! | `nonlinear` | boolean | false | colours saturate by internal reflection (ρ' = ρ) instead of keeping those of the texture (ρ' = 1) |
//!
//! ```xml
//! <bsdf type="plastic">
//!     <rgb name="diffuse_reflectance" value="0.1, 0.27, 0.36"/>
//!     <float name="int_ior" value="1.9"/>
//! </bsdf>
//! ```

use super::form::{Recipe, all_constant, bsdf};
use super::{fresnel, ior};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bsdf, Bxdf, BxdfSample, ColorSource, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};

/// Parameters shared with `roughplastic`.
pub const PARAMS: &[Param] = &[
    Param::color("diffuse_reflectance", Slot::Reflectance, 0.5, "albedo of the base"),
    Param::color("specular_reflectance", Slot::Reflectance, 1.0, "factor on the mirror reflection; 1 is physical"),
    ior::interior("polypropylene"),
    ior::EXTERIOR,
    Param::bool("nonlinear", false, "whether internal reflection saturates colours"),
];

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "plastic",
    aliases: &[],
    summary: "matte base under a smooth clear coat",
    params: &[PARAMS],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    let eta = ior::relative(p)?;
    Ok(bsdf(Plastic { base: Base::from(p, eta, fresnel::diffuse_reflectance(1.0 / eta)), eta }))
}

/// The base of a plastic with its colours.
pub struct Base {
    diffuse: ColorSource,
    specular: ColorSource,
    nonlinear: bool,
    internal_reflectance: f32,
    inv_eta2: f32,
    specular_sampling_weight: f32,
}

impl Base {
    /// Reads [`PARAMS`] for a coat with the relative index `eta` that reflects so much of the base's light back.
    pub fn from(p: &Properties<'_>, eta: f32, internal_reflectance: f32) -> Self {
        let (diffuse, specular) = (p.color("diffuse_reflectance"), p.color("specular_reflectance"));
        let (d, s) = (diffuse.mean(), specular.mean());
        Base {
            diffuse,
            specular,
            nonlinear: p.bool("nonlinear"),
            internal_reflectance,
            inv_eta2: 1.0 / (eta * eta),
            // Where both are black any weight will do.
            specular_sampling_weight: if d + s > 0.0 { s / (d + s) } else { 0.5 },
        }
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        all_constant(&[&self.diffuse, &self.specular])
    }

    /// The albedo of the base.
    pub fn diffuse_at(&self, hit: &SurfaceHit) -> Rgb {
        self.diffuse.at(hit)
    }

    /// The colours at a hit.
    pub fn at(&self, hit: &SurfaceHit) -> Colors {
        let diffuse = self.diffuse.at(hit);
        let trapped =
            if self.nonlinear { diffuse * self.internal_reflectance } else { Rgb::splat(self.internal_reflectance) };
        Colors {
            scattered: diffuse / trapped.map(|t| 1.0 - t) * self.inv_eta2,
            specular: self.specular.at(hit),
            specular_sampling_weight: self.specular_sampling_weight,
        }
    }
}

/// The colours of a plastic at a hit.
#[derive(Clone, Copy)]
pub struct Colors {
    /// What the base gives back of what has entered, before it passes the coat: `ρ / (η² (1 − F̄ ρ'))`.
    pub scattered: Rgb,
    /// Factor on the reflection of the coat.
    pub specular: Rgb,
    specular_sampling_weight: f32,
}

impl Colors {
    /// Probability of sampling the reflection off the coat where that reflects the part `f` of the light.
    #[inline]
    pub fn p_specular(&self, f: f32) -> f32 {
        let specular = f * self.specular_sampling_weight;
        let diffuse = (1.0 - f) * (1.0 - self.specular_sampling_weight);
        specular / (specular + diffuse)
    }
}

struct Plastic {
    base: Base,
    eta: f32,
}

impl Recipe for Plastic {
    type Form = Coated;

    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION | Lobes::DIFFUSE_REFLECTION
    }

    fn is_constant(&self) -> bool {
        self.base.is_constant()
    }

    fn at(&self, hit: &SurfaceHit) -> Coated {
        Coated { colors: self.base.at(hit), eta: self.eta }
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit) -> Option<Rgb> {
        Some(self.base.diffuse_at(hit))
    }
}

#[derive(Clone, Copy)]
struct Coated {
    colors: Colors,
    eta: f32,
}

impl Coated {
    fn fresnel(&self, cos_theta: f32) -> f32 {
        fresnel::dielectric(cos_theta, self.eta).reflectance
    }
}

impl Bxdf for Coated {
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION | Lobes::DIFFUSE_REFLECTION
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, _mode: Transport) -> Option<BxdfSample> {
        if wi.z <= 0.0 {
            return None;
        }
        let f_i = self.fresnel(wi.z);
        let p_specular = self.colors.p_specular(f_i);
        if u1 < p_specular {
            return Some(BxdfSample {
                wo: fresnel::reflect(wi),
                weight: self.colors.specular * (f_i / p_specular),
                pdf: p_specular,
                eta: 1.0,
                lobe: Lobes::DELTA_REFLECTION,
            });
        }
        let p_diffuse = 1.0 - p_specular;
        let wo = warp::square_to_cosine_hemisphere(u2);
        let pdf = p_diffuse * warp::cosine_hemisphere_pdf(wo);
        (pdf > 0.0).then(|| BxdfSample {
            wo,
            weight: self.colors.scattered * ((1.0 - f_i) * (1.0 - self.fresnel(wo.z)) / p_diffuse),
            pdf,
            eta: 1.0,
            lobe: Lobes::DIFFUSE_REFLECTION,
        })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, _mode: Transport) -> (Rgb, f32) {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let f_i = self.fresnel(wi.z);
        let cosine = warp::cosine_hemisphere_pdf(wo);
        let value = self.colors.scattered * (cosine * (1.0 - f_i) * (1.0 - self.fresnel(wo.z)));
        (value, cosine * (1.0 - self.colors.p_specular(f_i)))
    }

    /// Exact but for the 1 % by which the fits of the mean Fresnel reflectance are off.
    fn albedo(&self, wi: Vec3) -> Rgb {
        if wi.z <= 0.0 {
            return Rgb::BLACK;
        }
        let f = self.fresnel(wi.z);
        let leaves = 1.0 - fresnel::diffuse_reflectance(self.eta);
        self.colors.specular * f + self.colors.scattered * ((1.0 - f) * leaves)
    }

    fn roughness(&self) -> f32 {
        1.0
    }
}
