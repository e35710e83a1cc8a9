//! The light of the sun's disc, and the sampling of it.

use super::sun_fit::{IRRADIANCE, LIMB};
use lucerna_core::color::Rgb;
use lucerna_core::math::{Frame, Vec2, Vec3, lerp, safe_sqrt, sqr};
use lucerna_core::sampling::warp;
use std::f32::consts::TAU;

/// Elevation in degrees of the first and last node of the uniform sun; in between it is linear.
const NODES: (f32, f32) = (2.0, 89.0);
/// Number of intervals between the nodes.
const INTERVALS: f32 = 29.0;
/// Largest reddening that the limb darkening was fitted to.
const MAX_REDDENING: f32 = 4.0;

/// The sun as a disc on the dome. Up is +z.
pub struct Sun {
    frame: Frame,
    turbidity: f32,
    scale: f32,
    /// `1 − cos` of half the aperture: exact for the small angles it is about.
    versine: f32,
    /// Of the uniform disc; `None` if it is darkened towards its limb.
    uniform: Option<Rgb>,
}

impl Sun {
    /// The sun in a unit direction above the horizon. `turbidity` is in [1, 10]; `half_aperture` in radians, in
    /// (0, π/2). The irradiance on a surface facing the sun does not depend on the aperture.
    pub fn new(turbidity: f32, direction: Vec3, scale: f32, half_aperture: f32, limb_darkened: bool) -> Self {
        let mut sun = Sun {
            frame: Frame::from_normal(direction),
            turbidity,
            scale,
            versine: 2.0 * sqr((0.5 * half_aperture).sin()),
            uniform: None,
        };
        if !limb_darkened {
            sun.uniform = Some(sun.irradiance() / sun.solid_angle());
        }
        sun
    }

    /// Irradiance of the uniform sun on a surface facing it.
    pub fn irradiance(&self) -> Rgb {
        // The reference renderer tabulates this sun over elevation; so that low suns are alike, the same chords are
        // drawn here under the smooth curve.
        let (first, last) = NODES;
        let step = (last - first) / INTERVALS;
        let x = ((elevation(self.frame.n) - first) / step).clamp(0.0, INTERVALS);
        let (below, t) = (x.floor(), x.fract());
        let [a, b] = [below, below + 1.0].map(|node| mean_xyz(self.turbidity, first + step * node));
        to_rgb(std::array::from_fn(|c| lerp(a[c], b[c], t))) * self.scale
    }

    /// Solid angle of the disc.
    pub fn solid_angle(&self) -> f32 {
        TAU * self.versine
    }

    /// Radiance from a unit direction above the horizon: black outside the disc.
    pub fn radiance(&self, d: Vec3) -> Rgb {
        match self.uniform {
            _ if !self.covers(d) => Rgb::BLACK,
            Some(radiance) => radiance,
            None => self.darkened(d),
        }
    }

    /// The disc with limb darkening, dimmed by the air mass of each direction on its own.
    fn darkened(&self, d: Vec3) -> Rgb {
        let chord2 = (d - self.frame.n).length_squared();
        // sin² γ and sin² of the half aperture from the versines; their ratio is sin² ψ on the sun's sphere.
        let sin2 = chord2 * (1.0 - 0.25 * chord2) / (self.versine * (2.0 - self.versine));
        let x = 1.0 - safe_sqrt(1.0 - sin2);
        let mean = mean_xyz(self.turbidity, elevation(d));
        let q = (mean[0] / mean[2].max(f32::MIN_POSITIVE)).ln().clamp(0.0, MAX_REDDENING);
        let xyz = std::array::from_fn(|c| mean[c] * horner(&LIMB[c].map(|by_reddening| horner(&by_reddening, q)), x));
        to_rgb(xyz) * (self.scale / self.solid_angle())
    }

    /// Whether a unit direction hits the disc.
    pub fn covers(&self, d: Vec3) -> bool {
        // |d − s|² = 2 (1 − cos γ), without the cancellation in 1 − d·s.
        (d - self.frame.n).length_squared() <= 2.0 * self.versine
    }

    /// A unit direction uniform on the disc, maybe below the horizon.
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let p = warp::square_to_disk_concentric(u);
        let versine = self.versine * p.length_squared();
        let p = p * safe_sqrt(self.versine * (2.0 - versine));
        self.frame.to_world(p.extend(1.0 - versine))
    }

    /// Density of [`sample`](Self::sample) per solid angle.
    pub fn pdf(&self, d: Vec3) -> f32 {
        if self.covers(d) { 1.0 / self.solid_angle() } else { 0.0 }
    }
}

/// Elevation of a unit direction in degrees, not below the horizon.
fn elevation(d: Vec3) -> f32 {
    d.z.max(0.0).atan2(d.truncate().length()).to_degrees()
}

/// Irradiance of the sun on a surface facing it, as CIE XYZ; `elevation` in degrees, at least 0.
fn mean_xyz(turbidity: f32, elevation: f32) -> [f32; 3] {
    let s = air_mass_coordinate(elevation);
    let at = |level: f32| IRRADIANCE[(level as usize).clamp(1, 10) - 1].map(|powers| horner(&powers, s).exp());
    let (below, above, t) = (at(turbidity.floor()), at(turbidity.ceil()), turbidity.fract());
    std::array::from_fn(|c| lerp(below[c], above[c], t))
}

/// What the fit is polynomial in: the fourth root of the relative air mass (Kasten and Young 1989, "Revised optical
/// air mass tables"), stretched to −1 at the zenith and 1 at the horizon.
fn air_mass_coordinate(elevation: f32) -> f32 {
    let root = |e: f32| (e.to_radians().sin() + 0.50572 * (e + 6.07995).powf(-1.6364)).powf(-0.25);
    2.0 * (root(elevation) - 1.0) / (root(0.0) - 1.0) - 1.0
}

/// `Σ cᵢ xⁱ`.
fn horner(coefficients: &[f32], x: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// CIE XYZ to linear sRGB, not clipped: a red sun has less than no blue.
fn to_rgb([x, y, z]: [f32; 3]) -> Rgb {
    Rgb::new(
        3.240479 * x - 1.53715 * y - 0.498535 * z,
        -0.969256 * x + 1.875991 * y + 0.041556 * z,
        0.055648 * x - 0.204043 * y + 1.057311 * z,
    )
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::*;

    const REAL: f32 = 0.2679 * std::f32::consts::PI / 180.0;

    fn sun_at(turbidity: f32, elevation: f32, half_aperture: f32, limb_darkened: bool) -> Sun {
        let (sin, cos) = elevation.to_radians().sin_cos();
        Sun::new(turbidity, Vec3::new(cos, 0.0, sin), 1.0, half_aperture, limb_darkened)
    }

    /// Largest difference of the channels, relative to the largest channel.
    fn difference(a: Rgb, b: Rgb) -> f32 {
        (a - b).map(f32::abs).max_component() / b.max_component()
    }

    #[test]
    fn irradiance_agrees_with_the_reference() {
        let brightest = golden::SUN[0][5][0];
        for (t, turbidity) in golden::SUN_TURBIDITIES.into_iter().enumerate() {
            for (e, degrees) in golden::SUN_ELEVATIONS.into_iter().enumerate() {
                let [r, g, b] = golden::SUN[t][e];
                let expected = Rgb::new(r, g, b);
                let found = sun_at(turbidity, degrees, REAL, false).irradiance();
                // A sun of 1/1000 of the brightest is lost in the sky around it: there the absolute error counts.
                let error = difference(found, expected) * (r / (1e-3 * brightest)).min(1.0);
                assert!(error < 5e-4, "turbidity {turbidity}, {degrees}°: {found:?}, {expected:?}: {error}");
            }
        }
    }

    #[test]
    fn limb_darkening_agrees_with_the_reference() {
        for (t, turbidity) in golden::LIMB_TURBIDITIES.into_iter().enumerate() {
            for (e, degrees) in golden::LIMB_ELEVATIONS.into_iter().enumerate() {
                let uniform = sun_at(turbidity, degrees, REAL, false);
                let darkened = sun_at(turbidity, degrees, REAL, true);
                for (m, mu) in golden::LIMB_COSINES.into_iter().enumerate() {
                    let gamma = (safe_sqrt(1.0 - mu * mu) * REAL.sin()).asin();
                    let d = gamma.cos() * uniform.frame.n + gamma.sin() * Vec3::Y;
                    let mean = uniform.radiance(d);
                    let [r, g, b] = golden::LIMB[t][e][m];
                    let error = difference(darkened.radiance(d), mean * Rgb::new(r, g, b));
                    assert!(error < 3e-3, "turbidity {turbidity}, {degrees}°, μ {mu}: {error}");
                }
            }
        }
    }

    #[test]
    fn aperture_and_limb_leave_the_irradiance() {
        for half_aperture in [1e-4, REAL, 0.1] {
            let uniform = sun_at(3.0, 60.0, half_aperture, false);
            assert!(difference(uniform.radiance(uniform.frame.n) * uniform.solid_angle(), uniform.irradiance()) < 1e-5);
        }
        let darkened = sun_at(3.0, 60.0, REAL, true);
        let n = 256;
        let mut mean = Rgb::BLACK;
        for i in 0..n * n {
            let u = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
            mean += darkened.radiance(darkened.sample(u)) / (n * n) as f32;
        }
        // The two suns of the reference renderer differ by this much.
        let expected = darkened.irradiance() * Rgb::new(1.00103, 1.00124, 1.00160);
        let error = difference(mean * darkened.solid_angle(), expected);
        assert!(error < 1e-3, "{error}");
    }

    #[test]
    fn samples_fill_the_disc() {
        for half_aperture in [1e-4, REAL, 0.3] {
            let sun = sun_at(2.0, 40.0, half_aperture, false);
            let (mut inside, n) = (0, 64);
            for i in 0..n * n {
                let d = sun.sample(Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32));
                assert!((d.length() - 1.0).abs() < 1e-5);
                inside += i32::from(sun.covers(d));
            }
            assert!(inside as f32 > 0.998 * (n * n) as f32, "{half_aperture}: {inside}");
        }
    }
}
