//! Writes files with triangles and rays, and traces them one by one. `benches/rays_side_by_side.py` runs it beside
//! `benches/embree/rays.cpp`, which reads the same files.

mod file;
#[path = "../support/mod.rs"]
mod support;

use clap::Parser;
use file::PackedSet;
use lucerna::core::accel::Accel;
use rayon::prelude::*;
use std::error::Error;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use support::{mesh, objects, rays};

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;

/// Single rays against triangles.
#[derive(Parser)]
enum Command {
    /// Write a file with triangles and the rays of a camera, of a diffuse bounce and to random points.
    Write {
        /// The file.
        file: PathBuf,
        /// A scene whose meshes and camera are taken, instead of hills with boulders.
        #[arg(long)]
        scene: Option<PathBuf>,
        /// Triangles of the hills and boulders, roughly.
        #[arg(long, default_value_t = 1_000_000)]
        triangles: usize,
        /// Camera rays, roughly; each that hits has one of the others.
        #[arg(long, default_value_t = 1 << 20)]
        pixels: u32,
    },
    /// Trace a file and tell the times as JSON.
    Trace {
        /// The file.
        file: PathBuf,
        /// Threads that build and trace.
        #[arg(long, default_value_t = 1)]
        threads: usize,
        /// How often each set is traced; the quickest time counts.
        #[arg(long, default_value_t = 3)]
        passes: usize,
    },
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Write { file, scene, triangles, pixels } => write(&file, scene.as_deref(), triangles, pixels),
        Command::Trace { file, threads, passes } => trace(&file, threads, passes),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // A scene's errors begin with the word already.
            let text = error.to_string();
            eprintln!("error: {}", text.trim_start_matches("error: "));
            ExitCode::from(2)
        }
    }
}

type Done = Result<(), Box<dyn Error>>;

fn write(file: &std::path::Path, scene: Option<&std::path::Path>, triangles: usize, pixels: u32) -> Done {
    let (mesh, primary) = if let Some(path) = scene {
        let scene = objects::scene(path)?;
        let (mesh, others) = mesh::of_scene(&scene);
        if others > 0 {
            eprintln!("{}: {others} shapes are not meshes and are left out", path.display());
        }
        let sensor = scene.sensors().first().ok_or("the scene has no sensor")?;
        let film = sensor.film.settings().size;
        (mesh, rays::of_sensor(&*sensor.sensor, film, pixels))
    } else {
        (mesh::landscape(triangles), rays::above_landscape(pixels))
    };
    let accel = mesh.build();
    let diffuse = rays::diffuse(&mesh, &accel, &primary);
    let shadow = rays::shadow(&mesh, &accel, &primary);
    let mut out = BufWriter::new(File::create(file)?);
    file::write(&mut out, &mesh, &[primary, diffuse, shadow])?;
    Ok(out.flush()?)
}

fn trace(file: &std::path::Path, threads: usize, passes: usize) -> Done {
    let (mesh, sets) = file::read(&mut BufReader::new(File::open(file)?))?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let started = Instant::now();
    let accel = pool.install(|| mesh.build());
    let build_seconds = started.elapsed().as_secs_f64();

    let measured = sets.iter().map(|set| {
        let mut fewest = f64::INFINITY;
        let mut found = Found::default();
        for _ in 0..passes {
            let started = Instant::now();
            found = pool.install(|| find(&accel, set, threads));
            fewest = fewest.min(started.elapsed().as_secs_f64());
        }
        let rays = set.len();
        serde_json::json!({
            "name": set.name, "rays": rays, "seconds": fewest, "hits": found.hits, "sum_t": found.sum_t,
        })
    });
    let report = serde_json::json!({
        "tracer": concat!("lucerna ", env!("CARGO_PKG_VERSION")), "triangles": mesh.triangles.len(),
        "build_seconds": build_seconds, "sets": measured.collect::<Vec<_>>(),
    });
    println!("{report}");
    Ok(())
}

/// What tells whether two tracers found the same.
#[derive(Clone, Copy, Default)]
struct Found {
    hits: u64,
    /// Sum of the distances of first hits.
    sum_t: f64,
}

fn find(accel: &Accel, set: &PackedSet, threads: usize) -> Found {
    let chunks: Vec<_> = set.chunks(CHUNK).collect();
    let of_chunk = |chunk: &&[[f32; 8]]| {
        let mut found = Found::default();
        for ray in chunk.iter().copied().map(file::ray) {
            if set.any {
                found.hits += u64::from(accel.occluded(&ray));
            } else if let Some(hit) = accel.intersect(&ray) {
                found.hits += 1;
                found.sum_t += f64::from(hit.t);
            }
        }
        found
    };
    let add = |a: Found, b: Found| Found { hits: a.hits + b.hits, sum_t: a.sum_t + b.sum_t };
    if threads == 1 {
        return chunks.iter().map(of_chunk).fold(Found::default(), add);
    }
    chunks.par_iter().map(of_chunk).reduce(Found::default, add)
}
