//! `twosided`: lets a one-sided material be seen from both sides.
//!
//! One nested material is put on both sides; of two, the first is on the side of the normal, the second behind.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | (nested) | one or two BSDFs | required | front, back |
//! | `allow_transmission` | boolean | false | accept materials that let light through, which otherwise are an error |
//!
//! ```xml
//! <bsdf type="twosided">
//!     <bsdf type="diffuse">
//!         <rgb name="reflectance" value="0.4, 0.4, 0.4"/>
//!     </bsdf>
//! </bsdf>
//! ```

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "twosided",
    aliases: &[],
    summary: "shows a one-sided material on both sides",
    params: &[&[
        Param::child(ObjectKind::Bsdf, 1, 2, "material of the front, and another of the back"),
        Param::bool("allow_transmission", false, "accept materials that let light through"),
    ]],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    let mut nested = p.bsdfs().into_iter();
    let Some(front) = nested.next() else {
        return Err(p.error("bsdf", "a nested one-sided material is required"));
    };
    let back = nested.next().unwrap_or_else(|| front.clone());
    let allow_transmission = p.bool("allow_transmission");
    if (front.lobes() | back.lobes()).intersects(Lobes::TRANSMISSION) && !allow_transmission {
        return Err(p.error(
            "bsdf",
            "only materials without a transmission component can be nested (set \"allow_transmission\" to true to \
             nest this one all the same)",
        ));
    }
    Ok(Arc::new(TwoSided { front, back }))
}

/// Upside down.
fn flip(v: Vec3) -> Vec3 {
    Vec3::new(v.x, v.y, -v.z)
}

struct TwoSided {
    front: Arc<dyn Bsdf>,
    back: Arc<dyn Bsdf>,
}

impl TwoSided {
    /// The material that is seen at a hit, and the hit as it sees it.
    fn seen(&self, hit: &SurfaceHit) -> (&dyn Bsdf, SurfaceHit) {
        if hit.wi.z < 0.0 { (&*self.back, SurfaceHit { wi: flip(hit.wi), ..*hit }) } else { (&*self.front, *hit) }
    }
}

impl Bsdf for TwoSided {
    fn lobes(&self) -> Lobes {
        self.front.lobes() | self.back.lobes()
    }

    fn resolve<'a>(&'a self, hit: &SurfaceHit, arena: &'a Arena) -> &'a dyn Bxdf {
        let flipped = || SurfaceHit { wi: flip(hit.wi), ..*hit };
        let behind = hit.wi.z < 0.0;
        let (front, back) = if Arc::ptr_eq(&self.front, &self.back) {
            let seen = if behind { self.front.resolve(&flipped(), arena) } else { self.front.resolve(hit, arena) };
            (seen, seen)
        } else {
            let flipped = flipped();
            let (front, back) = if behind { (&flipped, hit) } else { (hit, &flipped) };
            (self.front.resolve(front, arena), self.back.resolve(back, arena))
        };
        arena.alloc(Sides { front, back })
    }

    fn null_transmission(&self, hit: &SurfaceHit) -> Rgb {
        let (bsdf, hit) = self.seen(hit);
        bsdf.null_transmission(&hit)
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit, arena: &Arena) -> Rgb {
        let (bsdf, hit) = self.seen(hit);
        bsdf.diffuse_reflectance(&hit, arena)
    }
}

struct Sides<'a> {
    front: &'a dyn Bxdf,
    back: &'a dyn Bxdf,
}

impl Bxdf for Sides<'_> {
    fn lobes(&self) -> Lobes {
        self.front.lobes() | self.back.lobes()
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        if wi.z < 0.0 {
            let sample = self.back.sample(flip(wi), u1, u2, mode)?;
            Some(BxdfSample { wo: flip(sample.wo), ..sample })
        } else {
            self.front.sample(wi, u1, u2, mode)
        }
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        if wi.z < 0.0 { self.back.eval_pdf(flip(wi), flip(wo), mode) } else { self.front.eval_pdf(wi, wo, mode) }
    }

    fn albedo(&self, wi: Vec3) -> Rgb {
        if wi.z < 0.0 { self.back.albedo(flip(wi)) } else { self.front.albedo(wi) }
    }

    fn roughness(&self) -> f32 {
        self.front.roughness().min(self.back.roughness())
    }
}
