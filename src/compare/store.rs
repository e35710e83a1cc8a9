//! What was rendered before: a folder with one EXR and one JSON file a run, named after the hash of all they depend on.
//! A comparison that was killed continues with it, and one with more methods or seeds renders only what is new.

use super::Shot;
use crate::check::key::digest;
use crate::pictures::{write_exr, write_json};
use lucerna_core::image::{ReadLimits, exr};
use serde_json::{Value, json};
use std::path::PathBuf;

/// The folder.
pub struct Store(PathBuf);

impl Store {
    /// Opens it, or makes a new one.
    ///
    /// # Errors
    /// If it cannot be written to.
    pub fn open(folder: PathBuf) -> Result<Self, String> {
        std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(Store(folder))
    }

    /// Whether a run is there and whole; the picture is not looked into.
    pub fn has(&self, subject: &str, spp: u32, seed: u32) -> bool {
        let path = self.path(subject, &format!("{spp} {seed}"));
        let about = std::fs::read(path.with_extension("json")).ok();
        let about = about.and_then(|text| serde_json::from_slice::<Value>(&text).ok()).unwrap_or_default();
        let bytes = std::fs::metadata(path.with_extension("exr")).ok().map(|file| file.len());
        bytes.is_some() && about["bytes"].as_u64() == bytes && about["seconds"].is_f64()
    }

    /// A run, if it is there and whole.
    pub fn load(&self, subject: &str, spp: u32, seed: u32) -> Option<Shot> {
        let path = self.path(subject, &format!("{spp} {seed}"));
        let about: Value = serde_json::from_slice(&std::fs::read(path.with_extension("json")).ok()?).ok()?;
        let image = exr::read(&path.with_extension("exr"), &ReadLimits::default()).ok()?.image;
        let number = |name: &str| about[name].as_f64();
        let of = about["of"].as_u64().and_then(|v| u32::try_from(v).ok()).unwrap_or(spp);
        Some(Shot { spp, of, seconds: number("seconds")?, cpu: number("cpu"), memory: number("peak_mib"), image })
    }

    /// Keeps a run. It appears as a whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep(&self, subject: &str, seed: u32, shot: &Shot) -> Result<(), String> {
        let path = self.path(subject, &format!("{} {seed}", shot.spp));
        let picture = path.with_extension("exr");
        write_exr(&picture, &shot.image)?;
        let bytes = std::fs::metadata(&picture).map_err(|e| format!("{}: {e}", picture.display()))?.len();
        let about = json!({
            "spp": shot.spp, "of": shot.of, "seed": seed, "seconds": shot.seconds, "cpu": shot.cpu, "peak_mib": shot.memory,
            "bytes": bytes,
        });
        write_json(&path.with_extension("json"), &about)
    }

    /// What is planned for a subject, if it is known: a list of numbers of samples per pixel.
    pub fn load_plan(&self, subject: &str, budgets: &str) -> Option<Vec<u32>> {
        let path = self.path(subject, budgets).with_extension("plan.json");
        serde_json::from_slice(&std::fs::read(path).ok()?).ok()
    }

    /// Keeps a plan.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_plan(&self, subject: &str, budgets: &str, plan: &[u32]) -> Result<(), String> {
        write_json(&self.path(subject, budgets).with_extension("plan.json"), &json!(plan))
    }

    fn path(&self, subject: &str, what: &str) -> PathBuf {
        let key = format!("{subject} {what} {} {}", rayon::current_num_threads(), super::facts::processor());
        self.0.join(&digest(key.as_bytes())[..32])
    }
}
