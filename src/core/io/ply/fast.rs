//! The short way for binary files in the usual layout: vertices of a fixed stride, faces with one list of integers.

use ply_rs_bw::ply::ScalarType;

use super::header::{Element, size_of};
use super::rows::Rows;
use super::{Faces, Target, Vertices};
use crate::io::Result;

/// Reads all vertices, column by column, if no property is a list and all that matter are 32-bit floats.
/// Returns whether it did.
pub(super) fn vertices(rows: &mut Rows<'_>, element: &Element, count: usize, vertices: &mut Vertices) -> Result<bool> {
    let Rows::Binary { cursor, big_endian } = rows else { return Ok(false) };
    let usual = element.properties.iter().zip(&vertices.targets).all(|(property, &target)| {
        property.length.is_none() && (target == Target::Nowhere || property.value == ScalarType::Float)
    });
    if !usual {
        return Ok(false);
    }
    let stride = element.smallest_row();
    let data = cursor.take(count * stride, "the vertices")?;
    let decode = if *big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
    let mut offset = 0;
    for (column, property) in element.properties.iter().enumerate() {
        if vertices.targets[column] != Target::Nowhere {
            for (vertex, row) in data.chunks_exact(stride).enumerate() {
                if let Some(bytes) = row[offset..].first_chunk::<4>() {
                    vertices.set(vertex, column, decode(*bytes));
                }
            }
        }
        offset += size_of(&property.value);
    }
    Ok(true)
}

/// Reads all faces, if they consist of nothing but a list of 32-bit integers with a one-byte length.
/// Returns whether it did.
pub(super) fn faces(rows: &mut Rows<'_>, element: &Element, count: usize, faces: &mut Faces) -> Result<bool> {
    let Rows::Binary { cursor, big_endian } = rows else { return Ok(false) };
    let [list] = &element.properties[..] else { return Ok(false) };
    let signed = match list.value {
        ScalarType::Int => true,
        ScalarType::UInt => false,
        _ => return Ok(false),
    };
    if list.length != Some(ScalarType::UChar) {
        return Ok(false);
    }
    let decode = if *big_endian { u32::from_be_bytes } else { u32::from_le_bytes };
    faces.triangles.reserve(count);
    for _ in 0..count {
        let [length] = cursor.array("the faces")?;
        let indices = cursor.take(usize::from(length) * 4, "the faces")?;
        let indices = indices.as_chunks::<4>().0.iter().map(|&bytes| decode(bytes));
        faces.push(indices.map(|i| if signed { i64::from(i as i32) } else { i64::from(i) }), |_| 0.0)?;
    }
    Ok(true)
}
