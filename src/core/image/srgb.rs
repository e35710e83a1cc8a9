//! The transfer function of sRGB (IEC 61966-2-1:1999).

use std::sync::LazyLock;

/// The linear value of an encoded one; the straight part continues below 0, the power above 1.
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The encoded value of a linear one; inverse of [`srgb_to_linear`].
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of an encoded byte, from a table.
pub fn srgb_byte_to_linear(encoded: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));
    TABLE[usize::from(encoded)]
}

/// The byte for a linear value, clamped to 0..=1 and rounded; NaN becomes 0.
pub fn linear_to_srgb_byte(linear: f32) -> u8 {
    // A cast from NaN gives 0.
    (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_has_its_known_values_and_inverse() {
        assert!((srgb_to_linear(128.0 / 255.0) - 0.215_860_5).abs() < 1e-6);
        assert_eq!((srgb_to_linear(0.0), linear_to_srgb(0.0)), (0.0, 0.0));
        assert!((srgb_to_linear(1.0) - 1.0).abs() < 1e-6 && (linear_to_srgb(1.0) - 1.0).abs() < 1e-6);
        for byte in 0..=255 {
            assert_eq!(linear_to_srgb_byte(srgb_byte_to_linear(byte)), byte);
        }
    }

    #[test]
    fn bytes_are_clamped() {
        for (linear, byte) in [(-1.0, 0), (2.0, 255), (f32::INFINITY, 255), (f32::NEG_INFINITY, 0), (f32::NAN, 0)] {
            assert_eq!(linear_to_srgb_byte(linear), byte);
        }
    }
}
