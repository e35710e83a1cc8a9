//! References that are stored in a repository: `reference/manifest.toml` and the images it lists.

use super::key::scene_hash;
use super::ours::Ours;
use super::reference::{Reference, Source};
use super::{Options, Refusal, compared};
use lucerna_core::image::{Image, ReadLimits, exr};
use lucerna_core::scene::xml;
use lucerna_core::stats::Measured;
use std::path::{Path, PathBuf};

/// The list of references, relative to a repository.
const MANIFEST: &str = "reference/manifest.toml";

/// The list of scenes whose reference is not the truth.
const APART: &str = "reference/apart.toml";

/// One table of the manifest.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The repository.
    pub root: PathBuf,
    /// `topic/name`, for exact images with `-seedS-sppN`.
    pub name: String,
    /// Scene file, relative to the repository.
    pub scene: String,
    /// The file the reference rendered instead, relative to the repository.
    pub twin: Option<String>,
    /// Values for the scene's `$name`.
    pub defines: Vec<(String, String)>,
    /// Size of the picture.
    pub size: [u32; 2],
    /// First seed.
    pub seed: u32,
    /// Samples per pixel of one pass.
    pub spp: u32,
    /// Independent passes.
    pub passes: u32,
    /// The variant that rendered it.
    pub variant: String,
    /// Version of the package.
    pub mitsuba: String,
    /// [`scene_hash`] of what was rendered.
    pub hash: String,
}

impl Entry {
    /// Whether the filter was looked up in a table.
    pub fn is_scalar(&self) -> bool {
        self.variant.starts_with("scalar")
    }

    fn read(&self, folder: &str, suffix: &str) -> Result<Image, Refusal> {
        let path = self.root.join(format!("reference/{folder}/{}{suffix}.exr", self.name));
        let read = exr::read(&path, &ReadLimits::default());
        read.map(|file| file.image).map_err(|e| Refusal::Failed(format!("{}: {e}", path.display())))
    }

    /// Mean and variance.
    ///
    /// # Errors
    /// If the images cannot be read or do not fit together.
    pub fn load(&self) -> Result<Reference, Refusal> {
        let (mean, variance) = (self.read("images", "")?, self.read("images", ".var")?);
        let channels = compared(&mean.channels);
        let measured = Measured::stored(&mean, &variance, self.passes, &channels).map_err(Refusal::Failed)?;
        Ok(Reference {
            measured,
            spp: self.spp,
            seconds: 0.0,
            mitsuba: self.mitsuba.clone(),
            variant: self.variant.clone(),
            tabulated: self.is_scalar(),
            source: Source::Stored,
            notes: Vec::new(),
        })
    }

    /// An exact image.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn load_exact(&self) -> Result<Image, Refusal> {
        self.read("exact", "")
    }

    /// Whether the reference is that of the scene as it is now.
    ///
    /// # Errors
    /// If not, or if a file cannot be read.
    pub fn check_fresh(&self) -> Result<(), String> {
        let rendered = self.root.join(self.twin.as_ref().unwrap_or(&self.scene));
        let options = xml::LoadOptions { defines: self.defines.clone(), ..xml::LoadOptions::default() };
        let description = xml::load(&rendered, &options).map_err(|e| e.to_string())?;
        if scene_hash(&rendered, &description.files())? != self.hash {
            return Err(format!(
                "the stored reference {} is older than the scene: reference/render.py renders it again, --fresh does without",
                self.name
            ));
        }
        Ok(())
    }
}

/// The repository a file belongs to: the nearest folder above it with a list of references.
pub fn repository(path: &Path) -> Option<PathBuf> {
    let real = path.canonicalize().ok()?;
    real.ancestors().find(|folder| folder.join(MANIFEST).is_file()).map(Path::to_owned)
}

/// The tables of a section of a repository's manifest: `image` or `exact`.
///
/// # Errors
/// If it cannot be read, or an entry lacks something.
pub fn manifest(root: &Path, section: &str) -> Result<Vec<Entry>, String> {
    let table = read_toml(&root.join(MANIFEST))?;
    let entries = table.get(section).and_then(toml::Value::as_table);
    let read = |(name, entry): (&String, &toml::Value)| {
        let entry = entry.as_table().and_then(|entry| read_entry(root, name, entry));
        entry.ok_or_else(|| format!("{}: the entry \"{name}\" is not complete", root.join(MANIFEST).display()))
    };
    entries.into_iter().flatten().map(read).collect()
}

fn read_entry(root: &Path, name: &str, entry: &toml::Table) -> Option<Entry> {
    let number = |key: &str| entry.get(key)?.as_integer().and_then(|v| u32::try_from(v).ok());
    let text = |key: &str| entry.get(key)?.as_str().map(str::to_owned);
    let defines = entry.get("define").and_then(toml::Value::as_array).into_iter().flatten();
    let pair = |text: &str| text.split_once('=').map(|(k, v)| (k.to_owned(), v.to_owned()));
    Some(Entry {
        root: root.to_owned(),
        name: name.to_owned(),
        scene: text("scene")?,
        twin: text("twin"),
        defines: defines.filter_map(|d| pair(d.as_str()?)).collect(),
        size: [number("width")?, number("height")?],
        seed: number("seed")?,
        spp: number("spp")?,
        passes: number("passes")?,
        variant: text("variant")?,
        mitsuba: text("mitsuba")?,
        hash: text("scene_sha256")?,
    })
}

fn read_toml(path: &Path) -> Result<toml::Table, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    text.parse().map_err(|e: toml::de::Error| format!("{}: {}", path.display(), e.message()))
}

/// Entries of a scene that are of use under these options.
fn entries(section: &str, path: &Path, ours: &Ours, options: &Options) -> Result<Vec<Entry>, Refusal> {
    let Some(root) = repository(path) else { return Ok(Vec::new()) };
    let real = path.canonicalize().map_err(Refusal::failed)?;
    let mut found = manifest(&root, section).map_err(Refusal::Failed)?;
    found.retain(|entry| {
        real == root.join(&entry.scene)
            && entry.defines == options.reading.defines
            && (options.size.is_none() || ours.size() == entry.size)
            && (options.variant.is_empty() || options.variant == entry.variant)
    });
    for entry in &found {
        entry.check_fresh().map_err(Refusal::Failed)?;
    }
    Ok(found)
}

/// The stored reference of a scene, if there is one under these options.
///
/// # Errors
/// If there is one, but older than the scene.
pub fn find(path: &Path, ours: &Ours, options: &Options) -> Result<Option<Entry>, Refusal> {
    Ok(entries("image", path, ours, options)?.pop())
}

/// The stored images for a comparison sample for sample: all, or those of the samples per pixel and the seed asked for.
///
/// # Errors
/// As [`find`].
pub fn find_exact(path: &Path, ours: &Ours, options: &Options) -> Result<Vec<Entry>, Refusal> {
    let mut found = entries("exact", path, ours, options)?;
    found.retain(|entry| {
        options.spp.is_none_or(|spp| spp == entry.spp) && options.seed.is_none_or(|seed| seed == entry.seed)
    });
    Ok(found)
}

/// Scenes of a repository whose reference is not the truth, and why: `(name, reason)`; a name may end in `*`.
///
/// # Errors
/// If the list cannot be read.
pub fn apart(root: &Path, exact: bool) -> Result<Vec<(String, String)>, String> {
    let table = read_toml(&root.join(APART))?;
    let section = table.get(if exact { "exact" } else { "image" }).and_then(toml::Value::as_table);
    let pairs = section.into_iter().flatten();
    Ok(pairs.filter_map(|(name, reason)| Some((name.clone(), reason.as_str()?.to_owned()))).collect())
}

/// Whether an entry of [`apart`] names a scene or an exact image of it.
pub fn is_named(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => name == pattern || name.strip_prefix(pattern).is_some_and(|rest| rest.starts_with("-seed")),
    }
}

/// Why a scene is known to differ.
pub fn known(path: &Path, exact: bool) -> Option<String> {
    let root = repository(path)?;
    let real = path.canonicalize().ok()?;
    let below =
        real.strip_prefix(root.join("scenes/tests")).or_else(|_| real.strip_prefix(root.join("scenes"))).ok()?;
    let name = below.with_extension("").to_string_lossy().into_owned();
    let list = apart(&root, exact).ok()?;
    list.into_iter().find(|(pattern, _)| is_named(pattern, &name)).map(|(_, reason)| reason)
}
