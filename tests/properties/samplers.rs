//! Samplers: uniform numbers, independent between pixels and dimensions, stratified as claimed, and none repeated.

use crate::support::{
    assert_every_plugin_is_configured, assert_found, assert_none, failures, part, plugin_of, sampler, uniform_over,
};
use lucerna::core::interfaces::{Sampler, mix, stream};
use lucerna::core::math::{UVec2, Vec2};
use lucerna::core::sampling::{PointSet, Stream};
use lucerna::core::scene::ObjectKind;
use lucerna::core::stats::chi2::{Chi2, sidak};
use std::collections::HashSet;
use std::sync::Arc;

const SEED: u32 = 7;
const FILM: UVec2 = UVec2::new(256, 256);

/// What a sampler claims of the points of one pixel and dimension.
#[derive(Clone, Copy)]
struct Claim {
    plugin: &'static str,
    /// Samples per pixel at which it does all it claims: a square, or that of a prime.
    spp: u32,
    /// One single in each of so many strata as there are samples.
    singles: bool,
    /// The same for both coordinates of a pair.
    axes: bool,
    /// One pair in each cell of a square grid.
    cells: bool,
    /// Largest mean squared L2 star discrepancy of 1024 or so pairs, as a part of that of random points.
    discrepancy: f64,
}

/// The table. Of n points in cells, the error of a box is made in the √n or so cells that its border crosses, and
/// the squared discrepancy is of order n^-3/2 against n^-1 of random points; points stratified in all elementary
/// intervals do better still.
const CLAIMS: [Claim; 6] = [
    Claim { plugin: "independent", spp: 64, singles: false, axes: false, cells: false, discrepancy: 1.3 },
    Claim { plugin: "stratified", spp: 64, singles: true, axes: false, cells: true, discrepancy: 0.1 },
    Claim { plugin: "multijitter", spp: 64, singles: true, axes: true, cells: true, discrepancy: 0.1 },
    Claim { plugin: "orthogonal", spp: 49, singles: true, axes: true, cells: true, discrepancy: 0.1 },
    Claim { plugin: "ldsampler", spp: 64, singles: true, axes: true, cells: true, discrepancy: 0.01 },
    Claim { plugin: "sobol", spp: 64, singles: true, axes: true, cells: true, discrepancy: 0.01 },
];

#[test]
fn every_sampler_is_configured() {
    let xml: Vec<String> = CLAIMS.iter().map(|claim| source(claim.plugin, claim.spp)).collect();
    assert_every_plugin_is_configured(ObjectKind::Sampler, xml.iter().map(|xml| plugin_of(xml)));
}

fn source(plugin: &str, spp: u32) -> String {
    format!("<sampler type='{plugin}'><integer name='sample_count' value='{spp}'/></sampler>")
}

/// Any number of any sample.
trait Numbers: Sync {
    fn stream(&self, pixel: UVec2, sample: u32) -> Stream<'_>;

    fn single(&self, pixel: UVec2, sample: u32, dimension: u32) -> f32 {
        let mut stream = self.stream(pixel, sample);
        (0..dimension).for_each(|_| _ = stream.next_1d());
        stream.next_1d()
    }

    fn pair(&self, pixel: UVec2, sample: u32, dimension: u32) -> Vec2 {
        let mut stream = self.stream(pixel, sample);
        (0..dimension).for_each(|_| _ = stream.next_2d());
        stream.next_2d()
    }
}

/// Those of a plugin.
struct Run {
    points: Option<Box<dyn PointSet>>,
    seed: u32,
    spp: u32,
}

impl Run {
    fn new(plugin: &str, spp: u32, seed: u32) -> Self {
        let sampler: Arc<dyn Sampler> = sampler(&source(plugin, spp));
        let rounded = sampler.round_spp(spp);
        assert_eq!(rounded, sampler.sample_count(), "{plugin}");
        Run { points: sampler.point_set(seed, rounded, FILM), seed, spp: rounded }
    }
}

impl Numbers for Run {
    fn stream(&self, pixel: UVec2, sample: u32) -> Stream<'_> {
        stream(self.points.as_deref(), self.seed, pixel, sample)
    }
}

/// A number of a sample: a single or a coordinate of a pair, and its dimension.
#[derive(Clone, Copy, Debug)]
enum Which {
    Single(u32),
    X(u32),
    Y(u32),
}

impl Which {
    fn of(self, numbers: &dyn Numbers, pixel: UVec2, sample: u32) -> f32 {
        match self {
            Which::Single(dimension) => numbers.single(pixel, sample, dimension),
            Which::X(dimension) => numbers.pair(pixel, sample, dimension).x,
            Which::Y(dimension) => numbers.pair(pixel, sample, dimension).y,
        }
    }
}

fn pixels(step: u32) -> impl Iterator<Item = UVec2> {
    (0..FILM.y).flat_map(move |y| (0..FILM.x / step).map(move |x| UVec2::new(step * x, y)))
}

/// One sample of each of many pixels, over 64 cells; its mean is a half, then.
fn uniformity(numbers: &dyn Numbers, which: Which, sample: u32) -> Chi2 {
    uniform_over(64, pixels(1).map(|pixel| part(which.of(numbers, pixel, sample), 64)))
}

#[test]
fn numbers_are_uniform() {
    let kinds = [Which::Single(0), Which::Single(9), Which::X(0), Which::Y(0), Which::X(4), Which::Y(4)];
    let runs = CLAIMS.map(|claim| (claim.plugin, Run::new(claim.plugin, 16, SEED)));
    let mut cases = Vec::new();
    for run in &runs {
        cases.extend([0, 3].iter().flat_map(|sample| kinds.map(|which| (run, which, *sample))));
    }
    let describe = |((plugin, _), which, sample): &(&(&str, Run), Which, u32)| format!("{plugin} {which:?} {sample}");
    assert_none(&failures(&cases, describe, |((_, run), which, sample)| uniformity(run, *which, *sample)));
}

/// Two numbers that have nothing to do with each other fall into 8 × 8 cells evenly.
#[derive(Clone, Copy, Debug)]
enum Pairing {
    /// Of the same dimension in a pixel and the next, or the one below.
    Pixels(Which, UVec2),
    /// Of two dimensions in one pixel, over the pixels.
    Dimensions(Which, Which),
    /// Of two samples of one pixel, over the pixels, of two dimensions.
    Samples(Which, Which),
    /// Of two dimensions in one pixel, over the samples.
    Within(Which, Which),
}

const PAIRINGS: [Pairing; 16] = [
    Pairing::Pixels(Which::Single(0), UVec2::X),
    Pairing::Pixels(Which::X(1), UVec2::X),
    Pairing::Pixels(Which::X(1), UVec2::Y),
    Pairing::Pixels(Which::Y(3), UVec2::new(1, 64)),
    Pairing::Dimensions(Which::X(0), Which::Y(0)),
    Pairing::Dimensions(Which::Single(0), Which::Single(1)),
    Pairing::Dimensions(Which::X(2), Which::X(3)),
    Pairing::Dimensions(Which::Single(2), Which::X(2)),
    Pairing::Dimensions(Which::Single(0), Which::Single(8)),
    Pairing::Dimensions(Which::X(0), Which::X(8)),
    Pairing::Samples(Which::Single(0), Which::Single(5)),
    Pairing::Samples(Which::X(1), Which::Y(2)),
    Pairing::Within(Which::Single(0), Which::Single(1)),
    Pairing::Within(Which::Single(3), Which::X(40)),
    Pairing::Within(Which::X(0), Which::Y(1)),
    Pairing::Within(Which::X(3), Which::X(4)),
];

/// What is stratified falls more evenly than chance, which is no failure.
fn independence(numbers: &dyn Numbers, spp: u32, pairing: Pairing) -> Chi2 {
    let cell = |a: f32, b: f32| part(a, 8) + 8 * part(b, 8);
    let over_pixels = |f: &dyn Fn(UVec2) -> usize| uniform_over(64, pixels(2).map(f));
    match pairing {
        Pairing::Pixels(which, step) => over_pixels(&|p| cell(which.of(numbers, p, 0), which.of(numbers, p + step, 0))),
        Pairing::Dimensions(a, b) => over_pixels(&|p| cell(a.of(numbers, p, 5), b.of(numbers, p, 5))),
        Pairing::Samples(a, b) => over_pixels(&|p| cell(a.of(numbers, p, 1), b.of(numbers, p, 2))),
        Pairing::Within(a, b) => {
            let pixel = UVec2::new(17, 23);
            uniform_over(64, (0..spp).map(|s| cell(a.of(numbers, pixel, s), b.of(numbers, pixel, s))))
        }
    }
}

#[test]
fn pixels_dimensions_and_samples_are_independent() {
    let runs = CLAIMS.map(|claim| (claim.plugin, Run::new(claim.plugin, 16, SEED), Run::new(claim.plugin, 4096, SEED)));
    let mut cases = Vec::new();
    for (plugin, few, many) in &runs {
        cases.extend(
            PAIRINGS.map(|pairing| (plugin, if matches!(pairing, Pairing::Within(..)) { many } else { few }, pairing)),
        );
    }
    let describe = |(plugin, _, pairing): &(&&str, &Run, Pairing)| format!("{plugin} {pairing:?}");
    assert_none(&failures(&cases, describe, |(_, run, pairing)| independence(*run, run.spp, *pairing)));
}

/// Whether each of so many strata is hit once.
fn one_in_each(strata: u32, values: impl Iterator<Item = usize>) -> bool {
    let mut hits = vec![0; strata as usize];
    values.for_each(|stratum| hits[stratum] += 1);
    hits.iter().all(|count| *count == 1)
}

/// The first claim about strata that does not hold.
fn broken_claim(numbers: &dyn Numbers, claim: &Claim) -> Option<String> {
    let (n, side) = (claim.spp as usize, f64::from(claim.spp).sqrt() as usize);
    for (dimension, pixel) in [0, 1, 2, 9, 100].iter().flat_map(|d| [(d, UVec2::new(3, 11)), (d, UVec2::new(200, 7))]) {
        let pairs: Vec<Vec2> = (0..claim.spp).map(|s| numbers.pair(pixel, s, *dimension)).collect();
        let singles = (0..claim.spp).map(|s| part(numbers.single(pixel, s, *dimension), n));
        let cells = pairs.iter().map(|p| part(p.x, side) + side * part(p.y, side));
        let [x, y] = [0, 1].map(|axis| one_in_each(claim.spp, pairs.iter().map(|p| part(p[axis], n))));
        if claim.singles && !one_in_each(claim.spp, singles) {
            return Some(format!("singles {dimension}"));
        }
        if claim.axes && !(x && y) {
            return Some(format!("axes of {dimension}"));
        }
        if claim.cells && !one_in_each(claim.spp, cells) {
            return Some(format!("cells of {dimension}"));
        }
    }
    None
}

#[test]
fn points_are_stratified_as_claimed() {
    for claim in CLAIMS {
        let run = Run::new(claim.plugin, claim.spp, SEED);
        assert_eq!(run.spp, claim.spp, "{}", claim.plugin);
        assert_eq!(broken_claim(&run, &claim), None, "{}", claim.plugin);
    }
}

/// Mean squared L2 star discrepancy (Warnock 1972) of pairs over some pixels and dimensions, as a part of that expected
/// of as many random points, (2⁻² − 3⁻²) / n.
fn discrepancy(numbers: &dyn Numbers, spp: u32) -> f64 {
    let n = f64::from(spp);
    let one = |pixel: UVec2, dimension: u32| {
        let points: Vec<[f64; 2]> =
            (0..spp).map(|s| numbers.pair(pixel, s, dimension).to_array().map(f64::from)).collect();
        let single: f64 = points.iter().map(|[x, y]| (1.0 - x * x) * (1.0 - y * y)).sum();
        let double: f64 = points
            .iter()
            .flat_map(|a| points.iter().map(move |b| (1.0 - a[0].max(b[0])) * (1.0 - a[1].max(b[1]))))
            .sum();
        1.0 / 9.0 - single / (2.0 * n) + double / (n * n)
    };
    let places = [(3, 5, 0), (100, 7, 1), (2, 200, 4), (33, 33, 0), (250, 1, 2), (0, 0, 0), (64, 128, 7), (9, 9, 30)];
    let sum: f64 = places.iter().map(|(x, y, dimension)| one(UVec2::new(*x, *y), *dimension)).sum();
    sum / places.len() as f64 * n / (1.0 / 4.0 - 1.0 / 9.0)
}

#[test]
fn discrepancy_is_as_claimed() {
    for claim in CLAIMS {
        let run = Run::new(claim.plugin, 1024, SEED);
        let found = discrepancy(&run, run.spp);
        println!("{}: {found}", claim.plugin);
        assert!(found <= claim.discrepancy, "{}: {found}", claim.plugin);
    }
    // Any number of points of a sequence, not only a power of two.
    let run = Run::new("sobol", 700, SEED);
    assert!(discrepancy(&run, 700) < 0.1);
}

#[test]
fn hc_x05_the_last_sample_and_dimension_work() {
    for claim in CLAIMS {
        let run = Run::new(claim.plugin, claim.spp, SEED);
        let mut seen = HashSet::new();
        let samples = [0, 1, 2, claim.spp - 1, claim.spp, 1 << 24, 1 << 31, u32::MAX - 1, u32::MAX];
        let pixels = [UVec2::ZERO, UVec2::new(65535, 65535)];
        for (sample, pixel) in samples.iter().flat_map(|sample| pixels.map(|pixel| (*sample, pixel))) {
            let mut stream = run.stream(pixel, sample);
            for _ in 0..1000 {
                let (u, p) = (stream.next_1d(), stream.next_2d());
                let inside = |v: f32| (0.0..1.0).contains(&v);
                assert!(inside(u) && inside(p.x) && inside(p.y), "{} {sample}: {u} {p}", claim.plugin);
                seen.insert([u, p.x, p.y].map(f32::to_bits));
            }
        }
        assert_eq!(seen.len(), samples.len() * pixels.len() * 1000, "{} repeats itself", claim.plugin);
        let Some(points) = &run.points else { continue };
        let (mut single, mut pair) = ([0.0; 2], [Vec2::ZERO; 2]);
        points.singles(pixels[1], u32::MAX, u32::MAX - 8, &mut single);
        points.pairs(pixels[1], u32::MAX, u32::MAX - 8, &mut pair);
        assert!(single[0] != single[1] && pair[0] != pair[1], "{}", claim.plugin);
    }
}

/// Samplers that say so, and no others, begin a long run with the numbers of a short one.
#[test]
fn sequences_begin_alike() {
    for claim in &CLAIMS {
        let [short, long] = [claim.spp, 4 * claim.spp].map(|spp| Run::new(claim.plugin, spp, SEED));
        let numbers = |run: &Run| {
            let samples = (0..claim.spp).flat_map(|sample| {
                let pixel = UVec2::new(3, 9);
                (0..4).map(move |i| (run.single(pixel, sample, i), run.pair(pixel, sample, i)))
            });
            samples.collect::<Vec<_>>()
        };
        let is_sequence = sampler(&source(claim.plugin, claim.spp)).is_sequence();
        assert_eq!(numbers(&short) == numbers(&long), is_sequence, "{}", claim.plugin);
    }
}

#[test]
fn seeds_give_other_numbers() {
    for claim in CLAIMS {
        let [a, b] = [1, 2].map(|seed| Run::new(claim.plugin, claim.spp, seed));
        let other = |pixel| (0..claim.spp).filter(|s| a.pair(pixel, *s, 0) != b.pair(pixel, *s, 0)).count();
        assert!(other(UVec2::ONE) as u32 > claim.spp - 4, "{}", claim.plugin);
    }
}

/// The numbers of a right sampler, made wrong in one way.
struct Wrong {
    right: Run,
    error: Error,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Error {
    None,
    /// All pixels of a row have the same numbers.
    SamePixels,
    /// Dimensions repeat after four.
    SameDimensions,
    /// Samples come in the same strata in every pixel.
    Numbered,
    /// 2 % of the numbers are moved to the lowest tenth.
    Leaning,
    /// Two samples share their numbers.
    Repeating,
}

impl Wrong {
    fn place(&self, pixel: UVec2, sample: u32, dimension: u32) -> (UVec2, u32, u32) {
        match self.error {
            Error::SamePixels => (UVec2::new(0, pixel.y), sample, dimension),
            Error::SameDimensions => (pixel, sample, dimension % 4),
            Error::Repeating if sample == 1 => (pixel, 0, dimension),
            _ => (pixel, sample, dimension),
        }
    }

    fn value(&self, value: f32, sample: u32, at: UVec2) -> f32 {
        match self.error {
            Error::Leaning if mix(u64::from(at.x) << 32 | u64::from(at.y)).is_multiple_of(50) => 0.1 * value,
            Error::Numbered => (value + sample as f32) / 64.0 % 1.0,
            _ => value,
        }
    }
}

impl Numbers for Wrong {
    fn stream(&self, pixel: UVec2, sample: u32) -> Stream<'_> {
        self.right.stream(pixel, sample)
    }

    fn single(&self, pixel: UVec2, sample: u32, dimension: u32) -> f32 {
        let (p, s, d) = self.place(pixel, sample, dimension);
        self.value(self.right.single(p, s, d), sample, pixel)
    }

    fn pair(&self, pixel: UVec2, sample: u32, dimension: u32) -> Vec2 {
        let (p, s, d) = self.place(pixel, sample, dimension);
        self.right.pair(p, s, d).to_array().map(|v| self.value(v, sample, pixel)).into()
    }
}

#[test]
fn planted_errors_are_found() {
    let claim = CLAIMS[5];
    let level = sidak(crate::support::SIGNIFICANCE, 100);
    let found = |error| {
        let wrong = Wrong { right: Run::new(claim.plugin, 1024, SEED), error };
        let by_independence = PAIRINGS.into_iter().any(|pairing| !independence(&wrong, 64, pairing).accepts(level));
        [
            !uniformity(&wrong, Which::X(0), 0).accepts(level),
            by_independence,
            broken_claim(&wrong, &claim).is_some(),
            discrepancy(&wrong, 1024) > claim.discrepancy,
        ]
    };
    let planted: &[(Error, &[usize])] = &[
        (Error::SamePixels, &[1]),
        (Error::SameDimensions, &[1]),
        (Error::Numbered, &[0]),
        (Error::Leaning, &[0]),
        (Error::Repeating, &[2]),
    ];
    assert_found(found, Error::None, planted);
    let random = Wrong { right: Run::new("independent", 64, SEED), error: Error::None };
    assert!(broken_claim(&random, &claim).is_some() && discrepancy(&random, 1024) > claim.discrepancy);
}
