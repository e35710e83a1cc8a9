//! Reads the data of a PLY file row by row, whatever its layout.

use ply_rs_bw::ply::{Encoding, ScalarType};

use super::header::{Element, Header, size_of};
use crate::io::limits::{Cursor, declared};
use crate::io::{IoError, Result};

/// The values of one row; every entry belongs to the property of the same number.
#[derive(Debug, Default)]
pub(super) struct Row {
    /// Values of scalars, lengths of lists.
    pub scalars: Vec<f64>,
    /// Entries of lists, empty for scalars.
    pub lists: Vec<Vec<f64>>,
}

/// The part of a file that has not been read yet.
pub(super) enum Rows<'a> {
    /// One row per line.
    Ascii {
        /// Behind the current line.
        rest: &'a [u8],
        /// What is left of the current line.
        words: &'a [u8],
        /// Number of the current line, from 1.
        line: usize,
    },
    /// Numbers without separators.
    Binary {
        /// At the next number.
        cursor: Cursor<'a>,
        /// Order of the bytes.
        big_endian: bool,
    },
}

impl<'a> Rows<'a> {
    /// The rows behind a header.
    pub fn new(bytes: &'a [u8], header: &Header) -> Result<Self> {
        let mut cursor = Cursor::new(bytes);
        cursor.take(header.length, "the header")?;
        Ok(match header.encoding {
            Encoding::Ascii => Rows::Ascii { rest: cursor.rest(), words: &[], line: header.lines },
            encoding => Rows::Binary { cursor, big_endian: encoding == Encoding::BinaryBigEndian },
        })
    }

    /// Checks the number of rows that an element declares against the bytes left.
    pub fn count(&self, element: &Element) -> Result<usize> {
        let what = match element.name.as_str() {
            "vertex" => "vertices",
            "face" => "faces",
            _ => "rows of another element",
        };
        match self {
            // One digit per number and something behind each but the last of the file.
            Rows::Ascii { rest, .. } => {
                declared(element.count, 2 * element.properties.len() as u64, rest.len() + 1, what)
            }
            Rows::Binary { cursor, .. } => {
                declared(element.count, element.smallest_row() as u64, cursor.rest().len(), what)
            }
        }
    }

    /// Reads one row of `element`.
    pub fn read(&mut self, element: &Element, row: &mut Row) -> Result<()> {
        self.next_line();
        row.scalars.clear();
        row.lists.resize_with(element.properties.len(), Vec::new);
        for (property, list) in element.properties.iter().zip(&mut row.lists) {
            let value = self.number(property.length.as_ref().unwrap_or(&property.value), &property.name)?;
            row.scalars.push(value);
            list.clear();
            if property.length.is_some() {
                if value < 0.0 || value.fract() != 0.0 {
                    return Err(self.here(&format!("\"{}\" has the length {value}", property.name)));
                }
                let (left, bytes_each) = match self {
                    Rows::Ascii { words, .. } => (words.len() + 1, 2),
                    Rows::Binary { cursor, .. } => (cursor.rest().len(), size_of(&property.value) as u64),
                };
                let length = declared(value as u64, bytes_each, left, "list entries")
                    .map_err(|error| self.here(&error.message))?;
                list.reserve(length);
                for _ in 0..length {
                    list.push(self.number(&property.value, &property.name)?);
                }
            }
        }
        Ok(())
    }

    /// An error at the current position.
    fn here(&self, what: &str) -> IoError {
        IoError::new(match self {
            Rows::Ascii { line, .. } => format!("line {line}: {what}"),
            Rows::Binary { cursor, .. } => format!("byte {}: {what}", cursor.position()),
        })
    }

    /// In text, goes on to the next line that is not blank; what is left of the current one is dropped.
    fn next_line(&mut self) {
        if let Rows::Ascii { rest, words, line } = self {
            *words = &[];
            while words.is_empty() && !rest.is_empty() {
                let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
                *words = rest[..end].trim_ascii();
                *rest = rest.get(end + 1..).unwrap_or_default();
                *line += 1;
            }
        }
    }

    fn number(&mut self, scalar: &ScalarType, name: &str) -> Result<f64> {
        match self {
            Rows::Ascii { words, .. } => {
                let end = words.iter().position(u8::is_ascii_whitespace).unwrap_or(words.len());
                let (word, tail) = words.split_at(end);
                *words = tail.trim_ascii_start();
                fast_float2::parse(word).map_err(|_| self.here(&format!("no number for \"{name}\"")))
            }
            Rows::Binary { cursor, big_endian } => {
                let bytes = cursor.take(size_of(scalar), name)?;
                Ok(number(bytes, scalar, *big_endian))
            }
        }
    }
}

/// One binary number; `bytes` has the right length.
fn number(bytes: &[u8], scalar: &ScalarType, big_endian: bool) -> f64 {
    let mut little = [0; 8];
    for (i, &byte) in bytes.iter().enumerate() {
        little[if big_endian { bytes.len() - 1 - i } else { i }] = byte;
    }
    let [a, b, c, d, ..] = little;
    match scalar {
        ScalarType::Char => f64::from(a as i8),
        ScalarType::UChar => f64::from(a),
        ScalarType::Short => f64::from(i16::from_le_bytes([a, b])),
        ScalarType::UShort => f64::from(u16::from_le_bytes([a, b])),
        ScalarType::Int => f64::from(i32::from_le_bytes([a, b, c, d])),
        ScalarType::UInt => f64::from(u32::from_le_bytes([a, b, c, d])),
        ScalarType::Float => f64::from(f32::from_le_bytes([a, b, c, d])),
        ScalarType::Double => f64::from_le_bytes(little),
    }
}
