//! References that were rendered before: one folder each, named after the hash of all they depend on.

use super::reference::{Reference, Source};
use crate::pictures::{write_exr, write_json};
use lucerna_core::image::{Image, ReadLimits, exr};
use lucerna_core::stats::Measured;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const MEAN: &str = "mean.exr";
const VARIANCE: &str = "variance.exr";
/// The means of tiles, one channel for each pass and channel.
const TILES: &str = "tiles.exr";
const ABOUT: &str = "reference.json";

/// `lucerna/references` in the user's folder for caches (XDG base directories), or in that for temporary files.
pub fn default_folder() -> PathBuf {
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let user = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")));
    user.unwrap_or_else(std::env::temp_dir).join("lucerna/references")
}

/// A reference of the cache; `None` if there is none, or it is damaged.
pub fn load(folder: &Path, key: &str) -> Option<Reference> {
    let folder = folder.join(key);
    let about: Value = serde_json::from_slice(&std::fs::read(folder.join(ABOUT)).ok()?).ok()?;
    let number = |name: &str| about[name].as_u64().and_then(|v| u32::try_from(v).ok());
    let text = |name: &str| about[name].as_str().map(str::to_owned);
    let list = |name: &str| -> Vec<String> {
        about[name].as_array().into_iter().flatten().filter_map(|v| v.as_str().map(str::to_owned)).collect()
    };
    let read = |name: &str| exr::read(&folder.join(name), &ReadLimits::default()).ok().map(|file| file.image);
    let (mean, variance, tiles) = (read(MEAN)?, read(VARIANCE)?, read(TILES)?);
    let (passes, channels) = (number("passes")?, list("channels"));
    let mut measured = Measured::stored(&mean, &variance, passes, &channels).ok()?;
    for pass in 0..passes {
        let names = channels.iter().map(|channel| tiles.channel(&tile_channel(pass, channel)));
        let order: Vec<usize> = names.collect::<Option<_>>()?;
        let pixels = tiles.data.chunks_exact(tiles.channels.len());
        measured.tiles.push(pixels.flat_map(|p| order.iter().map(|&c| f64::from(p[c]))).collect());
    }
    let is_whole = measured.tiles.iter().all(|pass| pass.len() == measured.tile_means().len());
    let variant = text("variant")?;
    is_whole.then_some(Reference {
        measured,
        spp: number("spp")?,
        seconds: about["seconds"].as_f64()?,
        mitsuba: text("mitsuba")?,
        tabulated: variant.starts_with("scalar"),
        variant,
        source: Source::Cached,
        notes: list("notes"),
    })
}

/// Keeps a reference. It appears as a whole or not at all.
///
/// # Errors
/// If the folder cannot be written to.
pub fn store(folder: &Path, key: &str, reference: &Reference) -> Result<(), String> {
    let text = |e: std::io::Error| e.to_string();
    let part = folder.join(format!("{key}.{}.part", std::process::id()));
    std::fs::create_dir_all(&part).map_err(text)?;
    let measured = &reference.measured;
    let tiles = Image {
        width: measured.size[0].div_ceil(lucerna_core::stats::TILE),
        height: measured.size[1].div_ceil(lucerna_core::stats::TILE),
        channels: (0..measured.passes)
            .flat_map(|pass| measured.channels.iter().map(move |channel| tile_channel(pass, channel)))
            .collect(),
        data: (0..measured.tile_means().len() / measured.channels.len())
            .flat_map(|tile| {
                let n = measured.channels.len();
                measured.tiles.iter().flat_map(move |pass| pass[tile * n..(tile + 1) * n].iter().map(|v| *v as f32))
            })
            .collect(),
    };
    let about = json!({
        "mitsuba": reference.mitsuba,
        "variant": reference.variant,
        "spp": reference.spp,
        "passes": measured.passes,
        "seconds": reference.seconds,
        "channels": measured.channels,
        "notes": reference.notes,
    });
    let written = write_exr(&part.join(MEAN), &measured.picture(&measured.mean))
        .and_then(|()| write_exr(&part.join(VARIANCE), &measured.picture(&measured.variance)))
        .and_then(|()| write_exr(&part.join(TILES), &tiles))
        .and_then(|()| write_json(&part.join(ABOUT), &about));
    let done = written.and_then(|()| {
        let whole = folder.join(key);
        // What is there was damaged, or another run was faster; either may go.
        let _ = std::fs::remove_dir_all(&whole);
        std::fs::rename(&part, &whole).map_err(text)
    });
    if done.is_err() {
        let _ = std::fs::remove_dir_all(&part);
    }
    done
}

fn tile_channel(pass: u32, channel: &str) -> String {
    format!("{pass:02}.{channel}")
}
