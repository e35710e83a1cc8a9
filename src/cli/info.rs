//! `lucerna info`: what a scene holds.

use super::Failure;
use super::scene_args::SceneArguments;
use clap::Args;
use lucerna_core::scene::{ObjectKind, Registry};
use std::collections::BTreeMap;
use std::process::ExitCode;

/// Options of `info`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
}

/// Prints counts and sizes.
pub fn run(registry: &Registry, arguments: &Arguments) -> Result<ExitCode, Failure> {
    let description = arguments.scene.describe()?;
    let mut counts: BTreeMap<(ObjectKind, String), usize> = BTreeMap::new();
    for node in description.nodes.iter().filter(|n| n.kind != ObjectKind::Scene) {
        *counts.entry((node.kind, node.plugin.clone())).or_default() += 1;
    }
    let version = description.version;
    println!("{} (version {}.{}.{})", arguments.scene.name(), version[0], version[1], version[2]);
    for ((kind, plugin), count) in counts {
        println!("  {count:>6}  {} {plugin}", kind.tag());
    }
    let scene = arguments.scene.build(registry, description)?.scene;
    let stats = scene.accel().stats();
    let primitives: usize = scene.shapes().iter().map(|s| s.shape.primitive_count()).sum();
    println!("  {:>6}  shapes with {primitives} primitives", scene.shapes().len());
    println!("  {:>6}  primitives without area, left out", stats.degenerate);
    println!("  {:>6}  emitters", scene.emitters().len());
    println!("  {:>6}  MiB of acceleration structure", stats.bytes >> 20);
    let bounds = scene.accel().bounds();
    if !bounds.is_empty() {
        println!("  bounds {:?} to {:?}", bounds.min.to_array(), bounds.max.to_array());
    }
    for (i, camera) in scene.sensors().iter().enumerate() {
        let film = camera.film.settings();
        let spp = camera.sampler.sample_count();
        println!("  sensor {i}: {} x {} pixels, {spp} spp", film.crop_size.x, film.crop_size.y);
    }
    Ok(ExitCode::SUCCESS)
}
