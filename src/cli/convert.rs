//! `lucerna convert`: an old scene in today's language.

use super::Failure;
use super::scene_args::{ReadingArguments, SceneArguments};
use clap::Args;
use lucerna_core::scene::write::{WriteOptions, to_xml};
use std::path::PathBuf;
use std::process::ExitCode;

/// Options of `convert`.
#[derive(Args)]
pub struct Arguments {
    /// The scene to read
    input: PathBuf,

    /// The file to write
    output: PathBuf,

    #[command(flatten)]
    reading: ReadingArguments,

    /// Keep plugins that the reference renderer does not have
    #[arg(long)]
    keep_own: bool,
}

/// Converts.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let scene = SceneArguments { scene: Some(arguments.input.clone()), reading: arguments.reading.clone() };
    let description = scene.describe()?;
    let folder = arguments.output.parent().map(std::path::Path::to_path_buf);
    let options = WriteOptions { for_reference: !arguments.keep_own, folder };
    let xml = to_xml(&description, &options);
    std::fs::write(&arguments.output, xml).map_err(|e| Failure::new(format!("{}: {e}", arguments.output.display())))?;
    Ok(ExitCode::SUCCESS)
}
