//! Pictures of a comparison, as files and for the report.

use super::Findings;
use lucerna_core::image::{Image, exr, png, srgb_to_linear};
use lucerna_core::stats::TILE;
use lucerna_core::stats::agreement::{relative_difference, scale};
use lucerna_core::stats::images::Scale;
use std::path::Path;

/// |t| at which the colours of a map end.
const MOST_SIGMA: f32 = 6.0;

/// A picture to be written and shown.
pub struct Map {
    /// Name of the file, without extension.
    pub name: &'static str,
    /// What it is, for the report.
    pub caption: String,
    /// The values.
    pub values: Image,
    /// As it is shown: 8 bits, sRGB.
    pub png: Vec<u8>,
}

impl Map {
    fn new(name: &'static str, caption: String, values: Image, shown: &Image) -> Result<Self, String> {
        let png = png::encode_srgb(shown).map_err(|e| e.to_string())?;
        Ok(Map { name, caption, values, png })
    }

    /// Writes the values as EXR, and the PNG as shown.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), String> {
        let failed = |path: &Path, e: String| format!("{}: {e}", path.display());
        let file = folder.join(self.name).with_extension("exr");
        exr::write(&file, &self.values, &exr::ExrOptions::default()).map_err(|e| failed(&file, e.to_string()))?;
        let file = folder.join(self.name).with_extension("png");
        std::fs::write(&file, &self.png).map_err(|e| failed(&file, e.to_string()))
    }
}

/// `image`, `reference`, `difference`, `z-map` and `tiles` of a comparison.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn maps(findings: &Findings) -> Result<Vec<Map>, String> {
    let (image, reference) = (&findings.ours, &findings.theirs);
    let exposure = exposure(reference);
    let brightness = if exposure == 1.0 { String::new() } else { format!(", brightness × {exposure:.3}") };
    let mean = scale(reference);
    let values = image.data.iter().zip(&reference.data);
    let relative = values.map(|(a, b)| relative_difference(*a, *b, 100.0 * mean).copysign(a - b));
    let difference = Image { data: relative.collect(), ..image.clone() };
    let most = quantile(difference.data.iter().map(|v| v.abs()), 0.99).max(1e-3);
    let percent = 100.0 * most;
    let caption =
        format!("Difference: red where Lucerna is brighter, blue where it is darker; full colour at {percent:.1} %");
    let mut maps = vec![
        Map::new("image", format!("Lucerna{brightness}"), image.clone(), &exposed(image, exposure))?,
        Map::new("reference", format!("Reference{brightness}"), reference.clone(), &exposed(reference, exposure))?,
        Map::new("difference", caption, difference.clone(), &diverging(&difference, most))?,
    ];
    if let Some(comparison) = &findings.comparison {
        let t = |scale| -> Vec<f32> { comparison.test(scale).values.iter().map(|v| v.t as f32).collect() };
        let pixels = Image { data: t(Scale::Pixel), ..image.clone() };
        let caption = format!("Pixels, in standard errors of the difference; full colour at {MOST_SIGMA} σ");
        maps.push(Map::new("z-map", caption, pixels.clone(), &diverging(&pixels, MOST_SIGMA))?);
        let tiles = enlarged(image, &t(Scale::Tile));
        let caption = format!("Means of 8 × 8 pixels, in standard errors; full colour at {MOST_SIGMA} σ");
        maps.push(Map::new("tiles", caption, tiles.clone(), &diverging(&tiles, MOST_SIGMA))?);
    }
    Ok(maps)
}

/// Values of tiles, one for each pixel.
fn enlarged(image: &Image, tiles: &[f32]) -> Image {
    let (width, height, channels) = (image.width, image.height, image.channels.len());
    let columns = width.div_ceil(TILE);
    let tile = |x: u32, y: u32| (y / TILE * columns + x / TILE) as usize * channels;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let data = pixels.flat_map(|(x, y)| &tiles[tile(x, y)..tile(x, y) + channels]).copied().collect();
    Image { width, height, channels: image.channels.clone(), data }
}

/// The channels that are shown: colour, else the first three times.
fn shown(image: &Image) -> [usize; 3] {
    match ["R", "G", "B"].map(|name| image.channel(name)) {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        _ => [image.channel("Y").unwrap_or(0); 3],
    }
}

/// A factor that makes a picture neither too dark nor too bright to look at.
pub(crate) fn exposure(image: &Image) -> f32 {
    let channels = shown(image);
    let pixels = image.data.chunks_exact(image.channels.len());
    let bright = quantile(pixels.map(|p| channels.map(|c| p[c]).into_iter().fold(0.0, f32::max)), 0.95);
    if (0.2..=1.2).contains(&bright) || bright <= 0.0 { 1.0 } else { 0.8 / bright }
}

pub(crate) fn exposed(image: &Image, factor: f32) -> Image {
    map(image, |rgb| rgb.map(|v| v * factor))
}

/// Red where positive, blue where negative, white at zero; the channel that is farthest from zero counts.
fn diverging(image: &Image, most: f32) -> Image {
    const RED: [f32; 3] = [0.70, 0.06, 0.14];
    const BLUE: [f32; 3] = [0.10, 0.27, 0.66];
    map(image, |rgb| {
        let value = rgb.into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0) / most;
        let (amount, end) = (value.abs().min(1.0), if value > 0.0 { RED } else { BLUE });
        end.map(|c| srgb_to_linear(1.0 + (c - 1.0) * amount))
    })
}

fn map(image: &Image, color: impl Fn([f32; 3]) -> [f32; 3]) -> Image {
    let channels = shown(image);
    let mut result = Image::new(image.width, image.height, &["R", "G", "B"]);
    let pixels = image.data.chunks_exact(image.channels.len());
    for (to, from) in result.data.as_chunks_mut::<3>().0.iter_mut().zip(pixels) {
        *to = color(channels.map(|c| from[c]));
    }
    result
}

fn quantile(values: impl Iterator<Item = f32>, part: f32) -> f32 {
    let mut values: Vec<f32> = values.filter(|v| v.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f32 * part) as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}
