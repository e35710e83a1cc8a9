//! Sample for sample: with its random numbers in its order, the reference renderer's own noise comes out.
//!
//! What Monte Carlo noise hides shows here: a pixel either follows the same paths as the reference or it does not.
//! Pixels whose path forks on the last bit are allowed for by the shares below; everything else is listed with its
//! reason in [`APART`].

mod support;

use lucerna::core::image::Image;
use lucerna::core::render::SampleOrder;
use support::{Entry, load_entry, manifest, read_exr, render_with, tabulate_filter};

/// Threads the reference counted: two workers and the main one.
const THREADS: u32 = 3;

/// Scenes that cannot follow the reference's samples, and why.
const APART: &[(&str, &str)] = &[
    (
        "analytic/furnace_sphere",
        "inside a sphere the reference misjudges the density of hits: 1.508 at depth 2, not 1.5",
    ),
    ("emitters/area_mesh", "the reference's density has the smooth normal's cosine: 0.8 % of the light lost beside it"),
    (
        "integrators/aov_uv_differentials",
        "the reference starts offset rays where the central one leaves the near plane: 0.27 % here",
    ),
    ("emitters/sunsky", "sun and sky are sampled in another way"),
    ("textures/bitmap_formats", "the JPEG decoders enlarge the chroma differently; the other formats agree"),
];

/// Channel that is not compared: the reference's numbers of shapes change from run to run, ours are in file order.
const SHAPE_NUMBER: &str = "shape.I";

/// Share of pixels that agree, and the worst pixel.
fn agreement(ours: &Image, reference: &Image, tolerance: f32) -> (f64, [u32; 2]) {
    let channels: Vec<(usize, usize)> = (reference.channels.iter().enumerate())
        .filter(|(_, name)| *name != SHAPE_NUMBER)
        .filter_map(|(i, name)| ours.channel(name).map(|j| (j, i)))
        .collect();
    assert!(!channels.is_empty(), "no common channels: {:?} {:?}", ours.channels, reference.channels);
    assert_eq!([ours.width, ours.height], [reference.width, reference.height]);
    let scale = reference.data.iter().map(|v| v.abs()).sum::<f32>() / reference.data.len() as f32;
    let (mut good, mut worst) = (0_u32, (0.0, [0, 0]));
    for y in 0..ours.height {
        for x in 0..ours.width {
            let (a, b) = (ours.pixel(x, y), reference.pixel(x, y));
            let error = channels
                .iter()
                .map(|&(j, i)| (a[j] - b[i]).abs() / b[i].abs().max(1e-3 * scale).max(1e-12))
                .fold(0.0, f32::max);
            good += u32::from(error <= tolerance);
            if error > worst.0 {
                worst = (error, [x, y]);
            }
        }
    }
    (f64::from(good) / f64::from(ours.width * ours.height), worst.1)
}

/// Renders an exact image and tells the share of agreeing pixels.
fn check(entry: &Entry) -> Result<f64, String> {
    let mut scene = load_entry(entry);
    scene.use_reference_offsets();
    let (ours, _) = render_with(&scene, entry.spp, entry.seed, |cx| {
        cx.order = SampleOrder::Reference { threads: THREADS };
        tabulate_filter(cx);
    });
    let reference = read_exr(&format!("reference/exact/{}.exr", entry.name));
    let is_depth = entry.scene.contains("depth");
    let (tolerance, wanted) = if is_depth { (1e-4, 0.999) } else { (1e-3, 0.99) };
    let (share, worst) = agreement(&ours, &reference, tolerance);
    let line = format!("{:<48} {:.4} of pixels (worst at {worst:?})", entry.name, share);
    if share >= wanted { Ok(share) } else { Err(line) }
}

#[test]
fn noise_of_the_reference() {
    let only = std::env::var("LUCERNA_ONLY").unwrap_or_default();
    let (mut failed, mut passed) = (Vec::new(), 0);
    for entry in manifest("exact").iter().filter(|e| e.name.contains(&only)) {
        if APART.iter().any(|(name, _)| entry.name.starts_with(name)) {
            continue;
        }
        match std::panic::catch_unwind(|| check(entry)) {
            Ok(Ok(_)) => passed += 1,
            Ok(Err(line)) => failed.push(line),
            Err(_) => failed.push(format!("{:<48} panicked", entry.name)),
        }
    }
    println!("{passed} images agree, {} are left apart", APART.len());
    assert!(failed.is_empty(), "{} of {} images differ:\n{}", failed.len(), failed.len() + passed, failed.join("\n"));
}
