//! JPEG pictures whose colour is stored at half the resolution.
//!
//! The decoder of the `image` crate rounds up each time it enlarges chroma: where that is noisy the mean of blue comes out
//! too bright, and a render shows it. The crate `jpeg-decoder` enlarges with less error, but errs in the conversion to
//! RGB, so that is done here. A test below holds both against a picture whose mean is known.

use super::ReadLimits;
use crate::io::Result;
use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

/// Width, height and RGB bytes of a picture in YCbCr with chroma of lower resolution. `None` for every other picture and
/// for one that cannot be decoded.
pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Option<(u32, u32, Vec<u8>)>> {
    if !is_subsampled_ycbcr(bytes).unwrap_or(false) {
        return Ok(None);
    }
    let mut decoder = Decoder::new(bytes);
    // Three channels as they are.
    decoder.set_color_transform(ColorTransform::RGB);
    if decoder.read_info().is_err() {
        return Ok(None);
    }
    let Some(info) = decoder.info().filter(|info| info.pixel_format == PixelFormat::RGB24) else { return Ok(None) };
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    limits.check(width.into(), height.into(), 3, bytes.len())?;
    decoder.set_max_decoding_buffer_size(usize::try_from(limits.most_bytes.saturating_mul(2)).unwrap_or(usize::MAX));
    let Ok(mut values) = decoder.decode() else { return Ok(None) };
    if values.len() != width as usize * height as usize * 3 {
        return Ok(None);
    }
    for pixel in values.as_chunks_mut::<3>().0 {
        *pixel = rgb(*pixel);
    }
    Ok(Some((width, height, values)))
}

/// By the JFIF standard (ITU-T T.871, section 7), rounded once.
fn rgb([y, cb, cr]: [u8; 3]) -> [u8; 3] {
    let [y, cb, cr] = [f32::from(y), f32::from(cb) - 128.0, f32::from(cr) - 128.0];
    // The cast cuts and clamps to bytes; `round` would be a call each.
    [y + 1.402 * cr, y - 0.344_136 * cb - 0.714_136 * cr, y + 1.772 * cb].map(|v| (v + 0.5) as u8)
}

/// From the segments before the first scan; `None` if they are damaged.
fn is_subsampled_ycbcr(bytes: &[u8]) -> Option<bool> {
    let mut rest = bytes.get(2..)?;
    // What Adobe's segment says of the colours: 1 is YCbCr.
    let (mut is_jfif, mut adobe) = (false, None);
    loop {
        // Any number of fill bytes may stand before a marker.
        while rest.first() == Some(&0xFF) && rest.get(1) == Some(&0xFF) {
            rest = &rest[1..];
        }
        let (&[0xFF, marker, high, low], _) = rest.split_first_chunk::<4>()? else { return None };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let segment = rest.get(4..2 + length)?;
        match marker {
            0xE0 if segment.starts_with(b"JFIF\0") => is_jfif = true,
            0xEE if segment.starts_with(b"Adobe") => adobe = segment.get(11).copied(),
            // The frame's header; C4, C8 and CC are others.
            0xC0..=0xCF if !matches!(marker, 0xC4 | 0xC8 | 0xCC) => {
                let components = segment.get(6..)?.as_chunks::<3>().0;
                let [first, others @ ..] = components else { return None };
                let is_rgb = components.iter().map(|component| component[0]).eq(*b"RGB");
                let ycbcr = components.len() == 3 && (is_jfif || adobe.map_or(!is_rgb, |transform| transform == 1));
                return Some(ycbcr && others.iter().any(|other| other[1] != first[1]));
            }
            0xDA => return None,
            _ => {}
        }
        rest = &rest[2 + length..];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;
    use crate::stats::figures::measured;

    /// The segments of a picture up to the frame's header, with these components: number and sampling factors.
    fn head(before: &[u8], components: &[[u8; 2]]) -> Vec<u8> {
        let mut bytes = vec![0xFF, 0xD8];
        bytes.extend(before);
        let length = 8 + 3 * components.len() as u8;
        bytes.extend([0xFF, 0xC0, 0, length, 8, 0, 4, 0, 4, components.len() as u8]);
        components.iter().for_each(|[number, sampling]| bytes.extend([*number, *sampling, 0]));
        bytes
    }

    #[test]
    fn only_ycbcr_with_chroma_of_lower_resolution() {
        const HALF: [[u8; 2]; 3] = [[1, 0x22], [2, 0x11], [3, 0x11]];
        const FULL: [[u8; 2]; 3] = [[1, 0x11], [2, 0x11], [3, 0x11]];
        const RGB: [[u8; 2]; 3] = [[b'R', 0x22], [b'G', 0x11], [b'B', 0x11]];
        let adobe = |transform| [&[0xFF, 0xEE, 0, 14][..], b"Adobe", &[0, 100, 0, 0, 0, 0, transform]].concat();
        assert_eq!(is_subsampled_ycbcr(&head(&[], &HALF)), Some(true));
        assert_eq!(is_subsampled_ycbcr(&head(&[], &FULL)), Some(false));
        assert_eq!(is_subsampled_ycbcr(&head(&[], &RGB)), Some(false));
        assert_eq!(is_subsampled_ycbcr(&head(&adobe(0), &HALF)), Some(false));
        assert_eq!(is_subsampled_ycbcr(&head(&adobe(1), &HALF)), Some(true));
        assert_eq!(is_subsampled_ycbcr(&head(b"\xFF\xE0\x00\x07JFIF\0", &RGB)), Some(true));
        assert_eq!(is_subsampled_ycbcr(&head(&[], &HALF[..1])), Some(false));
        let whole = head(&adobe(1), &HALF);
        for end in 0..whole.len() {
            assert_eq!(is_subsampled_ycbcr(&whole[..end]), None, "{end}");
        }
    }

    /// Colours of a picture with noisy chroma, the same in blocks of two by two, are right in the mean. Those of the crate
    /// `image` are not: else this file were of no use.
    #[test]
    fn the_mean_of_noisy_chroma_is_kept() {
        const SIZE: usize = 256;
        let mut pcg = Pcg32::new(1, 2);
        let mut chroma = || (0..SIZE * SIZE / 4).map(|_| 108 + (41.0 * pcg.next_f32()) as u8).collect::<Vec<u8>>();
        let (cb, cr) = (chroma(), chroma());
        let block = |i: usize| i / SIZE / 2 * (SIZE / 2) + i % SIZE / 2;
        let pixels: Vec<u8> = (0..SIZE * SIZE).flat_map(|i| [120, cb[block(i)], cr[block(i)]]).collect();
        let mut bytes = Vec::new();
        let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, 100);
        encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_2_2);
        encoder.encode(&pixels, SIZE as u16, SIZE as u16, jpeg_encoder::ColorType::Ycbcr).unwrap();

        let mean = |values: &[u8], channel: usize| {
            values.iter().skip(channel).step_by(3).map(|v| f64::from(*v)).sum::<f64>() / (SIZE * SIZE) as f64
        };
        let [y, b, r] = [0, 1, 2].map(|channel| mean(&pixels, channel));
        let (b, r) = (b - 128.0, r - 128.0);
        let expected = [y + 1.402 * r, y - 0.344_136 * b - 0.714_136 * r, y + 1.772 * b];
        let (_, _, ours) = read(&bytes, &ReadLimits::default()).unwrap().unwrap();
        let plain = image::load_from_memory(&bytes).unwrap().to_rgb8().into_raw();
        let off = |values: &[u8]| [0, 1, 2].map(|channel| mean(values, channel) - expected[channel]);
        measured("the_mean_of_noisy_chroma_is_kept", format!("{:.2?} of 255, plain {:.2?}", off(&ours), off(&plain)));
        assert!(off(&ours).iter().all(|error| error.abs() < 0.1), "{:?}", off(&ours));
        assert!(off(&plain)[2] > 0.25, "{:?}", off(&plain));
    }

    #[test]
    fn colours_are_those_of_the_standard() {
        assert_eq!(rgb([255, 128, 128]), [255; 3]);
        assert_eq!(rgb([76, 85, 255]), [254, 0, 0]);
        assert_eq!(rgb([29, 255, 107]), [0, 0, 254]);
        assert_eq!(rgb([0, 255, 255]), [178, 0, 225]);
        // Rounded to the nearest, whatever the numbers: of each, 11 values that are spread over all.
        let values = || (0..=255).step_by(25).map(|v| v as u8);
        for (y, cb, cr) in values().flat_map(|y| values().flat_map(move |b| values().map(move |r| (y, b, r)))) {
            let [yy, b, r] = [y, cb, cr].map(f64::from);
            let exact = [
                yy + 1.402 * (r - 128.0),
                yy - 0.344_136 * (b - 128.0) - 0.714_136 * (r - 128.0),
                yy + 1.772 * (b - 128.0),
            ];
            for (value, exact) in rgb([y, cb, cr]).map(f64::from).into_iter().zip(exact) {
                assert!((value - exact.clamp(0.0, 255.0)).abs() < 0.5001, "{y} {cb} {cr}: {value} {exact}");
            }
        }
    }
}
