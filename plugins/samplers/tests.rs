use super::*;
use crate::testing::Draft;
use lucerna_core::interfaces::Sampler;
use lucerna_core::math::Vec2;
use lucerna_core::sampling::{PointSet, Stream};
use lucerna_core::scene::{Object, ObjectKind};
use std::sync::Arc;

const STRUCTURED: [&str; 5] = ["sobol", "ldsampler", "stratified", "multijitter", "orthogonal"];
const FILM: UVec2 = UVec2::new(64, 64);

fn sampler(draft: &Draft) -> Arc<dyn Sampler> {
    match draft.build() {
        Ok(Object::Sampler(sampler)) => sampler,
        Ok(_) => panic!("not a sampler"),
        Err(errors) => panic!("{errors}"),
    }
}

fn points(plugin: &str, count: u32) -> (Box<dyn PointSet>, u32) {
    let sampler = sampler(&Draft::new(ObjectKind::Sampler, plugin).int("sample_count", count.into()));
    let spp = sampler.round_spp(count);
    assert_eq!(spp, sampler.sample_count());
    (sampler.point_set(7, spp, FILM).expect("structured"), spp)
}

fn pair(points: &dyn PointSet, pixel: UVec2, sample: u32, dimension: u32) -> Vec2 {
    let mut out = [Vec2::ZERO];
    points.pairs(pixel, sample, dimension, &mut out);
    out[0]
}

fn single(points: &dyn PointSet, pixel: UVec2, sample: u32, dimension: u32) -> f32 {
    let mut out = [0.0];
    points.singles(pixel, sample, dimension, &mut out);
    out[0]
}

/// Whether `values` fall into as many different strata.
fn one_in_each(values: impl Iterator<Item = f32>, strata: u32) -> bool {
    let mut hit = vec![false; strata as usize];
    let mut count = 0;
    for v in values {
        count += 1;
        if std::mem::replace(&mut hit[(v * strata as f32) as usize], true) {
            return false;
        }
    }
    count == strata
}

#[test]
fn hc_x04_counts_are_rounded_as_documented() {
    let rounded = |plugin: &str, count: i64| {
        sampler(&Draft::new(ObjectKind::Sampler, plugin).int("sample_count", count)).sample_count()
    };
    let expected = [
        ("independent", 7, 7),
        ("sobol", 7, 7),
        ("stratified", 17, 25),
        ("multijitter", 17, 20),
        ("multijitter", 64, 64),
        ("orthogonal", 26, 49),
        ("orthogonal", 4, 4),
        ("ldsampler", 1, 4),
        ("ldsampler", 17, 64),
    ];
    for (plugin, asked, given) in expected {
        assert_eq!(rounded(plugin, asked), given, "{plugin} {asked}");
    }
    for plugin in STRUCTURED {
        let sampler = sampler(&Draft::new(ObjectKind::Sampler, plugin).int("sample_count", u32::MAX.into()));
        assert_eq!(sampler.round_spp(sampler.sample_count()), sampler.sample_count(), "{plugin}");
    }
    assert!(Draft::new(ObjectKind::Sampler, "sobol").int("sample_count", 0).errors().contains("sample_count"));
}

#[test]
fn each_dimension_alone_is_stratified() {
    for (plugin, count) in STRUCTURED.map(|p| (p, if p == "orthogonal" { 49 } else { 64 })) {
        let (points, spp) = points(plugin, count);
        assert_eq!(spp, count);
        for dimension in [0, 1, 2, 9, 1000] {
            let pixel = UVec2::new(3, 11);
            let singles = (0..spp).map(|s| single(&*points, pixel, s, dimension));
            assert!(one_in_each(singles, spp), "{plugin}, single {dimension}");
            if plugin != "stratified" {
                let x = (0..spp).map(|s| pair(&*points, pixel, s, dimension).x);
                assert!(one_in_each(x, spp), "{plugin}, x of pair {dimension}");
                let y = (0..spp).map(|s| pair(&*points, pixel, s, dimension).y);
                assert!(one_in_each(y, spp), "{plugin}, y of pair {dimension}");
            }
        }
    }
}

#[test]
fn each_pair_is_stratified_on_a_grid() {
    for (plugin, side) in STRUCTURED.map(|p| (p, if p == "orthogonal" { 7 } else { 8 })) {
        let (points, spp) = points(plugin, side * side);
        for dimension in [0, 1, 2, 9, 1000] {
            let cells = (0..spp).map(|s| {
                let p = pair(&*points, UVec2::new(5, 1), s, dimension) * side as f32;
                (p.x.floor() + side as f32 * p.y.floor() + 0.5) / spp as f32
            });
            assert!(one_in_each(cells, spp), "{plugin}, pair {dimension}");
        }
    }
}

#[test]
fn an_orthogonal_array_is_stratified_across_dimensions() {
    let (points, spp) = points("orthogonal", 49);
    let pixel = UVec2::new(9, 9);
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let cells = (0..spp).map(|s| {
            let (x, y) = (pair(&*points, pixel, s, a).x, pair(&*points, pixel, s, b).y);
            ((x * 7.0).floor() + 7.0 * (y * 7.0).floor() + 0.5) / spp as f32
        });
        assert!(one_in_each(cells, spp), "x of {a} against y of {b}");
    }
    let draft = Draft::new(ObjectKind::Sampler, "orthogonal").int("strength", 3).int("sample_count", 125);
    let points = sampler(&draft).point_set(1, 125, FILM).expect("structured");
    let cells = (0..125).map(|s| {
        let level = |d| (single(&*points, pixel, s, d) * 5.0).floor();
        (level(0) + 5.0 * level(1) + 25.0 * level(3) + 0.5) / 125.0
    });
    assert!(one_in_each(cells, 125));
}

/// Star discrepancy over a grid of corners.
fn discrepancy(points: &[Vec2]) -> f32 {
    let mut worst = 0.0f32;
    for i in 1..=32 {
        for j in 1..=32 {
            let corner = Vec2::new(i as f32, j as f32) / 32.0;
            let inside = points.iter().filter(|p| p.cmplt(corner).all()).count() as f32;
            worst = worst.max((inside / points.len() as f32 - corner.x * corner.y).abs());
        }
    }
    worst
}

#[test]
fn discrepancy_is_low() {
    for (plugin, bound) in
        [("sobol", 0.01), ("ldsampler", 0.01), ("multijitter", 0.015), ("orthogonal", 0.03), ("stratified", 0.03)]
    {
        let (points, spp) = points(plugin, 1024);
        let set: Vec<Vec2> = (0..spp).map(|s| pair(&*points, UVec2::new(2, 3), s, 4)).collect();
        let found = discrepancy(&set);
        assert!(found < bound, "{plugin}: {found}");
    }
    // Any number of points, not only a power of two, is far better than chance (about 0.04 here).
    let (points, _) = points("sobol", 700);
    let set: Vec<Vec2> = (0..700).map(|s| pair(&*points, UVec2::new(2, 3), s, 4)).collect();
    assert!(discrepancy(&set) < 0.015);
}

fn correlation(pairs: impl Iterator<Item = (f32, f32)>) -> (f64, f64) {
    let (mut n, mut sum) = (0.0, [0.0; 5]);
    for (a, b) in pairs.map(|(a, b)| (f64::from(a), f64::from(b))) {
        n += 1.0;
        for (s, v) in sum.iter_mut().zip([a, b, a * a, b * b, a * b]) {
            *s += v;
        }
    }
    let [a, b, aa, bb, ab] = sum.map(|s| s / n);
    ((ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt(), n)
}

#[test]
fn neighbours_are_independent() {
    for plugin in STRUCTURED {
        let (points, _) = points(plugin, 16);
        let points = &*points;
        let pixels = (0..64).flat_map(|y| (0..64).map(move |x| UVec2::new(x, y)));
        let check = |name: &str, f: &dyn Fn(UVec2) -> (f32, f32)| {
            let (found, n) = correlation(pixels.clone().map(f));
            assert!(found.abs() < 4.0 / n.sqrt(), "{plugin}, {name}: {found}");
        };
        let right = UVec2::new(1, 0);
        check("pixels", &|p| (single(points, p, 0, 0), single(points, p + right, 0, 0)));
        check("pairs of pixels", &|p| (pair(points, p, 3, 1).x, pair(points, p + UVec2::new(0, 1), 3, 1).x));
        check("x and y", &|p| (pair(points, p, 0, 0).x, pair(points, p, 0, 0).y));
        check("singles", &|p| (single(points, p, 5, 0), single(points, p, 5, 1)));
        check("pairs", &|p| (pair(points, p, 5, 2).x, pair(points, p, 5, 3).x));
        check("singles and pairs", &|p| (single(points, p, 5, 2), pair(points, p, 5, 2).x));
    }
}

/// Within one pixel no dimension may follow from another.
#[test]
fn dimensions_of_a_pixel_are_independent() {
    for plugin in STRUCTURED {
        let (points, spp) = points(plugin, 4096);
        let points = &*points;
        let pixel = UVec2::new(17, 23);
        for (a, b) in [(0, 1), (1, 2), (0, 7), (3, 40)] {
            let (found, n) = correlation((0..spp).map(|s| (single(points, pixel, s, a), single(points, pixel, s, b))));
            assert!(found.abs() < 4.0 / n.sqrt(), "{plugin}, singles {a} and {b}: {found}");
            let (found, n) = correlation((0..spp).map(|s| (pair(points, pixel, s, a).x, pair(points, pixel, s, b).y)));
            assert!(found.abs() < 4.0 / n.sqrt(), "{plugin}, pairs {a} and {b}: {found}");
        }
    }
}

#[test]
fn the_mean_is_one_half() {
    for plugin in STRUCTURED {
        let (points, _) = points(plugin, 4);
        // One sample of each of many pixels: independent, so within 4 standard deviations of 1/2.
        let n = 20_000u32;
        let bound = 4.0 / (12.0 * f64::from(n)).sqrt();
        for sample in [0, 3] {
            let pixel = |i: u32| UVec2::new(i % 200, i / 200);
            let mean = |f: &dyn Fn(u32) -> f32| (0..n).map(|i| f64::from(f(i))).sum::<f64>() / f64::from(n);
            let singles = mean(&|i| single(&*points, pixel(i), sample, 1));
            let (x, y) =
                (mean(&|i| pair(&*points, pixel(i), sample, 1).x), mean(&|i| pair(&*points, pixel(i), sample, 1).y));
            for found in [singles, x, y] {
                assert!((found - 0.5).abs() < bound, "{plugin}, sample {sample}: {found}");
            }
        }
    }
}

#[test]
fn hc_x05_the_last_sample_and_dimension_work() {
    for plugin in STRUCTURED {
        let (points, _) = points(plugin, 64);
        let pixel = UVec2::new(65535, 65535);
        let mut seen = std::collections::HashSet::new();
        for sample in [0, 1, u32::MAX - 1, u32::MAX] {
            for dimension in [0, 1000, u32::MAX - 8] {
                let p = pair(&*points, pixel, sample, dimension / 2);
                let u = single(&*points, pixel, sample, dimension);
                assert!(p.min_element() >= 0.0 && p.max_element() < 1.0 && (0.0..1.0).contains(&u), "{plugin}");
                seen.insert((p.x.to_bits(), p.y.to_bits(), u.to_bits()));
            }
        }
        assert_eq!(seen.len(), 12, "{plugin} repeats itself");
    }
}

#[test]
fn a_block_is_what_its_parts_are() {
    for plugin in STRUCTURED {
        let (points, _) = points(plugin, 16);
        let pixel = UVec2::new(4, 2);
        let mut stream = Stream::structured(&*points, pixel, 9);
        for dimension in 0..20 {
            assert_eq!(stream.next_1d(), single(&*points, pixel, 9, dimension), "{plugin}");
            assert_eq!(stream.next_2d(), pair(&*points, pixel, 9, dimension), "{plugin}");
        }
    }
}

#[test]
fn without_jitter_points_are_centres() {
    for plugin in ["stratified", "multijitter", "orthogonal"] {
        let draft = Draft::new(ObjectKind::Sampler, plugin).int("sample_count", 49).bool("jitter", false);
        let points = sampler(&draft).point_set(0, 49, FILM).expect("structured");
        let u = single(&*points, UVec2::ZERO, 5, 3) * 49.0;
        assert!((u.fract() - 0.5).abs() < 1e-4, "{plugin}: {u}");
    }
}

#[test]
fn seeds_give_other_numbers() {
    for plugin in STRUCTURED {
        let sampler = sampler(&Draft::new(ObjectKind::Sampler, plugin).int("sample_count", 16));
        let [a, b] = [1, 2].map(|seed| sampler.point_set(seed, 16, FILM).expect("structured"));
        let differ = (0..16).filter(|s| pair(&*a, UVec2::ONE, *s, 0) != pair(&*b, UVec2::ONE, *s, 0)).count();
        assert!(differ > 12, "{plugin}");
    }
}
