//! Formats that the `image` crate decodes: PNG, JPEG, BMP, TGA, PNM and Radiance.

use std::io::Cursor;

use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::exr::separate;
use super::{PixelData, ReadLimits, Samples};
use crate::io::{IoError, Result};

/// Reads a picture.
pub(super) fn read(bytes: &[u8], extension: Option<&str>, limits: &ReadLimits) -> Result<PixelData> {
    let format = format_of(bytes, extension)
        .ok_or_else(|| IoError::new("is not a PNG, JPEG, BMP, TGA, PNM, PFM, Radiance or EXR picture"))?;
    let damaged = |error| IoError::from_library("the picture cannot be decoded", error);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut decoder_limits = Limits::default();
    decoder_limits.max_image_width = Some(limits.most_side);
    decoder_limits.max_image_height = Some(limits.most_side);
    decoder_limits.max_alloc = Some(limits.most_bytes.saturating_mul(2));
    reader.limits(decoder_limits);
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let pixel_bytes = decoder.color_type().bytes_per_pixel();
    limits.check(width.into(), height.into(), pixel_bytes.into(), bytes.len())?;
    let (channels, has_alpha, samples) = match DynamicImage::from_decoder(decoder).map_err(damaged)? {
        DynamicImage::ImageLuma8(picture) => (1, false, Samples::U8(picture.into_raw())),
        DynamicImage::ImageLumaA8(picture) => (1, true, Samples::U8(picture.into_raw())),
        DynamicImage::ImageRgb8(picture) => (3, false, Samples::U8(picture.into_raw())),
        DynamicImage::ImageRgba8(picture) => (3, true, Samples::U8(picture.into_raw())),
        DynamicImage::ImageLuma16(picture) => (1, false, Samples::U16(picture.into_raw())),
        DynamicImage::ImageLumaA16(picture) => (1, true, Samples::U16(picture.into_raw())),
        DynamicImage::ImageRgb16(picture) => (3, false, Samples::U16(picture.into_raw())),
        DynamicImage::ImageRgba16(picture) => (3, true, Samples::U16(picture.into_raw())),
        DynamicImage::ImageRgb32F(picture) => (3, false, Samples::F32(picture.into_raw())),
        DynamicImage::ImageRgba32F(picture) => (3, true, Samples::F32(picture.into_raw())),
        _ => return Err(IoError::new("pictures with this kind of pixels are not supported")),
    };
    let srgb = matches!(samples, Samples::U8(_) | Samples::U16(_));
    let (samples, alpha) = match samples {
        Samples::U8(values) => {
            let (color, alpha) = separate(values, channels, has_alpha);
            (Samples::U8(color), alpha.map(Samples::U8))
        }
        Samples::U16(values) => {
            let (color, alpha) = separate(values, channels, has_alpha);
            (Samples::U16(color), alpha.map(Samples::U16))
        }
        Samples::F32(values) => {
            let (color, alpha) = separate(values, channels, has_alpha);
            (Samples::F32(color), alpha.map(Samples::F32))
        }
        samples @ Samples::F16(_) => (samples, None),
    };
    Ok(PixelData { width, height, channels: channels as u32, samples, alpha, srgb })
}

/// The format by its first bytes, or TGA by the extension.
fn format_of(bytes: &[u8], extension: Option<&str>) -> Option<ImageFormat> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some(ImageFormat::Png),
        [0xFF, 0xD8, ..] => Some(ImageFormat::Jpeg),
        [b'#', b'?', ..] => Some(ImageFormat::Hdr),
        [b'P', b'1'..=b'7', ..] => Some(ImageFormat::Pnm),
        _ if extension == Some("tga") => Some(ImageFormat::Tga),
        [b'B', b'M', ..] => Some(ImageFormat::Bmp),
        _ => None,
    }
}
