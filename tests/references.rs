//! Every test scene against its reference image, statistically.
//!
//! Three questions, because each alone is blind to something: do single pixels agree (a wrong texel), do the means of
//! 8×8 tiles (a wrong region), does the image mean (a wrong factor)? The denominator holds the variance of the
//! reference, measured from its own passes, and that of our image, measured from ours. The first alone would accept a
//! bias of 5 to 20 %.

mod support;

use lucerna::core::image::Image;
use lucerna::core::render::RenderContext;
use rayon::prelude::*;
use support::{Entry, load_entry, manifest, read_exr, render_with, tabulate_filter};

/// Our passes, with seeds of their own.
const PASSES: u32 = 8;

/// Samples per pixel of each pass.
const SPP: u32 = 16;

/// Share of pixels that must agree at the level of [`SIGNIFICANCE`] with Šidák's correction.
const PIXELS: f64 = 0.9975;

/// Chance of a false alarm per test of tiles and of the mean.
const SIGNIFICANCE: f64 = 0.01;

/// Edge of a tile in pixels.
const TILE: u32 = 8;

/// A relative difference this small is rounding of the stored reference, whatever the noise says.
const ROUNDING: f64 = 5e-4;

/// Scenes whose reference is not the truth, and why.
const APART: &[(&str, &str)] = &[
    ("analytic/furnace_sphere", "the reference is 0.2 to 0.5 % too bright inside an emitting sphere; see analytic.rs"),
    (
        "integrators/aov_uv_differentials",
        "they shrink with the samples per pixel, which differ here; exact.rs compares them",
    ),
];

/// Scenes that are only the reference's when rays leave surfaces as its do, and why.
const REFERENCE_RAYS: &[(&str, &str)] = &[
    ("shapes/far_from_origin", "rays start 9 cm off surfaces there, 1000 units from the origin"),
    ("shapes/ply_binary", "light passes the open vase where shading normals tilt: 0.07 % of all, 1 % of the vase"),
];

/// The reference numbers shapes in an order that changes from run to run.
const SHAPE_NUMBER: &str = "shape.I";

/// Mean and variance of the mean, per value.
struct Measured {
    mean: Vec<f64>,
    variance: Vec<f64>,
}

fn measure(passes: &[Vec<f64>]) -> Measured {
    let n = passes.len() as f64;
    let values = passes[0].len();
    let mean: Vec<f64> = (0..values).map(|i| passes.iter().map(|p| p[i]).sum::<f64>() / n).collect();
    let variance =
        (0..values).map(|i| passes.iter().map(|p| (p[i] - mean[i]).powi(2)).sum::<f64>() / (n * (n - 1.0))).collect();
    Measured { mean, variance }
}

/// Means of whole tiles of the given edge, one after another per channel.
fn tile_means(image: &[f64], [width, height]: [u32; 2], edge: u32) -> Vec<f64> {
    let channels = image.len() / (width * height) as usize;
    let mut means = Vec::new();
    for ty in 0..(height / edge).max(1) {
        for tx in 0..(width / edge).max(1) {
            for channel in 0..channels {
                let (mut sum, mut count) = (0.0, 0.0);
                for y in ty * edge..(ty * edge + edge).min(height) {
                    for x in tx * edge..(tx * edge + edge).min(width) {
                        sum += image[(y * width + x) as usize * channels + channel];
                        count += 1.0;
                    }
                }
                means.push(sum / count);
            }
        }
    }
    means
}

/// Means over tiles of that edge, and their variances: from the variances of the pixels where these are independent,
/// else (under a filter wider than a pixel, neighbours share samples) from whole passes.
fn tiles(measured: &Measured, passes: Option<&[Vec<f64>]>, size: [u32; 2], edge: u32) -> Measured {
    if let Some(passes) = passes {
        return measure(&passes.iter().map(|p| tile_means(p, size, edge)).collect::<Vec<_>>());
    }
    let count = f64::from(edge.min(size[0]) * edge.min(size[1]));
    let variance = tile_means(&measured.variance, size, edge).iter().map(|v| v / count).collect();
    Measured { mean: tile_means(&measured.mean, size, edge), variance }
}

/// Two-sided p-value of Student's t with `freedom` degrees of freedom (Hill 1970, Algorithm 395: normal approximation).
fn p_value(t: f64, freedom: f64) -> f64 {
    let y = freedom * (t * t / freedom).ln_1p();
    let a = freedom - 0.5;
    let b = 48.0 * a * a;
    let y = y * a / freedom;
    let z =
        y.sqrt() * (1.0 + (((-0.4 * y - 3.3) * y - 24.0) * y - 85.5) / (0.8 * y * y + 100.0 + b) / b + (y + 3.0) / b);
    let normal = libm_erfc(z / std::f64::consts::SQRT_2);
    normal.clamp(0.0, 1.0)
}

/// Complementary error function to 1.2e-7 relative (Press et al. 1992, section 6.2: Chebyshev fit).
fn libm_erfc(x: f64) -> f64 {
    const C: [f64; 10] = [
        -1.26551223,
        1.00002368,
        0.37409196,
        0.09678418,
        -0.18628806,
        0.27886807,
        -1.13520398,
        1.48851587,
        -0.82215223,
        0.17087277,
    ];
    let t = 1.0 / (1.0 + 0.5 * x.abs());
    let polynomial = C.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let value = t * (-x * x + polynomial).exp();
    if x >= 0.0 { value } else { 2.0 - value }
}

/// What a comparison found.
struct Verdict {
    pixels: f64,
    worst_tile: f64,
    mean: f64,
    ratio: f64,
}

fn compare(entry: &Entry, spp: u32, seed: u32) -> Result<Verdict, String> {
    let mut scene = load_entry(entry);
    if REFERENCE_RAYS.iter().any(|(name, _)| *name == entry.name) {
        scene.use_reference_offsets();
    }
    let reference = read_exr(&format!("reference/images/{}.exr", entry.name));
    let variance = read_exr(&format!("reference/images/{}.var.exr", entry.name));
    let images: Vec<Image> = (0..PASSES)
        .map(|i| {
            let tabulate = |cx: &mut RenderContext<'_>| {
                if entry.scalar {
                    tabulate_filter(cx);
                }
            };
            render_with(&scene, spp, seed + i, tabulate).0
        })
        .collect();
    let ours = &images[0];
    if [ours.width, ours.height] != [reference.width, reference.height] {
        return Err(format!("sizes differ: {}x{}", ours.width, ours.height));
    }
    let missing: Vec<&String> = reference.channels.iter().filter(|c| ours.channel(c).is_none()).collect();
    if !missing.is_empty() {
        return Err(format!("channels {missing:?} are missing"));
    }
    let compared: Vec<&String> = reference.channels.iter().filter(|c| *c != SHAPE_NUMBER).collect();
    let pick = |image: &Image| -> Vec<f64> {
        let order: Vec<usize> = compared.iter().filter_map(|c| image.channel(c)).collect();
        let stride = image.channels.len();
        image.data.chunks_exact(stride).flat_map(|p| order.iter().map(|&c| f64::from(p[c]))).collect()
    };
    let passes: Vec<Vec<f64>> = images.iter().map(pick).collect();
    let mine = measure(&passes);
    let theirs = pick(&reference);
    let size = [ours.width, ours.height];

    // Our samples are fewer than the reference's by this factor: where one side saw no variance, the other's counts.
    let fewer = f64::from(entry.spp * entry.passes) / f64::from(spp * PASSES);
    let scale = theirs.iter().map(|v| v.abs()).sum::<f64>() / theirs.len() as f64;
    let freedom = f64::from(PASSES - 1) + f64::from(entry.passes - 1);

    let reference = Measured { mean: theirs, variance: pick(&variance) };
    let sidak = |n: usize| 1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / n.max(1) as f64);
    // p-values of all values; where one side happened to see no variance, the other's counts, scaled.
    let test = |a: &Measured, b: &Measured, freedom: f64| -> Vec<f64> {
        (0..b.mean.len())
            .map(|i| {
                let variance = a.variance[i].max(b.variance[i] * fewer) + b.variance[i].max(a.variance[i] / fewer);
                let rounding = ROUNDING * (b.mean[i].abs() + 0.01 * scale);
                let excess = ((a.mean[i] - b.mean[i]).abs() - rounding).max(0.0);
                if excess == 0.0 { 1.0 } else { p_value(excess / variance.sqrt().max(1e-30), freedom) }
            })
            .collect()
    };
    let bound = sidak(reference.mean.len());
    let good = test(&mine, &reference, freedom).iter().filter(|p| **p >= bound).count();
    let values = reference.mean.len();

    let box_filter = scene.sensors()[0].film.settings().filter.is_box();
    let whole = (!box_filter).then_some(&passes[..]);
    let averaged = |edge: u32| {
        let ours = tiles(&mine, whole, size, edge);
        let mut theirs = tiles(&reference, None, size, edge);
        if !box_filter {
            theirs.variance = ours.variance.iter().map(|v| v / fewer).collect();
        }
        let freedom = if box_filter { f64::from(edge * edge) * freedom } else { f64::from(PASSES - 1) };
        let p = test(&ours, &theirs, freedom);
        (p.iter().copied().fold(1.0, f64::min) / sidak(p.len()), ours, theirs)
    };
    let (worst_tile, ..) = averaged(TILE);
    let (worst_mean, mean, their_mean) = averaged(size[0].max(size[1]));
    let total = |v: &[f64]| v.iter().sum::<f64>();

    let verdict = Verdict {
        pixels: good as f64 / values as f64,
        worst_tile,
        mean: worst_mean,
        ratio: total(&mean.mean) / total(&their_mean.mean),
    };
    let line = format!(
        "{:<40} pixels {:.4}, worst tile p/bound {:.1e}, mean p/bound {:.1e}, ratio {:.5}",
        entry.name, verdict.pixels, verdict.worst_tile, verdict.mean, verdict.ratio
    );
    if verdict.pixels >= PIXELS && verdict.worst_tile >= 1.0 && verdict.mean >= 1.0 { Ok(verdict) } else { Err(line) }
}

#[test]
fn test_scenes_agree_with_their_references() {
    let only = std::env::var("LUCERNA_ONLY").unwrap_or_default();
    let apart = |name: &str| APART.iter().any(|(apart, _)| name.starts_with(apart));
    let entries: Vec<Entry> =
        manifest("image").into_iter().filter(|e| e.name.contains(&only) && !apart(&e.name)).collect();
    let results: Vec<Result<Verdict, String>> = entries
        .par_iter()
        .map(|entry| {
            // A hundred tests at 1 % raise one false alarm: a scene that fails gets a second look with other random
            // numbers and four times the samples, which a real difference does not survive.
            std::panic::catch_unwind(|| compare(entry, SPP, 1000).or_else(|_| compare(entry, 4 * SPP, 5000)))
                .unwrap_or_else(|_| Err(format!("{:<40} panicked", entry.name)))
                .map_err(|line| if line.starts_with(&entry.name) { line } else { format!("{:<40} {line}", entry.name) })
        })
        .collect();
    let failed: Vec<&String> = results.iter().filter_map(|r| r.as_ref().err()).collect();
    println!("{} scenes agree, {} are left apart", results.len() - failed.len(), APART.len());
    let list: Vec<&str> = failed.iter().map(|s| s.as_str()).collect();
    assert!(list.is_empty(), "{} of {} scenes differ:\n{}", list.len(), results.len(), list.join("\n"));
}
