//! A render that is watched: errors against a reference, an end at a given error, the viewer tev, the page.

mod browser;
mod page;
#[path = "../support/mod.rs"]
mod support;
mod target;
mod viewer;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// An empty folder for one test.
pub fn temporary(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("live").join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    folder
}

/// The program, about to render in a folder.
pub fn render(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lucerna"));
    command.arg("render").args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

/// Exit code and standard error of a whole run.
pub fn run(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = render(folder, arguments).output().expect("the program starts");
    let stderr = String::from_utf8(output.stderr).expect("messages are UTF-8");
    (output.status.code().expect("no signal"), stderr)
}

/// Red, green and blue of a picture, row by row.
pub fn picture(path: &Path) -> (u32, u32, Vec<f32>) {
    let read = lucerna::core::image::read(path, &Default::default()).expect("a valid picture");
    assert_eq!(read.channels, 3);
    (read.width, read.height, read.to_f32(false))
}
