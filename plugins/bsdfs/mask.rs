//! `mask`: cuts holes into a material.
//!
//! Where the opacity is below 1, light passes unchanged with the rest of the probability.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | (nested) | one BSDF | required | the material of what is opaque |
//! | `opacity` | float or texture | 0.5 | 1 is opaque, 0 is not there; clamped to [0, 1] |
//!
//! ```xml
//! <bsdf type="mask">
//!     <float name="opacity" value="0.3"/>
//!     <bsdf type="diffuse"/>
//! </bsdf>
//! ```

use super::null;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bsdf, Bxdf, BxdfSample, Lobes, ScalarSource, SurfaceHit, Transport};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Slot};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "mask",
    aliases: &[],
    summary: "cuts holes into a material",
    params: &[&[
        Param::child(ObjectKind::Bsdf, 1, 1, "material of what is opaque"),
        Param::scalar("opacity", Slot::Reflectance, 0.5, "1 is opaque, 0 is not there"),
    ]],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    match p.bsdfs().pop() {
        Some(nested) => Ok(Arc::new(Mask { nested, opacity: p.scalar("opacity") })),
        None => Err(p.error("bsdf", "a nested material is required")),
    }
}

struct Mask {
    nested: Arc<dyn Bsdf>,
    opacity: ScalarSource,
}

impl Mask {
    fn opacity(&self, hit: &SurfaceHit) -> f32 {
        self.opacity.at(hit).clamp(0.0, 1.0)
    }
}

impl Bsdf for Mask {
    fn lobes(&self) -> Lobes {
        self.nested.lobes() | Lobes::NULL
    }

    fn resolve<'a>(&'a self, hit: &SurfaceHit, arena: &'a Arena) -> &'a dyn Bxdf {
        arena.alloc(Masked { nested: self.nested.resolve(hit, arena), opacity: self.opacity(hit) })
    }

    fn null_transmission(&self, hit: &SurfaceHit) -> Rgb {
        let opacity = self.opacity(hit);
        self.nested.null_transmission(hit).map(|t| 1.0 - opacity * (1.0 - t))
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit, arena: &Arena) -> Rgb {
        self.nested.diffuse_reflectance(hit, arena)
    }
}

struct Masked<'a> {
    nested: &'a dyn Bxdf,
    opacity: f32,
}

impl Bxdf for Masked<'_> {
    fn lobes(&self) -> Lobes {
        self.nested.lobes() | Lobes::NULL
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        if u1 < self.opacity {
            let sample = self.nested.sample(wi, (u1 / self.opacity).min(ONE_MINUS_EPSILON), u2, mode)?;
            Some(BxdfSample { pdf: sample.pdf * self.opacity, ..sample })
        } else {
            Some(null::pass(wi, 1.0 - self.opacity))
        }
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        let (value, pdf) = self.nested.eval_pdf(wi, wo, mode);
        (value * self.opacity, pdf * self.opacity)
    }

    fn albedo(&self, wi: Vec3) -> Rgb {
        self.nested.albedo(wi).map(|a| 1.0 - self.opacity * (1.0 - a))
    }

    fn roughness(&self) -> f32 {
        self.nested.roughness()
    }
}
