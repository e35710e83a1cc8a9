//! How much light passes a rough dielectric interface, integrated at load.

use super::fresnel::{dielectric, reflect_at, refract_at};
use super::microfacet::{Microfacets, Shape, beckmann_across};
use lucerna_core::math::{Vec2, Vec3, lerp};
use lucerna_core::sampling::warp;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Number of cosines in the table, evenly spread over [0, 1].
const RESOLUTION: usize = 64;

/// Transmittance of a rough interface by direction from outside, and its mean reflectance from inside.
#[derive(Debug)]
pub struct RoughInterface {
    transmittance: [f32; RESOLUTION],
    /// Part of evenly spread light from inside that is reflected back in.
    pub internal_reflectance: f32,
}

/// Interfaces made so far, by shape and the bits of alpha and eta.
static MADE: Mutex<BTreeMap<(Shape, u32, u32), &'static RoughInterface>> = Mutex::new(BTreeMap::new());

impl RoughInterface {
    /// The interface of a roughness and relative index.
    ///
    /// Its 0.3 KiB live as long as the process: scenes often have a hundred materials that share a few interfaces,
    /// and a table takes some milliseconds to integrate.
    pub fn of(shape: Shape, alpha: f32, eta: f32) -> &'static RoughInterface {
        let key = (shape, alpha.to_bits(), eta.to_bits());
        let made = || MADE.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(interface) = made().get(&key) {
            return interface;
        }
        let interface = Self::integrate(shape, alpha, eta);
        made().entry(key).or_insert_with(|| Box::leak(Box::new(interface)))
    }

    fn integrate(shape: Shape, alpha: f32, eta: f32) -> RoughInterface {
        let facets = Microfacets::new(shape, alpha, alpha, true);
        let direction = |i: usize| {
            let mu = (i as f32 / (RESOLUTION - 1) as f32).max(1e-6);
            Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu)
        };
        let transmitted = |wi: Vec3, m: Vec3| {
            let interface = dielectric(wi.dot(m), eta);
            let wo = refract_at(wi, m, &interface);
            if wo.z * wi.z < 0.0 { facets.smith_g1(wo, m) * (1.0 - interface.reflectance) } else { 0.0 }
        };
        let reflected = |wi: Vec3, m: Vec3| {
            let wo = reflect_at(wi, m);
            if wo.z > 0.0 { facets.smith_g1(wo, m) * dielectric(wi.dot(m), 1.0 / eta).reflectance } else { 0.0 }
        };

        let mut transmittance = [0.0; RESOLUTION];
        let nodes = Quadrature::for_index(eta, shape);
        transmittance
            .par_iter_mut()
            .enumerate()
            .for_each(|(i, t)| *t = nodes.mean_over_facets(&facets, direction(i), transmitted));

        let nodes = Quadrature::for_index(1.0 / eta, shape);
        let inside: Vec<f32> = (0..RESOLUTION)
            .into_par_iter()
            .map(|i| nodes.mean_over_facets(&facets, direction(i), reflected) * direction(i).z)
            .collect();
        RoughInterface { transmittance, internal_reflectance: 2.0 * inside.iter().sum::<f32>() / RESOLUTION as f32 }
    }

    /// Part of the light from outside that enters, by the cosine of its direction with the normal.
    #[inline]
    pub fn transmittance(&self, cos_theta: f32) -> f32 {
        let x = cos_theta * (RESOLUTION - 1) as f32;
        let index = (x as usize).min(RESOLUTION - 2);
        lerp(self.transmittance[index], self.transmittance[index + 1], x - index as f32)
    }
}

/// Integrates over facets.
struct Quadrature {
    /// Gauss–Legendre nodes and weights over [0, 1].
    nodes: Vec<(f64, f64)>,
    /// What samples of facets have in common for all directions, at nodes of the first half (rows) and at all.
    common: Common,
}

/// See [`Quadrature`].
enum Common {
    /// Slopes across the direction, of the first half of the nodes.
    Beckmann(Vec<f32>),
    /// Points of the unit disk, row after row.
    Ggx(Vec<Vec2>),
}

impl Quadrature {
    /// Total reflection puts a kink into the integrand, which needs more nodes.
    fn for_index(eta: f32, shape: Shape) -> Self {
        Self::new(if eta > 1.0 { 32 } else { 128 }, shape)
    }

    fn new(n: usize, shape: Shape) -> Self {
        let nodes = gauss_legendre(n);
        let number = |i: usize| nodes[i].0 as f32;
        let common = match shape {
            Shape::Beckmann => Common::Beckmann((0..n / 2).map(|i| beckmann_across(number(i))).collect()),
            Shape::Ggx => {
                let point = |i| warp::square_to_disk_concentric(Vec2::new(number(i / n), number(i % n)));
                Common::Ggx((0..n / 2 * n).map(point).collect())
            }
        };
        Quadrature { nodes, common }
    }

    /// Mean over the facets visible from `wi`, in the plane y = 0, of an `f` that is the same for both of two facets
    /// which mirror each other there.
    fn mean_over_facets(&self, facets: &Microfacets, wi: Vec3, f: impl Fn(Vec3, Vec3) -> f32) -> f32 {
        let seen = facets.seen_from(wi);
        let number = |j: &(f64, f64)| j.0 as f32;
        2.0 * match &self.common {
            Common::Beckmann(across) => {
                let along: Vec<f32> = self.nodes.iter().map(|j| seen.beckmann_along(number(j))).collect();
                self.mean_over_slopes(|i, j| f(wi, seen.normal(Vec2::new(along[j], across[i]))))
            }
            Common::Ggx(points) => {
                self.mean_over_slopes(|i, j| f(wi, seen.normal(seen.ggx(points[i * self.nodes.len() + j]))))
            }
        }
    }

    /// One of both numbers chooses between mirrored facets, below 1/2 or not: half of its nodes will do.
    #[inline(always)]
    fn mean_over_slopes(&self, f: impl Fn(usize, usize) -> f32) -> f32 {
        let mut sum = 0.0;
        for (i, (_, wx)) in self.nodes[..self.nodes.len() / 2].iter().enumerate() {
            for (j, (_, wy)) in self.nodes.iter().enumerate() {
                sum += f64::from(f(i, j)) * wx * wy;
            }
        }
        sum as f32
    }
}

/// Nodes and weights over [0, 1]: the roots of the Legendre polynomial of degree `n`, by Newton's method.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = -((i as f64 + 0.75) / (n as f64 + 0.5) * std::f64::consts::PI).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut p, mut previous) = (x, 1.0);
            for k in 2..=n {
                let k = k as f64;
                (p, previous) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k, p);
            }
            slope = n as f64 * (x * p - previous) / (x * x - 1.0);
            let step = p / slope;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        (0.5 + 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdfs::fresnel;

    #[test]
    fn quadrature_is_exact_for_polynomials() {
        for n in [32, 128] {
            let nodes = gauss_legendre(n);
            let integral = |power: i32| nodes.iter().map(|(x, w)| w * x.powi(power)).sum::<f64>();
            for power in [0, 1, 2, 7, 40] {
                assert!((integral(power) * f64::from(power + 1) - 1.0).abs() < 1e-12, "{n} {power}");
            }
        }
    }

    /// A nearly smooth interface is Fresnel's; the same one is integrated once.
    #[test]
    fn smooth_limit() {
        let interface = RoughInterface::of(Shape::Ggx, 1e-4, 1.5);
        for mu in [0.2, 0.5, 1.0] {
            let exact = 1.0 - dielectric(mu, 1.5).reflectance;
            assert!((interface.transmittance(mu) - exact).abs() < 1e-3, "{mu}");
        }
        assert!((interface.internal_reflectance - fresnel::diffuse_reflectance(1.0 / 1.5)).abs() < 0.02);
        assert!(std::ptr::eq(interface, RoughInterface::of(Shape::Ggx, 1e-4, 1.5)));
    }
}
