//! Files of our own, which keep what a run has found: what a guide has learnt, where a render stood.
//!
//! A file is eight bytes that name its kind, the version of its layout (`u32`), the content, and the CRC-32 of all that
//! before (`u32`); numbers are little-endian. Kind, version and checksum are looked at before the content. As a checksum
//! keeps accidents away and nobody's intentions, what reads the content trusts no number in it either.

use super::limits::Cursor;
use super::{IoError, Result, output, read_bytes};
use flate2::Crc;
use std::io::Write;
use std::path::Path;

/// A kind of file.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// The first bytes.
    pub magic: [u8; 8],
    /// Version of the layout.
    pub version: u32,
    /// What such a file is called in messages, with its article.
    pub what: &'static str,
}

/// Bytes before the content.
const HEAD: usize = 12;
/// Bytes after it.
const TAIL: usize = 4;

/// A file with this content.
pub fn seal(kind: Kind, content: &[u8]) -> Vec<u8> {
    let mut file = Vec::with_capacity(HEAD + content.len() + TAIL);
    file.extend(kind.magic);
    file.extend(kind.version.to_le_bytes());
    file.extend(content);
    let sum = checksum(&file);
    file.extend(sum.to_le_bytes());
    file
}

/// The content of a file.
///
/// # Errors
/// If it is of another kind or version, or damaged.
pub fn unseal(kind: Kind, file: &[u8]) -> Result<&[u8]> {
    if file.get(..kind.magic.len()) != Some(&kind.magic[..]) {
        return Err(IoError::new(format!("is not {}", kind.what)));
    }
    let version = Cursor::new(&file[kind.magic.len()..]).u32("the version")?;
    if version != kind.version {
        let (what, ours) = (kind.what, kind.version);
        return Err(IoError::new(format!("is {what} of version {version}, and this program knows version {ours}")));
    }
    let damaged = || IoError::new(format!("is {} that is damaged: its checksum is wrong", kind.what));
    let end = file.len().checked_sub(TAIL).filter(|end| *end >= HEAD).ok_or_else(damaged)?;
    match Cursor::new(&file[end..]).u32("the checksum")? == checksum(&file[..end]) {
        true => Ok(&file[HEAD..end]),
        false => Err(damaged()),
    }
}

/// The CRC-32 of some bytes.
pub fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// Writes a file, complete or not at all.
///
/// # Errors
/// If it cannot be written.
pub fn write(path: &Path, kind: Kind, content: &[u8]) -> Result<()> {
    let bytes = seal(kind, content);
    output::replace_file(path, |file| {
        file.write_all(&bytes).map_err(|error| IoError::from_library("cannot write the file", error))
    })
}

/// Reads the content of a file.
///
/// # Errors
/// If it cannot be read, is of another kind or version, or damaged.
pub fn read(path: &Path, kind: Kind) -> Result<Vec<u8>> {
    let mut file = read_bytes(path)?;
    let length = unseal(kind, &file)?.len();
    file.truncate(HEAD + length);
    drop(file.drain(..HEAD));
    Ok(file)
}

/// Puts numbers into bytes, little-endian. [`Cursor`] takes them out again.
#[derive(Default)]
pub struct Packer(pub Vec<u8>);

impl Packer {
    /// A whole number.
    pub fn u16(&mut self, value: u16) {
        self.0.extend(value.to_le_bytes());
    }

    /// A whole number.
    pub fn u32(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    /// A whole number.
    pub fn u64(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    /// A number, to the bit.
    pub fn f32(&mut self, value: f32) {
        self.0.extend(value.to_le_bytes());
    }

    /// A number, to the bit.
    pub fn f64(&mut self, value: f64) {
        self.0.extend(value.to_le_bytes());
    }

    /// Bytes with their number before them.
    pub fn block(&mut self, bytes: &[u8]) {
        self.u64(bytes.len() as u64);
        self.0.extend(bytes);
    }

    /// Text with its length before it.
    pub fn text(&mut self, text: &str) {
        self.block(text.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: Kind = Kind { magic: *b"LUCTEST\0", version: 3, what: "a test file" };

    #[test]
    fn content_comes_back_and_damage_is_told() {
        let mut content = Packer::default();
        content.u16(7);
        content.f64(-0.1);
        content.text("Straße");
        let file = seal(KIND, &content.0);
        let mut cursor = Cursor::new(unseal(KIND, &file).unwrap());
        assert_eq!((cursor.u16("a"), cursor.f64("b")), (Ok(7), Ok(-0.1)));
        assert_eq!(cursor.text("c").as_deref(), Ok("Straße"));
        for at in 0..file.len() {
            let mut bytes = file.clone();
            bytes[at] ^= 4;
            assert!(unseal(KIND, &bytes).is_err() && unseal(KIND, &file[..at]).is_err(), "{at}");
        }
        let told = |kind: Kind| unseal(kind, &file).unwrap_err().message;
        assert_eq!(told(Kind { magic: *b"ANOTHER\0", ..KIND }), "is not a test file");
        let newer = told(Kind { version: 4, ..KIND });
        assert_eq!(newer, "is a test file of version 3, and this program knows version 4");
    }
}
