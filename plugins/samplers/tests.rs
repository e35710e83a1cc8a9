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
