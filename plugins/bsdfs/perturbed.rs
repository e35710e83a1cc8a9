//! A material whose normal is turned: what `bumpmap` and `normalmap` share.
//!
//! Microfacet shadowing against the hard terminator: Estevez, Lecocq and Stein 2019 ("A microfacet-based shadowing
//! function to solve the bump terminator problem"). Turned normals that face away from the viewer are mirrored about
//! the shading normal: Schüssler et al. 2017 ("Microfacet-based normal mapping for robust Monte Carlo path tracing").

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bsdf, Bxdf, BxdfSample, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Frame, Vec2, Vec3};
use lucerna_core::scene::{Failed, ObjectKind, Param, Properties};
use std::sync::Arc;

/// Parameters of both plugins.
pub const PARAMS: &[Param] = &[
    Param::child(ObjectKind::Bsdf, 1, 1, "material whose normal is turned"),
    Param::bool("flip_invalid_normals", true, "mirror normals that face away from the viewer"),
    Param::bool("use_shadowing_function", true, "soften the terminator by microfacet shadowing"),
];

/// Where the normal goes.
pub trait Perturbation: Send + Sync + 'static {
    /// The turned normal in the local shading frame, of any length.
    fn normal(&self, hit: &SurfaceHit) -> Vec3;

    /// The local direction that the turned frame's x axis follows.
    fn tangent(&self, _hit: &SurfaceHit) -> Vec3 {
        Vec3::X
    }
}

/// A nested material with turned normals.
pub struct Perturbed<P: Perturbation> {
    perturbation: P,
    nested: Arc<dyn Bsdf>,
    flip_invalid: bool,
    shadowing: bool,
}

impl<P: Perturbation> Perturbed<P> {
    /// Reads [`PARAMS`].
    pub fn from(p: &Properties<'_>, perturbation: P) -> Result<Self, Failed> {
        let nested = p.bsdfs().pop().ok_or_else(|| p.error("bsdf", "a nested material is required"))?;
        Ok(Perturbed {
            perturbation,
            nested,
            flip_invalid: p.bool("flip_invalid_normals"),
            shadowing: p.bool("use_shadowing_function"),
        })
    }
}

impl<P: Perturbation> Bsdf for Perturbed<P> {
    fn lobes(&self) -> Lobes {
        self.nested.lobes()
    }

    fn resolve<'a>(&'a self, hit: &SurfaceHit, arena: &'a Arena) -> &'a dyn Bxdf {
        let frames = Frames::new(self.perturbation.normal(hit), self.perturbation.tangent(hit), self.flip_invalid);
        // What is nested sees the turned hit (of use if it turns the normal once more).
        let seen = frames.seen_from(hit.wi);
        let nested_hit = SurfaceHit {
            wi: seen.to_local(hit.wi),
            frame: Frame { s: hit.to_world(seen.s), t: hit.to_world(seen.t), n: hit.to_world(seen.n) },
            ..*hit
        };
        arena.alloc(Turned { nested: self.nested.resolve(&nested_hit, arena), frames, shadowing: self.shadowing })
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit, arena: &Arena) -> Rgb {
        self.nested.diffuse_reflectance(hit, arena)
    }
}

/// The turned frame in the local shading frame, and the one for directions that see it from behind.
#[derive(Clone, Copy)]
struct Frames {
    /// The turned normal, of any length.
    n: Vec3,
    turned: Frame,
    mirrored: Frame,
}

impl Frames {
    fn new(n: Vec3, tangent: Vec3, flip_invalid: bool) -> Self {
        let turned = local_frame(n, tangent);
        let mirrored = if flip_invalid { local_frame(Vec3::new(-n.x, -n.y, n.z), tangent) } else { turned };
        Frames { n, turned, mirrored }
    }

    fn seen_from(&self, wi: Vec3) -> &Frame {
        if wi.z * wi.dot(self.n) <= 0.0 { &self.mirrored } else { &self.turned }
    }
}

/// The frame about a normal that follows a tangent; the unturned frame for an unusable normal.
fn local_frame(n: Vec3, tangent: Vec3) -> Frame {
    match n.try_normalize() {
        Some(n) => Frame::from_tangent(n, tangent),
        None => Frame::default(),
    }
}

/// tan² of the angle of a local direction with z.
fn tan2(v: Vec3) -> f32 {
    (1.0 - v.z * v.z).max(0.0) / (v.z * v.z)
}

struct Turned<'a> {
    nested: &'a dyn Bxdf,
    frames: Frames,
    shadowing: bool,
}

impl Turned<'_> {
    /// Part of the light in direction `wo` that the unresolved relief leaves.
    fn shadow(&self, frame: &Frame, wo: Vec3) -> f32 {
        if !self.shadowing {
            return 1.0;
        }
        let alpha2 = (0.125 * tan2(frame.n)).min(1.0);
        2.0 / (1.0 + (1.0 + alpha2 * tan2(wo)).sqrt())
    }
}

impl Bxdf for Turned<'_> {
    fn lobes(&self) -> Lobes {
        self.nested.lobes()
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        let frame = self.frames.seen_from(wi);
        let sample = self.nested.sample(frame.to_local(wi), u1, u2, mode)?;
        let wo = frame.to_world(sample.wo);
        // Both normals must agree on the side the light goes to.
        (sample.wo.z * wo.z > 0.0).then(|| BxdfSample { wo, weight: sample.weight * self.shadow(frame, wo), ..sample })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        let frame = self.frames.seen_from(wi);
        let turned = frame.to_local(wo);
        if wo.z * turned.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let (value, pdf) = self.nested.eval_pdf(frame.to_local(wi), turned, mode);
        (value * self.shadow(frame, wo), pdf)
    }

    /// That of the nested material, without what the terminator takes.
    fn albedo(&self, wi: Vec3) -> Rgb {
        self.nested.albedo(self.frames.seen_from(wi).to_local(wi))
    }

    fn roughness(&self) -> f32 {
        self.nested.roughness()
    }
}
