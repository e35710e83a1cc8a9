//! The values of a picture, as compact as its file had them.

use half::f16;
use lucerna_core::color::Rgb;
use lucerna_core::image::{PixelData, Samples, srgb_byte_to_linear, srgb_to_linear};
use lucerna_core::math::UVec2;
use rayon::prelude::*;

/// How texels are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Bytes stay bytes, 16-bit and half-precision values are kept in half precision, others in single precision.
    Auto,
    /// In half precision.
    Half,
    /// In single precision.
    Single,
}

/// How often each byte occurs in each of `N` interleaved channels.
fn histograms<const N: usize>(values: &[u8]) -> [[u64; 256]; N] {
    const PIECE: usize = 1 << 18;
    let count = |pixels: &[[u8; N]]| {
        let mut counts = [[0; 256]; N];
        for pixel in pixels {
            for (counts, value) in counts.iter_mut().zip(pixel) {
                counts[usize::from(*value)] += 1;
            }
        }
        counts
    };
    let add = |mut sum: [[u64; 256]; N], more: [[u64; 256]; N]| {
        sum.iter_mut().flatten().zip(more.iter().flatten()).for_each(|(sum, more)| *sum += more);
        sum
    };
    values.as_chunks::<N>().0.par_chunks(PIECE).map(count).reduce(|| [[0; 256]; N], add)
}

enum Storage {
    /// With the value that each byte stands for.
    Bytes(Vec<u8>, Box<[f32; 256]>),
    Half(Vec<f16>),
    Single(Vec<f32>),
}

impl Storage {
    #[inline]
    fn get(&self, index: usize) -> f32 {
        match self {
            Storage::Bytes(values, decode) => decode[usize::from(values[index])],
            Storage::Half(values) => values[index].to_f32(),
            Storage::Single(values) => values[index],
        }
    }
}

/// Decoded, linear texels of one or three channels.
pub(super) struct Texels {
    /// Columns and rows.
    pub size: UVec2,
    grey: bool,
    storage: Storage,
}

impl Texels {
    /// From a picture; `raw` leaves out the decoding of sRGB. A message if a value is not finite.
    pub fn new(picture: PixelData, raw: bool, format: Format) -> Result<Self, String> {
        let (size, channels) = (UVec2::new(picture.width, picture.height), picture.channels as usize);
        let decode = picture.srgb && !raw;
        let is_16_bit = matches!(picture.samples, Samples::U16(_) | Samples::F16(_));
        let storage = match (picture.samples, format) {
            (Samples::U8(bytes), Format::Auto) => {
                let value = |byte| if decode { srgb_byte_to_linear(byte) } else { f32::from(byte) / 255.0 };
                Storage::Bytes(bytes, Box::new(std::array::from_fn(|byte| value(byte as u8))))
            }
            (Samples::F16(values), Format::Auto | Format::Half) if !decode => Storage::Half(values),
            (Samples::F32(values), Format::Auto | Format::Single) if !decode => Storage::Single(values),
            (samples, format) => {
                let value = |i| if decode { srgb_to_linear(samples.get(i)) } else { samples.get(i) };
                let values = (0..samples.len()).map(value);
                if format == Format::Half || format == Format::Auto && is_16_bit {
                    Storage::Half(values.map(f16::from_f32).collect())
                } else {
                    Storage::Single(values.collect())
                }
            }
        };
        let texels = Texels { size, grey: channels == 1, storage };
        if matches!(texels.storage, Storage::Bytes(..)) {
            return Ok(texels);
        }
        let count = size.x as usize * size.y as usize * channels;
        match (0..count).find(|i| !texels.storage.get(*i).is_finite()) {
            None => Ok(texels),
            Some(i) => {
                let (x, y) = (i / channels % size.x as usize, i / channels / size.x as usize);
                Err(format!("pixel ({x}, {y}) is {}", texels.storage.get(i)))
            }
        }
    }

    /// Whether there is one channel only.
    pub fn is_grey(&self) -> bool {
        self.grey
    }

    /// Colour of a texel.
    #[inline]
    pub fn color(&self, x: u32, y: u32) -> Rgb {
        let i = y as usize * self.size.x as usize + x as usize;
        if self.grey {
            return Rgb::splat(self.storage.get(i));
        }
        // One look at how values are kept for three of them.
        match &self.storage {
            Storage::Bytes(values, decode) => {
                let [r, g, b] = [0, 1, 2].map(|c| decode[usize::from(values[3 * i + c])]);
                Rgb::new(r, g, b)
            }
            Storage::Half(values) => {
                Rgb::new(values[3 * i].to_f32(), values[3 * i + 1].to_f32(), values[3 * i + 2].to_f32())
            }
            Storage::Single(values) => Rgb::new(values[3 * i], values[3 * i + 1], values[3 * i + 2]),
        }
    }

    /// Value or luminance of a texel.
    #[inline]
    pub fn scalar(&self, x: u32, y: u32) -> f32 {
        if self.grey { self.color(x, y).r } else { self.color(x, y).luminance() }
    }

    /// Values or luminances of all texels, row by row.
    pub fn scalars(&self) -> impl Iterator<Item = f32> {
        (0..self.size.y).flat_map(move |y| (0..self.size.x).map(move |x| self.scalar(x, y)))
    }

    /// Mean of the values or luminances.
    pub fn mean(&self) -> f32 {
        let count = f64::from(self.size.x) * f64::from(self.size.y);
        let sum = match &self.storage {
            // Large pictures are mostly of this kind: counting is several times faster than adding up.
            Storage::Bytes(values, decode) => {
                let total = |counts: &[u64; 256]| -> f64 {
                    counts.iter().zip(decode.iter()).map(|(count, value)| *count as f64 * f64::from(*value)).sum()
                };
                if self.grey {
                    let [counts] = histograms(values);
                    total(&counts)
                } else {
                    let [r, g, b] = histograms(values).map(|counts| (total(&counts) / count) as f32);
                    return Rgb::new(r, g, b).luminance();
                }
            }
            _ => self.scalars().map(f64::from).sum(),
        };
        (sum / count) as f32
    }

    /// Smallest and largest value in any channel.
    pub fn range(&self) -> [f32; 2] {
        if let Storage::Bytes(values, decode) = &self.storage {
            let (min, max) = values.iter().fold((255, 0), |(min, max), v| (*v.min(&min), *v.max(&max)));
            // Decoding keeps the order.
            return [min, max].map(|byte: u8| decode[usize::from(byte)]);
        }
        let count = self.size.x as usize * self.size.y as usize * if self.grey { 1 } else { 3 };
        let widen = |[min, max]: [f32; 2], value: f32| [min.min(value), max.max(value)];
        (0..count).map(|i| self.storage.get(i)).fold([f32::INFINITY, f32::NEG_INFINITY], widen)
    }
}
