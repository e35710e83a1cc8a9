//! Radiance pictures (RGBE) as a result.

use std::path::Path;

use ::image::Rgb;
use ::image::codecs::hdr::HdrEncoder;

use super::Image;
use crate::io::{IoError, Result, output};

/// Writes the colour (`R G B`; else `Y` or the first channel, as grey) in the shared-exponent format: about 1 %
/// accuracy of the largest component, no negative values. NaN becomes 0; infinity the largest number.
///
/// # Errors
/// If the file cannot be written or the sizes in `image` do not fit together.
pub fn write(path: &Path, image: &Image) -> Result<()> {
    // The largest number with a shared exponent; `max` drops NaN.
    let storable = |value: f32| value.max(0.0).min(1.69e38);
    let pixels: Vec<Rgb<f32>> = image.rgb()?.map(|pixel| Rgb(pixel.map(storable))).collect();
    output::replace_file(path, |file| {
        HdrEncoder::new(file)
            .encode(&pixels, image.width as usize, image.height as usize)
            .map_err(|error| IoError::from_library("cannot write the Radiance file", error))
    })
}
