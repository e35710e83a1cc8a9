//! Places that a picture cannot be written to: told before the render starts.

use crate::REFUSED;
use crate::run::{Folder, Run, scene};
use std::fs;
use std::path::Path;

/// A render that would take hours, so that only an error before it can be quick.
fn refused(folder: &Folder, output: &str, message: &str) {
    fs::write(folder.0.join("scene.xml"), scene("<shape type=\"sphere\"/>\n")).unwrap();
    let arguments = ["--spp", "1000000000", "-q"].map(str::to_owned);
    let run = Run::render(&folder.0, Path::new("scene.xml"), Path::new(output), arguments);
    assert_eq!((run.errors.trim_end(), run.code), (message, Some(REFUSED)));
}

#[test]
fn hc_i21_outputs_are_tested_before_the_render() {
    let folder = Folder::new("output");
    let known = "known are .exr, .png, .pfm, .hdr and .rgbe";
    refused(&folder, "out.jpg", &format!("error: out.jpg: cannot write this format; {known}"));
    refused(&folder, "out", &format!("error: out: cannot write this format; {known}"));
    refused(&folder, "none/out.exr", "error: none/out.exr: cannot write: the folder does not exist");
    fs::create_dir(folder.0.join("folder.exr")).unwrap();
    refused(&folder, "folder.exr", "error: folder.exr: cannot write: the path is a folder");
    refused(&folder, "scene.xml/out.exr", "error: scene.xml/out.exr: cannot write: the folder does not exist");
    let left: Vec<_> = fs::read_dir(&folder.0).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
#[cfg(unix)]
fn hc_i21_folders_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new("output-permission");
    let locked = folder.0.join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o500)).unwrap();
    if fs::write(locked.join("probe"), "").is_ok() {
        eprintln!("skipped: this user may write everywhere");
        return;
    }
    let message = "error: locked/out.exr: cannot write into the folder: permission denied";
    refused(&folder, "locked/out.exr", message);
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o700)).unwrap();
}

/// The disk is full: the write fails, nothing is left behind, and an older picture stays.
#[test]
#[cfg(target_os = "linux")]
fn hc_i21_a_device_is_no_place_for_a_picture() {
    let folder = Folder::new("output-device");
    std::os::unix::fs::symlink("/dev/full", folder.0.join("out.exr")).unwrap();
    refused(&folder, "out.exr", "error: out.exr: cannot write: the path is not a regular file");
}
