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
    // The upper end is the largest number with a shared exponent.
    let storable = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.69e38) };
    let pixels: Vec<Rgb<f32>> = image.rgb()?.map(|pixel| Rgb(pixel.map(storable))).collect();
    output::replace_file(path, |file| {
        HdrEncoder::new(file)
            .encode(&pixels, image.width as usize, image.height as usize)
            .map_err(|error| IoError::from_library("cannot write the Radiance file", error))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ReadLimits, Samples, read};
    use crate::io::output::TestFolder;

    #[test]
    fn values_survive_within_the_precision_of_the_format() {
        let folder = TestFolder::new("hdr");
        let path = folder.0.join("a.hdr");
        let mut image = Image::new(9, 5, &["R", "G", "B"]);
        image.data.iter_mut().enumerate().for_each(|(i, value)| *value = 0.001 * 1.2f32.powi(i as i32));
        image.data[..6].copy_from_slice(&[f32::NAN, -1.0, 1.0, f32::INFINITY, 0.0, 0.0]);
        write(&path, &image).unwrap();
        let read = read(&path, &ReadLimits::default()).unwrap();
        assert!(!read.srgb && matches!(read.samples, Samples::F32(_)));
        let values = read.to_f32(false);
        assert!(values[..2].iter().all(|value| value.abs() < 0.005) && values[3] > 1e38);
        for (pixel, given) in values[6..].chunks(3).zip(image.data[6..].chunks(3)) {
            let largest = given.iter().fold(0.0f32, |a, &b| a.max(b));
            assert!(pixel.iter().zip(given).all(|(a, b)| (a - b).abs() <= largest / 128.0), "{pixel:?} {given:?}");
        }
    }
}
