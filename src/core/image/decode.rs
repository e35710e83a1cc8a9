//! Formats that the `image` crate decodes: PNG, JPEG, BMP, TGA, PNM and Radiance.

use std::io::Cursor;

use ::image::codecs::hdr::HdrDecoder;
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};

use super::exr::separate;
use super::{PixelData, ReadLimits, Samples, jpeg};
use crate::io::limits::shielded;
use crate::io::{IoError, Result};

/// Reads a picture.
pub(super) fn read(bytes: &[u8], extension: Option<&str>, limits: &ReadLimits) -> Result<PixelData> {
    let format = format_of(bytes, extension)
        .ok_or_else(|| IoError::new("is not a PNG, JPEG, BMP, TGA, PNM, PFM, Radiance or EXR picture"))?;
    shielded("the picture", || decode(bytes, format, limits))
}

/// What the decoder says, without the names it gives to itself.
fn damaged(error: ImageError) -> IoError {
    let reason = match &error {
        ImageError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => "the file ends early".into(),
        ImageError::Decoding(error) => {
            std::error::Error::source(error).map_or_else(|| error.to_string(), |e| e.to_string())
        }
        other => other.to_string(),
    };
    let reason = match reason.split(" while decoding ").next().unwrap_or_default() {
        early if early.contains("Not enough bytes") || early.contains("EOF") => "the file ends early",
        other => other,
    };
    IoError::from_library("the picture is damaged", reason)
}

fn decode(bytes: &[u8], format: ImageFormat, limits: &ReadLimits) -> Result<PixelData> {
    if format == ImageFormat::Jpeg
        && let Some((width, height, values)) = jpeg::read(bytes, limits)?
    {
        return Ok(PixelData { width, height, channels: 3, samples: Samples::U8(values), alpha: None, srgb: true });
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut decoder_limits = Limits::default();
    decoder_limits.max_image_width = Some(limits.most_side);
    decoder_limits.max_image_height = Some(limits.most_side);
    decoder_limits.max_alloc = Some(limits.most_bytes.saturating_mul(2));
    reader.limits(decoder_limits);
    let decoder: Box<dyn ImageDecoder + '_> = match format {
        // The other way insists on "#?RADIANCE", but "#?RGBE" is as common.
        ImageFormat::Hdr => Box::new(HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(damaged)?),
        _ => Box::new(reader.into_decoder().map_err(damaged)?),
    };
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

#[cfg(test)]
mod tests {
    use ::image::{DynamicImage, GrayImage, ImageBuffer, Luma, Rgb, RgbImage, Rgba};

    use super::*;

    fn encode(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    fn decode(bytes: &[u8]) -> PixelData {
        read(bytes, None, &ReadLimits::default()).unwrap()
    }

    fn rgb() -> DynamicImage {
        RgbImage::from_fn(12, 7, |x, y| Rgb([x as u8 * 20, y as u8 * 30, 128])).into()
    }

    #[test]
    fn integer_formats_keep_their_bits_and_are_srgb() {
        let expected = Samples::U8(rgb().to_rgb8().into_raw());
        for format in [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Pnm, ImageFormat::Tga] {
            let extension = (format == ImageFormat::Tga).then_some("tga");
            let picture = read(&encode(&rgb(), format), extension, &ReadLimits::default()).unwrap();
            assert_eq!((picture.width, picture.height, picture.channels, picture.srgb), (12, 7, 3, true));
            assert_eq!(picture.samples, expected, "{format:?}");
        }
        let jpeg = decode(&encode(&rgb(), ImageFormat::Jpeg));
        assert!((0..jpeg.samples.len()).all(|i| {
            let Samples::U8(expected) = &expected else { return false };
            (jpeg.samples.get(i) * 255.0 - f32::from(expected[i])).abs() < 24.0
        }));
    }

    #[test]
    fn opacity_is_separated_and_grey_stays_grey() {
        let rgba = ImageBuffer::from_pixel(2, 2, Rgba([1u8, 2, 3, 4])).into();
        let picture = decode(&encode(&rgba, ImageFormat::Png));
        assert_eq!(picture.samples, Samples::U8([1, 2, 3].repeat(4)));
        assert_eq!(picture.alpha, Some(Samples::U8(vec![4; 4])));
        let grey_alpha = ImageBuffer::from_pixel(2, 2, ::image::LumaA([300u16, 400])).into();
        let picture = decode(&encode(&grey_alpha, ImageFormat::Png));
        assert_eq!((picture.channels, picture.samples), (1, Samples::U16(vec![300; 4])));
        assert_eq!(picture.alpha, Some(Samples::U16(vec![400; 4])));
        let grey16 = ImageBuffer::from_pixel(1, 1, Luma([32896u16])).into();
        let value = decode(&encode(&grey16, ImageFormat::Png));
        assert!((value.to_f32(false)[0] - 0.2158).abs() < 1e-4 && (value.to_f32(true)[0] - 0.50196).abs() < 1e-5);
        let bits = decode(b"P1\n3 1\n0 1 0\n");
        assert_eq!((bits.channels, bits.samples), (1, Samples::U8(vec![255, 0, 255])));
    }

    #[test]
    fn both_signatures_of_radiance_files_are_known() {
        for signature in ["RADIANCE", "RGBE"] {
            let mut bytes = format!("#?{signature}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n").into_bytes();
            bytes.extend([128, 64, 0, 129, 128, 128, 128, 128]);
            assert_eq!(decode(&bytes).samples, Samples::F32(vec![1.0, 0.5, 0.0, 0.5, 0.5, 0.5]));
        }
    }

    #[test]
    fn bytes_are_decoded_by_the_srgb_curve() {
        let grey = decode(&encode(&GrayImage::from_pixel(1, 1, Luma([128])).into(), ImageFormat::Png));
        assert!((grey.to_f32(false)[0] - 0.21586).abs() < 1e-5);
        assert!((grey.to_f32(true)[0] - 0.50196).abs() < 1e-5);
    }

    #[test]
    fn impossible_sizes_are_refused_before_decoding() {
        let mut bmp = encode(&rgb(), ImageFormat::Bmp);
        bmp[18..22].copy_from_slice(&30_000u32.to_le_bytes());
        bmp[22..26].copy_from_slice(&30_000u32.to_le_bytes());
        let limits = ReadLimits::default();
        assert!(read(&bmp, None, &limits).unwrap_err().message.contains("30000 x 30000 pixels need 2700000000 bytes"));
        assert!(read(b"P5\n100000 1\n255\n", None, &limits).is_err());
        assert!(read(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n", None, &limits).is_err());
        assert!(read(b"GIF89a", None, &limits).unwrap_err().message.starts_with("is not a PNG"));
        assert!(read(b"", Some("tga"), &limits).is_err());
    }
}
