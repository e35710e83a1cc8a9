//! Microfacet normal distributions: Beckmann and GGX, with Smith's shadowing and two ways to sample.
//!
//! Walter et al. 2007 ("Microfacet models for refraction through rough surfaces") for both distributions; Heitz and
//! d'Eon 2014 for sampling only normals that are seen; Jakob 2014 ("An improved visible normal sampling routine for
//! the Beckmann distribution") for the Beckmann inversion; Heitz 2018 ("Sampling the GGX distribution of visible
//! normals") for GGX. Shadowing is Smith's, separable: G(wi, wo) = G1(wi) G1(wo). There is no compensation for
//! multiple scattering: rough surfaces lose energy.

use super::erf::{erf, erfinv};
use lucerna_core::interfaces::ScalarSource;
use lucerna_core::math::{Vec2, Vec3, lerp, safe_sqrt, sqr};
use lucerna_core::sampling::warp;
use lucerna_core::scene::{Failed, Param, Properties, Slot};
use std::f32::consts::{PI, TAU};

/// `1/√π`.
const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

/// Parameters of every BSDF with a textured microfacet distribution.
pub const PARAMS: &[Param] = &[
    DISTRIBUTION,
    Param::scalar("alpha", Slot::Unbounded, 0.1, "roughness in both directions; excludes alpha_u and alpha_v")
        .at_least(0.0),
    Param::scalar_opt("alpha_u", Slot::Unbounded, "roughness along the tangent").at_least(0.0),
    Param::scalar_opt("alpha_v", Slot::Unbounded, "roughness along the bitangent").at_least(0.0),
    SAMPLE_VISIBLE,
];

/// Which distribution.
pub const DISTRIBUTION: Param =
    Param::choice("distribution", &["beckmann", "ggx"], "beckmann", "distribution of microfacet normals");

/// Whether only visible normals are sampled.
pub const SAMPLE_VISIBLE: Param =
    Param::bool("sample_visible", true, "sample only normals that are seen from the incident direction");

/// The shape of the distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// Gaussian slopes; alpha is √2 times their standard deviation.
    Beckmann,
    /// Long tails (Trowbridge and Reitz 1975).
    Ggx,
}

impl Shape {
    /// What a scene has chosen.
    pub fn from(p: &Properties<'_>) -> Self {
        if p.choice("distribution") == "ggx" { Shape::Ggx } else { Shape::Beckmann }
    }
}

/// A distribution whose roughness may be textured.
pub struct Roughness {
    shape: Shape,
    alpha: [ScalarSource; 2],
    sample_visible: bool,
}

impl Roughness {
    /// Reads [`PARAMS`].
    pub fn from(p: &Properties<'_>) -> Result<Self, Failed> {
        p.exclusive("alpha", "alpha_u")?;
        p.exclusive("alpha", "alpha_v")?;
        let alpha = match (p.scalar_opt("alpha_u"), p.scalar_opt("alpha_v")) {
            (Some(u), Some(v)) => [u, v],
            (None, None) => [p.scalar("alpha"), p.scalar("alpha")],
            (Some(_), None) => return Err(p.error("alpha_u", "\"alpha_u\" is set but \"alpha_v\" is not")),
            (None, Some(_)) => return Err(p.error("alpha_v", "\"alpha_v\" is set but \"alpha_u\" is not")),
        };
        Ok(Roughness { shape: Shape::from(p), alpha, sample_visible: p.bool("sample_visible") })
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        self.alpha.iter().all(|a| a.constant().is_some())
    }

    /// The distribution at a hit.
    pub fn at(&self, hit: &lucerna_core::interfaces::SurfaceHit) -> Microfacets {
        Microfacets::new(self.shape, self.alpha[0].at(hit), self.alpha[1].at(hit), self.sample_visible)
    }
}

/// A distribution of microfacet normals over the local hemisphere about +z.
#[derive(Clone, Copy, Debug)]
pub struct Microfacets {
    shape: Shape,
    alpha_u: f32,
    alpha_v: f32,
    sample_visible: bool,
}

impl Microfacets {
    /// Roughness below 1e-4 is raised to it.
    #[inline]
    pub fn new(shape: Shape, alpha_u: f32, alpha_v: f32, sample_visible: bool) -> Self {
        Microfacets { shape, alpha_u: alpha_u.max(1e-4), alpha_v: alpha_v.max(1e-4), sample_visible }
    }

    /// Whether only visible normals are sampled.
    #[inline]
    pub fn samples_visible(&self) -> bool {
        self.sample_visible
    }

    /// Geometric mean of both roughnesses.
    #[inline]
    pub fn mean_alpha(&self) -> f32 {
        (self.alpha_u * self.alpha_v).sqrt()
    }

    /// The same distribution, `factor` times as rough.
    #[inline]
    pub fn scaled(&self, factor: f32) -> Self {
        Microfacets { alpha_u: self.alpha_u * factor, alpha_v: self.alpha_v * factor, ..*self }
    }

    /// Density of facet area per unit solid angle of `m` and unit area of the surface.
    pub fn eval(&self, m: Vec3) -> f32 {
        let slopes = sqr(m.x / self.alpha_u) + sqr(m.y / self.alpha_v);
        let area = PI * self.alpha_u * self.alpha_v;
        let cos2 = m.z * m.z;
        let d = match self.shape {
            Shape::Beckmann => (-slopes / cos2).exp() / (area * cos2 * cos2),
            Shape::Ggx => 1.0 / (area * sqr(slopes + cos2)),
        };
        // Smaller values are of no effect and would overflow when divided by.
        if d * m.z > 1e-20 { d } else { 0.0 }
    }

    /// Density per unit solid angle with which [`sample`](Self::sample) gives `m`; `wi.z` must be positive.
    pub fn pdf(&self, wi: Vec3, m: Vec3) -> f32 {
        let d = self.eval(m);
        if self.sample_visible { d * self.smith_g1(wi, m) * wi.dot(m).abs() / wi.z } else { d * m.z }
    }

    /// A normal and its density per unit solid angle; `wi.z` must be positive.
    pub fn sample(&self, wi: Vec3, u: Vec2) -> (Vec3, f32) {
        if self.sample_visible { self.sample_seen(wi, u) } else { self.sample_all(u) }
    }

    fn sample_all(&self, u: Vec2) -> (Vec3, f32) {
        let (sin_phi, cos_phi, alpha2) = if self.alpha_u == self.alpha_v {
            let (sin, cos) = (TAU * u.y).sin_cos();
            (sin, cos, sqr(self.alpha_u))
        } else {
            let tan = self.alpha_v / self.alpha_u * (TAU * u.y).tan();
            let cos = (1.0 / (tan * tan + 1.0).sqrt()) * ((u.y - 0.5).abs() - 0.25).signum();
            let sin = cos * tan;
            (sin, cos, 1.0 / (sqr(cos / self.alpha_u) + sqr(sin / self.alpha_v)))
        };
        let area = PI * self.alpha_u * self.alpha_v;
        let tan2 = match self.shape {
            Shape::Beckmann => -alpha2 * (1.0 - u.x).ln(),
            Shape::Ggx => alpha2 * u.x / (1.0 - u.x),
        };
        let cos_theta = 1.0 / (1.0 + tan2).sqrt();
        let shape = match self.shape {
            Shape::Beckmann => 1.0 - u.x,
            Shape::Ggx => 1.0 / sqr(1.0 + tan2 / alpha2),
        };
        let pdf = shape / (area * (cos_theta * cos_theta * cos_theta).max(1e-20));
        // Not the root of 1 − cos²: it would lose half the digits of a small angle, and with them the density.
        let sin_theta = tan2.sqrt() * cos_theta;
        (Vec3::new(cos_phi * sin_theta, sin_phi * sin_theta, cos_theta), pdf)
    }

    fn sample_seen(&self, wi: Vec3, u: Vec2) -> (Vec3, f32) {
        let seen = self.seen_from(wi);
        let slope = match self.shape {
            Shape::Beckmann => Vec2::new(seen.beckmann_along(u.x), beckmann_across(u.y)),
            Shape::Ggx => seen.ggx(warp::square_to_disk_concentric(u)),
        };
        let m = seen.normal(slope);
        (m, self.eval(m) * self.smith_g1(wi, m) * wi.dot(m).abs() / wi.z)
    }

    /// The facets that are visible from a direction; `wi.z` must be positive.
    #[inline]
    pub fn seen_from(&self, wi: Vec3) -> Seen {
        // Stretch until the roughness is 1, take a slope there, turn and shrink it back.
        let stretched = Vec3::new(self.alpha_u * wi.x, self.alpha_v * wi.y, wi.z).normalize();
        Seen { cos_theta: stretched.z, azimuth: azimuth(stretched), alpha: [self.alpha_u, self.alpha_v] }
    }

    /// Part of the facets of normal `m` that are seen from both directions.
    #[inline]
    pub fn g(&self, wi: Vec3, wo: Vec3, m: Vec3) -> f32 {
        self.smith_g1(wi, m) * self.smith_g1(wo, m)
    }

    /// Part of the facets of normal `m` that are seen from `v`; zero if `v` sees the facet's other side than the
    /// surface's.
    pub fn smith_g1(&self, v: Vec3, m: Vec3) -> f32 {
        if v.dot(m) * v.z <= 0.0 {
            return 0.0;
        }
        let stretched2 = sqr(self.alpha_u * v.x) + sqr(self.alpha_v * v.y);
        if stretched2 == 0.0 {
            return 1.0;
        }
        let tan2 = stretched2 / sqr(v.z);
        match self.shape {
            Shape::Beckmann => {
                // Rational fit of Walter et al. 2007, section 5.2; relative error below 0.35 %.
                let a = 1.0 / tan2.sqrt();
                if a >= 1.6 { 1.0 } else { (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a) }
            }
            Shape::Ggx => 2.0 / (1.0 + (1.0 + tan2).sqrt()),
        }
    }
}

/// Sine and cosine of the angle of a unit vector about z; (0, 1) near the pole.
fn azimuth(v: Vec3) -> (f32, f32) {
    let sin2 = v.x * v.x + v.y * v.y;
    if sin2 <= 2.0 * f32::EPSILON {
        return (0.0, 1.0);
    }
    let inv = 1.0 / sin2.sqrt();
    ((v.y * inv).clamp(-1.0, 1.0), (v.x * inv).clamp(-1.0, 1.0))
}

/// Facets that are visible from one direction. Slopes are those of a surface stretched to a roughness of 1, along the
/// direction and across.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Of the stretched direction.
    cos_theta: f32,
    /// Sine and cosine of its azimuth.
    azimuth: (f32, f32),
    alpha: [f32; 2],
}

impl Seen {
    /// The facet of a slope.
    #[inline]
    pub fn normal(&self, slope: Vec2) -> Vec3 {
        let ((sin_phi, cos_phi), [alpha_u, alpha_v]) = (self.azimuth, self.alpha);
        let x = -(cos_phi * slope.x - sin_phi * slope.y) * alpha_u;
        let y = -(sin_phi * slope.x + cos_phi * slope.y) * alpha_v;
        Vec3::new(x, y, 1.0).normalize()
    }

    /// The slope of the Beckmann distribution along the direction, for a number in [0, 1). The cumulative distribution is
    /// inverted by at most three Newton steps in the domain of erf, which keeps the map continuous; after a small one,
    /// the next is nothing.
    pub fn beckmann_along(&self, u: f32) -> f32 {
        let tan = safe_sqrt(1.0 - self.cos_theta * self.cos_theta) / self.cos_theta;
        let cot = 1.0 / tan;
        let max = erf(cot);
        let u = inside(u);
        // The exact solution at grazing incidence, where the distribution is least linear.
        let mut x = max - (max + 1.0) * erf((-u.ln()).sqrt());
        let target = u * (1.0 + max + FRAC_1_SQRT_PI * tan * (-cot * cot).exp());
        for _ in 0..3 {
            let slope = erfinv(x);
            let value = 1.0 + x + FRAC_1_SQRT_PI * tan * (-slope * slope).exp() - target;
            let step = value / (1.0 - slope * tan);
            x -= step;
            if step.abs() < 1e-4 {
                break;
            }
        }
        erfinv(x)
    }

    /// The slope of the GGX distribution, for a point of the unit disk (see [`warp::square_to_disk_concentric`]).
    #[inline]
    pub fn ggx(&self, mut p: Vec2) -> Vec2 {
        p.y = lerp(safe_sqrt(1.0 - p.x * p.x), p.y, 0.5 * (1.0 + self.cos_theta));
        let z = safe_sqrt(1.0 - p.length_squared());
        let sin_theta = safe_sqrt(1.0 - self.cos_theta * self.cos_theta);
        let norm = 1.0 / (sin_theta * p.y + self.cos_theta * z);
        Vec2::new(self.cos_theta * p.y - sin_theta * z, p.x) * norm
    }
}

/// The slope of the Beckmann distribution across the direction, wherever that is, for a number in [0, 1).
#[inline]
pub fn beckmann_across(u: f32) -> f32 {
    erfinv(2.0 * inside(u) - 1.0)
}

/// Kept off the ends, where slopes are infinite.
#[inline]
fn inside(u: f32) -> f32 {
    u.clamp(1e-6, 1.0 - 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ D(m) cos θm dm = 1, and ∫ G1(wi, m) D(m) ⟨wi, m⟩ dm = cos θi (the masking function conserves area).
    #[test]
    fn normalisation() {
        for shape in [Shape::Beckmann, Shape::Ggx] {
            for (au, av) in [(0.3, 0.3), (0.2, 0.7), (1.0, 1.0)] {
                let d = Microfacets::new(shape, au, av, true);
                let wi = Vec3::new(0.6, 0.0, 0.8);
                let (rings, spokes) = (1500, 256);
                let (mut area, mut seen) = (0.0f64, 0.0f64);
                for i in 0..rings {
                    let theta = (i as f32 + 0.5) / rings as f32 * PI / 2.0;
                    for j in 0..spokes {
                        let phi = (j as f32 + 0.5) / spokes as f32 * TAU;
                        let m = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                        let cell = theta.sin() * (PI / 2.0 / rings as f32) * (TAU / spokes as f32);
                        area += f64::from(d.eval(m) * m.z * cell);
                        seen += f64::from(d.eval(m) * d.smith_g1(wi, m) * wi.dot(m).max(0.0) * cell);
                    }
                }
                assert!((area - 1.0).abs() < 2e-3, "{shape:?} {au} {av}: {area}");
                assert!((seen / 0.8 - 1.0).abs() < 5e-3, "{shape:?} {au} {av}: {seen}");
            }
        }
    }

    #[test]
    fn sampling_reports_its_density() {
        for shape in [Shape::Beckmann, Shape::Ggx] {
            for visible in [true, false] {
                let d = Microfacets::new(shape, 0.1, 0.4, visible);
                let wi = Vec3::new(0.5, -0.3, 0.66_f32.sqrt()).normalize();
                for i in 1..200 {
                    let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 * 0.414_214).fract());
                    let (m, pdf) = d.sample(wi, u);
                    assert!((m.length() - 1.0).abs() < 1e-5, "{shape:?} {visible} {u}: {m}");
                    let again = d.pdf(wi, m);
                    assert!((pdf - again).abs() <= 2e-3 * again.max(1e-6), "{shape:?} {visible} {u}: {pdf} {again}");
                }
            }
        }
    }
}
