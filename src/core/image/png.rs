//! PNG as a result for viewing.

use std::io::Write;
use std::path::Path;

use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder};

use super::{Image, linear_to_srgb_byte};
use crate::io::{IoError, Result, output};

/// Writes the colour (`R G B`; else `Y` or the first channel, as grey) in 8 bits with the sRGB curve. Values are
/// clamped to 0..=1; NaN becomes 0.
///
/// # Errors
/// If the file cannot be written or the sizes in `image` do not fit together.
pub fn write_srgb(path: &Path, image: &Image) -> Result<()> {
    let file_bytes = encode_srgb(image)?;
    output::replace_file(path, |file| {
        file.write_all(&file_bytes).map_err(|error| IoError::from_library("cannot write the PNG file", error))
    })
}

/// As [`write_srgb`], into memory.
///
/// # Errors
/// If the sizes in `image` do not fit together.
pub fn encode_srgb(image: &Image) -> Result<Vec<u8>> {
    let bytes: Vec<u8> = image.rgb()?.flat_map(|pixel| pixel.map(linear_to_srgb_byte)).collect();
    let mut encoded = Vec::new();
    PngEncoder::new(&mut encoded)
        .write_image(&bytes, image.width, image.height, ExtendedColorType::Rgb8)
        .map_err(|error| IoError::from_library("cannot write the PNG file", error))?;
    Ok(encoded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ReadLimits, Samples, read};
    use crate::io::output::TestFolder;

    #[test]
    fn values_are_encoded_and_clamped() {
        let folder = TestFolder::new("png");
        let path = folder.0.join("a.png");
        let mut image = Image::new(2, 1, &["B", "G", "R", "A"]);
        image.data.copy_from_slice(&[0.2158605, -1.0, 7.0, 0.0, f32::NAN, 1.0, f32::INFINITY, 0.0]);
        write_srgb(&path, &image).unwrap();
        let read = read(&path, &ReadLimits::default()).unwrap();
        assert_eq!(read.samples, Samples::U8(vec![255, 0, 128, 255, 255, 0]));
    }
}
