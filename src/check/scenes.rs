//! Which scenes to check.

use super::stored::{manifest, repository};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The scenes among files and folders, and how many of them were named one by one. Folders are searched for `.xml` files
/// that hold a `<scene>`, through all levels; hidden ones are left out.
///
/// # Errors
/// If something does not exist or a folder holds no scene.
pub fn find(named: &[PathBuf]) -> Result<Vec<(PathBuf, bool)>, String> {
    let mut found = Vec::new();
    for path in named {
        if !path.exists() {
            return Err(format!("{}: no such file or folder", path.display()));
        }
        if !path.is_dir() {
            found.push((path.clone(), true));
            continue;
        }
        let mut inside = BTreeSet::new();
        walk(path, &mut inside, 0).map_err(|e| format!("{}: {e}", path.display()))?;
        if inside.is_empty() {
            return Err(format!("{}: the folder holds no scenes", path.display()));
        }
        found.extend(inside.into_iter().map(|scene| (scene, false)));
    }
    Ok(found)
}

/// All scenes with a stored reference, of the repository the current folder belongs to.
///
/// # Errors
/// If there is none.
pub fn all() -> Result<Vec<(PathBuf, bool)>, String> {
    let here = Path::new(".");
    let root = repository(here).ok_or("--all needs a repository with reference/manifest.toml, here or above")?;
    // As the user sees them: relative to the current folder where that is the repository.
    let is_here = here.canonicalize().is_ok_and(|real| real == root);
    let name = |scene: String| if is_here { PathBuf::from(scene) } else { root.join(scene) };
    let scenes: BTreeSet<String> = manifest(&root, "image")?.into_iter().map(|entry| entry.scene).collect();
    Ok(scenes.into_iter().map(|scene| (name(scene), false)).collect())
}

fn walk(folder: &Path, found: &mut BTreeSet<PathBuf>, depth: u32) -> std::io::Result<()> {
    // A link may lead back up.
    const DEEPEST: u32 = 16;
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if hidden {
            continue;
        }
        if path.is_dir() && depth < DEEPEST {
            walk(&path, found, depth + 1)?;
        } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml")) && holds_scene(&path) {
            found.insert(path);
        }
    }
    Ok(())
}

/// Whether a file has a scene with a camera: parts that others include have none.
fn holds_scene(path: &Path) -> bool {
    std::fs::read(path).is_ok_and(|bytes| {
        let text = String::from_utf8_lossy(&bytes);
        text.contains("<scene") && text.contains("<sensor") || text.contains("<camera")
    })
}
