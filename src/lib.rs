//! Lucerna renders existing Mitsuba scenes on the CPU.
//!
//! This package is the program and a facade over the two floors below it: [`core`] (what a plugin is written
//! against) and [`plugins`] (what a scene can choose). A program with plugins of its own adds them to a registry and
//! hands it to [`run`]:
//!
//! ```no_run
//! let mut registry = lucerna::builtin();
//! // registry.add(my_integrator::PLUGIN);
//! lucerna::run(registry);
//! ```
#![forbid(unsafe_code)]

pub mod check;
mod cli;
pub mod compare;
mod pictures;
mod process;
mod short_form;
pub mod view;

pub use lucerna_core as core;
pub use lucerna_plugins as plugins;
pub use lucerna_plugins::builtin;

/// The scene that is rendered when none is named.
pub const DEFAULT_SCENE: &str = include_str!("../scenes/cornell-box.xml");

/// Runs the command line with the given plugins.
///
/// The exit code is 0 when all is done, 1 when `check` found a scene that differs, 2 when it could not be done (wrong
/// arguments, a scene with mistakes, an output that cannot be written), and 3 when a render under `--strict-nan` met
/// samples that were not finite or negative.
pub fn run(registry: core::scene::Registry) -> std::process::ExitCode {
    cli::run(&registry)
}
