//! `--error-vs`: the error against a picture that is given.

use super::Point;
use lucerna_core::color::Rgb;
use lucerna_core::image::{self, ReadLimits};
use lucerna_core::math::UVec2;
use lucerna_core::stats::metrics::{Errors, errors};
use std::path::Path;

/// Head of the table.
pub const HEAD: &str = "       spp     seconds         MSE      relMSE   estimated";

/// A row of the table.
pub fn row(point: &Point) -> String {
    let text = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3e}"));
    let [mse, rel_mse] = [point.errors.map(|e| e.mse), point.errors.map(|e| e.rel_mse)].map(text);
    format!("{:>10} {:>11.2} {mse:>11} {rel_mse:>11} {:>11}", point.spp, point.seconds, text(point.estimate))
}

/// The picture that a render is compared with.
pub struct Reference {
    /// Values row by row; red, green and blue, or grey alone.
    values: Vec<f32>,
    channels: usize,
}

impl Reference {
    /// Reads a picture of the size of the window that is rendered, or of the whole film, of which the window is taken.
    ///
    /// # Errors
    /// If it cannot be read, is of another size, or has no finite pixel.
    pub fn read(path: &Path, film: UVec2, (offset, size): (UVec2, UVec2)) -> Result<Self, String> {
        let fail = |message: String| format!("{}: {message}", path.display());
        let picture = image::read(path, &ReadLimits::default()).map_err(|e| fail(e.to_string()))?;
        let found = UVec2::new(picture.width, picture.height);
        let start = match () {
            () if found == size => UVec2::ZERO,
            () if found == film => offset,
            () => {
                let wanted = format!("{} x {} pixels instead of {} x {}", found.x, found.y, size.x, size.y);
                return Err(fail(wanted));
            }
        };
        let channels = picture.channels as usize;
        let all = picture.to_f32(false);
        let values: Vec<f32> = (start.y..start.y + size.y)
            .flat_map(|y| {
                let first = (y as usize * found.x as usize + start.x as usize) * channels;
                &all[first..first + size.x as usize * channels]
            })
            .copied()
            .collect();
        if !values.chunks_exact(channels).any(|pixel| pixel.iter().all(|v| v.is_finite())) {
            return Err(fail("no pixel is finite".to_owned()));
        }
        Ok(Reference { values, channels })
    }

    /// How far a picture is from it; a grey reference is compared with luminances. `None` if no pixel is finite in both.
    pub fn errors(&self, rgb: Vec<f32>) -> Option<Errors> {
        let picture = match self.channels {
            1 => rgb.chunks_exact(3).map(|c| Rgb::new(c[0], c[1], c[2]).luminance()).collect(),
            _ => rgb,
        };
        errors(&picture, &self.values, self.channels).ok()
    }
}
