//! What the tests of emitters and textures share.

use crate::emitters;
use lucerna_core::interfaces::{Emitter, LightPoint};
use lucerna_core::math::{DMat4, Vec2, Vec3};
use lucerna_core::sampling::{Pcg32, warp};
use lucerna_core::scene::{
    Description, Location, Node, NodeId, Object, ObjectKind, Parameter, Registry, SceneErrors, Value, build_one,
};
use std::path::PathBuf;
use std::sync::Arc;

fn parameter(name: &str, value: Value) -> Parameter {
    Parameter { name: name.to_owned(), value, at: Location::file("test.xml") }
}

pub(crate) fn float(name: &str, value: f64) -> Parameter {
    parameter(name, Value::Float(value))
}

pub(crate) fn rgb(name: &str, value: [f64; 3]) -> Parameter {
    parameter(name, Value::Rgb(value))
}

pub(crate) fn vector(name: &str, value: [f64; 3]) -> Parameter {
    parameter(name, Value::Vector(value))
}

pub(crate) fn matrix(name: &str, value: DMat4) -> Parameter {
    parameter(name, Value::Transform(value))
}

pub(crate) fn text(name: &str, value: &str) -> Parameter {
    parameter(name, Value::String(value.to_owned()))
}

/// An object of a plugin of this package.
pub(crate) fn build(kind: ObjectKind, plugin: &str, parameters: Vec<Parameter>) -> Result<Object, SceneErrors> {
    let node = Node {
        kind,
        plugin: plugin.to_owned(),
        id: None,
        parameters,
        at: Location::file("test.xml"),
        included_from: Vec::new(),
    };
    let description = Description {
        nodes: vec![node],
        root: NodeId(0),
        version: [3, 0, 0],
        search_path: vec![PathBuf::from(".")],
        notes: Vec::new(),
        warnings: Vec::new(),
        confined_to: None,
        file_versions: Vec::new(),
    };
    let mut registry = Registry::new();
    registry.add_all(emitters::PLUGINS).add_all(crate::textures::PLUGINS);
    build_one(&registry, &description)
}

pub(crate) fn emitter(plugin: &str, parameters: Vec<Parameter>) -> Result<Arc<dyn Emitter>, SceneErrors> {
    match build(ObjectKind::Emitter, plugin, parameters)? {
        Object::Emitter(emitter) => Ok(emitter),
        _ => unreachable!("an emitter was asked for"),
    }
}

/// What is said about a wrong emitter.
pub(crate) fn errors(plugin: &str, parameters: Vec<Parameter>) -> String {
    emitter(plugin, parameters).err().expect("the parameters are wrong").to_string()
}

/// The values of the test pictures of reference/golden_lights.py, exact in single precision.
pub(crate) fn pattern(width: u32, height: u32, channels: u32) -> Vec<f32> {
    (0..width * height * channels)
        .map(|i| {
            let (x, y, c) = (i / channels % width, i / channels / width, i % channels);
            ((7 * x * x + 13 * y + 5 * c + x * y) % 11) as f32 / 4.0
        })
        .collect()
}

/// The lines of a golden table for one case: the numbers after the name.
pub(crate) fn golden(table: &'static str, case: &str) -> impl Iterator<Item = Vec<f32>> {
    let lines: Vec<_> = table
        .lines()
        .filter_map(|line| line.strip_prefix(case)?.strip_prefix(' '))
        .map(|line| line.split(' ').map(|v| v.parse().expect("a number")).collect::<Vec<f32>>())
        .collect();
    assert!(!lines.is_empty(), "no golden values of {case}");
    lines.into_iter()
}

/// Equal to 2e-5, relatively or absolutely.
pub(crate) fn assert_close(a: &[f32], b: &[f32], what: &str) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= 2e-5 * b.abs().max(1.0), "{what}: {a} is not {b}");
    }
}

/// `sample_direct` gives what reference/golden_lights.py got: point, two numbers → direction, distance (0 if
/// infinite), density, weight.
pub(crate) fn assert_golden(light: &dyn Emitter, case: &str) {
    for line in golden(include_str!("golden.txt"), case) {
        let (input, expected) = line.split_at(5);
        let (from, u2) = (Vec3::from_slice(input), Vec2::from_slice(&input[3..]));
        let got = light.sample_direct(from, u2).map_or([0.0; 8], |s| {
            let distance = if s.point.distance.is_finite() { s.point.distance } else { 0.0 };
            let (d, w) = (s.point.d, s.weight);
            [d.x, d.y, d.z, distance, s.pdf, w.r, w.g, w.b]
        });
        assert_close(&got[5..], &expected[5..], case);
        if got[5..] != [0.0; 3] {
            assert_close(&got[..5], &expected[..5], case);
        }
    }
}

/// Density and radiance of samples agree with those of the points they give.
pub(crate) fn assert_consistent(light: &dyn Emitter) {
    let mut rng = Pcg32::new(5, 1);
    for _ in 0..10_000 {
        let u2 = Vec2::new(rng.next_f32(), rng.next_f32());
        let sample = light.sample_direct(Vec3::ZERO, u2).expect("there is light everywhere");
        let pdf = light.pdf_direct(Vec3::ZERO, &sample.point);
        let radiance = light.background(sample.point.d);
        // Near the poles and edges of texels the direction is not exact enough to come back to the same texel.
        assert!((pdf - sample.pdf).abs() <= 5e-3 * sample.pdf, "{u2}: {pdf} is not {}", sample.pdf);
        let scale = 5e-3 * radiance.max_component().max(sample.weight.max_component() * sample.pdf);
        for channel in 0..3 {
            assert!((sample.weight[channel] * sample.pdf - radiance[channel]).abs() <= scale, "{u2}");
        }
    }
}

/// Directions come as often as their density says (χ² test over 10 × 20 cells of equal solid angle).
pub(crate) fn assert_density_is_sampled(light: &dyn Emitter) {
    const SAMPLES: u32 = 100_000;
    const ROWS: usize = 10;
    const COLUMNS: usize = 20;
    /// Per cell and axis, for the integral of the density.
    const STEPS: usize = 60;
    let mut rng = Pcg32::new(9, 1);
    let mut counts = [0.0f64; ROWS * COLUMNS];
    for _ in 0..SAMPLES {
        let u2 = Vec2::new(rng.next_f32(), rng.next_f32());
        let Some(d) = light.sample_direct(Vec3::ZERO, u2).map(|s| s.point.d) else { continue };
        let row = ((0.5 - 0.5 * d.z) * ROWS as f32) as usize;
        let column = (warp::azimuth(d.x, d.y) / std::f32::consts::TAU * COLUMNS as f32) as usize;
        counts[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1.0;
    }
    let mut total = 0.0;
    let (mut chi2, mut cells) = (0.0, -1.0f64);
    let (mut rest_count, mut rest_expected) = (0.0, 0.0);
    for (cell, count) in counts.iter().enumerate() {
        let mut mean = 0.0;
        for i in 0..STEPS * STEPS {
            let x = ((cell % COLUMNS) as f32 + ((i % STEPS) as f32 + 0.5) / STEPS as f32) / COLUMNS as f32;
            let y = ((cell / COLUMNS) as f32 + ((i / STEPS) as f32 + 0.5) / STEPS as f32) / ROWS as f32;
            let d = warp::square_to_sphere(Vec2::new(x, y));
            mean += f64::from(light.pdf_direct(Vec3::ZERO, &LightPoint::of_environment(d)));
        }
        let probability = mean / (STEPS * STEPS) as f64 / f64::from(warp::SPHERE_PDF) / (ROWS * COLUMNS) as f64;
        total += probability;
        let expected = probability * f64::from(SAMPLES);
        if expected < 20.0 {
            rest_count += count;
            rest_expected += expected;
        } else {
            chi2 += (count - expected).powi(2) / expected;
            cells += 1.0;
        }
    }
    if rest_expected > 20.0 {
        chi2 += (rest_count - rest_expected).powi(2) / rest_expected;
        cells += 1.0;
    }
    assert!((total - 1.0).abs() < 5e-3, "the density integrates to {total}");
    // Wilson and Hilferty 1931; 3.7 standard deviations are passed once in ten thousand times.
    let limit = cells * (1.0 - 2.0 / (9.0 * cells) + 3.7 * (2.0 / (9.0 * cells)).sqrt()).powi(3);
    assert!(chi2 < limit, "χ² is {chi2}, the limit {limit}");
}
