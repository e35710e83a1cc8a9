//! The `lucerna` program: Lucerna with its own plugins and no others.

use std::process::ExitCode;

fn main() -> ExitCode {
    lucerna::run(lucerna::builtin())
}
