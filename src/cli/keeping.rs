//! The options of `render` that keep what a run has found: what a guide has learnt, and where the run stands.

use super::Failure;
use crate::check::key::digest;
use clap::Args;
use lucerna_core::interfaces::FilmSettings;
use lucerna_core::io::output::check_replaceable;
use lucerna_core::render::{Budget, Checkpoint, GuideFile, RenderContext};
use lucerna_core::scene::write::{WriteOptions, to_xml};
use lucerna_core::scene::{Description, ObjectKind};
use std::path::PathBuf;

/// Options of `render`.
#[derive(Args)]
pub struct KeepingArguments {
    /// Begin with what the guide has learnt in this file, if it is there, and leave in it what it has learnt
    #[arg(long, value_name = "FILE", conflicts_with = "pixel")]
    guide_file: Option<PathBuf>,

    /// Learn nothing, and leave the guide's file as it is
    #[arg(long, requires = "guide_file")]
    guide_frozen: bool,

    /// Keep the state of the run in this file, and go on from it if it is there: the same command continues a run that
    /// was interrupted
    #[arg(long, value_name = "FILE", conflicts_with_all = ["pixel", "target_relmse"])]
    checkpoint: Option<PathBuf>,

    /// Seconds between two writes of it; it is also written at the end
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = super::render::positive, requires = "checkpoint")]
    checkpoint_every: f64,
}

/// What a run depends on besides the scene.
pub struct Chosen<'a> {
    /// Number of the sensor.
    pub sensor: usize,
    /// Another sampler, in short form.
    pub sampler: Option<&'a str>,
    /// The seed.
    pub seed: u32,
}

impl KeepingArguments {
    /// Whether the hash of the scene is needed.
    pub fn keeps_state(&self) -> bool {
        self.checkpoint.is_some()
    }

    /// A guide's file named here stands for one that the scene names.
    pub fn override_scene(&self, description: &mut Description) {
        let guides = description.nodes.iter_mut().filter(|node| node.kind == ObjectKind::Guide);
        for guide in guides.filter(|_| self.guide_file.is_some()) {
            guide.take("file");
            guide.take("frozen");
        }
    }

    /// Checks that files can be written.
    ///
    /// # Errors
    /// If one cannot.
    pub fn check(&self) -> Result<(), Failure> {
        let learnt = self.guide_file.as_ref().filter(|_| !self.guide_frozen);
        let check =
            |path: &PathBuf| check_replaceable(path).map_err(|e| Failure::new(format!("{}: {e}", path.display())));
        learnt.into_iter().chain(&self.checkpoint).try_for_each(check)
    }

    /// Tells a context where to keep what. `scene` is the hash of the scene as it is rendered.
    pub fn apply(&self, cx: &mut RenderContext<'_>, scene: &str, chosen: &Chosen<'_>) {
        cx.leaves_learnt = true;
        cx.guide_file = self.guide_file.clone().map(|path| GuideFile { path, frozen: self.guide_frozen });
        let samples = match cx.budget {
            Budget::Samples(spp) => spp.to_string(),
            Budget::Seconds(_) => "what fits into the time".to_owned(),
        };
        let FilmSettings { crop_offset: at, crop_size: size, .. } = cx.film;
        let guide = match &self.guide_file {
            None => "none",
            Some(_) if self.guide_frozen => "frozen",
            Some(_) => "learning",
        };
        let of = [
            ("program version", env!("CARGO_PKG_VERSION").to_owned()),
            ("scene", scene.to_owned()),
            ("sensor", chosen.sensor.to_string()),
            ("sampler", chosen.sampler.unwrap_or("that of the scene").to_owned()),
            ("seed", chosen.seed.to_string()),
            ("window", format!("{}x{} at {},{}", size.x, size.y, at.x, at.y)),
            ("number of samples per pixel", samples),
            ("guide file", guide.to_owned()),
        ];
        let of = of.map(|(name, value)| (name.to_owned(), value)).to_vec();
        cx.checkpoint = self.checkpoint.clone().map(|path| Checkpoint { path, every: self.checkpoint_every, of });
    }
}

/// SHA-256 of all that a scene's picture depends on: its description as it is rendered, and the files it names.
///
/// # Errors
/// If a file cannot be read.
pub fn hash(description: &Description) -> Result<String, Failure> {
    let mut all = to_xml(description, &WriteOptions { for_reference: false, folder: None });
    for file in description.files() {
        let bytes = std::fs::read(&file).map_err(|e| Failure::new(format!("{}: {e}", file.display())))?;
        all += &digest(&bytes);
    }
    Ok(digest(all.as_bytes()))
}
