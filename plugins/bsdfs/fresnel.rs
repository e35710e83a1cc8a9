//! Fresnel reflection: how much of the light an interface sends back.

use lucerna_core::color::Rgb;
use lucerna_core::math::{Vec3, safe_sqrt, sqr};

/// What an interface between two dielectrics does to unpolarised light from one direction.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// The part that is reflected.
    pub reflectance: f32,
    /// Cosine of the refracted direction about the normal, signed: on the other side than the incident one. Zero
    /// under total internal reflection.
    pub cos_theta_t: f32,
    /// Index of the side gone to over the side come from.
    pub eta_it: f32,
    /// Its reciprocal.
    pub eta_ti: f32,
}

/// Fresnel's equations for an interface of relative index `eta` (side without the normal over side with it), exact.
/// A negative `cos_theta_i` comes from the side without the normal.
#[inline]
pub fn dielectric(cos_theta_i: f32, eta: f32) -> Interface {
    let rcp = 1.0 / eta;
    let (eta_it, eta_ti) = if cos_theta_i >= 0.0 { (eta, rcp) } else { (rcp, eta) };
    let cos_i = cos_theta_i.abs();
    // Snell: sin² of the refracted angle is sin²θi · η⁻².
    let cos_t = safe_sqrt(1.0 - (1.0 - cos_theta_i * cos_theta_i) * (eta_ti * eta_ti));

    let reflectance = if eta == 1.0 {
        0.0
    } else if cos_i == 0.0 {
        1.0
    } else {
        let s = (cos_i - eta_it * cos_t) / (cos_i + eta_it * cos_t);
        let p = (cos_t - eta_it * cos_i) / (cos_t + eta_it * cos_i);
        0.5 * (s * s + p * p)
    };
    let cos_theta_t = if cos_theta_i.is_sign_negative() { cos_t } else { -cos_t };
    Interface { reflectance, cos_theta_t, eta_it, eta_ti }
}

/// Fresnel reflectance of a conductor with index `eta + i k` for light from the outside (Möller 1988, "Optics").
#[inline]
pub fn conductor(cos_theta_i: f32, eta: Rgb, k: Rgb) -> Rgb {
    let channel = |eta: f32, k: f32| {
        let cos2 = sqr(cos_theta_i);
        let sin2 = 1.0 - cos2;
        let t = eta * eta - k * k - sin2;
        let a2_plus_b2 = safe_sqrt(t * t + 4.0 * k * k * eta * eta);
        let a = safe_sqrt(0.5 * (a2_plus_b2 + t));

        let (sum, mixed) = (a2_plus_b2 + cos2, 2.0 * cos_theta_i * a);
        let s = (sum - mixed) / (sum + mixed);
        let (sum, mixed) = (a2_plus_b2 * cos2 + sin2 * sin2, mixed * sin2);
        let p = s * (sum - mixed) / (sum + mixed);
        0.5 * (s + p)
    };
    Rgb::new(channel(eta.r, k.r), channel(eta.g, k.g), channel(eta.b, k.b))
}

/// Mean Fresnel reflectance of a dielectric under evenly spread light, within 1 %: fits by Egan and Hilgeman (1973)
/// below an index of 1 and by d'Eon and Irving (2011) above.
///
/// The first fit passes 1 below an index of 0.2; there the exact relation of both sides of an interface takes over.
pub fn diffuse_reflectance(eta: f32) -> f32 {
    let inv = 1.0 / eta;
    if eta < 1.0 {
        let fit = 0.0636 * inv + (eta * (eta * -1.4399 + 0.7099) + 0.6681);
        if fit < 1.0 { fit } else { 1.0 - (1.0 - diffuse_reflectance(inv)) * eta * eta }
    } else {
        let fit = [0.919317, -3.4793, 6.75335, -7.80989, 4.98554, -1.36881];
        fit.iter().rev().fold(0.0, |sum, c| sum * inv + c)
    }
}

/// Mirrors `wi` at the plane of local normal z.
#[inline]
pub fn reflect(wi: Vec3) -> Vec3 {
    Vec3::new(-wi.x, -wi.y, wi.z)
}

/// Mirrors `wi` at the plane of normal `m`.
#[inline]
pub fn reflect_at(wi: Vec3, m: Vec3) -> Vec3 {
    m * (2.0 * wi.dot(m)) - wi
}

/// Refracts `wi` at the plane of local normal z.
#[inline]
pub fn refract(wi: Vec3, interface: &Interface) -> Vec3 {
    Vec3::new(-interface.eta_ti * wi.x, -interface.eta_ti * wi.y, interface.cos_theta_t)
}

/// Refracts `wi` at the plane of normal `m`; `interface` was evaluated at `wi · m`.
#[inline]
pub fn refract_at(wi: Vec3, m: Vec3, interface: &Interface) -> Vec3 {
    m * (wi.dot(m) * interface.eta_ti + interface.cos_theta_t) - wi * interface.eta_ti
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of 2 cos θ F(cos θ) against the fits, over the indices they are made for.
    #[test]
    fn diffuse_fits_agree_with_the_integral() {
        for eta in [1.0 / 1.9f32, 1.0 / 1.5, 1.0 / 1.33, 1.33, 1.5, 2.4] {
            let n = 20_000;
            let exact: f64 = (0..n)
                .map(|i| (i as f32 + 0.5) / n as f32)
                .map(|mu| f64::from(2.0 * mu * dielectric(mu, eta).reflectance))
                .sum::<f64>()
                / f64::from(n);
            let fit = f64::from(diffuse_reflectance(eta));
            assert!((fit - exact).abs() < 0.01 * exact.max(0.3), "eta {eta}: {fit} against {exact}");
        }
    }

    #[test]
    fn snell_holds_and_nothing_is_lost() {
        for eta in [0.5f32, 0.999_999, 1.0, 1.000_001, 1.5, 10.0] {
            for mu in [1.0f32, 0.7, 0.1, 1e-8, 0.0, -1e-8, -0.1, -0.7, -1.0] {
                let i = dielectric(mu, eta);
                assert!((0.0..=1.0).contains(&i.reflectance), "eta {eta}, cos {mu}: {i:?}");
                let wi = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                if i.cos_theta_t != 0.0 {
                    assert!((refract(wi, &i).length() - 1.0).abs() < 1e-5);
                    assert!((refract_at(wi, Vec3::Z, &i) - refract(wi, &i)).length() < 1e-5);
                    assert!(i.cos_theta_t * mu <= 0.0);
                }
            }
        }
    }

    #[test]
    fn a_perfect_mirror_is_a_conductor_without_refraction() {
        for mu in [1.0, 0.5, 0.01] {
            let f = conductor(mu, Rgb::BLACK, Rgb::WHITE);
            assert!((f.r - 1.0).abs() < 1e-6 && f.r == f.g && f.g == f.b);
        }
    }
}
