//! Files that appear complete or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{IoError, Result, plain_io_error};

/// Writes a file under a temporary name in the same folder and renames it when all is written, so that neither a
/// crash nor a full disk leaves half a file or destroys an existing one.
///
/// # Errors
/// If the folder cannot be written to, `write` fails or the disk is full; the temporary file is removed.
pub fn replace_file(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    let temporary = temporary_name(path)?;
    let failed = |error| IoError::new(format!("cannot write the file: {}", plain_io_error(&error)));
    let result = File::create(&temporary).map_err(failed).and_then(|file| {
        let mut writer = BufWriter::with_capacity(1 << 16, file);
        write(&mut writer)?;
        writer.flush().map_err(failed)?;
        writer.get_ref().sync_all().map_err(failed)?;
        fs::rename(&temporary, path).map_err(failed)
    });
    if result.is_err() {
        // The first error is the one worth reporting.
        let _ = fs::remove_file(&temporary);
    }
    result
}

/// Checks that [`replace_file`] can be expected to work for `path`, leaving an existing file alone.
///
/// # Errors
/// If the folder is missing or not writable, or the path is a folder or a file that is write-protected.
pub fn check_replaceable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(IoError::new("cannot write: the path is a folder"));
    }
    if path.exists() {
        if !path.is_file() {
            return Err(IoError::new("cannot write: the path is not a regular file"));
        }
        OpenOptions::new()
            .append(true)
            .open(path)
            .map_err(|error| IoError::new(format!("cannot write: {}", plain_io_error(&error))))?;
    }
    let temporary = temporary_name(path)?;
    let failed = |error| IoError::new(format!("cannot write into the folder: {}", plain_io_error(&error)));
    File::create(&temporary).map_err(failed)?;
    fs::remove_file(&temporary).map_err(failed)
}

fn temporary_name(path: &Path) -> Result<PathBuf> {
    let Some(name) = path.file_name() else { return Err(IoError::new("cannot write: the path names no file")) };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(IoError::new("cannot write: the folder does not exist"));
    }
    // The process number keeps two renderings into the same folder apart.
    Ok(folder.join(format!(".{}.{}.part", name.to_string_lossy(), std::process::id())))
}

/// A folder of its own for a test, removed at the end.
#[cfg(test)]
pub(crate) struct TestFolder(pub PathBuf);

#[cfg(test)]
impl TestFolder {
    /// Creates the folder; `name` must be unique among the tests.
    pub fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("lucerna-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        TestFolder(folder)
    }
}

#[cfg(test)]
impl Drop for TestFolder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = TestFolder::new("replace");
        let path = folder.0.join("a.exr");
        replace_file(&path, |file| file.write_all(b"old").map_err(|e| IoError::from_library("", e))).unwrap();
        let failed = replace_file(&path, |file| {
            file.write_all(b"half").map_err(|e| IoError::from_library("", e))?;
            Err(IoError::new("no more"))
        });
        assert_eq!(failed, Err(IoError::new("no more")));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        check_replaceable(&path).unwrap();
        check_replaceable(&folder.0.join("new.exr")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 1);
    }

    #[test]
    fn impossible_places_are_noticed() {
        let folder = TestFolder::new("impossible");
        assert!(check_replaceable(&folder.0).unwrap_err().message.contains("is a folder"));
        assert!(check_replaceable(&folder.0.join("none/a.exr")).unwrap_err().message.contains("does not exist"));
        assert!(check_replaceable(Path::new("/")).is_err());
        fs::write(folder.0.join("file"), "").unwrap();
        assert!(check_replaceable(&folder.0.join("file/a.exr")).is_err());
    }
}
