//! OpenEXR, through the `exr` crate.

use std::collections::{HashMap, HashSet};
use std::io::Cursor;
use std::path::Path;

use ::exr::block::lines::LineRef;
use ::exr::block::reader::{ChunksReader, Reader};
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use ::exr::image::{Blocks, write::WritableImage};
use ::exr::math::Vec2;
use ::exr::meta::MetaData;
use ::exr::meta::attribute::{AttributeValue, LineOrder, SampleType, Text};
use ::exr::meta::header::{Header, LayerAttributes};
use half::f16;
use rayon::prelude::*;

use super::{Image, PixelData, ReadLimits, Samples};
use crate::io::limits::{declared, shielded};
use crate::io::{IoError, Result, output, read_bytes};

pub use ::exr::compression::Compression;

/// How to write.
#[derive(Clone, Debug)]
pub struct ExrOptions {
    /// Which channels are stored as half floats.
    pub half: HalfChannels,
    /// ZIP over 16 lines by default.
    pub compression: Compression,
    /// Further attributes of the header, say the renderer's name and the samples per pixel.
    pub attributes: Vec<(String, Attribute)>,
}

impl Default for ExrOptions {
    fn default() -> Self {
        ExrOptions { half: HalfChannels::None, compression: Compression::ZIP16, attributes: Vec::new() }
    }
}

/// Which channels are stored as half floats; the others are single floats.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum HalfChannels {
    /// None.
    #[default]
    None,
    /// All.
    All,
    /// One answer per channel, in the order of the picture's channels; missing answers mean no.
    Each(Vec<bool>),
}

/// The value of an attribute in the header.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text.
    Text(String),
    /// A number, stored as double.
    Number(f64),
    /// An integer, stored as 32 bits where it fits and as double otherwise.
    Integer(i64),
}

/// Writes all channels as one part, sorted by name as the format demands.
///
/// # Errors
/// If the file cannot be written, the sizes in `image` do not fit together, or two channels have the same name.
pub fn write(path: &Path, image: &Image, options: &ExrOptions) -> Result<()> {
    let exr = to_exr(image, options)?;
    output::replace_file(path, |file| {
        exr.write().to_buffered(file).map_err(|error| IoError::from_library("cannot write the EXR file", error))
    })
}

fn text(text: &str) -> Result<Text> {
    let valid = !text.is_empty() && text.len() < 256 && !text.contains('\0');
    Text::new_or_none(text).filter(|_| valid).ok_or_else(|| IoError::new(format!("{text:?} cannot be a name in EXR")))
}

fn to_exr(image: &Image, options: &ExrOptions) -> Result<ExrImage<Layer<AnyChannels<FlatSamples>>>> {
    image.check()?;
    let count = image.channels.len();
    let mut list = Vec::with_capacity(count);
    for (number, name) in image.channels.iter().enumerate() {
        if image.channels[..number].contains(name) {
            return Err(IoError::new(format!("two channels have the name {name:?}")));
        }
        let values = image.data.iter().skip(number).step_by(count);
        let half = match &options.half {
            HalfChannels::None => false,
            HalfChannels::All => true,
            HalfChannels::Each(each) => each.get(number).copied().unwrap_or(false),
        };
        let samples = if half {
            FlatSamples::F16(values.map(|&value| f16::from_f32(value)).collect())
        } else {
            FlatSamples::F32(values.copied().collect())
        };
        list.push(AnyChannel::new(text(name)?, samples));
    }
    let mut attributes = LayerAttributes::default();
    for (name, value) in &options.attributes {
        let value = match value {
            Attribute::Text(value) => {
                let value = Text::new_or_none(value)
                    .ok_or_else(|| IoError::new(format!("the attribute {name:?} has characters beyond Latin-1")))?;
                // The crate keeps the standard names apart.
                match name.as_str() {
                    "software" => attributes.software_name = Some(value),
                    "comments" => attributes.comments = Some(value),
                    "owner" => attributes.owner = Some(value),
                    _ => _ = attributes.other.insert(text(name)?, AttributeValue::Text(value)),
                }
                continue;
            }
            Attribute::Number(value) => AttributeValue::F64(*value),
            Attribute::Integer(value) => {
                i32::try_from(*value).map_or(AttributeValue::F64(*value as f64), AttributeValue::I32)
            }
        };
        attributes.other.insert(text(name)?, value);
    }
    let encoding =
        Encoding { compression: options.compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (image.width as usize, image.height as usize);
    Ok(ExrImage::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(list.into()))))
}

/// A picture with all its channels, and the text and number attributes of its header.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrFile {
    /// All channels, sorted by name; in a file of several parts, those of all parts that have the size of the first,
    /// with the part's name and a dot in front.
    pub image: Image,
    /// Attributes of the first part that are text or numbers, sorted by name, without those every file has.
    pub attributes: Vec<(String, Attribute)>,
}

/// Reads all channels of an EXR file.
///
/// # Errors
/// If the file cannot be read, is damaged or deep, or exceeds `limits`.
pub fn read(path: &Path, limits: &ReadLimits) -> Result<ExrFile> {
    read_from_bytes(&read_bytes(path)?, limits)
}

/// As [`read`], for a file in memory.
///
/// # Errors
/// As [`read`].
pub fn read_from_bytes(bytes: &[u8], limits: &ReadLimits) -> Result<ExrFile> {
    shielded("the EXR file", || read_all(bytes, limits))
}

fn read_all(bytes: &[u8], limits: &ReadLimits) -> Result<ExrFile> {
    let reader = open(bytes)?;
    let headers = reader.headers();
    let size = headers[0].layer_size;
    let (mut wanted, mut channels) = (Vec::new(), Vec::new());
    for (part, header) in headers.iter().enumerate().filter(|(_, header)| header.layer_size == size) {
        for (number, channel) in header.channels.list.iter().enumerate() {
            let prefix = header.own_attributes.layer_name.as_ref().filter(|_| headers.len() > 1);
            channels.push(prefix.map_or_else(|| channel.name.to_string(), |part| format!("{part}.{}", channel.name)));
            wanted.push((part, number));
        }
    }
    let mut attributes: Vec<_> = headers[0]
        .own_attributes
        .other
        .iter()
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(value) => Attribute::Text(value.to_string()),
                AttributeValue::F64(value) => Attribute::Number(*value),
                AttributeValue::F32(value) => Attribute::Number(f64::from(*value)),
                AttributeValue::I32(value) => Attribute::Integer(i64::from(*value)),
                _ => return None,
            };
            Some((name.to_string(), value))
        })
        .collect();
    let own = &headers[0].own_attributes;
    for (name, value) in [("software", &own.software_name), ("comments", &own.comments), ("owner", &own.owner)] {
        attributes.extend(value.as_ref().map(|value| (name.to_owned(), Attribute::Text(value.to_string()))));
    }
    attributes.sort_by(|a, b| a.0.cmp(&b.0));
    let data = load(reader, &wanted, bytes.len(), limits, |value| value, f16::to_f32)?;
    Ok(ExrFile { image: Image { width: size.0 as u32, height: size.1 as u32, channels, data }, attributes })
}

/// Which channels of which part make the colour of a texture.
struct Choice {
    part: usize,
    color: Vec<usize>,
    alpha: Option<usize>,
    xyz: bool,
}

fn choose(headers: &[Header]) -> Choice {
    // (prefix, last component) of every channel name.
    let split = |name: &str| match name.rsplit_once('.') {
        Some((prefix, last)) => (prefix.to_owned(), last.to_owned()),
        None => (String::new(), name.to_owned()),
    };
    let parts: Vec<Vec<(String, String)>> = headers
        .iter()
        .map(|header| header.channels.list.iter().map(|channel| split(&channel.name.to_string())).collect())
        .collect();
    for (components, xyz) in [(&["R", "G", "B"][..], false), (&["X", "Y", "Z"], true), (&["Y"], false)] {
        // Channels without a prefix come before those with one.
        for bare in [true, false] {
            for (part, names) in parts.iter().enumerate() {
                let find = |prefix: &str, last: &str| names.iter().position(|(p, l)| p == prefix && l == last);
                let starts = names.iter().filter(|(prefix, last)| last == components[0] && prefix.is_empty() == bare);
                for (prefix, _) in starts {
                    let color: Option<Vec<usize>> = components.iter().map(|last| find(prefix, last)).collect();
                    if let Some(color) = color {
                        return Choice { part, color, alpha: find(prefix, "A"), xyz };
                    }
                }
            }
        }
    }
    Choice { part: 0, color: vec![0], alpha: None, xyz: false }
}

/// Reads the colour channels of a file, see [`super::read`].
pub(super) fn read_color(bytes: &[u8], limits: &ReadLimits) -> Result<PixelData> {
    shielded("the EXR file", || read_chosen(bytes, limits))
}

fn read_chosen(bytes: &[u8], limits: &ReadLimits) -> Result<PixelData> {
    let reader = open(bytes)?;
    let Choice { part, color, alpha, xyz } = choose(reader.headers());
    let header = &reader.headers()[part];
    let (Vec2(width, height), channels) = (header.layer_size, color.len());
    let wanted: Vec<(usize, usize)> = color.iter().chain(&alpha).map(|&channel| (part, channel)).collect();
    let all_half = wanted.iter().all(|&(_, c)| header.channels.list[c].sample_type == SampleType::F16);
    let (samples, alpha) = if all_half && !xyz {
        let values = load(reader, &wanted, bytes.len(), limits, f16::from_f32, |value| value)?;
        let (color, alpha) = separate(values, channels, alpha.is_some());
        (Samples::F16(color), alpha.map(Samples::F16))
    } else {
        let values = load(reader, &wanted, bytes.len(), limits, |value| value, f16::to_f32)?;
        let (mut color, alpha) = separate(values, channels, alpha.is_some());
        if xyz {
            color.as_chunks_mut().0.iter_mut().for_each(|pixel| *pixel = xyz_to_rgb(*pixel));
        }
        (Samples::F32(color), alpha.map(Samples::F32))
    };
    let (width, height) = (width as u32, height as u32);
    Ok(PixelData { width, height, channels: channels as u32, samples, alpha, srgb: false })
}

/// Linear sRGB of CIE XYZ, both relative to D65 (IEC 61966-2-1:1999).
fn xyz_to_rgb([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.240_479 * x - 1.537_15 * y - 0.498_535 * z,
        -0.969_256 * x + 1.875_991 * y + 0.041_556 * z,
        0.055_648 * x - 0.204_043 * y + 1.057_311 * z,
    ]
}

/// Takes the last of every `channels + 1` values apart if there is opacity.
pub(super) fn separate<T: Copy>(values: Vec<T>, channels: usize, has_alpha: bool) -> (Vec<T>, Option<Vec<T>>) {
    if !has_alpha {
        return (values, None);
    }
    let pixels = values.chunks_exact(channels + 1);
    let alpha = pixels.clone().map(|pixel| pixel[channels]).collect();
    (pixels.flat_map(|pixel| &pixel[..channels]).copied().collect(), Some(alpha))
}

/// More channels than any renderer writes; choosing among them takes quadratic time.
const MOST_CHANNELS: usize = 4096;

type BytesReader<'a> = Reader<Cursor<&'a [u8]>>;

fn damaged(error: ::exr::error::Error) -> IoError {
    IoError::from_library("the EXR file cannot be read", error)
}

fn open(bytes: &[u8]) -> Result<BytesReader<'_>> {
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(damaged)?;
    let headers = reader.headers();
    if headers.is_empty() || headers.iter().any(|header| header.channels.list.is_empty()) {
        return Err(IoError::new("the EXR file has a part without channels"));
    }
    if headers.iter().map(|header| header.channels.list.len()).sum::<usize>() > MOST_CHANNELS {
        return Err(IoError::new(format!("the EXR file has more than {MOST_CHANNELS} channels")));
    }
    Ok(reader)
}

/// Chunks that are decompressed in parallel before their samples are put in place, and their total size.
const CHUNKS_AT_ONCE: usize = 64;
const BYTES_AT_ONCE: usize = 64 << 20;

/// Reads the `wanted` channels (part, channel), all of parts of the same size, interleaved in this order.
fn load<T: Clone + Default>(
    reader: BytesReader<'_>,
    wanted: &[(usize, usize)],
    file_size: usize,
    limits: &ReadLimits,
    from_f32: impl Fn(f32) -> T,
    from_f16: impl Fn(f16) -> T,
) -> Result<Vec<T>> {
    let headers = reader.headers();
    let Vec2(width, height) = headers[wanted[0].0].layer_size;
    let pixel_bytes = wanted.len() as u64 * size_of::<T>() as u64;
    let pixels = limits.check(width as u64, height as u64, pixel_bytes, file_size)?;
    let mut largest_chunk = 1;
    let whole = |Vec2(x, y): Vec2<usize>| x == 1 && y == 1;
    for &(part, channel) in wanted {
        let header = &headers[part];
        if header.deep || !whole(header.channels.list[channel].sampling) {
            return Err(IoError::new("deep and subsampled EXR files are not supported"));
        }
        // Every chunk takes at least its offset and its size, and is decompressed with all its channels.
        declared(header.chunk_count as u64, 12, file_size, "chunks")?;
        let Vec2(chunk_width, chunk_height) = header.max_block_pixel_size();
        let bytes = header.channels.bytes_per_pixel as u64;
        limits.check(chunk_width as u64, chunk_height as u64, bytes, file_size)?;
        largest_chunk = largest_chunk.max(header.max_block_byte_size());
    }
    let slots: HashMap<(usize, usize), usize> = wanted.iter().copied().zip(0..).collect();
    let parts: HashSet<usize> = wanted.iter().map(|&(part, _)| part).collect();
    let mut data = vec![T::default(); pixels * wanted.len()];
    let mut insert = |meta: &MetaData, block: UncompressedBlock| -> ::exr::error::UnitResult {
        let header = &meta.headers[block.index.layer];
        for LineRef { location, value } in block.lines(&header.channels) {
            let line = LineRef { location, value };
            let Some(&slot) = slots.get(&(location.layer, location.channel)) else { continue };
            let Vec2(x, y) = location.position;
            if y >= height || x.saturating_add(location.sample_count) > width {
                return Err(::exr::error::Error::Invalid("block outside the picture".into()));
            }
            let row = data[((y * width + x) * wanted.len() + slot)..].iter_mut().step_by(wanted.len());
            match header.channels.list[location.channel].sample_type {
                SampleType::F16 => fill(row, line.read_samples::<f16>(), &from_f16)?,
                SampleType::F32 => fill(row, line.read_samples::<f32>(), &from_f32)?,
                SampleType::U32 => fill(row, line.read_samples::<u32>(), |value| from_f32(value as f32))?,
            }
        }
        Ok(())
    };
    let mut chunks = reader
        .filter_chunks(false, |_, tile, block: BlockIndex| {
            tile.level_index == Vec2(0, 0) && parts.contains(&block.layer)
        })
        .map_err(damaged)?;
    // The crate's own parallel reading would abort the process if a damaged chunk made it panic in one of its threads.
    let meta = chunks.meta_data().clone();
    let at_once = (BYTES_AT_ONCE / largest_chunk).clamp(1, CHUNKS_AT_ONCE);
    loop {
        let batch = chunks.by_ref().take(at_once).collect::<::exr::error::Result<Vec<_>>>().map_err(damaged)?;
        if batch.is_empty() {
            return Ok(data);
        }
        let blocks: Vec<_> = batch
            .into_par_iter()
            .map(|chunk| UncompressedBlock::decompress_chunk(chunk, &meta, false))
            .collect::<::exr::error::Result<_>>()
            .map_err(damaged)?;
        blocks.into_iter().try_for_each(|block| insert(&meta, block)).map_err(damaged)?;
    }
}

fn fill<'a, S, T: 'a>(
    row: impl Iterator<Item = &'a mut T>,
    samples: impl Iterator<Item = ::exr::error::Result<S>>,
    convert: impl Fn(S) -> T,
) -> ::exr::error::UnitResult {
    for (to, sample) in row.zip(samples) {
        *to = convert(sample?);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use ::exr::meta::attribute::IntegerBounds;
    use ::exr::meta::header::ImageAttributes;

    use super::*;
    use crate::io::output::TestFolder;

    fn sample(width: u32, height: u32, channels: &[&str]) -> Image {
        let mut image = Image::new(width, height, channels);
        let count = channels.len();
        // The channel's number is the whole part, the pixel's the fraction.
        image.data.iter_mut().enumerate().for_each(|(i, value)| {
            *value = (i % count + 1) as f32 + (i / count % 512) as f32 / 1024.0;
        });
        image
    }

    fn encode(image: &Image, options: &ExrOptions) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        to_exr(image, options).unwrap().write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    fn color(image: &Image) -> PixelData {
        read_color(&encode(image, &ExrOptions::default()), &ReadLimits::default()).unwrap()
    }

    #[test]
    fn what_was_written_is_read_bit_for_bit() {
        let folder = TestFolder::new("exr");
        let path = folder.0.join("out.exr");
        let mut image = sample(37, 21, &["A", "B", "G", "R", "normal.X", "normal.Y"]);
        image.data[..6].copy_from_slice(&[f32::NAN, f32::INFINITY, -0.0, f32::MIN_POSITIVE / 2.0, -1e38, 65536.5]);
        let attributes = vec![
            ("samples".to_owned(), Attribute::Integer(64)),
            ("seconds".to_owned(), Attribute::Number(0.1)),
            ("software".to_owned(), Attribute::Text("Lucerna".into())),
        ];
        let bits = |image: &Image| image.data.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        for compression in [Compression::ZIP16, Compression::Uncompressed, Compression::RLE, Compression::PIZ] {
            let options = ExrOptions { compression, attributes: attributes.clone(), ..ExrOptions::default() };
            write(&path, &image, &options).unwrap();
            let file = read(&path, &ReadLimits::default()).unwrap();
            assert_eq!(file.image.channels, image.channels);
            assert_eq!(bits(&file.image), bits(&image));
            assert_eq!(file.attributes, attributes);
        }
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 1, "nothing temporary is left");
    }

    #[test]
    fn channels_are_sorted_and_large_pictures_load_in_parallel() {
        let image = sample(700, 400, &["R", "G", "B"]);
        let file = read_from_bytes(&encode(&image, &ExrOptions::default()), &ReadLimits::default()).unwrap();
        assert_eq!(file.image.channels, ["B", "G", "R"]);
        let (stored, given) = (file.image.pixel(699, 399), image.pixel(699, 399));
        assert_eq!([stored[2], stored[1], stored[0]], given);
        assert_eq!(color(&image).samples, Samples::F32(image.data));
    }

    #[test]
    fn the_colour_is_found_by_name() {
        for (names, picked, alpha) in [
            (&["R", "G", "B"][..], &[1.0, 2.0, 3.0][..], None),
            (&["R", "G", "B", "A", "depth.Y"], &[1.0, 2.0, 3.0], Some(4.0)),
            (&["left.B", "left.G", "left.R", "left.A"], &[3.0, 2.0, 1.0], Some(4.0)),
            (&["albedo.R", "albedo.G", "albedo.B", "R", "G", "B"], &[4.0, 5.0, 6.0], None),
            (&["Y", "A"], &[1.0], Some(2.0)),
            (&["R", "G", "Y"], &[3.0], None),
            (&["Z"], &[1.0], None),
        ] {
            let picture = color(&sample(4, 3, names));
            assert_eq!(picture.channels as usize, picked.len(), "{names:?}");
            picked.iter().enumerate().for_each(|(i, value)| assert_eq!(picture.samples.get(i), *value, "{names:?}"));
            assert_eq!(picture.alpha.map(|alpha| alpha.get(0)), alpha, "{names:?}");
            assert!(!picture.srgb);
        }
        let xyz = color(&sample(1, 1, &["X", "Y", "Z"])).to_f32(false);
        let reference = [-1.329_426, 2.907_394, 2.819_495];
        xyz.iter().zip(reference).for_each(|(value, expected)| assert!((value - expected).abs() < 2e-5, "{xyz:?}"));
    }

    #[test]
    fn displaced_tiled_and_many_part_files_load() {
        let image = sample(70, 50, &["R", "G", "B"]);
        let mut first = to_exr(&sample(70, 50, &["depth"]), &ExrOptions::default()).unwrap().layer_data;
        let mut second = to_exr(&image, &ExrOptions::default()).unwrap().layer_data;
        second.encoding.blocks = Blocks::Tiles(Vec2(32, 32));
        (first.attributes.layer_name, second.attributes.layer_name) = (Some("one".into()), Some("two".into()));
        (first.attributes.layer_position, second.attributes.layer_position) = (Vec2(-20, 7), Vec2(-20, 7));
        let window = IntegerBounds::from_dimensions((100, 100));
        let mut bytes = Cursor::new(Vec::new());
        let layers = ExrImage::from_layers(ImageAttributes::new(window), vec![first, second]);
        layers.write().to_buffered(&mut bytes).unwrap();
        let bytes = bytes.into_inner();
        let picture = read_color(&bytes, &ReadLimits::default()).unwrap();
        assert_eq!((picture.width, picture.height, picture.samples), (70, 50, Samples::F32(image.data)));
        let file = read_from_bytes(&bytes, &ReadLimits::default()).unwrap();
        assert_eq!(file.image.channels, ["one.depth", "two.B", "two.G", "two.R"]);
    }

    #[test]
    fn half_channels_stay_half() {
        let image = sample(5, 5, &["R", "G", "B", "A"]);
        let bytes = encode(&image, &ExrOptions { half: HalfChannels::All, ..ExrOptions::default() });
        let picture = read_color(&bytes, &ReadLimits::default()).unwrap();
        assert!(matches!(&picture.samples, Samples::F16(values) if values.len() == 75));
        assert_eq!(picture.samples.get(3), image.data[4]);
        let each = HalfChannels::Each(vec![true, false]);
        let bytes = encode(&image, &ExrOptions { half: each, ..ExrOptions::default() });
        let reader = open(&bytes).unwrap();
        let halves: Vec<String> = reader.headers()[0]
            .channels
            .list
            .iter()
            .filter(|channel| channel.sample_type == SampleType::F16)
            .map(|channel| channel.name.to_string())
            .collect();
        assert_eq!(halves, ["R"]);
    }

    #[test]
    fn wrong_pictures_are_refused() {
        let path = Path::new("/nowhere/at/all.exr");
        let options = ExrOptions::default();
        assert!(write(path, &sample(2, 2, &["R", "R"]), &options).unwrap_err().message.contains("two channels"));
        assert!(write(path, &sample(2, 2, &[""]), &options).unwrap_err().message.contains("name"));
        let image = Image { width: 9, ..sample(2, 2, &["R"]) };
        assert!(write(path, &image, &options).unwrap_err().message.contains("cannot have 4 values"));
        assert!(write(path, &sample(2, 2, &["R"]), &options).unwrap_err().message.contains("does not exist"));
        let limits = ReadLimits { most_side: 10, ..ReadLimits::default() };
        let bytes = encode(&sample(11, 2, &["R"]), &options);
        assert!(read_color(&bytes, &limits).unwrap_err().message.contains("1 to 10 per side"));
    }
}
