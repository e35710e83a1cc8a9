//! Portable float maps: `PF` or `Pf`, width, height, scale, then 32-bit floats from the bottom row up. The sign of the
//! scale tells the order of the bytes (negative: little endian); its size is passed over, as the reference does.

use std::io::Write;
use std::path::Path;

use super::{Image, PixelData, ReadLimits, Samples};
use crate::io::{IoError, Result, output};

/// Reads a picture.
pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<PixelData> {
    let mut rest = bytes;
    let mut words = [&b""[..]; 4];
    for word in &mut words {
        rest = rest.trim_ascii_start();
        // No sensible number is longer; this keeps the search short in a damaged file.
        let end = rest.iter().take(64).position(u8::is_ascii_whitespace);
        let end = end.ok_or_else(|| IoError::new("the header of the PFM file cannot be read"))?;
        (*word, rest) = rest.split_at(end);
    }
    let [magic, width, height, scale] = words;
    let number = |word: &[u8], what: &str| {
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<u32>().ok());
        number.ok_or_else(|| IoError::new(format!("the {what} of the PFM file is not a number")))
    };
    let (width, height) = (number(width, "width")?, number(height, "height")?);
    let scale: f32 =
        fast_float2::parse(scale).map_err(|_| IoError::new("the scale of the PFM file is not a number"))?;
    if scale == 0.0 || scale.is_nan() {
        return Err(IoError::new("the scale of the PFM file is neither positive nor negative"));
    }
    let channels = if magic == b"PF" { 3 } else { 1 };
    let pixels = limits.check(width.into(), height.into(), channels * 4, bytes.len())?;
    let row = width as usize * channels as usize;
    // One separator follows the header.
    let data = rest
        .get(1..1 + row * height as usize * 4)
        .ok_or_else(|| IoError::new(format!("byte {}: the PFM file ends before its {pixels} pixels", bytes.len())))?;
    let decode = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let rows = data.chunks_exact(row * 4).rev();
    let values = rows.flat_map(|row| row.as_chunks::<4>().0.iter().map(|&bytes| decode(bytes))).collect();
    Ok(PixelData { width, height, channels: channels as u32, samples: Samples::F32(values), alpha: None, srgb: false })
}

/// Writes the colour (`R G B`; else `Y` or the first channel, as grey) with all its bits.
///
/// # Errors
/// If the file cannot be written or the sizes in `image` do not fit together.
pub fn write(path: &Path, image: &Image) -> Result<()> {
    let bytes = encode(image)?;
    output::replace_file(path, |file| file.write_all(&bytes).map_err(|e| IoError::from_library("cannot write", e)))
}

fn encode(image: &Image) -> Result<Vec<u8>> {
    let color = ["R", "G", "B"].iter().all(|name| image.channel(name).is_some());
    let pixels: Vec<[f32; 3]> = image.rgb()?.collect();
    let magic = if color { "PF" } else { "Pf" };
    let mut bytes = format!("{magic}\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    for row in pixels.chunks_exact(image.width as usize).rev() {
        for pixel in row {
            pixel[..if color { 3 } else { 1 }].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(channels: &[&str]) -> Image {
        let mut image = Image::new(3, 2, channels);
        image.data.iter_mut().enumerate().for_each(|(i, value)| *value = i as f32 * 0.1 - 0.3);
        image
    }

    #[test]
    fn what_was_written_is_read() {
        for channels in [&["R", "G", "B"][..], &["Y"]] {
            let image = sample(channels);
            let read = read(&encode(&image).unwrap(), &ReadLimits::default()).unwrap();
            assert_eq!((read.width, read.height, read.channels as usize), (3, 2, channels.len()));
            assert_eq!(read.samples, Samples::F32(image.data));
        }
        let big_endian = b"Pf 1 2\n1.0\n\x3F\x80\0\0\x40\0\0\0";
        assert_eq!(read(big_endian, &ReadLimits::default()).unwrap().samples, Samples::F32(vec![2.0, 1.0]));
    }

    #[test]
    fn sizes_are_held_against_the_file() {
        let huge = read(b"PF\n60000 60000\n-1\nabc", &ReadLimits::default()).unwrap_err();
        assert!(huge.message.contains("need 43200000000 bytes"), "{huge}");
        assert!(read(b"PF\n4 4\n-1\nabc", &ReadLimits::default()).unwrap_err().message.contains("ends before"));
    }
}
