//! Densities are true, and samples follow them.

use super::{Traced, draft, shape, uniform};
use crate::testing::Draft;
use lucerna_core::interfaces::LightPoint;
use lucerna_core::math::{DMat4, DVec3, Frame, Vec2, Vec3};
use lucerna_core::sampling::{Pcg32, warp};
use std::f32::consts::TAU;
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

/// Normal quantile of a χ² statistic of `k` degrees of freedom (Wilson and Hilferty 1931).
fn normal_quantile(statistic: f64, k: f64) -> f64 {
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
            let frame = Frame::from_normal(d);
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
        center + Vec3::new(0.1, 0.05, 0.3) * radius,
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

/// The directions in which a shape may be seen: a cone around its bounding sphere, or all.
struct Outlook {
    frame: Frame,
    /// Cosine of the cone's half angle.
    rim: f32,
}

impl Outlook {
    const CELLS: (usize, usize) = (10, 20);
    const COUNT: usize = Self::CELLS.0 * Self::CELLS.1;

    fn new(traced: &Traced, from: Vec3) -> Self {
        let (center, radius) = traced.shape.bounds().bounding_sphere();
        let away = (center - from).length();
        let rim = if away > radius { (1.0 - (radius / away).powi(2)).sqrt() - 1e-4 } else { -1.0 };
        Outlook { frame: Frame::from_normal((center - from) / away), rim }
    }

    fn solid_angle(&self) -> f64 {
        2.0 * PI * f64::from(1.0 - self.rim)
    }

    fn cell(&self, d: Vec3) -> usize {
        let local = self.frame.to_local(d);
        let row = (local.z - self.rim) / (1.0 - self.rim) * Self::CELLS.0 as f32;
        let column = warp::azimuth(local.x, local.y) / TAU * Self::CELLS.1 as f32;
        (row as usize).min(Self::CELLS.0 - 1) * Self::CELLS.1 + (column as usize).min(Self::CELLS.1 - 1)
    }

    /// The direction at a place within a cell.
    fn direction(&self, cell: usize, within: Vec2) -> Vec3 {
        let height = ((cell / Self::CELLS.1) as f32 + within.x) / Self::CELLS.0 as f32;
        let phi = ((cell % Self::CELLS.1) as f32 + within.y) / Self::CELLS.1 as f32 * TAU;
        let z = self.rim + height * (1.0 - self.rim);
        let rho = (1.0 - z * z).max(0.0).sqrt();
        self.frame.to_world(Vec3::new(rho * phi.cos(), rho * phi.sin(), z))
    }
}

/// χ² over the directions of samples against the density, integrated over each cell by rays: all hits of a ray are
/// points that could have been sampled.
#[test]
fn directions_follow_the_density() {
    const INNER: usize = 24;
    let n = 100_000;
    for (name, traced) in shapes() {
        for from in viewpoints(&traced).into_iter().take(4) {
            let outlook = Outlook::new(&traced, from);
            let mut pcg = Pcg32::new(6, 7);
            let mut counts = [0u32; Outlook::COUNT];
            for _ in 0..n {
                let Some((point, _, _)) = traced.shape.sample_direct(from, uniform(&mut pcg)) else { continue };
                counts[outlook.cell(point.d)] += 1;
            }
            let scale = f64::from(n) * outlook.solid_angle() / Outlook::COUNT as f64;
            let (mut total, mut statistic, mut cells) = (0.0, 0.0, 0.0);
            for (cell, count) in counts.into_iter().enumerate() {
                let (mut sum, mut square) = (0.0, 0.0);
                for i in 0..INNER * INNER {
                    let corner = Vec2::new((i / INNER) as f32, (i % INNER) as f32);
                    let d = outlook.direction(cell, (corner + uniform(&mut pcg)) / INNER as f32);
                    let value = density(&traced, from, d, name) * scale;
                    sum += value;
                    square += value * value;
                }
                let inner = (INNER * INNER) as f64;
                let expected = sum / inner;
                // The error of the quadrature, large at silhouettes, where the density has a pole.
                let variance = (square / inner - expected * expected).max(0.0) / inner;
                total += expected / f64::from(n);
                if expected >= 20.0 {
                    statistic += (f64::from(count) - expected).powi(2) / (expected + variance);
                    cells += 1.0;
                }
            }
            assert!((total - 1.0).abs() < 0.02, "{name} from {from}: the density integrates to {total}");
            let z = normal_quantile(statistic, cells);
            assert!(z < 4.0, "{name} from {from}: {z} standard deviations");
        }
    }
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
            let around = warp::azimuth(point.d.x, point.d.y) / TAU;
            counts[(height * 20.0) as usize * 20 + ((around * 20.0) as usize).min(19)] += 1;
        }
        let expected = f64::from(n) / 400.0;
        let statistic = counts.iter().map(|c| (f64::from(*c) - expected).powi(2) / expected).sum();
        let z = normal_quantile(statistic, 399.0);
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
