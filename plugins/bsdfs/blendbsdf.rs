//! `blendbsdf`: a weighted sum of two materials.
//!
//! One of the two is picked with its weight and sampled with what is left of the random number; value and density are
//! those of the sum. As in the reference renderer this is also done for a mirror-like lobe, whose discrete probability
//! is added to the density the other material has in the same direction: the weight of such a sample is off where
//! the other material has a density there.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | (nested) | two BSDFs | required | first and second material |
//! | `weight` | float or texture | required | 0 is the first, 1 the second; clamped to [0, 1] |
//!
//! ```xml
//! <bsdf type="blendbsdf">
//!     <float name="weight" value="0.3"/>
//!     <bsdf type="diffuse"/>
//!     <bsdf type="conductor"/>
//! </bsdf>
//! ```

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bsdf, Bxdf, BxdfSample, Lobes, ScalarSource, SurfaceHit, Transport};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Slot};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "blendbsdf",
    aliases: &[],
    summary: "weighted sum of two materials",
    params: &[&[
        Param::child(ObjectKind::Bsdf, 2, 2, "first and second material"),
        Param::scalar("weight", Slot::Reflectance, 0.5, "0 is the first material, 1 the second").required(),
    ]],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    match <[_; 2]>::try_from(p.bsdfs()) {
        Ok(nested) => Ok(Arc::new(Blend { nested, weight: p.scalar("weight") })),
        Err(_) => Err(p.error("bsdf", "two nested materials are required")),
    }
}

struct Blend {
    nested: [Arc<dyn Bsdf>; 2],
    weight: ScalarSource,
}

impl Blend {
    fn weight(&self, hit: &SurfaceHit) -> f32 {
        self.weight.at(hit).clamp(0.0, 1.0)
    }

    fn mix(&self, hit: &SurfaceHit, of: impl Fn(&dyn Bsdf) -> Rgb) -> Rgb {
        let w = self.weight(hit);
        of(&*self.nested[0]) * (1.0 - w) + of(&*self.nested[1]) * w
    }
}

impl Bsdf for Blend {
    fn lobes(&self) -> Lobes {
        self.nested[0].lobes() | self.nested[1].lobes()
    }

    fn resolve<'a>(&'a self, hit: &SurfaceHit, arena: &'a Arena) -> &'a dyn Bxdf {
        let [first, second] = &self.nested;
        arena.alloc(Blended {
            nested: [first.resolve(hit, arena), second.resolve(hit, arena)],
            weight: self.weight(hit),
        })
    }

    fn null_transmission(&self, hit: &SurfaceHit) -> Rgb {
        self.mix(hit, |bsdf| bsdf.null_transmission(hit))
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit, arena: &Arena) -> Rgb {
        self.mix(hit, |bsdf| bsdf.diffuse_reflectance(hit, arena))
    }
}

struct Blended<'a> {
    nested: [&'a dyn Bxdf; 2],
    weight: f32,
}

impl Bxdf for Blended<'_> {
    fn lobes(&self) -> Lobes {
        self.nested[0].lobes() | self.nested[1].lobes()
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        let [first, second] = self.nested;
        let w = self.weight;
        let (picked, p_picked, u1, other) = if u1 <= w && w > 0.0 {
            (second, w, u1 / w, first)
        } else {
            (first, 1.0 - w, (u1 - w) / (1.0 - w), second)
        };
        let sample = picked.sample(wi, u1.min(ONE_MINUS_EPSILON), u2, mode)?;
        let (value, pdf_other) = other.eval_pdf(wi, sample.wo, mode);
        let p_other = 1.0 - p_picked;
        let pdf = sample.pdf * p_picked + pdf_other * p_other;
        let weight = (sample.weight * (sample.pdf * p_picked) + value * p_other) / pdf;
        Some(BxdfSample { weight, pdf, ..sample })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        let w = self.weight;
        let (value0, pdf0) = self.nested[0].eval_pdf(wi, wo, mode);
        let (value1, pdf1) = self.nested[1].eval_pdf(wi, wo, mode);
        (value0 * (1.0 - w) + value1 * w, pdf0 * (1.0 - w) + pdf1 * w)
    }

    fn albedo(&self, wi: Vec3) -> Rgb {
        self.nested[0].albedo(wi) * (1.0 - self.weight) + self.nested[1].albedo(wi) * self.weight
    }

    /// The narrower of those that take part and have a density.
    fn roughness(&self) -> f32 {
        let of = |i: usize, share: f32| {
            let bxdf = self.nested[i];
            (share > 0.0 && bxdf.lobes().is_smooth()).then(|| bxdf.roughness())
        };
        match (of(0, 1.0 - self.weight), of(1, self.weight)) {
            (Some(a), Some(b)) => a.min(b),
            (Some(a), None) | (None, Some(a)) => a,
            (None, None) => 0.0,
        }
    }
}
