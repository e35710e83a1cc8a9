//! Scenes whose mean is known without any renderer.
//!
//! Each file in `scenes/tests/analytic` says in its head what its mean is and how near a render must come:
//! `<!-- expect mean = 1.5 within 1% -->`. A test is added by adding a file.

mod support;

use lucerna::core::render::SampleOrder;
use lucerna::core::stats::figures::measured;
use support::{load, render, repository};

/// The expected mean and the relative tolerance, from the scene's comment.
fn expectation(text: &str) -> Option<(f64, f64)> {
    let (_, rest) = text.split_once("<!-- expect mean = ")?;
    let (mean, rest) = rest.split_once(" within ")?;
    let (tolerance, _) = rest.split_once('%')?;
    Some((mean.trim().parse().ok()?, tolerance.trim().parse::<f64>().ok()? / 100.0))
}

#[test]
fn hc_s05_means_are_what_theory_says() {
    let mut scenes: Vec<_> = std::fs::read_dir(repository("scenes/tests/analytic"))
        .expect("folder")
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    scenes.sort();
    let mut wrong = Vec::new();
    let mut used = 0.0_f64;
    for path in &scenes {
        let text = std::fs::read_to_string(path).expect("scene");
        let (expected, tolerance) = expectation(&text).unwrap_or_else(|| panic!("{}: no expectation", path.display()));
        let scene = load(path, &[], |_| {});
        let (picture, report) = render(&scene, 256, 1, SampleOrder::PerSample);
        let mean = picture.data.iter().map(|v| f64::from(*v)).sum::<f64>() / picture.data.len() as f64;
        used = used.max((mean - expected).abs() / (tolerance * expected.abs().max(1e-3)));
        if (mean - expected).abs() > tolerance * expected.abs().max(1e-3) || report.bad.count > 0 {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            wrong.push(format!("{name}: {mean} instead of {expected} ± {tolerance} ({} bad)", report.bad.count));
        }
    }
    let figure = format!("{} scenes, at most {:.0} % of the tolerance used", scenes.len(), 100.0 * used);
    measured("hc_s05_means_are_what_theory_says", figure);
    assert!(wrong.is_empty(), "{} of {} scenes are wrong:\n{}", wrong.len(), scenes.len(), wrong.join("\n"));
}
