//! The command line: one file per subcommand.

mod check;
mod compare;
mod convert;
mod guide;
mod info;
mod keeping;
mod plugins;
mod render;
mod scene_args;
mod views;

use crate::short_form::key_value;
use clap::{Parser, Subcommand};
use lucerna_core::scene::Registry;
use std::process::ExitCode;

/// Told at the end of the help.
const EXIT_CODES: &str = "Exit codes: 0 done; 1 a scene differs (check); 2 could not run (arguments, scene, output, or a compared method); 3 bad samples under --strict-nan";

/// Exit code of a run that could not be done.
const FAILURE: u8 = 2;

#[derive(Parser)]
#[command(name = "lucerna", version, about, arg_required_else_help = true, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene (without one: the built-in Cornell box)
    Render(Box<render::Arguments>),
    /// Compare scenes with the reference renderer
    Check(Box<check::Arguments>),
    /// Compare speed against error of integrators, samplers and settings
    Compare(Box<compare::Arguments>),
    /// Write an old scene in today's language
    Convert(convert::Arguments),
    /// List plugins, or the parameters of one
    Plugins(plugins::Arguments),
    /// Show what a scene holds
    Info(info::Arguments),
    /// Show what a guide has learnt
    Guide(guide::Arguments),
}

/// What went wrong, ready to print; the word `error:` is already in it.
pub struct Failure(String);

impl Failure {
    /// A message without a position.
    fn new(message: impl std::fmt::Display) -> Self {
        Failure(format!("error: {message}"))
    }
}

impl From<lucerna_core::scene::SceneErrors> for Failure {
    fn from(errors: lucerna_core::scene::SceneErrors) -> Self {
        Failure(errors.to_string())
    }
}

/// Parses the arguments and does what they say.
pub fn run(registry: &Registry) -> ExitCode {
    let arguments = Arguments::parse();
    let done = match arguments.command {
        Command::Render(arguments) => render::run(registry, &arguments),
        Command::Check(arguments) => check::run(registry, &arguments),
        Command::Compare(arguments) => compare::run(registry, &arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Plugins(arguments) => plugins::run(registry, &arguments),
        Command::Info(arguments) => info::run(registry, &arguments),
        Command::Guide(arguments) => guide::run(registry, &arguments),
    };
    done.unwrap_or_else(|Failure(message)| {
        eprintln!("{message}");
        ExitCode::from(FAILURE)
    })
}

/// Renders with so many threads, if a number is given.
fn set_threads(threads: Option<u16>) -> Result<(), Failure> {
    let Some(threads) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
    pool.build_global().map_err(|e| Failure::new(format!("cannot start {threads} threads: {e}")))
}
