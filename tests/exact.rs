//! Sample for sample: with its random numbers in its order, the reference renderer's own noise comes out.
//!
//! What Monte Carlo noise hides shows here: a pixel either follows the same paths as the reference or it does not.
//! Pixels whose path forks on the last bit are allowed for by the shares below; everything else is listed with its
//! reason in `reference/apart.toml`.

mod support;

use lucerna::check::compared;
use lucerna::check::ours::REFERENCE_THREADS;
use lucerna::check::stored::Entry;
use lucerna::core::stats::agreement::{SHARE, TOLERANCE, agreement};
use support::{apart, load_entry, manifest, render_with};

/// Renders an exact image and tells the share of agreeing pixels.
fn check(entry: &Entry) -> Result<f64, String> {
    let mut scene = load_entry(entry);
    scene.use_reference_offsets();
    let (ours, _) = render_with(&scene, entry.spp, entry.seed, |cx| cx.follow_reference(REFERENCE_THREADS));
    let reference = entry.load_exact().unwrap_or_else(|e| panic!("{e:?}"));
    let is_depth = entry.scene.contains("depth");
    let (tolerance, wanted) = if is_depth { (1e-4, 0.999) } else { (TOLERANCE, SHARE) };
    let found = agreement(&ours, &reference, &compared(&reference.channels), tolerance)?;
    let line = format!("{:<48} {:.4} of pixels (worst at {:?})", entry.name, found.share, found.worst_pixel);
    if found.share >= wanted { Ok(found.share) } else { Err(line) }
}

#[test]
fn noise_of_the_reference() {
    let only = std::env::var("LUCERNA_ONLY").unwrap_or_default();
    let (mut failed, mut passed, mut left) = (Vec::new(), 0, 0);
    for entry in manifest("exact").iter().filter(|e| e.name.contains(&only)) {
        if apart("exact", &entry.name).is_some() {
            left += 1;
            continue;
        }
        match std::panic::catch_unwind(|| check(entry)) {
            Ok(Ok(_)) => passed += 1,
            Ok(Err(line)) => failed.push(line),
            Err(_) => failed.push(format!("{:<48} panicked", entry.name)),
        }
    }
    println!("{passed} images agree, {left} are left apart");
    assert!(failed.is_empty(), "{} of {} images differ:\n{}", failed.len(), failed.len() + passed, failed.join("\n"));
}
