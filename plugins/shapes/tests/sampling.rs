//! What is lit from close by. That densities are true and samples follow them is tested for every shape in
//! `tests/properties`.

use super::{Traced, draft, shape, uniform};
use lucerna_core::math::Vec3;
use lucerna_core::sampling::{Pcg32, warp};
use std::f32::consts::TAU;

/// Normal quantile of a χ² statistic of `k` degrees of freedom (Wilson and Hilferty 1931).
fn normal_quantile(statistic: f64, k: f64) -> f64 {
    ((statistic / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()
}

/// A uniform cone from 1e-6 above a sphere of radius 1, and from inside of it, down to its surface.
#[test]
fn hc_g19_close_views_of_a_sphere() {
    let traced = Traced::new(shape(&draft("sphere")));
    let mut pcg = Pcg32::new(1, 6);
    for distance in [1e-6f32, 1e-3, 0.1] {
        let from = Vec3::new(0.0, 0.0, 1.0 + distance);
        // Uniform in the cone: the cosine is uniform between that of the rim and 1.
        let rim = (1.0 - (1.0 / f64::from(from.z)).powi(2)).sqrt();
        let mut counts = [0u32; 400];
        let n = 100_000;
        for _ in 0..n {
            let (point, p_error, pdf) = traced.shape.sample_direct(from, uniform(&mut pcg)).expect("a point");
            assert!(point.p.is_finite() && p_error.is_finite() && pdf.is_finite() && point.distance > 0.0);
            let height = ((f64::from(-point.d.z) - rim) / (1.0 - rim)).clamp(0.0, 0.999_999);
            let around = warp::azimuth(point.d.x, point.d.y) / TAU;
            counts[(height * 20.0) as usize * 20 + ((around * 20.0) as usize).min(19)] += 1;
        }
        let expected = f64::from(n) / 400.0;
        let statistic = counts.iter().map(|c| (f64::from(*c) - expected).powi(2) / expected).sum();
        let z = normal_quantile(statistic, 399.0);
        assert!(z < 3.5, "{distance}: {z} standard deviations");
    }
}
