//! From the bytes of a file to text with line numbers.

use crate::scene::error::{Location, SceneError};
use std::sync::Arc;

/// Turns the bytes of a scene file into text: UTF-8 with or without byte order mark, UTF-16 of either byte order,
/// and ISO-8859-1 where the XML declaration says so.
///
/// # Errors
/// An empty file, an encoding other than these, and bytes that do not follow their encoding.
pub(super) fn decode(bytes: &[u8], file: &Arc<str>) -> Result<String, SceneError> {
    let whole_file = Location::file(Arc::clone(file));
    let fail = |message: &str| SceneError::at(&whole_file, message).hint("save it as UTF-8");
    if bytes.iter().all(|b| b.is_ascii_whitespace()) {
        return Err(SceneError::at(&whole_file, "the file is empty"));
    }
    let utf16 = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        let text: Result<String, _> = char::decode_utf16(units).collect();
        text.ok().filter(|_| bytes.len().is_multiple_of(2)).ok_or_else(|| fail("the file is not valid UTF-16"))
    };
    match bytes {
        [0xff, 0xfe, rest @ ..] => return utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => return utf16(rest, u16::from_be_bytes),
        [b'<', 0, ..] => return utf16(bytes, u16::from_le_bytes),
        [0, b'<', ..] => return utf16(bytes, u16::from_be_bytes),
        _ => {}
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match declared_encoding(bytes).as_deref() {
        None | Some("utf-8" | "utf8" | "us-ascii" | "ascii") => String::from_utf8(bytes.to_vec()).map_err(|error| {
            let valid = &bytes[..error.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|b| **b == b'\n').count() as u32;
            let at = Location { file: Arc::clone(file), line, column: 0 };
            SceneError::at(&at, "this line is not valid UTF-8")
                .hint("save the file as UTF-8, or declare encoding=\"ISO-8859-1\" if that is what it is")
        }),
        Some("iso-8859-1" | "latin1" | "latin-1") => Ok(bytes.iter().map(|b| char::from(*b)).collect()),
        Some(other) => Err(fail(&format!("the encoding \"{other}\" is not supported"))),
    }
}

/// The `encoding` of the XML declaration, in lower case.
fn declared_encoding(bytes: &[u8]) -> Option<String> {
    let declaration = bytes.strip_prefix(b"<?xml")?;
    let end = declaration.iter().take(200).position(|b| *b == b'>')?;
    let text = String::from_utf8_lossy(&declaration[..end]).to_ascii_lowercase();
    let value = text.split_once("encoding")?.1.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    value[1..].split_once(quote).map(|(name, _)| name.to_owned())
}

/// Translates byte offsets to lines and columns. Offsets that mostly grow cost one walk over the text in all, also
/// where the file is a single line of megabytes.
pub(super) struct Cursor<'t> {
    text: &'t str,
    file: Arc<str>,
    offset: usize,
    line: u32,
    column: u32,
}

impl<'t> Cursor<'t> {
    pub fn new(text: &'t str, file: Arc<str>) -> Self {
        Cursor { text, file, offset: 0, line: 1, column: 1 }
    }

    /// The place of the character at byte `offset`.
    pub fn locate(&mut self, offset: usize) -> Location {
        let offset = self.text.floor_char_boundary(offset);
        if offset < self.offset {
            (self.offset, self.line, self.column) = (0, 1, 1);
        }
        for (position, character) in self.text[self.offset..].char_indices() {
            if self.offset + position >= offset {
                break;
            }
            match character {
                '\n' => (self.line, self.column) = (self.line + 1, 1),
                _ => self.column += 1,
            }
        }
        self.offset = offset.min(self.text.len());
        Location { file: Arc::clone(&self.file), line: self.line, column: self.column }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &[u8]) -> Result<String, String> {
        decode(bytes, &"a.xml".into()).map_err(|e| e.to_string())
    }

    #[test]
    fn hc_i02_encodings() {
        let utf16 = |order: fn(u16) -> [u8; 2], text: &str| text.encode_utf16().flat_map(order).collect::<Vec<_>>();
        assert_eq!(text(b"\xef\xbb\xbf<a/>").as_deref(), Ok("<a/>"));
        assert_eq!(text(&utf16(u16::to_le_bytes, "\u{feff}<é/>")).as_deref(), Ok("<é/>"));
        assert_eq!(text(&utf16(u16::to_be_bytes, "\u{feff}<é/>")).as_deref(), Ok("<é/>"));
        assert_eq!(text(&utf16(u16::to_le_bytes, "<é/>")).as_deref(), Ok("<é/>"));
        let latin = b"<?xml version='1.0' encoding='ISO-8859-1'?><\xe9/>";
        assert_eq!(text(latin).as_deref(), Ok("<?xml version='1.0' encoding='ISO-8859-1'?><é/>"));
    }

    #[test]
    fn hc_i02_messages() {
        assert_eq!(text(b"").unwrap_err(), "a.xml: the file is empty");
        assert_eq!(text(b" \n").unwrap_err(), "a.xml: the file is empty");
        assert_eq!(text(b"\xff\xfe<").unwrap_err(), "a.xml: the file is not valid UTF-16 (save it as UTF-8)");
        assert_eq!(
            text(b"<a>\n\xff</a>").unwrap_err(),
            "a.xml:2: this line is not valid UTF-8 (save the file as UTF-8, or declare encoding=\"ISO-8859-1\" if \
             that is what it is)"
        );
        assert_eq!(
            text(b"<?xml version=\"1.0\" encoding=\"Shift_JIS\"?><a/>").unwrap_err(),
            "a.xml: the encoding \"shift_jis\" is not supported (save it as UTF-8)"
        );
    }

    #[test]
    fn columns_count_characters() {
        let mut cursor = Cursor::new("é<a/>\n\t<b/>", "x".into());
        let place = |l: Location| (l.line, l.column);
        assert_eq!(place(cursor.locate(2)), (1, 2));
        assert_eq!(place(cursor.locate(8)), (2, 2));
        assert_eq!(place(cursor.locate(0)), (1, 1));
        assert_eq!(place(cursor.locate(999)), (2, 6));
    }
}
