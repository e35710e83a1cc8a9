//! Mesh and data files, read so that no file can crash, stall or exhaust the renderer.
//!
//! Every reader takes the whole file as bytes and returns either plain data or an [`IoError`] that says in one line
//! what is wrong and where (line, byte, face, vertex). Counts that a file declares are compared with its size before
//! anything is allocated, products are checked, and indices are checked before they are used; [`limits`] has the one
//! helper for each of these. A reader knows nothing about scenes: whoever calls it adds the place in the scene.

pub mod limits;
mod mesh;
pub mod obj;
pub mod output;
pub mod ply;
pub mod sealed;
pub mod serialized;
pub mod vol;

use std::path::Path;

pub use mesh::{MeshAttribute, TriangleMesh};

/// What is wrong with a file, and where, in one line without a full stop.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct IoError {
    /// The line that is shown to the user. It carries no part of the file's content and no file name.
    pub message: String,
}

impl IoError {
    /// An error from a message of our own, already one line.
    pub fn new(message: impl Into<String>) -> Self {
        IoError { message: message.into() }
    }

    /// An error that a library reported while doing `what`. Only its first line is kept, and at most 160 characters
    /// of that: libraries like to append what they read.
    pub fn from_library(what: &str, error: impl std::fmt::Display) -> Self {
        let text = error.to_string();
        // The number of the operating system tells users nothing.
        let text = text.split(" (os error").next().unwrap_or_default();
        let line = text.lines().next().unwrap_or_default().trim_end_matches(['.', ':', ' ']);
        let line: String = line.chars().filter(|c| !c.is_control()).take(160).collect();
        IoError { message: format!("{what}: {line}") }
    }
}

/// What the operating system says, without its number and in lower case.
pub(crate) fn plain_io_error(error: &std::io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or(&text);
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}

/// The result of everything in this module.
pub type Result<T> = std::result::Result<T, IoError>;

/// Reads a whole file, which must be a regular one: a pipe or a device could deliver without end.
///
/// # Errors
/// If the file is missing, a directory or not readable.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let failed = |error| IoError::new(plain_io_error(&error));
    let about = std::fs::metadata(path).map_err(failed)?;
    if !about.is_file() {
        return Err(IoError::new(if about.is_dir() { "is a folder, not a file" } else { "is not a regular file" }));
    }
    std::fs::read(path).map_err(failed)
}
