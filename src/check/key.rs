//! Hashes of scenes: is a reference that of this very scene?

use sha2::{Digest, Sha256};
use std::path::{Component, Path, PathBuf};

/// Lower-case hexadecimal digits of a SHA-256.
pub fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 over the sorted lines `<path relative to the scene> <SHA-256 of the file>\n` of a scene and all files it
/// depends on, as `reference/render.py` computes it.
///
/// # Errors
/// If a file cannot be read.
pub fn scene_hash(scene: &Path, files: &[PathBuf]) -> Result<String, String> {
    let real = |path: &Path| path.canonicalize().map_err(|e| format!("{}: {e}", path.display()));
    let scene = real(scene)?;
    let folder = scene.parent().unwrap_or(Path::new("/"));
    let mut files = files.iter().map(|file| real(file)).collect::<Result<Vec<_>, _>>()?;
    files.push(scene.clone());
    let mut lines = Vec::new();
    for file in files {
        let bytes = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        lines.push((relative(folder, &file), digest(&bytes)));
    }
    // As names, not as lines: a space sorts before other characters.
    lines.sort();
    lines.dedup();
    let text: String = lines.iter().map(|(name, digest)| format!("{name} {digest}\n")).collect();
    Ok(digest(text.as_bytes()))
}

/// A real path as seen from a real folder.
fn relative(folder: &Path, file: &Path) -> String {
    let from: Vec<Component> = folder.components().collect();
    let to: Vec<Component> = file.components().collect();
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..".to_owned(), from.len() - common);
    let down = to[common..].iter().map(|c| c.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_relative() {
        for (folder, file, expected) in
            [("/a/b", "/a/b/c.xml", "c.xml"), ("/a/b", "/a/d/e", "../d/e"), ("/", "/x", "x"), ("/a", "/b", "../b")]
        {
            assert_eq!(relative(Path::new(folder), Path::new(file)), expected);
        }
    }

    #[test]
    fn known_digest() {
        assert_eq!(digest(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
