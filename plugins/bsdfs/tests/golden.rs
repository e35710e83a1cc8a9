//! The numbers of the reference renderer, one by one. `reference/golden_bsdfs.py` makes the table and explains it.

use super::{build, numbers};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bsdf, Lobes, SurfaceHit, Transport};
use lucerna_core::math::{Frame, Vec2, Vec3};

const TABLE: &str = include_str!("../golden.txt");

/// One case of the table: its name, the object, the hit and the rows.
struct Case<'a> {
    name: &'a str,
    object: String,
    hit: SurfaceHit,
    rows: Vec<Vec<&'a str>>,
}

fn vec3(v: &[f64]) -> Vec3 {
    Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

fn cases() -> Vec<Case<'static>> {
    let mut cases: Vec<Case<'_>> = Vec::new();
    for line in TABLE.lines() {
        let fields: Vec<&str> = line.split('\t').collect();
        if fields[0] == "case" {
            let hit = SurfaceHit::default();
            cases.push(Case { name: fields[1], object: String::new(), hit, rows: Vec::new() });
            continue;
        }
        let case = cases.last_mut().unwrap();
        match fields[0] {
            "hit" => {
                let v = numbers(fields[1]);
                let frame = Frame { s: vec3(&v[3..]), t: vec3(&v[6..]), n: vec3(&v[9..]) };
                case.hit = SurfaceHit { n: vec3(&v), frame, dp_du: vec3(&v[12..]), dp_dv: vec3(&v[15..]), ..case.hit };
            }
            "sample" | "eval" | "null" => case.rows.push(fields),
            _ => case.object += &format!("{line}\n"),
        }
    }
    cases
}

/// Largest deviation, absolute below 1 and relative above.
fn deviation(ours: &[f32], theirs: &[f64]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    ours.iter().zip(theirs).map(|(a, b)| (f64::from(*a) - b).abs() / b.abs().max(1.0)).fold(0.0, f64::max)
}

fn channels(c: Rgb) -> Vec<f32> {
    c.to_array().to_vec()
}

/// How far one row is off.
fn row_deviation(case: &Case<'_>, bsdf: &dyn Bsdf, row: &[&str]) -> f64 {
    let arena = Arena::new();
    let mode = if row[1] == "importance" { Transport::Importance } else { Transport::Radiance };
    let input = numbers(if row[0] == "null" { row[1] } else { row[2] });
    let wi = vec3(&input);
    let hit = SurfaceHit { wi, ..case.hit };
    let bxdf = bsdf.resolve(&hit, &arena);
    let input: Vec<f32> = input.iter().map(|v| *v as f32).collect();
    let place = format!("{}: {row:?}", case.name);
    match row[0] {
        "sample" => {
            let sample = bxdf.sample(wi, input[3], Vec2::new(input[4], input[5]), mode);
            let sample = sample.filter(|s| !s.weight.is_black());
            if row[3] == "none" {
                assert!(sample.is_none(), "{place}: {sample:?}");
                return 0.0;
            }
            let s = sample.unwrap_or_else(|| panic!("{place}: no sample"));
            let theirs = numbers(row[3]);
            let lobe = [
                Lobes::NULL,
                Lobes::DIFFUSE_REFLECTION,
                Lobes::DIFFUSE_TRANSMISSION,
                Lobes::GLOSSY_REFLECTION,
                Lobes::GLOSSY_TRANSMISSION,
                Lobes::DELTA_REFLECTION,
                Lobes::DELTA_TRANSMISSION,
            ][(theirs[8] as u32).trailing_zeros() as usize];
            assert_eq!(s.lobe, lobe, "{place}");
            let ours = [s.wo.to_array().to_vec(), channels(s.weight), vec![s.pdf, s.eta]].concat();
            deviation(&ours, &theirs[..8])
        }
        "eval" => {
            let (value, pdf) = bxdf.eval_pdf(wi, vec3(&numbers(row[2])[3..]), mode);
            let theirs = numbers(row[3]);
            // Opaque and seen from behind, `principled` is black and samples nothing. The reference tells a density all
            // the same.
            let is_back = case.object.starts_with("bsdf\tprincipled") && wi.z < 0.0 && theirs[..3] == [0.0; 3];
            if is_back && value.is_black() && pdf == 0.0 {
                return 0.0;
            }
            deviation(&[channels(value), vec![pdf]].concat(), &theirs)
        }
        _ => {
            let ours = [channels(bsdf.null_transmission(&hit)), channels(bsdf.diffuse_reflectance(&hit, &arena))];
            deviation(&ours.concat(), &numbers(row[2]))
        }
    }
}

#[test]
fn agree_with_the_reference() {
    let mut failures = String::new();
    for case in cases() {
        assert!(case.rows.len() >= 24, "{}", case.name);
        let bsdf = build(&case.object);
        // Where all normals are sampled the reference takes the sine of a small angle from 1 − cos², which leaves it half
        // its digits: an error of 6·10⁻⁸ over the sine.
        let loses_digits = case.name.contains("all normals");
        for row in &case.rows {
            let deviation = row_deviation(&case, &*bsdf, row);
            let tolerance = if loses_digits && row[0] == "sample" { 1e-4 } else { 2e-5 };
            if deviation > tolerance {
                failures += &format!("{}: off by {deviation:.1e} in {row:?}\n", case.name);
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Every plugin has golden numbers.
#[test]
fn covers_every_plugin() {
    for plugin in crate::bsdfs::PLUGINS {
        assert!(TABLE.contains(&format!("\nbsdf\t{}\n", plugin.name)), "{}", plugin.name);
    }
}
