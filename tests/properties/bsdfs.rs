//! BSDFs: samples follow their density, weight times density is the value, nothing is negative or not finite, and
//! what claims it is reciprocal.

mod energy;
mod materials;
mod teeth;

use crate::support::{assert_every_plugin_is_configured, assert_none, bsdf, close, failures, plugin_of, uniform};
use lucerna::core::color::Rgb;
use lucerna::core::interfaces::{Arena, Bsdf, Bxdf, Lobes, SurfaceHit, Transport};
use lucerna::core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna::core::sampling::Pcg32;
use lucerna::core::scene::ObjectKind;
use lucerna::core::stats::chi2::{Chi2, SphereGrid, pearson};
use materials::{Material, extreme, materials};
use rayon::prelude::*;

const SAMPLES: usize = 1_000_000;
const GRID: SphereGrid = SphereGrid { rings: 20, spokes: 40 };
const MODES: [Transport; 2] = [Transport::Radiance, Transport::Importance];
/// Of a component of a direction that was computed in a few steps.
const ROUNDING: f32 = 4.0 * f32::EPSILON;
/// cos θi, from straight above to grazing, and from below.
const INCIDENCES: [f32; 6] = [1.0, 0.5, 0.1, 0.01, -0.6, -0.01];

/// A direction of a given cosine with z, at an angle that is in no plane of symmetry.
fn direction(cos_theta: f32) -> Vec3 {
    let sin = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let (s, c) = 0.7f32.sin_cos();
    Vec3::new(sin * c, sin * s, cos_theta)
}

/// Where textures have a slope and colours differ.
fn hit(wi: Vec3) -> SurfaceHit {
    SurfaceHit { wi, uv: Vec2::new(0.31, 0.57), ..SurfaceHit::default() }
}

fn with(bsdf: &dyn Bsdf, wi: Vec3, check: impl FnOnce(&dyn Bxdf)) {
    let arena = Arena::new();
    check(bsdf.resolve(&hit(wi), &arena));
}

fn fine(c: Rgb) -> bool {
    c.is_finite() && c.min_component() >= 0.0
}

#[test]
fn every_bsdf_is_configured() {
    let materials = materials();
    assert_every_plugin_is_configured(ObjectKind::Bsdf, materials.iter().map(|m| plugin_of(&m.xml)));
}

/// Whether samples and densities are the same bits in both modes, as far as can be seen: then one test is of both.
fn modes_agree(bxdf: &dyn Bxdf, wi: Vec3) -> bool {
    let mut pcg = Pcg32::new(3, 4);
    (0..1000).all(|_| {
        let (u1, u2) = (pcg.next_f32(), uniform(&mut pcg));
        let [a, b] = MODES.map(|mode| bxdf.sample(wi, u1, u2, mode).map(|s| (s.wo, s.pdf, s.lobe)));
        let [c, d] = MODES.map(|mode| a.map(|(wo, ..)| bxdf.eval_pdf(wi, wo, mode).1));
        a == b && c == d
    })
}

/// Samples against the density of the smooth lobes; a sample of a delta lobe gives no direction.
fn chi_square(bxdf: &dyn Bxdf, wi: Vec3, mode: Transport, grid: SphereGrid, factor: f32) -> Chi2 {
    let mut pcg = Pcg32::new(0x5eed, 1);
    let sample = || {
        let sample = bxdf.sample(wi, pcg.next_f32(), uniform(&mut pcg), mode)?;
        sample.lobe.is_smooth().then_some(sample.wo)
    };
    grid.test(SAMPLES, sample, |wo| factor * bxdf.eval_pdf(wi, wo, mode).1)
}

#[test]
fn hc_s01_s11_s14_samples_follow_their_density() {
    let materials = materials();
    let mut cases = Vec::new();
    for material in &materials {
        let bsdf = bsdf(&material.xml);
        for cos_theta in INCIDENCES {
            if !material.is_exact(direction(cos_theta)) {
                continue;
            }
            let wi = direction(cos_theta);
            with(&*bsdf, wi, |bxdf| {
                let modes = if modes_agree(bxdf, wi) { &MODES[..1] } else { &MODES };
                cases.extend(modes.iter().map(|mode| (material, cos_theta, *mode)));
            });
        }
    }
    let describe = |(material, cos_theta, mode): &(&Material, f32, Transport)| {
        format!("{} at {cos_theta}, {mode:?}", material.xml)
    };
    assert_none(&failures(&cases, describe, |(material, cos_theta, mode)| {
        let (bsdf, arena, wi) = (bsdf(&material.xml), Arena::new(), direction(*cos_theta));
        chi_square(bsdf.resolve(&hit(wi), &arena), wi, *mode, material.grid, material.density_factor(wi))
    }));
}

/// Delta lobes have no density; what they give instead is the probability they are chosen with. `blendbsdf` adds to it
/// the density of its other material, as its manual tells.
#[test]
fn delta_lobes_come_as_often_as_told() {
    let n = 100_000;
    let materials = materials();
    let cases: Vec<_> = materials
        .iter()
        .filter(|m| plugin_of(&m.xml) != "blendbsdf")
        .flat_map(|m| INCIDENCES.map(|cos_theta| (m, cos_theta)))
        .collect();
    assert_none(&failures(
        &cases,
        |(m, cos_theta)| format!("{} at {cos_theta}", m.xml),
        |(material, cos_theta)| {
            let (bsdf, arena, wi) = (bsdf(&material.xml), Arena::new(), direction(*cos_theta));
            let bxdf = bsdf.resolve(&hit(wi), &arena);
            let mut pcg = Pcg32::new(0xde17a, 1);
            let mut lobes: Vec<(Lobes, f32, u64)> = Vec::new();
            for sample in (0..n).filter_map(|_| bxdf.sample(wi, pcg.next_f32(), uniform(&mut pcg), MODES[0])) {
                match lobes.iter_mut().find(|(lobe, ..)| *lobe == sample.lobe) {
                    Some((_, _, count)) => *count += 1,
                    None if !sample.lobe.is_smooth() => lobes.push((sample.lobe, sample.pdf, 1)),
                    None => {}
                }
            }
            let (mut counts, mut expected): (Vec<u64>, Vec<f64>) =
                lobes.iter().map(|(_, pdf, count)| (*count, f64::from(*pdf) * n as f64)).unzip();
            counts.push(n - counts.iter().sum::<u64>());
            expected.push((n as f64 - expected.iter().sum::<f64>()).max(0.0));
            pearson(&counts, &expected)
        },
    ));
}

/// Weight times density is the value, and the density that of the direction given, to 10⁻⁴. A direction is rounded to
/// single precision after it was sampled: where that alone changes the value or the density by more, as at grazing
/// incidence, where the half vector is a difference of nearly opposite directions, so much is granted.
fn disagreement(bxdf: &dyn Bxdf, wi: Vec3, seed: u64) -> Option<String> {
    let mut pcg = Pcg32::new(seed, 1);
    for i in 0..2000 {
        let mode = MODES[i % 2];
        let Some(s) = bxdf.sample(wi, pcg.next_f32(), uniform(&mut pcg), mode) else { continue };
        if !(s.pdf > 0.0 && (s.wo.length() - 1.0).abs() < 1e-4 && fine(s.weight)) {
            return Some(format!("{s:?}"));
        }
        if !s.lobe.is_smooth() {
            continue;
        }
        let asked = |wo| {
            let (value, pdf) = bxdf.eval_pdf(wi, wo, mode);
            [value.r, value.g, value.b, pdf]
        };
        let sampled = [s.weight.r, s.weight.g, s.weight.b, 1.0].map(|v| v * s.pdf);
        let there = asked(s.wo);
        if (0..4).all(|i| close(sampled[i], there[i], 1e-4)) {
            continue;
        }
        let mut granted = [0.0f32; 4];
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let [up, down] = [1.0, -1.0].map(|sign| asked(s.wo + axis * (sign * ROUNDING)));
            for i in 0..4 {
                granted[i] += (up[i] - there[i]).abs().max((down[i] - there[i]).abs());
            }
        }
        if (0..4).any(|i| (sampled[i] - there[i]).abs() > 1e-4 * sampled[i].max(there[i]) + granted[i]) {
            return Some(format!("{mode:?} {s:?}: {sampled:?}, {there:?}, granted {granted:?}"));
        }
    }
    None
}

#[test]
fn hc_s02_weight_times_density_is_the_value() {
    let failures: Vec<String> = materials()
        .par_iter()
        .flat_map_iter(|material| {
            let bsdf = bsdf(&material.xml);
            let found = INCIDENCES.into_iter().filter_map(move |cos_theta| {
                let (arena, wi) = (Arena::new(), direction(cos_theta));
                let found = disagreement(bsdf.resolve(&hit(wi), &arena), wi, 3);
                found.map(|found| format!("{} at {cos_theta}: {found}", material.xml))
            });
            let found: Vec<String> = found.collect();
            match material.is_weighed_as_the_reference() {
                true if found.is_empty() => vec![format!("{} agrees: take it off the list", material.xml)],
                true => Vec::new(),
                false => found,
            }
        })
        .collect();
    assert_none(&failures);
}

/// Nothing negative, infinite or NaN where random numbers, incidences and directions are at their ends.
#[test]
fn hc_s06_s08_extreme_inputs_stay_finite() {
    let subjects: Vec<String> = materials().into_iter().map(|m| m.xml).chain(extreme()).collect();
    let failures: Vec<String> = subjects
        .par_iter()
        .flat_map_iter(|xml| {
            let bsdf = bsdf(xml);
            let ends = [1.0, 0.5, 1e-3, 1e-8, f32::MIN_POSITIVE, 0.0, -0.0, -1e-8, -0.5, -1.0];
            ends.into_iter().filter_map(move |cos_theta| {
                let (arena, wi) = (Arena::new(), direction(cos_theta));
                let found = first_extreme(bsdf.resolve(&hit(wi), &arena), wi);
                found.map(|found| format!("{xml} at {cos_theta}: {found}"))
            })
        })
        .collect();
    assert_none(&failures);
}

fn first_extreme(bxdf: &dyn Bxdf, wi: Vec3) -> Option<String> {
    let edge = [0.0, f32::MIN_POSITIVE, 1e-7, 0.25, 0.5, 0.75, ONE_MINUS_EPSILON];
    if !(fine(bxdf.albedo(wi)) && (0.0..=1.0).contains(&bxdf.roughness())) {
        return Some(format!("albedo {:?}, roughness {}", bxdf.albedo(wi), bxdf.roughness()));
    }
    for (u1, u2) in edge.iter().flat_map(|u| edge.iter().flat_map(|x| edge.map(|y| (*u, Vec2::new(*x, y))))) {
        for mode in MODES {
            let Some(s) = bxdf.sample(wi, u1, u2, mode) else { continue };
            let is_fine = fine(s.weight) && s.wo.is_finite() && s.pdf > 0.0 && s.pdf.is_finite();
            if !(is_fine && s.eta > 0.0 && s.eta.is_finite()) {
                return Some(format!("{u1} {u2}: {s:?}"));
            }
        }
    }
    for cos_o in [1.0, 1e-8, 0.0, -1e-8, -1.0, wi.z, -wi.z] {
        for wo in [direction(cos_o), -direction(-cos_o), Vec3::new(-wi.x, -wi.y, wi.z), -wi] {
            for mode in MODES {
                let (value, pdf) = bxdf.eval_pdf(wi, wo, mode);
                if !(fine(value) && pdf >= 0.0 && pdf.is_finite()) {
                    return Some(format!("to {wo}: {value:?} {pdf}"));
                }
            }
        }
    }
    None
}

/// They turn normals and darken by a shadowing function that knows one of the two directions only.
const NOT_RECIPROCAL: [&str; 2] = ["normalmap", "bumpmap"];

/// The largest relative difference of f(wi, wo) and f*(wo, wi), where radiance one way is importance the other, and in
/// how many pairs of directions there was light. What the rounding of a direction changes is granted: near the critical
/// angle little is left of the digits of what passes.
fn asymmetry(bxdf: &dyn Bxdf) -> (f32, usize) {
    let mut pcg = Pcg32::new(11, 1);
    let (mut worst, mut lit) = (0.0f32, 0);
    for _ in 0..10_000 {
        let mut sphere = || lucerna::core::sampling::warp::square_to_sphere(uniform(&mut pcg));
        let (wi, wo) = (sphere(), sphere());
        if wi.z.abs() < 0.01 || wo.z.abs() < 0.01 {
            continue;
        }
        let value = |wi: Vec3, wo: Vec3, mode| (bxdf.eval_pdf(wi, wo, mode).0 / wo.z.abs()).to_array();
        let there = value(wi, wo, Transport::Radiance);
        let back = value(wo, wi, Transport::Importance);
        let apart = |a: [f32; 3], b: [f32; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max);
        let scale = there.into_iter().chain(back).fold(1e-3, f32::max);
        let mut difference = apart(there, back);
        if difference > 1e-3 * scale {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                let step = axis * ROUNDING;
                difference -= apart(there, value(wi + step, wo, Transport::Radiance));
                difference -= apart(back, value(wo + step, wi, Transport::Importance));
            }
        }
        worst = worst.max(difference / scale);
        lit += usize::from(there != [0.0; 3]);
    }
    (worst, lit)
}

#[test]
fn hc_s03_reciprocity() {
    for material in materials() {
        let (bsdf, plugin) = (bsdf(&material.xml), plugin_of(&material.xml).to_owned());
        with(&*bsdf, Vec3::Z, |bxdf| {
            let (worst, lit) = asymmetry(bxdf);
            if NOT_RECIPROCAL.contains(&&*plugin) {
                assert!(worst > 1e-2, "{} is reciprocal: take it off the list", material.xml);
            } else {
                assert!(worst <= 1e-3, "{}: {worst}", material.xml);
                assert!(lit > 10 || !bxdf.lobes().is_smooth(), "{}: {lit}", material.xml);
            }
        });
    }
}
