//! Every combination of decisions agrees with `path` in published scenes, which are not part of the repository: a
//! folder each in the folder that `LUCERNA_SCENES` names. Without it nothing is rendered, and the test says so.

use crate::support::render;
use lucerna::compare::method::{Method, Methods};
use lucerna::core::image::Image;
use lucerna::core::render::SampleOrder;
use lucerna::core::scene::{Scene, instantiate, xml};
use lucerna::core::stats::Measured;
use lucerna::core::stats::chi2::sidak;
use lucerna::core::stats::figures::measured;
use lucerna::core::stats::images::{Scale, compare};
use std::path::{Path, PathBuf};

/// Of a small lamp in view, a pixel sees much or nothing: ten pictures of few samples would say little about their
/// mean.
const PATH: &str = "path:hide_emitters=true";
/// Pixels of a picture.
const SIZE: [u32; 2] = [48, 32];
/// Independent pictures of each method.
const SEEDS: u32 = 10;
/// Samples per pixel of each; of `path` four times as many.
const SPP: u32 = 64;

/// All combinations of a guide or none, a roulette and a light sampler; guided to the end, in several iterations. The first is `path` itself and left out: without a
/// guide its throughput is what the roulette `albedo` goes by.
fn methods() -> Vec<Method> {
    let mut names = Vec::new();
    let sets = ["one", "direct_indirect", "primary_product"];
    let guides = sets.map(|sets| format!("+guide=sd_tree:least_gain=0,learning=0.4,sets={sets}"));
    for guide in ["", &guides[0], &guides[1], &guides[2]] {
        for roulette in ["+roulette=albedo", "+roulette=adjoint"] {
            for lights in ["", "+light_sampler=power", "+light_sampler=light_tree", "+light_sampler=ris"] {
                names.push(format!("{PATH}{guide}{roulette}{lights}"));
            }
        }
    }
    Methods::parse(&names[1..]).expect("methods").list
}

/// The scene files of a folder, one of each folder inside: the last that loads.
fn scenes(folder: &Path) -> Vec<PathBuf> {
    let files = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut paths: Vec<_> = entries.map(|entry| entry.path()).collect();
        paths.sort();
        paths
    };
    let is_scene = |path: &&PathBuf| path.extension().is_some_and(|e| e == "xml") && load(path, None).is_some();
    files(folder).iter().filter_map(|folder| files(folder).iter().rev().find(is_scene).cloned()).collect()
}

/// A scene at the test's size with a method; `None` if it does not load.
fn load(path: &Path, method: Option<&Method>) -> Option<Scene> {
    let mut description = xml::load_upgraded(path, &xml::LoadOptions::default()).ok()?;
    description.resize_films(SIZE, "test");
    let registry = lucerna::builtin();
    let path_itself = Method::of_text(PATH).ok()?;
    method.unwrap_or(&path_itself).apply(&mut description, &registry).ok()?;
    instantiate(&registry, description, false).ok().map(|built| built.scene)
}

fn pictures(scene: &Scene, spp: u32, first_seed: u32) -> Measured {
    let shots: Vec<Image> =
        (0..SEEDS).map(|seed| render(scene, spp, first_seed + seed, SampleOrder::PerSample).0).collect();
    Measured::of(&shots, &["R", "G", "B"].map(str::to_owned)).expect("ten pictures of a size")
}

#[test]
fn decisions_are_unbiased_in_published_scenes() {
    let Some(folder) = std::env::var_os("LUCERNA_SCENES") else {
        eprintln!("LUCERNA_SCENES is not set: no scene was rendered");
        return;
    };
    let (scenes, methods) = (scenes(Path::new(&folder)), methods());
    let level = sidak(0.01, scenes.len() * methods.len());
    let (mut failures, mut blind) = (Vec::new(), 0.0_f64);
    for path in &scenes {
        let plain = pictures(&load(path, None).expect("loaded before"), 4 * SPP, 1000);
        for (i, method) in methods.iter().enumerate() {
            let guided = pictures(&load(path, Some(method)).expect("a method"), SPP, 100 * (i as u32 + 20));
            let found = compare(&guided, &plain, true, level).expect("of a kind");
            let (difference, error) = found.mean_difference();
            eprintln!(
                "{}, {}: mean {:+.2} % ± {:.2} %, {}",
                path.display(),
                method.name,
                100.0 * difference,
                100.0 * error,
                if found.agrees() { "agrees" } else { "differs" }
            );
            blind = blind.max(found.detectable());
            if !found.agrees() {
                let worst = |scale| found.test(scale).worst().0;
                let (tile, pixel) = (worst(Scale::Tile), worst(Scale::Pixel));
                failures.push(format!("{}, {}: tiles {tile:?}; pixels {pixel:?}", path.display(), method.name));
            }
        }
    }
    measured(
        "decisions_are_unbiased_in_published_scenes",
        format!(
            "{} methods in {} scenes; an error of {:.1} % of the mean would be found",
            methods.len(),
            scenes.len(),
            100.0 * blind
        ),
    );
    assert!(failures.is_empty(), "{failures:#?}");
}
