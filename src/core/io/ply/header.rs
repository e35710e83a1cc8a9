//! The text at the start of a PLY file: encoding, elements and their properties.

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Encoding, PropertyType, ScalarType};

use crate::io::{IoError, Result};

/// What one property of an element is, and how it is stored.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub name: String,
    /// For a list, the type of its length.
    pub length: Option<ScalarType>,
    /// The type of the value, or of every entry of a list.
    pub value: ScalarType,
}

/// A table of the file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes that one binary row takes at least, and exactly if there are no lists.
    pub fn smallest_row(&self) -> usize {
        self.properties.iter().map(|p| size_of(p.length.as_ref().unwrap_or(&p.value))).sum()
    }
}

/// Everything before the data.
#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Lines of the header, including `end_header`.
    pub lines: usize,
    /// Bytes of the header.
    pub length: usize,
}

/// Bytes of one binary number.
pub(super) fn size_of(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Longest header and most lines in it that are accepted; real files stay far below.
const LONGEST_HEADER: usize = 1 << 20;
const MOST_LINES: usize = 4096;

/// Reads the header through `ply-rs-bw`, after white space and comments have been cleaned away.
///
/// # Errors
/// With the line.
pub(super) fn read(bytes: &[u8]) -> Result<Header> {
    if !bytes.starts_with(b"ply") {
        return Err(IoError::new("is not a PLY file: it does not begin with \"ply\""));
    }
    let (mut clean, mut lines, mut length, mut declarations) = (String::new(), 0, 0, 0);
    let mut ended = false;
    while !ended {
        let rest = &bytes[length..bytes.len().min(LONGEST_HEADER)];
        let end = rest.iter().position(|&byte| byte == b'\n').filter(|_| lines < MOST_LINES);
        let end = end.ok_or_else(|| IoError::new(format!("line {}: the header has no end_header", lines + 1)))?;
        let text = String::from_utf8_lossy(&rest[..end]);
        let words: Vec<&str> = text.split_whitespace().collect();
        match words.first().copied().unwrap_or("comment") {
            "comment" | "obj_info" => clean.push_str("comment"),
            keyword => {
                declarations += usize::from(matches!(keyword, "element" | "property"));
                ended = keyword == "end_header";
                clean.push_str(&words.join(" "));
            }
        }
        clean.push('\n');
        length += end + 1;
        lines += 1;
    }
    let header = Parser::<DefaultElement>::new()
        .read_header(&mut Reader::new(clean.as_bytes()))
        .map_err(|error| IoError::new(not_understood(&error.to_string())))?;
    let elements: Vec<Element> = header.elements.into_values().map(element).collect::<Result<_>>()?;
    // The crate keeps only the last of several of the same name, after which all data would be misread.
    if elements.iter().map(|element| 1 + element.properties.len()).sum::<usize>() != declarations {
        return Err(IoError::new("the header declares an element or a property twice"));
    }
    Ok(Header { encoding: header.encoding, elements, lines, length })
}

/// What is wrong with a header by what the crate says, which begins with the line but knows no reasons.
fn not_understood(error: &str) -> String {
    match error.strip_prefix("Line ").and_then(|rest| rest.split(':').next()) {
        Some("1") => "line 1: there is more than \"ply\"".to_owned(),
        Some("2") => "line 2: the format is not ascii, binary_little_endian or binary_big_endian 1.0".to_owned(),
        Some(line) => format!("line {line}: neither an element with its count nor a property of a known type"),
        None => "the header is damaged".to_owned(),
    }
}

fn element(definition: ply_rs_bw::ply::ElementDef) -> Result<Element> {
    let properties = definition.properties.into_values().map(|property| match property.data_type {
        PropertyType::Scalar(value) => Ok(Property { name: property.name, length: None, value }),
        PropertyType::List(ScalarType::Float | ScalarType::Double, _) => {
            Err(IoError::new(format!("the length of the list \"{}\" is not an integer", property.name)))
        }
        PropertyType::List(length, value) => Ok(Property { name: property.name, length: Some(length), value }),
    });
    Ok(Element {
        name: definition.name,
        count: definition.count as u64,
        properties: properties.collect::<Result<_>>()?,
    })
}
