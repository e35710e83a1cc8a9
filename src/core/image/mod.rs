//! Pictures: read for textures and environment maps, written as results.
//!
//! There are two types because there are two needs. [`PixelData`] is a colour picture as a file stores it, compact
//! (bytes stay bytes) and with its encoding noted, so that a texture can decode as its parameters say. [`Image`] is
//! any number of named float channels, which is what a render produces and EXR files keep.
//!
//! All pictures are row-major from the top left corner, channels interleaved.

mod decode;
pub mod exr;
pub mod hdr;
mod jpeg;
pub mod pfm;
pub mod png;
mod srgb;

use std::path::Path;

use half::f16;

use crate::io::limits::product;
use crate::io::{IoError, Result, output, read_bytes};

pub use srgb::{linear_to_srgb, linear_to_srgb_byte, srgb_byte_to_linear, srgb_to_linear};

/// Named float channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Names of the channels, say `R`, `G`, `B`, `A` or `normal.X`.
    pub channels: Vec<String>,
    /// `width * height * channels.len()` values, channels interleaved.
    pub data: Vec<f32>,
}

impl Image {
    /// A black picture.
    pub fn new(width: u32, height: u32, channels: &[&str]) -> Self {
        let channels: Vec<String> = channels.iter().map(|&name| name.to_owned()).collect();
        let data = vec![0.0; width as usize * height as usize * channels.len()];
        Image { width, height, channels, data }
    }

    /// The values of all channels at a pixel.
    ///
    /// # Panics
    /// If the pixel is outside.
    pub fn pixel(&self, x: u32, y: u32) -> &[f32] {
        let at = (y as usize * self.width as usize + x as usize) * self.channels.len();
        &self.data[at..at + self.channels.len()]
    }

    /// The number of the channel with this name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|channel| channel == name)
    }

    /// The channels of these names, in this order.
    ///
    /// # Errors
    /// If there is none of a name; one line.
    pub fn pick(&self, names: &[String]) -> std::result::Result<Image, String> {
        let find = |name: &String| self.channel(name).ok_or_else(|| format!("there is no channel \"{name}\""));
        let order = names.iter().map(find).collect::<std::result::Result<Vec<usize>, _>>()?;
        let pixels = self.data.chunks_exact(self.channels.len().max(1));
        let data = pixels.flat_map(|pixel| order.iter().map(|&c| pixel[c])).collect();
        Ok(Image { channels: names.to_vec(), data, ..*self })
    }

    /// The colour at every pixel: channels `R G B`, or the only one of `Y` or the first three times.
    fn rgb(&self) -> Result<impl Iterator<Item = [f32; 3]> + '_> {
        self.check()?;
        let grey = self.channel("Y").unwrap_or(0);
        let rgb = match ["R", "G", "B"].map(|name| self.channel(name)) {
            [Some(r), Some(g), Some(b)] => [r, g, b],
            _ => [grey; 3],
        };
        Ok(self.data.chunks_exact(self.channels.len()).map(move |pixel| rgb.map(|channel| pixel[channel])))
    }

    /// Checks that the sizes fit together and are writable.
    fn check(&self) -> Result<()> {
        let (width, height) = (u64::from(self.width), u64::from(self.height));
        if product(&[width, height, self.channels.len() as u64], "the picture")? != self.data.len()
            || self.data.is_empty()
        {
            return Err(IoError::new(format!(
                "a picture of {width} x {height} pixels and {} channels cannot have {} values",
                self.channels.len(),
                self.data.len()
            )));
        }
        Ok(())
    }
}

/// Values as a file stores them.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// 0 to 255 stand for 0 to 1.
    U8(Vec<u8>),
    /// 0 to 65535 stand for 0 to 1.
    U16(Vec<u16>),
    /// Half floats.
    F16(Vec<f16>),
    /// Single floats.
    F32(Vec<f32>),
}

impl Samples {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Samples::U8(values) => values.len(),
            Samples::U16(values) => values.len(),
            Samples::F16(values) => values.len(),
            Samples::F32(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One value, integers scaled to 0..=1, without decoding of sRGB.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn get(&self, index: usize) -> f32 {
        match self {
            Samples::U8(values) => f32::from(values[index]) / 255.0,
            Samples::U16(values) => f32::from(values[index]) / 65535.0,
            Samples::F16(values) => values[index].to_f32(),
            Samples::F32(values) => values[index],
        }
    }
}

/// A colour picture as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelData {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// 1 (grey) or 3 (red, green, blue).
    pub channels: u32,
    /// `width * height * channels` values, channels interleaved.
    pub samples: Samples,
    /// `width * height` values of opacity, never sRGB-encoded.
    pub alpha: Option<Samples>,
    /// Whether `samples` are encoded with the sRGB curve: true for all integer formats.
    pub srgb: bool,
}

impl PixelData {
    /// All values as linear floats; `raw` leaves out the decoding of sRGB.
    pub fn to_f32(&self, raw: bool) -> Vec<f32> {
        match &self.samples {
            Samples::U8(bytes) if self.srgb && !raw => bytes.iter().map(|&byte| srgb_byte_to_linear(byte)).collect(),
            Samples::F32(values) if !self.srgb || raw => values.clone(),
            samples => {
                let decode = |value| if self.srgb && !raw { srgb_to_linear(value) } else { value };
                (0..samples.len()).map(|i| decode(samples.get(i))).collect()
            }
        }
    }
}

/// What a reader may be asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadLimits {
    /// Most pixels in a row or column.
    pub most_side: u32,
    /// Most bytes of a decoded picture.
    pub most_bytes: u64,
}

impl Default for ReadLimits {
    /// 65536 pixels a side and 4 GiB.
    fn default() -> Self {
        ReadLimits { most_side: 1 << 16, most_bytes: 4 << 30 }
    }
}

impl ReadLimits {
    /// No compression of the formats read here inflates by more than about 1032 (deflate).
    const MOST_INFLATION: u64 = 2048;
    /// Refused as a lie of the header only above this size, so that small pictures need no second thought.
    const ALWAYS_BELIEVED: u64 = 64 << 20;

    /// Checks the size that a header declares before anything is allocated and returns the number of pixels.
    fn check(&self, width: u64, height: u64, pixel_bytes: u64, file_size: usize) -> Result<usize> {
        let side = u64::from(self.most_side);
        if width == 0 || height == 0 || width > side || height > side {
            return Err(IoError::new(format!("{width} x {height} pixels; 1 to {side} per side are allowed")));
        }
        let bytes = product(&[width, height, pixel_bytes], "the picture")? as u64;
        let believed = Self::ALWAYS_BELIEVED.max((file_size as u64).saturating_mul(Self::MOST_INFLATION));
        if bytes > self.most_bytes {
            let most = self.most_bytes;
            return Err(IoError::new(format!("{width} x {height} pixels need {bytes} bytes; the limit is {most}")));
        }
        if bytes > believed {
            return Err(IoError::new(format!(
                "{width} x {height} pixels need {bytes} bytes, which {file_size} bytes of file cannot hold"
            )));
        }
        Ok((width * height) as usize)
    }
}

/// Reads a PNG, JPEG, BMP, TGA, PNM, PFM, Radiance or EXR picture. The content decides about the format; the
/// extension is asked only for TGA, which cannot be recognised.
///
/// EXR: of all parts the first that has `R G B` (or `X Y Z`, which become RGB), with any common prefix; else `Y`, else
/// the first channel of the file. `A` beside the chosen channels is the opacity. The picture is the data window.
///
/// # Errors
/// If the file cannot be read, is damaged or of an unknown format, or exceeds `limits`.
pub fn read(path: &Path, limits: &ReadLimits) -> Result<PixelData> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    read_from_bytes(&read_bytes(path)?, extension.as_deref(), limits)
}

/// As [`read`], for a file in memory; `extension` is in lower case.
///
/// # Errors
/// As [`read`].
pub fn read_from_bytes(bytes: &[u8], extension: Option<&str>, limits: &ReadLimits) -> Result<PixelData> {
    match bytes {
        [0x76, 0x2F, 0x31, 0x01, ..] => exr::read_color(bytes, limits),
        [b'P', b'F' | b'f', b'\n' | b'\r' | b' ' | b'\t', ..] => pfm::read(bytes, limits),
        _ => decode::read(bytes, extension, limits),
    }
}

/// Checks before a render that its result can be written to `path`: known extension (`.exr`, `.png`, `.pfm`, `.hdr`,
/// `.rgbe`), folder there and writable. An existing file stays as it is.
///
/// # Errors
/// If not.
pub fn check_writable(path: &Path) -> Result<()> {
    format_of(path)?;
    output::check_replaceable(path)
}

/// Writes a picture in the format that the extension of `path` names; EXR with default options.
///
/// # Errors
/// As [`check_writable`], and if the disk is full or the sizes in `image` do not fit together.
pub fn write(path: &Path, image: &Image) -> Result<()> {
    match format_of(path)? {
        Format::Exr => exr::write(path, image, &exr::ExrOptions::default()),
        Format::Png => png::write_srgb(path, image),
        Format::Pfm => pfm::write(path, image),
        Format::Hdr => hdr::write(path, image),
    }
}

enum Format {
    Exr,
    Png,
    Pfm,
    Hdr,
}

fn format_of(path: &Path) -> Result<Format> {
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("exr") => Ok(Format::Exr),
        Some("png") => Ok(Format::Png),
        Some("pfm") => Ok(Format::Pfm),
        Some("hdr" | "rgbe") => Ok(Format::Hdr),
        _ => Err(IoError::new("cannot write this format; known are .exr, .png, .pfm, .hdr and .rgbe")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::output::TestFolder;

    #[test]
    fn every_format_that_can_be_written_can_be_read() {
        let folder = TestFolder::new("formats");
        let mut image = Image::new(4, 3, &["R", "G", "B"]);
        image.data.fill(1.0);
        for name in ["a.exr", "a.PNG", "a.pfm", "a.hdr", "a.rgbe"] {
            let path = folder.0.join(name);
            check_writable(&path).unwrap();
            write(&path, &image).unwrap();
            let read = read(&path, &ReadLimits::default()).unwrap();
            assert_eq!((read.width, read.height, read.channels), (4, 3, 3), "{name}");
            assert!(read.to_f32(false).iter().all(|value| (value - 1.0).abs() < 0.01), "{name}");
        }
    }

    #[test]
    fn unwritable_results_and_unreadable_files_are_noticed() {
        let folder = TestFolder::new("unwritable");
        assert!(check_writable(&folder.0.join("a.jpg")).unwrap_err().message.contains("known are"));
        assert!(check_writable(&folder.0.join("none/a.exr")).unwrap_err().message.contains("does not exist"));
        assert!(read(&folder.0, &ReadLimits::default()).unwrap_err().message.contains("is a folder"));
        assert!(read(&folder.0.join("a.png"), &ReadLimits::default()).unwrap_err().message.contains("no such file"));
    }

    #[test]
    fn grey_results_are_written_as_grey() {
        let mut image = Image::new(1, 1, &["depth", "Y"]);
        image.data.copy_from_slice(&[5.0, 0.25]);
        assert_eq!(image.rgb().unwrap().collect::<Vec<_>>(), [[0.25; 3]]);
        assert_eq!(image.pixel(0, 0), [5.0, 0.25]);
        assert!(Image::new(0, 4, &["Y"]).rgb().is_err());
    }
}
