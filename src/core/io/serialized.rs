//! The `serialized` meshes of Mitsuba 0.x, format versions 3 and 4.
//!
//! Each shape of a file begins with the 16-bit numbers 0x041C and version, followed by a zlib stream: 32-bit flags; in
//! version 4 a name ended by a zero; 64-bit numbers of vertices and triangles; positions, normals, texture coordinates
//! and colours as floats of the flagged width; 32-bit indices. The file ends with the offset of every shape (64 bits
//! in version 4, 32 in version 3) and their 32-bit number. All little endian.

use std::io::{BufReader, Read};

use flate2::bufread::ZlibDecoder;
use glam::{Vec2, Vec3};

use super::limits::{Cursor, declared, index, product};
use super::{IoError, Result, TriangleMesh};

/// One shape of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct SerializedMesh {
    /// The triangles; colours are not kept.
    pub mesh: TriangleMesh,
    /// The shape's name; empty in version 3.
    pub name: String,
    /// Whether the shape asks to be shaded flat, by its geometric normals.
    pub face_normals: bool,
}

const NORMALS: u32 = 0x1;
const UVS: u32 = 0x2;
const COLORS: u32 = 0x8;
const FACE_NORMALS: u32 = 0x10;
const SINGLE: u32 = 0x1000;
const DOUBLE: u32 = 0x2000;

/// A shape may inflate to this much, or to [`MOST_INFLATION`] times its compressed size if that is more.
const ALWAYS_ALLOWED: u64 = 64 << 20;
const MOST_INFLATION: u64 = 64;
const LONGEST_NAME: usize = 1 << 12;

/// Reads the shape number `shape_index` (from 0) of a file.
///
/// # Errors
/// If the file is truncated or damaged, has fewer shapes, declares more data than its size can hold, or the mesh is
/// empty, not finite or has indices out of range.
pub fn read(bytes: &[u8], shape_index: usize) -> Result<SerializedMesh> {
    let version = magic(&mut Cursor::new(bytes))?;
    let (start, end) = shape_range(bytes, shape_index, version)?;
    let mut cursor = Cursor::new(&bytes[start..end]);
    let version = magic(&mut cursor)?;
    let compressed = cursor.rest();
    let mut stream = Inflated { stream: BufReader::new(ZlibDecoder::new(compressed)), position: 0 };
    shape(&mut stream, version, compressed.len() as u64)
        .map_err(|error| IoError::new(format!("shape {shape_index} at byte {start}: {error}")))
}

/// Checks the start of a file or shape and returns the version.
fn magic(cursor: &mut Cursor<'_>) -> Result<u16> {
    let at = cursor.position();
    let magic = u16::from_le_bytes(cursor.array("the file format")?);
    let version = u16::from_le_bytes(cursor.array("the version")?);
    match (magic, version) {
        (0x041C, 3 | 4) => Ok(version),
        (0x041C, _) => Err(IoError::new(format!("byte {at}: version {version} is not supported, only 3 and 4"))),
        _ => Err(IoError::new(format!("byte {at}: not a serialized mesh"))),
    }
}

/// The bytes of one shape, by the table at the end of the file.
fn shape_range(bytes: &[u8], shape_index: usize, version: u16) -> Result<(usize, usize)> {
    let width = if version == 4 { 8 } else { 4 };
    let Some((body, count)) = bytes.split_last_chunk::<4>() else {
        return Err(IoError::new("the file ends before the table of shapes"));
    };
    let count = declared(u32::from_le_bytes(*count).into(), width as u64, body.len(), "shapes")
        .map_err(|error| IoError::new(format!("the table at the end {}: is the file complete?", error.message)))?;
    if shape_index >= count {
        return Err(IoError::new(format!("shape {shape_index} does not exist, the file has {count} (from 0)")));
    }
    let table = body.len() - count * width;
    let offset = |shape: usize| {
        let mut number = [0; 8];
        number[..width].copy_from_slice(&body[table + shape * width..][..width]);
        u64::from_le_bytes(number)
    };
    let start = offset(shape_index);
    if start >= table as u64 {
        return Err(IoError::new(format!("the offset {start} of shape {shape_index} is outside the file")));
    }
    Ok((start as usize, table))
}

/// The inflated bytes of a shape.
struct Inflated<'a> {
    /// Buffered, because names and indices are read in small pieces.
    stream: BufReader<ZlibDecoder<&'a [u8]>>,
    position: u64,
}

impl Inflated<'_> {
    fn fill(&mut self, buffer: &mut [u8], what: &str) -> Result<()> {
        self.stream.read_exact(buffer).map_err(|error| {
            let place = format!("inflated byte {}, {what}", self.position);
            match error.kind() {
                std::io::ErrorKind::UnexpectedEof => IoError::new(format!("{place}: the data ends here")),
                _ => IoError::from_library(&place, error),
            }
        })?;
        self.position += buffer.len() as u64;
        Ok(())
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut array = [0; N];
        self.fill(&mut array, what)?;
        Ok(array)
    }

    /// `count` rows of `N` numbers of four or eight bytes, handed over one row at a time, so that memory grows only
    /// with what has really been inflated.
    fn rows<const N: usize>(
        &mut self,
        count: usize,
        double: bool,
        what: &str,
        mut row: impl FnMut([f32; N]),
    ) -> Result<()> {
        let width = if double { 8 } else { 4 };
        let mut buffer = vec![0; 1024 * N * width];
        let mut left = count;
        while left > 0 {
            let now = left.min(1024);
            let bytes = &mut buffer[..now * N * width];
            self.fill(bytes, what)?;
            for bytes in bytes.chunks_exact(N * width) {
                let mut values = [0.0; N];
                for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(width)) {
                    let mut number = [0; 8];
                    number[..width].copy_from_slice(bytes);
                    let [a, b, c, d, ..] = number;
                    *value = if double { f64::from_le_bytes(number) as f32 } else { f32::from_le_bytes([a, b, c, d]) };
                }
                row(values);
            }
            left -= now;
        }
        Ok(())
    }
}

fn shape(stream: &mut Inflated<'_>, version: u16, compressed: u64) -> Result<SerializedMesh> {
    let flags = u32::from_le_bytes(stream.array("flags")?);
    let double = match flags & (SINGLE | DOUBLE) {
        SINGLE => false,
        DOUBLE => true,
        _ => return Err(IoError::new("the flags demand neither or both of single and double precision")),
    };
    let mut name = Vec::new();
    if version == 4 {
        loop {
            match stream.array("name")? {
                [0] => break,
                [_] if name.len() == LONGEST_NAME => return Err(IoError::new("the name has no end")),
                [byte] => name.push(byte),
            }
        }
    }
    let vertex_count = u64::from_le_bytes(stream.array("vertex count")?);
    let triangle_count = u64::from_le_bytes(stream.array("triangle count")?);

    let has = |flag: u32| u64::from(flags & flag != 0);
    let floats = 3 + 3 * has(NORMALS) + 2 * has(UVS) + 3 * has(COLORS);
    let vertex_bytes = product(&[vertex_count, floats, if double { 8 } else { 4 }], "the vertices")?;
    let triangle_bytes = product(&[triangle_count, 12], "the triangles")?;
    let total = (vertex_bytes as u64).saturating_add(triangle_bytes as u64);
    let allowed = ALWAYS_ALLOWED.max(compressed.saturating_mul(MOST_INFLATION));
    if total > allowed || vertex_count > u64::from(u32::MAX) {
        return Err(IoError::new(format!(
            "declares {vertex_count} vertices and {triangle_count} triangles, {total} bytes, in {compressed} compressed bytes"
        )));
    }
    let (vertices, triangles) = (vertex_count as usize, triangle_count as usize);

    let mut mesh = TriangleMesh::default();
    stream.rows(vertices, double, "positions", |p: [f32; 3]| mesh.positions.push(Vec3::from(p)))?;
    if flags & NORMALS != 0 {
        stream.rows(vertices, double, "normals", |n: [f32; 3]| mesh.normals.push(Vec3::from(n)))?;
    }
    if flags & UVS != 0 {
        stream.rows(vertices, double, "texture coordinates", |uv: [f32; 2]| mesh.uvs.push(Vec2::from(uv)))?;
    }
    if flags & COLORS != 0 {
        stream.rows(vertices, double, "colours", |_: [f32; 3]| ())?;
    }
    for face in 0..triangles {
        let bytes: [u8; 12] = stream.array("indices")?;
        let mut triangle = [0; 3];
        for (corner, bytes) in triangle.iter_mut().zip(bytes.as_chunks::<4>().0) {
            let stored = i64::from(u32::from_le_bytes(*bytes));
            *corner = index(stored, vertices, || format!("face {face} (from 0)"))?;
        }
        mesh.triangles.push(triangle);
    }
    Ok(SerializedMesh {
        mesh: mesh.finish()?,
        name: String::from_utf8_lossy(&name).into_owned(),
        face_normals: flags & FACE_NORMALS != 0,
    })
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::{Compression, write::ZlibEncoder};

    use super::*;

    fn content(version: u16, flags: u32, counts: [u64; 2], indices: &[u32]) -> Vec<u8> {
        let mut bytes = flags.to_le_bytes().to_vec();
        if version == 4 {
            bytes.extend(b"shape\0");
        }
        counts.iter().for_each(|count| bytes.extend(count.to_le_bytes()));
        let mut floats = |values: &[f32]| {
            for &value in values {
                match flags & DOUBLE {
                    0 => bytes.extend(value.to_le_bytes()),
                    _ => bytes.extend(f64::from(value).to_le_bytes()),
                }
            }
        };
        floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        if flags & NORMALS != 0 {
            floats(&[0.0, 0.0, 1.0].repeat(3));
        }
        if flags & UVS != 0 {
            floats(&[0.0, 0.0, 0.25, 0.0, 0.0, 0.5]);
        }
        if flags & COLORS != 0 {
            floats(&[9.0; 9]);
        }
        indices.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
        bytes
    }

    fn file(version: u16, contents: &[Vec<u8>]) -> Vec<u8> {
        let (mut bytes, mut offsets) = (Vec::new(), Vec::new());
        for content in contents {
            offsets.push(bytes.len() as u64);
            bytes.extend(0x041Cu16.to_le_bytes());
            bytes.extend(version.to_le_bytes());
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(content).unwrap();
            bytes.extend(encoder.finish().unwrap());
        }
        for offset in &offsets {
            bytes.extend(&offset.to_le_bytes()[..if version == 4 { 8 } else { 4 }]);
        }
        bytes.extend((offsets.len() as u32).to_le_bytes());
        bytes
    }

    fn triangle(version: u16, flags: u32) -> Vec<u8> {
        content(version, flags, [3, 1], &[0, 1, 2])
    }

    fn error(content: Vec<u8>) -> String {
        read(&file(4, &[content]), 0).unwrap_err().message
    }

    #[test]
    fn both_versions_and_all_flags_load() {
        for version in [3, 4] {
            for precision in [SINGLE, DOUBLE] {
                let all = NORMALS | UVS | COLORS | FACE_NORMALS | precision;
                let bytes = file(version, &[triangle(version, precision), triangle(version, all)]);
                let first = read(&bytes, 0).unwrap();
                assert_eq!(first.mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
                assert!(first.mesh.normals.is_empty() && first.mesh.uvs.is_empty() && !first.face_normals);
                let second = read(&bytes, 1).unwrap();
                assert_eq!(second.name, if version == 4 { "shape" } else { "" });
                assert_eq!(second.mesh.normals, [Vec3::Z; 3]);
                assert_eq!(second.mesh.uvs[1..], [Vec2::new(0.25, 0.0), Vec2::new(0.0, 0.5)]);
                assert_eq!(second.mesh.triangles, [[0, 1, 2]]);
                assert!(second.face_normals);
                assert!(read(&bytes, 2).unwrap_err().message.contains("shape 2 does not exist, the file has 2"));
            }
        }
    }

    #[test]
    fn errors_name_the_place() {
        assert!(error(content(4, SINGLE, [3, 1], &[0, 1, 3])).contains("face 0 (from 0): index 3"));
        assert!(error(content(4, SINGLE, [3, 2], &[0, 1, 2])).contains("indices: the data ends here"));
        assert!(error(content(4, SINGLE, [3, 0], &[])).contains("no faces"));
        assert!(error(content(4, 0, [3, 1], &[0, 1, 2])).contains("precision"));
        assert_eq!(read(b"", 0).unwrap_err().message, "byte 0: the file ends inside the file format");
        assert!(read(b"\x1C\x04\x05\x00", 0).unwrap_err().message.contains("version 5"));
        assert!(read(b"not a mesh", 0).unwrap_err().message.contains("not a serialized mesh"));
        let mut damaged = file(4, &[triangle(4, SINGLE)]);
        damaged[4] ^= 0xFF;
        assert!(read(&damaged, 0).unwrap_err().message.starts_with("shape 0 at byte 0: inflated byte 0"));
        let end = damaged.len() - 4;
        damaged[end..].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(read(&damaged, 0).unwrap_err().message.contains("declares 4294967295 shapes"));
    }

    #[test]
    fn declared_sizes_beyond_reason_are_refused_without_allocating() {
        for counts in [[u64::MAX, 1], [3, u64::MAX], [1 << 40, 1], [3, 1 << 33], [u64::MAX / 12, u64::MAX / 12]] {
            let message = error(content(4, SINGLE, counts, &[0, 1, 2]));
            assert!(message.contains("declares") || message.contains("overflows"), "{message}");
        }
        // A bomb: 120 MB of zeros in 120 kB.
        let mut bomb = SINGLE.to_le_bytes().to_vec();
        bomb.push(0);
        bomb.extend(10_000_000u64.to_le_bytes());
        bomb.extend(0u64.to_le_bytes());
        bomb.resize(120_000_000, 0);
        assert!(error(bomb).contains("declares 10000000 vertices"));
    }
}
