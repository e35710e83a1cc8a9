//! Densities are true, and samples follow them.

use super::{Traced, draft, shape, uniform};
use crate::testing::Draft;
use lucerna_core::interfaces::LightPoint;
use lucerna_core::math::{DMat4, DVec3, Vec2, Vec3};
use lucerna_core::sampling::{Pcg32, warp};
use std::f64::consts::PI;

/// Placed, turned and scaled shapes of each kind; planar ones stretched.
fn shapes() -> Vec<(&'static str, Traced)> {
    let turn = DMat4::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let even = DMat4::from_translation(DVec3::new(0.3, -0.2, 0.1)) * turn * DMat4::from_scale(DVec3::splat(0.7));
    let uneven = turn * DMat4::from_scale(DVec3::new(0.5, 1.5, 1.0));
    let placed = |plugin: &str, m| draft(plugin).to_world(m);
    let file = |plugin: &str| placed(plugin, even).string("filename", &format!("bumpy.{plugin}"));
    let drafts: [(&'static str, Draft); 9] = [
        ("rectangle", placed("rectangle", uneven)),
        ("disk", placed("disk", uneven)),
        ("cylinder", placed("cylinder", even)),
        ("sphere", placed("sphere", even)),
        ("inward sphere", placed("sphere", even).bool("flip_normals", true)),
        ("cube", placed("cube", uneven)),
        ("obj", file("obj")),
        ("ply", file("ply")),
        ("flat obj", file("obj").bool("face_normals", true)),
    ];
    drafts.into_iter().map(|(name, draft)| (name, Traced::new(shape(&draft)))).collect()
}

/// Normal quantile of a χ² statistic (Wilson and Hilferty 1931).
fn chi2_z(counts: &[u32], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0.0);
    for (count, e) in counts.iter().zip(expected).filter(|(_, e)| **e >= 5.0) {
        statistic += (f64::from(*count) - e).powi(2) / e;
        cells += 1.0;
    }
    let k: f64 = cells - 1.0;
    ((statistic / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()
}

/// A sample at random numbers lies on the surface that rays hit, with the same normal, coordinates and density.
#[test]
fn samples_lie_on_the_surface() {
    let mut pcg = Pcg32::new(2, 9);
    for (name, traced) in shapes() {
        for _ in 0..500 {
            let sample = traced.shape.sample_area(uniform(&mut pcg)).expect("a point");
            let hit = traced.hit(sample.p + sample.n * 0.01, -sample.n).expect("the surface");
            assert!((hit.p - sample.p).length() < 1e-5, "{name}: {} and {}", hit.p, sample.p);
            assert!((hit.n - sample.n).length() < 1e-5, "{name}: {} and {}", hit.n, sample.n);
            let uv = (hit.uv - sample.uv).abs();
            assert!(uv.min(Vec2::ONE - uv).max_element() < 1e-4, "{name}: {} and {}", hit.uv, sample.uv);
            assert!((sample.pdf * traced.shape.area() - 1.0).abs() < 1e-5, "{name}");
        }
    }
}

/// Area samples, seen through rays that hit the shape uniformly: the number of lines through a surface element is
/// proportional to its area (Cauchy and Crofton), so the means of any function of the point must agree.
#[test]
fn area_samples_are_uniform() {
    let n = 200_000;
    for (name, traced) in shapes() {
        let mut pcg = Pcg32::new(8, 1);
        let bounds = traced.shape.bounds();
        let (center, radius) = bounds.bounding_sphere();
        let (mut lines, mut crossings) = (Vec::new(), 0.0);
        for _ in 0..n {
            // Isotropic uniform lines through the bounding sphere.
            let d = warp::square_to_sphere(uniform(&mut pcg));
            let across = warp::square_to_disk_concentric(uniform(&mut pcg)) * radius;
            let frame = lucerna_core::math::Frame::from_normal(d);
            let mut o = center - d * (2.0 * radius) + frame.s * across.x + frame.t * across.y;
            while let Some(hit) = traced.hit(o, d) {
                crossings += 1.0;
                lines.push(hit.p);
                o = hit.origin_towards(d);
            }
        }
        // A sphere of that radius is crossed twice by every line.
        let area = crossings / f64::from(n) / 2.0 * 4.0 * PI * f64::from(radius * radius);
        let error = 5.0 / (lines.len() as f64).sqrt();
        assert!((area / f64::from(traced.shape.area()) - 1.0).abs() < error, "{name}: area {area}");
        let samples: Vec<Vec3> =
            (0..n).map(|_| traced.shape.sample_area(uniform(&mut pcg)).expect("a point").p).collect();
        for moment in [|p: Vec3| p.x, |p: Vec3| p.y, |p: Vec3| p.z, |p: Vec3| p.x * p.y, |p: Vec3| p.z * p.z] {
            let mean = |points: &[Vec3]| {
                let (sum, square) =
                    points.iter().map(|p| f64::from(moment(*p))).fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
                let count = points.len() as f64;
                (sum / count, (square / count - (sum / count).powi(2)).max(0.0) / count)
            };
            let ((a, va), (b, vb)) = (mean(&lines), mean(&samples));
            // Crossings of one line are correlated, at most twofold here.
            assert!((a - b).abs() < 4.5 * (2.0 * va + vb).sqrt() + 1e-6, "{name}: {a} and {b}");
        }
    }
}

fn viewpoints(traced: &Traced) -> Vec<Vec3> {
    let (center, radius) = traced.shape.bounds().bounding_sphere();
    let above = traced.shape.sample_area(Vec2::new(0.3, 0.6)).expect("a point");
    vec![
        center + Vec3::new(1.0, 2.0, 2.0) * radius,
        center + Vec3::new(-0.9, 0.5, 0.7) * radius,
        center + Vec3::new(0.1, 0.05, 0.02) * radius,
        above.p + above.n * 0.1,
        above.p + above.n * 1e-2,
        center + Vec3::new(-3e3, 1e3, 2e3) * radius,
    ]
}

#[test]
fn densities_of_samples_are_those_that_are_asked_for() {
    let mut pcg = Pcg32::new(4, 4);
    for (name, traced) in shapes() {
        for from in viewpoints(&traced) {
            for _ in 0..500 {
                let Some((point, _, pdf)) = traced.shape.sample_direct(from, uniform(&mut pcg)) else { continue };
                let asked = traced.shape.pdf_direct(from, &point);
                assert!((asked / pdf - 1.0).abs() < 1e-4, "{name} from {from}: {pdf} and {asked}");
                assert!(point.d.is_normalized() && point.n.is_normalized(), "{name}");
                let apart = (from + point.d * point.distance - point.p).length();
                assert!(apart < 1e-5 * (1.0 + from.length()), "{name} from {from}: {apart}");
            }
        }
    }
}

/// χ² over the directions of samples against the density, integrated over each cell by rays: all hits of a ray are
/// points that could have been sampled.
#[test]
fn directions_follow_the_density() {
    const CELLS: (usize, usize) = (10, 20);
    const INNER: usize = 24;
    let n = 100_000;
    for (name, traced) in shapes() {
        for from in viewpoints(&traced).into_iter().take(4) {
            let mut counts = [0u32; CELLS.0 * CELLS.1];
            let mut pcg = Pcg32::new(6, 7);
            for _ in 0..n {
                let Some((point, _, _)) = traced.shape.sample_direct(from, uniform(&mut pcg)) else { continue };
                let row = ((point.d.z * 0.5 + 0.5) * CELLS.0 as f32) as usize;
                let column = warp::azimuth(point.d.x, point.d.y) / std::f32::consts::TAU * CELLS.1 as f32;
                counts[row.min(CELLS.0 - 1) * CELLS.1 + (column as usize).min(CELLS.1 - 1)] += 1;
            }
            let mut expected = [0.0; CELLS.0 * CELLS.1];
            for (cell, e) in expected.iter_mut().enumerate() {
                for i in 0..INNER * INNER {
                    let (row, column) = (i / INNER, i % INNER);
                    let z = ((cell / CELLS.1) as f32 + (row as f32 + pcg.next_f32()) / INNER as f32) / CELLS.0 as f32;
                    let phi =
                        ((cell % CELLS.1) as f32 + (column as f32 + pcg.next_f32()) / INNER as f32) / CELLS.1 as f32;
                    let d = warp::square_to_sphere(Vec2::new(phi, 1.0 - z));
                    *e += density(&traced, from, d, name);
                }
                *e *= f64::from(n) * 4.0 * PI / (expected_cells(CELLS) * (INNER * INNER) as f64);
            }
            let total: f64 = expected.iter().sum::<f64>() / f64::from(n);
            // Edges of the shape and grazing views make the quadrature rough, so only its sum and large cells count.
            assert!((total - 1.0).abs() < 0.02, "{name} from {from}: the density integrates to {total}");
            let z = relative_chi2(&counts, &expected);
            assert!(z < 4.0, "{name} from {from}: {z} standard deviations");
        }
    }
}

fn expected_cells((rows, columns): (usize, usize)) -> f64 {
    (rows * columns) as f64
}

/// χ² with the quadrature's own error (about 2 % per cell) added to the variance.
fn relative_chi2(counts: &[u32], expected: &[f64]) -> f64 {
    let scaled: Vec<(u32, f64)> =
        counts.iter().copied().zip(expected.iter().copied()).filter(|(_, e)| *e >= 50.0).collect();
    let (mut statistic, k) = (0.0, scaled.len() as f64);
    for (count, e) in scaled {
        statistic += (f64::from(count) - e).powi(2) / (e + (0.02 * e).powi(2));
    }
    ((statistic / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt()
}

/// The density of all points of the shape in a direction.
fn density(traced: &Traced, from: Vec3, d: Vec3, name: &str) -> f64 {
    let (mut sum, mut o) = (0.0, from);
    while let Some(hit) = traced.hit(o, d) {
        sum += f64::from(traced.shape.pdf_direct(from, &LightPoint::of_hit(from, &hit, d)));
        // Seen from outside, only the near side of a sphere is sampled.
        let center = traced.shape.bounds().center();
        if name.ends_with("sphere") && (from - center).length() > 0.7 {
            break;
        }
        o = hit.origin_towards(d);
    }
    sum
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
            let around = warp::azimuth(point.d.x, point.d.y) / std::f32::consts::TAU;
            counts[(height * 20.0) as usize * 20 + ((around * 20.0) as usize).min(19)] += 1;
        }
        let z = chi2_z(&counts, &[f64::from(n) / 400.0; 400]);
        assert!(z < 3.5, "{distance}: {z} standard deviations");
    }
}

#[test]
fn hc_g19_on_and_in_the_surface_all_is_finite() {
    let mut pcg = Pcg32::new(1, 6);
    for (name, traced) in shapes() {
        for _ in 0..200 {
            let on = traced.shape.sample_area(uniform(&mut pcg)).expect("a point");
            for from in [on.p, on.p + on.n * 1e-6, on.p - on.n * 1e-6, on.p - on.n * 1e-3] {
                if let Some((point, p_error, pdf)) = traced.shape.sample_direct(from, uniform(&mut pcg)) {
                    assert!(pdf.is_finite() && pdf > 0.0 && p_error.is_finite(), "{name}");
                    assert!(point.d.is_normalized() && traced.shape.pdf_direct(from, &point).is_finite(), "{name}");
                }
            }
        }
    }
}
