//! Voxel grids in the `.vol` format, version 3 with 32-bit floats.
//!
//! `VOL`, the byte 3, then 32-bit integers: type (1, floats), size in x, y and z, channels; six floats: the corners
//! of a box; then the values, channel fastest, then x, y, z. All little endian.

use glam::Vec3;

use super::limits::{Cursor, product};
use super::{IoError, Result};

/// A grid of values.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Voxels in x, y and z, at least 1 each.
    pub size: [u32; 3],
    /// Values per voxel, at least 1.
    pub channels: u32,
    /// Lower and upper corner of the box that the file states.
    pub bounds: [Vec3; 2],
    /// `x * y * z * channels` values, channel fastest, then x, y, z. All finite.
    pub data: Vec<f32>,
}

/// Reads a grid from the bytes of a file.
///
/// # Errors
/// If the file is of another format or type, its sizes are not positive, it is too short for them, or a value is not
/// finite (with its voxel).
pub fn read(bytes: &[u8]) -> Result<VoxelGrid> {
    let mut cursor = Cursor::new(bytes);
    match cursor.array("the file format")? {
        [b'V', b'O', b'L', 3] => {}
        [b'V', b'O', b'L', version] => {
            return Err(IoError::new(format!("version {version} of the volume format is not supported, only 3")));
        }
        _ => return Err(IoError::new("not a volume file")),
    }
    let kind = i32::from_le_bytes(cursor.array("the type")?);
    if kind != 1 {
        return Err(IoError::new(format!("type {kind} is not supported, only 1 (32-bit floats)")));
    }
    let mut sizes = [0; 4];
    for size in &mut sizes {
        let stored = i32::from_le_bytes(cursor.array("the size")?);
        *size = u32::try_from(stored).ok().filter(|&size| size > 0).ok_or_else(|| {
            IoError::new(format!("byte {}: the size {stored} is not positive", cursor.position() - 4))
        })?;
    }
    let mut bounds = [Vec3::ZERO; 2];
    for corner in &mut bounds {
        for axis in 0..3 {
            corner[axis] = f32::from_le_bytes(cursor.array("the box")?);
        }
    }
    let [x, y, z, channels] = sizes;
    let length = product(&[u64::from(x), u64::from(y), u64::from(z), u64::from(channels), 4], "the grid")?;
    let left = cursor.rest().len();
    let values = cursor.rest().get(..length).ok_or_else(|| {
        IoError::new(format!(
            "declares {x} x {y} x {z} voxels with {channels} channels, {length} bytes, but has {left}"
        ))
    })?;
    let data: Vec<f32> = values.as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    if let Some(value) = data.iter().position(|value| !value.is_finite()) {
        let voxel = value / channels as usize;
        let (x, y) = (x as usize, y as usize);
        let place = [voxel % x, voxel / x % y, voxel / x / y];
        return Err(IoError::new(format!("voxel {place:?} (from 0) is not finite")));
    }
    Ok(VoxelGrid { size: [x, y, z], channels, bounds, data })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(sizes: [i32; 4], values: &[f32]) -> Vec<u8> {
        let mut bytes = b"VOL\x03\x01\0\0\0".to_vec();
        sizes.iter().for_each(|size| bytes.extend(size.to_le_bytes()));
        [0.0f32, 0.0, 0.0, 1.0, 2.0, 3.0].iter().chain(values).for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes
    }

    fn error(bytes: &[u8]) -> String {
        read(bytes).unwrap_err().message
    }

    #[test]
    fn a_grid_loads() {
        let values: Vec<f32> = (0..12).map(|i| i as f32).collect();
        let grid = read(&file([2, 3, 1, 2], &values)).unwrap();
        assert_eq!((grid.size, grid.channels, grid.bounds[1]), ([2, 3, 1], 2, Vec3::new(1.0, 2.0, 3.0)));
        assert_eq!(grid.data, values);
    }

    #[test]
    fn errors_tell_what_is_wrong() {
        assert_eq!(error(b"VOX\x03"), "not a volume file");
        assert!(error(b"VOL\x02").contains("version 2"));
        assert!(error(b"VOL\x03\x02\0\0\0").contains("type 2"));
        assert_eq!(error(b"VOL\x03\x01\0\0\0\x02"), "byte 8: the file ends inside the size");
        assert_eq!(error(&file([2, -3, 1, 1], &[])), "byte 12: the size -3 is not positive");
        assert!(error(&file([i32::MAX; 4], &[])).contains("overflows"));
        assert!(error(&file([30_000, 30_000, 1, 1], &[0.0])).contains("3600000000 bytes, but has 4"));
        assert_eq!(error(&file([2, 1, 2, 1], &[0.0, 0.0, 0.0, f32::NAN])), "voxel [1, 0, 1] (from 0) is not finite");
    }
}
