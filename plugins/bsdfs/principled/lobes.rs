//! The closed form: lobes, how they are sampled and what they add up to.

use super::Rates;
use crate::bsdfs::fresnel::{Interface, dielectric, reflect_at, refract_at};
use crate::bsdfs::microfacet::Microfacets;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bxdf, BxdfSample, Lobes, Transport};
use lucerna_core::math::{Vec2, Vec3, lerp, safe_sqrt, sqr};
use lucerna_core::sampling::warp;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// All parameters at a hit.
#[derive(Clone, Copy)]
pub struct Surface {
    pub(super) base_color: Rgb,
    pub(super) roughness: f32,
    pub(super) facets: Microfacets,
    pub(super) metallic: f32,
    pub(super) spec_trans: f32,
    pub(super) spec_tint: f32,
    pub(super) sheen: f32,
    pub(super) sheen_tint: f32,
    pub(super) flatness: f32,
    pub(super) clearcoat: f32,
    pub(super) clearcoat_gloss: f32,
    pub(super) eta: f32,
    pub(super) rates: Rates,
}

/// Probabilities of sampling each lobe; they add up to 1.
struct Probabilities {
    diffuse: f32,
    clearcoat: f32,
    transmission: f32,
    reflection: f32,
}

/// Schlick's weight (1 − cos θ)⁵.
fn schlick(cos_theta: f32) -> f32 {
    let m = (1.0 - cos_theta).clamp(0.0, 1.0);
    sqr(sqr(m)) * m
}

/// The weight between reflectance at normal incidence and 1; on the way into the thinner medium it goes by the
/// refracted angle.
fn schlick_weight(cos_theta_i: f32, eta: f32) -> f32 {
    let interface = dielectric(cos_theta_i, eta);
    if interface.eta_it > 1.0 { schlick(cos_theta_i.abs()) } else { schlick(interface.cos_theta_t.abs()) }
}

/// The direction, turned over where `side` is negative.
fn towards(v: Vec3, side: f32) -> Vec3 {
    if side.is_sign_negative() { -v } else { v }
}

/// Whether facet and surface agree on the sides light comes from and goes to.
fn sides_agree(m: Vec3, wi: Vec3, wo: Vec3, reflected: bool) -> bool {
    let m = towards(m, wi.z);
    wi.dot(m) > 0.0 && if reflected { wo.dot(m) > 0.0 } else { wo.dot(m) < 0.0 }
}

/// The clear coat's distribution with long tails, "GTR1" (Burley 2012, appendix B.2).
struct Gtr1 {
    alpha2: f32,
}

impl Gtr1 {
    fn of_gloss(gloss: f32) -> Self {
        Gtr1 { alpha2: sqr(lerp(0.1, 0.001, gloss)) }
    }

    fn eval(&self, m: Vec3) -> f32 {
        let a = self.alpha2 - 1.0;
        let d = a / (PI * self.alpha2.ln() * (1.0 + a * m.z * m.z));
        if d * m.z > 1e-20 { d } else { 0.0 }
    }

    fn pdf(&self, m: Vec3) -> f32 {
        if m.z < 0.0 { 0.0 } else { m.z * self.eval(m) }
    }

    fn sample(&self, u: Vec2) -> Vec3 {
        let (sin_phi, cos_phi) = (TAU * u.x).sin_cos();
        let cos2 = (1.0 - self.alpha2.powf(1.0 - u.y)) / (1.0 - self.alpha2);
        let sin = safe_sqrt(1.0 - cos2);
        Vec3::new(cos_phi * sin, sin_phi * sin, safe_sqrt(cos2))
    }

    /// Shadowing of GGX at a fixed roughness of 0.25.
    fn smith_g1(v: Vec3, m: Vec3) -> f32 {
        if v.dot(m) * v.z <= 0.0 {
            return 0.0;
        }
        let cos2 = v.z * v.z;
        let tan2 = (1.0 - cos2) / cos2;
        2.0 / (1.0 + (1.0 + sqr(0.25) * tan2).sqrt())
    }
}

impl Surface {
    /// Weights of the opaque dielectric and of the glass.
    fn brdf_bsdf(&self) -> (f32, f32) {
        ((1.0 - self.metallic) * (1.0 - self.spec_trans), (1.0 - self.metallic) * self.spec_trans)
    }

    fn transmits(&self) -> bool {
        self.spec_trans > 0.0
    }

    /// Probabilities where the facet that was picked, or would be picked, reflects the part `f` of the light. From
    /// inside there is only glass.
    fn probabilities(&self, from_front: bool, f: f32) -> Probabilities {
        let (brdf, bsdf) = self.brdf_bsdf();
        let mut p = if from_front {
            Probabilities {
                diffuse: brdf * self.rates.diffuse,
                clearcoat: 0.25 * self.clearcoat * self.rates.clearcoat,
                transmission: self.rates.specular * bsdf * (1.0 - f),
                reflection: self.rates.specular * (1.0 - bsdf * (1.0 - f)),
            }
        } else {
            let transmission = if self.transmits() { 1.0 - f } else { 0.0 };
            Probabilities { diffuse: 0.0, clearcoat: 0.0, transmission, reflection: f }
        };
        let norm = 1.0 / (p.diffuse + p.clearcoat + p.transmission + p.reflection);
        for lobe in [&mut p.diffuse, &mut p.clearcoat, &mut p.transmission, &mut p.reflection] {
            *lobe *= norm;
        }
        p
    }

    /// The base colour at luminance 1; white if it is black.
    fn tint(&self) -> Rgb {
        let luminance = self.base_color.luminance();
        if luminance > 0.0 { self.base_color / luminance } else { Rgb::WHITE }
    }

    /// Reflectance of the main lobe: dielectric, tinted dielectric and metal by their weights.
    fn main_fresnel(&self, from_front: bool, cos_theta_i: f32, interface: &Interface) -> Rgb {
        let (_, bsdf) = self.brdf_bsdf();
        let f = interface.reflectance;
        if !from_front {
            return Rgb::splat(bsdf * f);
        }
        let mut total = Rgb::splat((1.0 - self.metallic) * (1.0 - self.spec_tint) * f);
        if self.metallic > 0.0 || self.spec_tint > 0.0 {
            let weight = schlick_weight(cos_theta_i, self.eta);
            let from_normal = |r0: Rgb| r0 * (1.0 - weight) + Rgb::splat(weight);
            let dielectric_r0 = sqr((interface.eta_it - 1.0) / (interface.eta_it + 1.0));
            total += from_normal(self.base_color) * self.metallic;
            if self.spec_tint > 0.0 {
                total += from_normal(self.tint() * dielectric_r0) * ((1.0 - self.metallic) * self.spec_tint);
            }
        }
        total
    }

    /// Diffuse, retro-reflective, flat and sheen light; `h` is the half vector.
    fn diffuse_value(&self, wi: Vec3, wo: Vec3, h: Vec3) -> Rgb {
        let (brdf, _) = self.brdf_bsdf();
        let (cos_i, cos_o, cos_d) = (wi.z.abs(), wo.z.abs(), h.dot(wo));
        let (f_i, f_o) = (schlick(cos_i), schlick(cos_o));
        let diffuse = (1.0 - 0.5 * f_i) * (1.0 - 0.5 * f_o);
        let rr = 2.0 * self.roughness * cos_d * cos_d;
        let retro = rr * (f_o + f_i + f_o * f_i * (rr - 1.0));
        // After Hanrahan and Krueger 1993: flattens the retro-reflection.
        let ss90 = 0.5 * rr;
        let ss = lerp(1.0, ss90, f_o) * lerp(1.0, ss90, f_i);
        let flat = 1.25 * (ss * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
        let value = self.base_color * (brdf * cos_o * FRAC_1_PI * lerp(diffuse + retro, flat, self.flatness));

        let sheen = self.sheen * (1.0 - self.metallic) * schlick(cos_d.abs()) * cos_o;
        if sheen > 0.0 && brdf > 0.0 {
            let tint = self.tint() * self.sheen_tint + Rgb::splat(1.0 - self.sheen_tint);
            value + tint * sheen
        } else {
            value
        }
    }
}

impl Bxdf for Surface {
    fn lobes(&self) -> Lobes {
        let reflection = Lobes::DIFFUSE_REFLECTION | Lobes::GLOSSY_REFLECTION;
        if self.transmits() { reflection | Lobes::GLOSSY_TRANSMISSION } else { reflection }
    }

    fn sample(&self, wi: Vec3, u1: f32, u2: Vec2, mode: Transport) -> Option<BxdfSample> {
        let from_front = wi.z > 0.0;
        if wi.z == 0.0 || !(from_front || self.brdf_bsdf().1 > 0.0) {
            return None;
        }
        let (m, _) = self.facets.sample(towards(wi, wi.z), u2);
        let interface = dielectric(wi.dot(m), self.eta);
        let p = self.probabilities(from_front, interface.reflectance);

        let mut eta = 1.0;
        let (wo, valid, lobe) = if u1 < p.diffuse {
            let wo = warp::square_to_cosine_hemisphere(u2);
            (wo, wo.z * wi.z > 0.0, Lobes::DIFFUSE_REFLECTION)
        } else if u1 < p.diffuse + p.clearcoat {
            let m = Gtr1::of_gloss(self.clearcoat_gloss).sample(u2);
            let wo = reflect_at(wi, m);
            (wo, wo.z * wi.z > 0.0 && sides_agree(m, wi, wo, true), Lobes::GLOSSY_REFLECTION)
        } else if u1 < p.diffuse + p.clearcoat + p.transmission {
            let wo = refract_at(wi, m, &interface);
            eta = interface.eta_it;
            (wo, wo.z * wi.z < 0.0 && sides_agree(m, wi, wo, false), Lobes::GLOSSY_TRANSMISSION)
        } else {
            let wo = reflect_at(wi, m);
            (wo, wo.z * wi.z > 0.0 && sides_agree(m, wi, wo, true), Lobes::GLOSSY_REFLECTION)
        };
        if !valid {
            return None;
        }
        let (value, pdf) = self.eval_pdf(wi, wo, mode);
        (pdf > 0.0 && pdf < f32::INFINITY).then(|| BxdfSample { wo, weight: value / pdf, pdf, eta, lobe })
    }

    fn eval_pdf(&self, wi: Vec3, wo: Vec3, mode: Transport) -> (Rgb, f32) {
        const NOTHING: (Rgb, f32) = (Rgb::BLACK, 0.0);
        let side = wi.z * wo.z;
        // Also turns NaN away.
        if !(side > 0.0 || (side < 0.0 && self.transmits())) {
            return NOTHING;
        }
        let (from_front, reflected) = (wi.z > 0.0, side > 0.0);
        let (brdf, bsdf) = self.brdf_bsdf();
        // Nothing is sampled from behind where there is no glass.
        if !from_front && bsdf == 0.0 {
            return NOTHING;
        }
        let eta = if from_front { self.eta } else { 1.0 / self.eta };
        let Some(h) = (wi + wo * if reflected { 1.0 } else { eta }).try_normalize() else {
            return NOTHING;
        };
        let h = towards(h, h.z);
        let (cos_i, cos_o) = (wi.dot(h), wo.dot(h));
        let agree = sides_agree(h, wi, wo, reflected);
        let interface = dielectric(cos_i, self.eta);
        let f = interface.reflectance;
        let p = self.probabilities(from_front, f);
        let mut value = Rgb::BLACK;
        let mut pdf = 0.0;

        if agree {
            let d = self.facets.eval(h);
            let dg = d * self.facets.g(wi, wo, h);
            let pdf_h = self.facets.pdf(towards(wi, wi.z), h);
            if reflected {
                let dh_dwo = (1.0 / (4.0 * cos_o)).abs();
                pdf += p.reflection * pdf_h * dh_dwo;
                if f > 0.0 {
                    value += self.main_fresnel(from_front, cos_i, &interface) * (dg / (4.0 * wi.z.abs()));
                }
                if self.clearcoat > 0.0 && from_front {
                    let coat = Gtr1::of_gloss(self.clearcoat_gloss);
                    pdf += p.clearcoat * coat.pdf(h) * dh_dwo;
                    let fresnel = lerp(schlick_weight(cos_i, self.eta), 1.0, 0.04);
                    let shadowing = Gtr1::smith_g1(wi, h) * Gtr1::smith_g1(wo, h);
                    value += Rgb::splat(0.25 * self.clearcoat * fresnel * coat.eval(h) * shadowing * wo.z.abs());
                }
            } else {
                let dh_dwo = (sqr(eta) * cos_o / sqr(cos_i + eta * cos_o)).abs();
                pdf += p.transmission * pdf_h * dh_dwo;
                if bsdf > 0.0 && f < 1.0 {
                    let scale = if mode == Transport::Radiance { 1.0 / sqr(eta) } else { 1.0 };
                    let passes = scale * (1.0 - f) * dg * (cos_i / wi.z).abs() * dh_dwo;
                    value += self.base_color.map(f32::sqrt) * (bsdf * passes);
                }
            }
        }
        if reflected {
            pdf += p.diffuse * warp::cosine_hemisphere_pdf(wo);
            if from_front && brdf > 0.0 {
                value += self.diffuse_value(wi, wo, h);
            }
        }
        if pdf.is_finite() { (value, pdf) } else { NOTHING }
    }

    /// Base colour by weight plus a Fresnel highlight; without sheen, coat and the model's gain at grazing angles.
    fn albedo(&self, wi: Vec3) -> Rgb {
        let (brdf, bsdf) = self.brdf_bsdf();
        let from_front = wi.z > 0.0;
        let interface = dielectric(wi.z, self.eta);
        let highlight = self.main_fresnel(from_front, wi.z, &interface);
        let glass = self.base_color.map(f32::sqrt) * (bsdf * (1.0 - interface.reflectance));
        let diffuse = if from_front { self.base_color * brdf } else { Rgb::BLACK };
        (highlight + glass + diffuse).map(|a| a.min(1.0))
    }

    fn roughness(&self) -> f32 {
        self.facets.mean_alpha()
    }
}
