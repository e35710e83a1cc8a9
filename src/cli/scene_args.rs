//! Options that say which scene and how to read it, and the loading itself.

use super::{Failure, key_value};
use clap::Args;
use lucerna_core::scene::xml::{LoadOptions, load, load_str, upgraded};
use lucerna_core::scene::{Description, Instantiated, Registry, instantiate};
use std::path::{Path, PathBuf};

/// Which scene, and how to read it.
#[derive(Args, Clone)]
pub struct SceneArguments {
    /// Scene file in XML (without one: the built-in Cornell box)
    pub scene: Option<PathBuf>,

    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// How to read a scene.
#[derive(Args, Clone)]
pub struct ReadingArguments {
    /// Give the scene's $name a value (repeatable)
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = key_value)]
    pub defines: Vec<(String, String)>,

    /// Folders to look for files in, separated by ";"
    #[arg(short = 'a', long = "append", value_name = "PATHS")]
    pub append: Vec<String>,

    /// Missing files and unknown parameters are warnings
    #[arg(long)]
    pub lenient: bool,

    /// Refuse to read files outside this folder
    #[arg(long, value_name = "FOLDER")]
    pub root: Option<PathBuf>,

    /// Tell every rewrite of an old scene (repeatable)
    #[arg(short = 'v', long, action = clap::ArgAction::Count)]
    pub verbose: u8,
}

impl ReadingArguments {
    /// As the loader takes it.
    pub fn options(&self) -> LoadOptions {
        LoadOptions {
            defines: self.defines.clone(),
            search_path: self.append.iter().flat_map(|list| list.split(';')).map(PathBuf::from).collect(),
            lenient: self.lenient,
            root: self.root.clone(),
        }
    }
}

impl SceneArguments {
    /// The scene's name for messages.
    pub fn name(&self) -> String {
        self.scene.as_deref().map_or_else(|| "built-in scene".to_owned(), |path| path.display().to_string())
    }

    /// Reads the scene and brings it into today's language; tells notes under `-v`.
    pub fn describe(&self) -> Result<Description, Failure> {
        let description = upgraded(match &self.scene {
            Some(path) => load(path, &self.reading.options())?,
            None => load_str(crate::DEFAULT_SCENE, "cornell-box.xml", &self.reading.options())?,
        })?;
        if self.reading.verbose > 0 {
            for note in &description.notes {
                eprintln!("note: {note}");
            }
        }
        Ok(description)
    }

    /// Builds the scene; tells warnings.
    pub fn build(&self, registry: &Registry, description: Description) -> Result<Instantiated, Failure> {
        let built = instantiate(registry, description, self.reading.lenient)?;
        for warning in &built.warnings {
            eprintln!("warning: {warning}");
        }
        Ok(built)
    }
}

/// The scene file with another extension; in the current directory for the built-in scene.
pub fn default_output(scene: Option<&Path>) -> PathBuf {
    scene.unwrap_or_else(|| Path::new("cornell-box.xml")).with_extension("exr")
}
