//! What tests measure, for people to read.

use std::fmt::Display;

/// Where figures go if this names a folder: one file for each test.
pub const FOLDER: &str = "LUCERNA_FIGURES";

/// Notes what the test of this name measured: on standard output, and for the table of hard cases if [`FOLDER`] is set
/// in the environment. A figure should be the same in every run.
///
/// # Panics
/// If the file cannot be written: a test that was asked for its figure must not lose it.
pub fn measured(test: &str, figure: impl Display) {
    println!("{test}: {figure}");
    if let Some(folder) = std::env::var_os(FOLDER) {
        let folder = std::path::Path::new(&folder);
        let written =
            std::fs::create_dir_all(folder).and_then(|()| std::fs::write(folder.join(test), figure.to_string()));
        assert!(written.is_ok(), "{}: {written:?}", folder.join(test).display());
    }
}
