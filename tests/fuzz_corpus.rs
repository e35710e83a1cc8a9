//! The readers of foreign files, on the seeds of the fuzzer, on files that broke something once, and on thousands of
//! damaged versions of them: no panic, no hang, no memory beyond the size of the file.
//!
//! `fuzz/` has the same targets for a fuzzer, which looks further but needs minutes; what it finds is kept in
//! `fuzz/regressions/<target>`, and every run of this test meets it again.

#[path = "../fuzz/targets.rs"]
mod targets;

mod support;

use peak_alloc::PeakAlloc;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use support::damage::{Random, damage_bytes, damage_scene};
use support::repository;
use targets::Target;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Held while a reader runs: memory is counted for the whole process.
static ALONE: Mutex<()> = Mutex::new(());

/// Damaged versions of the seeds of each target, shared out among them.
const VERSIONS: usize = 20_000;

/// A scene takes longer than a small file.
const SCENE_VERSIONS: usize = 5000;

/// What a reader may take beyond the size of the file.
const MOST_BYTES: usize = 256 << 20;

/// Readers take microseconds, and a second is a hang; this is for machines that are busy with something else.
const HANGS: Duration = Duration::from_secs(20);

/// The files of a folder below `fuzz/`, by name.
fn files(folder: &str, target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(repository("fuzz").join(folder).join(target)) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(path).expect("a file"))).collect()
}

/// Valid files to begin with: the seeds, and for scenes all test scenes.
fn seeds(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    if target != "xml" {
        return files("seeds", target);
    }
    let folders =
        fs::read_dir(repository("scenes/tests")).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<PathBuf> = folders
        .filter(|path| path.is_dir())
        .flat_map(|folder| fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "xml"))
        .collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(path).expect("a file"))).collect()
}

/// Reads a file: whether it was accepted, or what it did that no file may do.
fn read(target: Target, bytes: &[u8]) -> Result<bool, String> {
    let _alone = ALONE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    MEMORY.reset_peak_usage();
    let (before, start) = (MEMORY.current_usage(), Instant::now());
    let accepted = catch_unwind(AssertUnwindSafe(|| target(bytes))).map_err(|_| "panics".to_owned())?;
    let taken = MEMORY.peak_usage().saturating_sub(before);
    if start.elapsed() > HANGS {
        return Err(format!("takes {:?}", start.elapsed()));
    }
    if taken > MOST_BYTES + bytes.len() {
        return Err(format!("takes {} MiB", taken >> 20));
    }
    Ok(accepted)
}

#[test]
fn seeds_are_valid_and_what_broke_something_once_is_survived() {
    let mut wrong = Vec::new();
    for &(name, target) in targets::ALL {
        let seeds = seeds(name);
        assert!(seeds.len() > 1, "{name} has no seeds: run the generator, see fuzz/seeds.rs");
        for (path, bytes) in &seeds {
            // Scenes name files, which are out of reach here.
            match read(target, bytes) {
                Ok(accepted) if accepted || name == "xml" => {}
                other => wrong.push(format!("{}: {other:?}", path.display())),
            }
        }
        for (path, bytes) in files("regressions", name) {
            wrong.extend(read(target, &bytes).err().map(|what| format!("{}: {what}", path.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Keeps a file that did something wrong, for the fuzzer and for a closer look.
fn keep(target: &str, number: usize, bytes: &[u8]) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("fuzz").join(target);
    fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(number.to_string());
    fs::write(&path, bytes).expect("a file");
    path
}

#[test]
fn damaged_files_are_survived() {
    let registry = lucerna::builtin();
    let plugins: Vec<&str> = registry.all().map(|plugin| plugin.name).collect();
    let mut wrong = Vec::new();
    for &(name, target) in targets::ALL {
        let mut seeds = seeds(name);
        seeds.extend(files("regressions", name));
        let versions = if name == "xml" { SCENE_VERSIONS } else { VERSIONS };
        let mut accepted = 0;
        for version in 0..versions {
            let mut random = Random(version as u64);
            let mut bytes = seeds[version % seeds.len()].1.clone();
            for _ in 0..1 + version % 3 {
                if name == "xml" {
                    let mut text = String::from_utf8_lossy(&bytes).into_owned();
                    damage_scene(&mut text, &plugins, &mut random);
                    bytes = text.into_bytes();
                } else if !bytes.is_empty() {
                    damage_bytes(&mut bytes, &mut random);
                }
            }
            match read(target, &bytes) {
                Ok(well) => accepted += usize::from(well),
                Err(what) => wrong.push(format!("{name}: {what}: {}", keep(name, version, &bytes).display())),
            }
        }
        eprintln!("{name}: {accepted} of {versions} accepted");
        // Else the damage is too great or too small to say much.
        assert!(accepted > versions / 50 && accepted < versions - versions / 50, "{name}: {accepted} of {versions}");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
