//! The guards that every reader of foreign files uses.
//!
//! Nearly all known holes in readers of scene files are one of four: a declared size is trusted, an index is not
//! checked, a multiplication overflows, a recursion has no end. Here is one helper against each: [`declared`],
//! [`index`], [`product`] and [`deeper`]; [`Cursor`] rests on them and never reads past the end.

use super::{IoError, Result};

/// Against trusted sizes: turns a declared number of `what` into a length, if the `available` bytes that are left can
/// hold that many at `bytes_each` (the smallest encoding of one, at least 1).
///
/// # Errors
/// If the file is too short for what it declares.
pub fn declared(count: u64, bytes_each: u64, available: usize, what: &str) -> Result<usize> {
    match count.checked_mul(bytes_each.max(1)) {
        Some(bytes) if bytes <= available as u64 => Ok(count as usize),
        _ => Err(IoError::new(format!(
            "declares {count} {what} of at least {bytes_each} bytes each, but only {available} bytes are left"
        ))),
    }
}

/// Against unchecked indices: the index as `u32`, if it lies in `0..length`. `what` names its owner, say `face 7`.
///
/// # Errors
/// If the index is negative or too large.
pub fn index(index: i64, length: usize, what: impl FnOnce() -> String) -> Result<u32> {
    match u32::try_from(index) {
        Ok(small) if (small as usize) < length => Ok(small),
        _ => Err(IoError::new(format!("{}: index {index} is out of range, there are {length}", what()))),
    }
}

/// Against overflow: the product of all factors.
///
/// # Errors
/// If it does not fit.
pub fn product(factors: &[u64], what: &str) -> Result<usize> {
    factors
        .iter()
        .try_fold(1u64, |product, &factor| product.checked_mul(factor))
        .and_then(|product| usize::try_from(product).ok())
        .ok_or_else(|| IoError::new(format!("the size of {what} overflows ({factors:?})")))
}

/// Against endless recursion: the depth one level further down, at most `limit`.
///
/// # Errors
/// If the limit is exceeded.
pub fn deeper(depth: usize, limit: usize, what: &str) -> Result<usize> {
    if depth < limit { Ok(depth + 1) } else { Err(IoError::new(format!("{what} nested deeper than {limit} levels"))) }
}

/// Against panics in libraries, some of which subtract or index without looking when a file is damaged. The panic's own
/// message still goes to standard error, for it deserves a report to the library; the caller gets an error.
///
/// # Errors
/// If `read` fails or panics.
pub fn shielded<T>(what: &str, read: impl FnOnce() -> Result<T>) -> Result<T> {
    // Nothing that `read` leaves half done can be seen afterwards: readers only build what they return.
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(read))
        .unwrap_or_else(|_| Err(IoError::new(format!("{what} is damaged and cannot be decoded"))))
}

/// A position in the bytes of a file.
#[derive(Clone, Debug)]
pub struct Cursor<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Cursor<'a> {
    /// A cursor at the start.
    pub fn new(bytes: &'a [u8]) -> Self {
        Cursor { bytes, position: 0 }
    }

    /// Bytes before the cursor.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Everything behind the cursor.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.position..]
    }

    /// The next `count` bytes; `what` says what they should have been.
    ///
    /// # Errors
    /// If fewer are left.
    pub fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8]> {
        let taken = self
            .rest()
            .get(..count)
            .ok_or_else(|| IoError::new(format!("byte {}: the file ends inside {what}", self.position)))?;
        self.position += count;
        Ok(taken)
    }

    /// The next `N` bytes as an array, to be fed to `from_le_bytes` and the like.
    ///
    /// # Errors
    /// If fewer are left.
    pub fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    /// The next number, little-endian.
    ///
    /// # Errors
    /// If the file ends before.
    pub fn u16(&mut self, what: &str) -> Result<u16> {
        self.array(what).map(u16::from_le_bytes)
    }

    /// As [`u16`](Self::u16).
    ///
    /// # Errors
    /// If the file ends before.
    pub fn u32(&mut self, what: &str) -> Result<u32> {
        self.array(what).map(u32::from_le_bytes)
    }

    /// As [`u16`](Self::u16).
    ///
    /// # Errors
    /// If the file ends before.
    pub fn u64(&mut self, what: &str) -> Result<u64> {
        self.array(what).map(u64::from_le_bytes)
    }

    /// As [`u16`](Self::u16); it may be infinite or no number.
    ///
    /// # Errors
    /// If the file ends before.
    pub fn f32(&mut self, what: &str) -> Result<f32> {
        self.array(what).map(f32::from_le_bytes)
    }

    /// As [`u16`](Self::u16); it may be infinite or no number.
    ///
    /// # Errors
    /// If the file ends before.
    pub fn f64(&mut self, what: &str) -> Result<f64> {
        self.array(what).map(f64::from_le_bytes)
    }

    /// Bytes with their number before them.
    ///
    /// # Errors
    /// If fewer are left.
    pub fn block(&mut self, what: &str) -> Result<&'a [u8]> {
        let length = self.u64(what)?;
        let length = declared(length, 1, self.rest().len(), "bytes")?;
        self.take(length, what)
    }

    /// Text with its length before it.
    ///
    /// # Errors
    /// If it is cut short or no UTF-8.
    pub fn text(&mut self, what: &str) -> Result<String> {
        let bytes = self.block(what)?;
        String::from_utf8(bytes.to_vec()).map_err(|_| IoError::new(format!("{what} is no text")))
    }

    /// A number of things, of which each takes `bytes_each` of what is left at least.
    ///
    /// # Errors
    /// If they cannot be there.
    pub fn count(&mut self, bytes_each: u64, what: &str) -> Result<usize> {
        let count = self.u32(what)?;
        declared(count.into(), bytes_each, self.rest().len(), what)
    }

    /// Checks that nothing is left.
    ///
    /// # Errors
    /// If something is.
    pub fn end(&self) -> Result<()> {
        match self.rest().len() {
            0 => Ok(()),
            left => Err(IoError::new(format!("{left} bytes are left over at the end"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declared_counts_are_held_against_the_bytes_left() {
        assert_eq!(declared(4, 12, 48, "vertices"), Ok(4));
        assert!(declared(5, 12, 48, "vertices").is_err());
        assert!(declared(u64::MAX, 12, usize::MAX, "vertices").is_err());
        assert!(declared(4_000_000_000, 0, 48, "nothings").is_err(), "elements without content count one byte each");
    }

    #[test]
    fn indices_products_and_depths_are_checked() {
        assert_eq!(index(2, 3, String::new), Ok(2));
        assert!(index(3, 3, || "face 7".into()).unwrap_err().message.contains("face 7"));
        assert!(index(-1, 3, String::new).is_err());
        assert!(index(1 << 32, usize::MAX, String::new).is_err());
        assert_eq!(product(&[30_000, 30_000, 4], "pixels"), Ok(3_600_000_000));
        assert!(product(&[1 << 32, 1 << 32], "voxels").is_err());
        assert_eq!(deeper(255, 256, "elements"), Ok(256));
        assert!(deeper(256, 256, "elements").is_err());
    }

    #[test]
    fn a_panic_becomes_an_error() {
        let shift = [1, 2].len();
        assert!(shielded("the picture", || Ok([0; 2][shift])).unwrap_err().message.contains("the picture is damaged"));
        assert_eq!(shielded("the picture", || Ok(7)), Ok(7));
    }

    #[test]
    fn a_cursor_stops_at_the_end() {
        let mut cursor = Cursor::new(&[1, 2, 3]);
        assert_eq!(cursor.array::<2>("a pair"), Ok([1, 2]));
        assert_eq!(cursor.take(2, "a pair").unwrap_err().message, "byte 2: the file ends inside a pair");
        assert_eq!(cursor.rest(), [3]);
        assert_eq!(cursor.position(), 2);
    }
}
