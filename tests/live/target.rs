//! `--error-vs` and `--target-relmse`: the table, the rule that ends a run and how far it is off, and the bits of the picture.

use crate::{picture, run, temporary};
use lucerna::core::stats::metrics::errors;
use serde_json::Value;
use std::path::Path;

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a document")).expect("JSON")
}

/// The same number, but for how it was written and read.
fn is_about(value: &Value, expected: f64) -> bool {
    value.as_f64().is_some_and(|value| (value / expected - 1.0).abs() < 1e-12)
}

/// Errors at doublings and at the end, those of pictures that are rendered with so many samples and compared afterwards.
#[test]
fn errors_against_a_reference() {
    let folder = temporary("errors");
    let made = run(&folder, &["-q", "-D", "res=24", "--spp", "512", "--seed", "5", "-o", "true.exr"]);
    assert_eq!(made.0, 0, "{}", made.1);
    let arguments = ["-D", "res=24", "--error-vs", "true.exr", "--stats-json", "stats.json", "-o", "box.exr"];
    let (code, stderr) = run(&folder, &[&arguments[..], &["--spp", "24"]].concat());
    assert_eq!(code, 0, "{stderr}");
    let stats = json(&folder.join("stats.json"));
    let rows = stats["errors"].as_array().expect("errors");
    let spp: Vec<u64> = rows.iter().map(|row| row["spp"].as_u64().expect("a number")).collect();
    assert_eq!(spp, [1, 2, 4, 8, 16, 24]);
    let times: Vec<f64> = rows.iter().map(|row| row["seconds"].as_f64().expect("a number")).collect();
    assert!(times.is_sorted() && times[0] > 0.0, "{times:?}");
    let (_, _, reference) = picture(&folder.join("true.exr"));
    for row in rows {
        let spp = row["spp"].to_string();
        let (code, message) = run(&folder, &["-q", "-D", "res=24", "--spp", &spp, "-o", "own.exr"]);
        assert_eq!(code, 0, "{message}");
        let expected = errors(&picture(&folder.join("own.exr")).2, &reference, 3).expect("errors");
        assert!(is_about(&row["mse"], expected.mse) && is_about(&row["rel_mse"], expected.rel_mse), "{row}");
        // The same in the table, with four digits.
        let line =
            stderr.lines().find(|l| l.starts_with("   ") && l.split_whitespace().next() == Some(&spp)).expect("a row");
        let shown: Vec<f64> = line.split_whitespace().skip(2).take(2).map(|v| v.parse().expect("a number")).collect();
        assert!(
            (shown[0] / expected.mse - 1.0).abs() < 1e-3 && (shown[1] / expected.rel_mse - 1.0).abs() < 1e-3,
            "{line}"
        );
    }
    assert!(rows[3]["estimated_rel_mse"].is_null() && rows[4]["estimated_rel_mse"].is_f64());
    // A part is compared with that part; looking changes no bit.
    let crop = [&arguments[..], &["--spp", "4", "--crop", "3,4,10,9"]].concat();
    assert_eq!(run(&folder, &crop).0, 0);
    let (width, height, part) = picture(&folder.join("box.exr"));
    let inside: Vec<f32> = (0..height)
        .flat_map(|y| (0..width * 3).map(move |i| (((y + 4) * 24 + 3) * 3 + i) as usize))
        .map(|i| reference[i])
        .collect();
    let expected = errors(&part, &inside, 3).expect("errors");
    assert!(is_about(&json(&folder.join("stats.json"))["errors"][2]["rel_mse"], expected.rel_mse));
    assert_eq!(run(&folder, &["-q", "-D", "res=24", "--spp", "4", "--crop", "3,4,10,9", "-o", "own.exr"]).0, 0);
    assert!(picture(&folder.join("own.exr")).2 == part);
}

#[test]
fn mistakes_are_told_before_anything_is_rendered() {
    let folder = temporary("mistakes");
    assert_eq!(run(&folder, &["-q", "-D", "res=12", "--spp", "1", "-o", "small.exr"]).0, 0);
    std::fs::write(folder.join("broken.exr"), b"v/1\x01 and nothing more").expect("written");
    for (arguments, expected) in [
        (&["--error-vs", "small.exr"][..], "small.exr: 12 x 12 pixels instead of 16 x 16"),
        (&["--error-vs", "none.exr"], "none.exr: no such file"),
        (&["--error-vs", "broken.exr"], "broken.exr: "),
    ] {
        let (code, stderr) = run(&folder, &[&["-q", "-D", "res=16", "-o", "box.exr"], arguments].concat());
        assert_eq!((code, stderr.lines().count()), (2, 1), "{stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(expected), "{stderr}");
        assert!(!folder.join("box.exr").exists());
    }
    for target in ["0", "nan", "inf", "much"] {
        let (code, stderr) = run(&folder, &["--target-relmse", target]);
        assert!(code == 2 && stderr.contains("expected a number above 0"), "{target}: {stderr}");
    }
}

/// The picture is that of so many samples, for any number of threads; the cap holds, and is told.
#[test]
fn a_target_ends_the_run_and_changes_nothing_else() {
    let folder = temporary("target");
    let base = ["-D", "res=24", "--stats-json", "stats.json"];
    for sampler in ["independent", "sobol"] {
        let with = |more: &[&str]| run(&folder, &[&base[..], &["--sampler", sampler], more].concat());
        let (code, stderr) = with(&["--target-relmse", "0.004", "-t", "1", "-o", "box.exr"]);
        assert_eq!(code, 0, "{stderr}");
        let stats = json(&folder.join("stats.json"));
        let spp = stats["spp"].as_u64().expect("a number");
        let estimate = stats["estimated_rel_mse"].as_f64().expect("an estimate");
        assert!(spp > 16 && estimate <= 0.004 && stats["target_reached"] == true, "{stats}");
        assert!(stats["stopped"] == false && !stderr.contains("stopped early"), "{stderr}");
        assert!(stderr.contains(&format!("{spp} spp, estimated relMSE {estimate:.2e}")), "{stderr}");
        assert_eq!(with(&["--spp", &spp.to_string(), "-t", "3", "-o", "same.exr"]).0, 0);
        assert!(picture(&folder.join("box.exr")).2 == picture(&folder.join("same.exr")).2, "{sampler}");
        // A pass less was not enough.
        assert!(json(&folder.join("stats.json")).get("estimated_rel_mse").is_none());
        // A target that is met by anything: no fewer than 16 samples.
        assert_eq!(with(&["--target-relmse", "100", "-o", "box.exr"]).0, 0);
        assert_eq!(json(&folder.join("stats.json"))["spp"], 16);
        let (code, stderr) = with(&["--target-relmse", "1e-6", "--spp", "40", "-o", "box.exr"]);
        let stats = json(&folder.join("stats.json"));
        assert!(code == 0 && stats["spp"] == 40 && stats["target_reached"] == false, "{stats}");
        assert!(stderr.contains("warning: a relMSE of 1e-6 was not reached: the estimate is "), "{stderr}");
        let (_, stderr) = with(&["--target-relmse", "0.1", "--spp", "8", "-o", "box.exr"]);
        assert!(stderr.contains("was not reached: there were too few samples to tell"), "{stderr}");
        let (code, stderr) = with(&["--target-relmse", "1e-9", "--seconds", "0.2", "-o", "box.exr"]);
        assert!(code == 0 && stderr.contains("was not reached: "), "{stderr}");
    }
}

/// The true error where the rule ends a run, over the one that was asked for: its mean over seeds, for independent and for
/// low-discrepancy samples.
#[test]
fn the_error_is_about_the_one_asked_for() {
    const SEEDS: u32 = 16;
    let folder = temporary("bias");
    let size = ["-q", "-D", "res=32"];
    let reference = ["--sampler", "sobol", "--spp", "4096", "--seed", "1000", "-o", "true.exr"];
    assert_eq!(run(&folder, &[&size[..], &reference].concat()).0, 0);
    let (_, _, truth) = picture(&folder.join("true.exr"));
    let mut figures = Vec::new();
    for sampler in ["independent", "sobol"] {
        for (target, bounds) in [(0.01, [0.8, 1.2]), (0.003, [0.8, 1.2])] {
            let ratios: Vec<f64> = (0..SEEDS)
                .map(|seed| {
                    let (target, seed) = (target.to_string(), seed.to_string());
                    let more = ["--sampler", sampler, "--target-relmse", &target, "--seed", &seed, "-o", "box.exr"];
                    let (code, stderr) = run(&folder, &[&size[..], &more].concat());
                    assert_eq!(code, 0, "{stderr}");
                    errors(&picture(&folder.join("box.exr")).2, &truth, 3).expect("errors").rel_mse
                })
                .map(|error| error / target)
                .collect();
            let mean = ratios.iter().sum::<f64>() / f64::from(SEEDS);
            let most = ratios.iter().fold(0.0_f64, |a, b| a.max(*b));
            let least = ratios.iter().fold(f64::INFINITY, |a, b| a.min(*b));
            figures.push(format!("{sampler} {target}: mean {mean:.2}, {least:.2} to {most:.2}"));
            assert!(mean > bounds[0] && mean < bounds[1], "{figures:?}");
        }
    }
    println!("{}", figures.join("\n"));
}
