//! Guided paths: unbiased whatever was learnt, the same bits for any number of threads, densities that are those of the
//! samples.

mod budget;
mod cone;
mod corrupted;
mod determinism;
mod field;
mod kept;
mod photons;
mod published;
mod roulette;
mod sets;
#[path = "../support/mod.rs"]
mod support;
mod unbiased;

use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{Scene, instantiate, resolve, upgrade};

/// A scene of this folder with this integrator inside.
fn scene(text: &str, integrator: &str) -> Scene {
    let text = text.replace("<!-- integrator -->", integrator);
    let mut description = load_str(&text, "scene.xml", &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    resolve::resolve(&mut description).unwrap_or_else(|e| panic!("{e}"));
    upgrade::upgrade(&mut description);
    let mut registry = lucerna::builtin();
    registry.add(corrupted::PLUGIN).add(roulette::PLUGIN);
    instantiate(&registry, description, false).unwrap_or_else(|e| panic!("{e}")).scene
}

/// A guide with small cells, so that there are many, and several iterations; paths are guided to the end.
fn guided(spatial_threshold: u32, more: &str) -> String {
    sd_tree(spatial_threshold, 0, more)
}

/// One that leaves paths to the BSDF as soon as it can tell what it gains.
fn left_to_the_bsdf(spatial_threshold: u32) -> String {
    sd_tree(spatial_threshold, 20, "")
}

fn sd_tree(spatial_threshold: u32, least_gain: u32, more: &str) -> String {
    format!(
        "<guide type='sd_tree'><float name='spatial_threshold' value='{spatial_threshold}'/>
         <float name='least_gain' value='{least_gain}'/><float name='learning' value='0.4'/>{more}</guide>"
    )
}

/// Sun and sky with a pane before them.
const PANE: &str = include_str!("pane.xml");

/// Five small scenes with what a guide may do wrong: light from below and through a gap, glass and mirrors, BSDFs of smooth
/// and delta lobes, transmission, light from everywhere and from a point, a sun behind glass.
const SCENES: [(&str, &str); 5] = [
    ("gap", include_str!("gap.xml")),
    ("glass", include_str!("glass.xml")),
    ("sky", include_str!("sky.xml")),
    ("leaves", include_str!("leaves.xml")),
    ("pane", PANE),
];
