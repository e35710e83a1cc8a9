//! The scene language: XML files as the reference renderer reads them, turned into a [`Description`].
//!
//! # The language
//!
//! The root is an object, normally `<scene version="3.0.0">`; `version` is required in every file.
//!
//! | element | attributes | meaning |
//! |---|---|---|
//! | an [object tag](super::ObjectKind) | `type` `id` `name` | an object; it holds properties and further objects |
//! | `<float>` `<integer>` `<boolean>` `<string>` | `name` `value` | a value |
//! | `<point>` `<vector>` | `name`, `x y z` or `value` | three numbers, or one for all three |
//! | `<rgb>` | `name` `value` | linear sRGB primaries, one or three numbers |
//! | `<spectrum>` | `name`, `value` or `filename` | one number, `nm:value` pairs, or an `.spd` file |
//! | `<transform>` | `name` | holds `<translate> <scale> <rotate> <lookat> <matrix>`, each applied after the ones before |
//! | `<ref>` | `id` `name` | an object declared before or later |
//! | `<default>` | `name` `value` | a value for `$name` where none is given from outside |
//! | `<include>` | `filename` `name` | another file: the objects in its `<scene>`, or the one object it is |
//! | `<path>` | `value` | a folder to look for files in, before all others |
//! | `<alias>` | `id` `as` | another name for an object |
//!
//! `$name` in any attribute value is replaced by a parameter, `\$` is a dollar sign. Comments, processing instructions
//! and text are skipped.
//!
//! # Limits
//!
//! No document type definitions, no entities but the predefined ones, 256 levels of elements, 15 of includes,
//! 64 attributes per element. Reading never recurses deeper than the includes.
//!
//! # Old files
//!
//! In files before 3.0 some elements that are gone are read as what they mean today (`<lookAt>`, `<srgb>`,
//! `<blackbody>`, hexadecimal colours, `<camera>`, …), with a note; everything that concerns plugins and their
//! parameters is left to [`upgrade`](super::upgrade).

mod attributes;
mod definitions;
mod loader;
mod numbers;
mod parser;
mod property;
mod source;
mod transform;

#[cfg(test)]
mod tests;

use super::{Description, SceneErrors};
use std::path::{Path, PathBuf};

/// How a scene is loaded.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Values for `$name`, as `(name, value)`; they win over `<default>`. An unused one is an error.
    pub defines: Vec<(String, String)>,
    /// Folders to look for files in, after the scene's own folder and the current directory.
    pub search_path: Vec<PathBuf>,
    /// Unused definitions, unknown elements and unknown attributes are warnings, not errors.
    pub lenient: bool,
    /// Files outside this folder are refused, however they are named.
    pub root: Option<PathBuf>,
}

/// Reads a scene file and all it includes.
///
/// References are checked but not joined, and names stay as written: see [`resolve`](super::resolve) and
/// [`upgrade`](super::upgrade).
///
/// # Errors
/// All that is wrong, as far as it can be told in one run: files that are missing, malformed XML, values that do not
/// parse, unknown elements and attributes, duplicate names, dangling and circular references, undefined and unused
/// parameters.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Description, SceneErrors> {
    loader::load(loader::Main::File(path), options)
}

/// Reads a scene file and makes it ready to be instantiated: [`load`] and [`upgraded`].
///
/// # Errors
/// As those two.
pub fn load_upgraded(path: &Path, options: &LoadOptions) -> Result<Description, SceneErrors> {
    upgraded(load(path, options)?)
}

/// A scene that was read, ready to be instantiated: [`resolve`](super::resolve::resolve),
/// [`upgrade`](super::upgrade::upgrade).
///
/// # Errors
/// As `resolve`.
pub fn upgraded(mut description: Description) -> Result<Description, SceneErrors> {
    super::resolve::resolve(&mut description)?;
    super::upgrade::upgrade(&mut description);
    Ok(description)
}

/// Reads a scene from `text`; `name` stands for the file name in messages. Files it names are looked up in the
/// current directory and the given search path.
///
/// # Errors
/// As [`load`].
pub fn load_str(text: &str, name: &str, options: &LoadOptions) -> Result<Description, SceneErrors> {
    loader::load(loader::Main::Text { text, name }, options)
}
