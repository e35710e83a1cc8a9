//! What a render spends its time in, piece by piece. `cargo bench` runs all, `cargo bench -- bsdfs` those whose name
//! contains a word. One file for each group; all run on one thread, so times are those of a core.

mod accel;
mod bsdfs;
mod film;
mod samplers;
#[path = "../support/mod.rs"]
mod support;
mod textures;

use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime};
use lucerna::core::math::Vec2;
use lucerna::core::sampling::Pcg32;
use std::time::Duration;

/// How many random inputs each measured call goes through.
const INPUTS: usize = 4096;

/// A group that takes a few seconds for each of its benches.
fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(30).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    group
}

/// Points in the unit square, the same in every run.
fn uniform_pairs() -> Vec<Vec2> {
    let mut pcg = Pcg32::new(1, 1);
    let mut pair = || Vec2::from_array([(); 2].map(|()| pcg.next_f32()));
    (0..INPUTS).map(|_| pair()).collect()
}

/// Runs on one thread of a pool of its own, so that what the renderer hands to other threads stays there.
fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread").install(work)
}

criterion_group!(kernels, accel::build, accel::traversal, bsdfs::all, samplers::all, textures::all, film::all);
criterion_main!(kernels);
