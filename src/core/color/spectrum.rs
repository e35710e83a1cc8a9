//! Spectra reduced to linear RGB, as the reference renderer does in its RGB variants.

use super::{Rgb, cie};
use crate::scene::SpectrumValue;
use crate::scene::param::Slot;

/// Number of wavelengths at which a spectrum is integrated.
const STEPS: usize = 1000;

/// CIE XYZ to linear sRGB primaries.
const XYZ_TO_RGB: [[f64; 3]; 3] =
    [[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]];

/// The RGB colour of a spectrum in a slot, and whether it had to be clipped.
///
/// A table is zero outside its wavelengths. In a slot of light it is integrated as it is, else as seen under D65 of
/// luminance 1. Negative channels (colours more saturated than sRGB can show) become 0, and those of a reflectance
/// above 1 become 1. A uniform spectrum is the grey of its value, except as light.
pub fn to_rgb(spectrum: &SpectrumValue, slot: Slot) -> (Rgb, bool) {
    match spectrum {
        // Equal energy is XYZ (1, 1, 1): a little pinkish, since white is D65.
        SpectrumValue::Uniform(v) if slot == Slot::Emissive => (Rgb::from_f64(xyz_to_rgb([*v; 3])), false),
        SpectrumValue::Uniform(v) => (Rgb::splat(*v as f32), false),
        SpectrumValue::Table(table) => clip(integrate(|wavelength| interpolate(table, wavelength), slot), slot),
        SpectrumValue::Blackbody { temperature, scale } => {
            let (color, _) = clip(integrate(|wavelength| scale * planck(*temperature, wavelength), slot), slot);
            // Planckian colours below 1900 K are redder than sRGB can show: nothing to warn about.
            (color, false)
        }
    }
}

/// Radiance of a black body in W·m⁻²·sr⁻¹·nm⁻¹ at a temperature in kelvin and a wavelength in nm (Planck 1901).
pub fn planck(temperature: f64, wavelength: f64) -> f64 {
    /// 2hc² in W·m²·sr⁻¹ and hc/k in m·K, from the exact constants of the SI of 2019.
    const C1: f64 = 1.191_042_972e-16;
    const C2: f64 = 1.438_776_877e-2;
    let metres = wavelength * 1e-9;
    C1 / (metres.powi(5) * (C2 / (metres * temperature)).exp_m1()) * 1e-9
}

/// RGB of a spectrum: mean over evenly spaced wavelengths from 360 nm to 830 nm, both included.
fn integrate(value: impl Fn(f64) -> f64, slot: Slot) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for i in 0..STEPS {
        let wavelength = cie::FIRST + (cie::LAST - cie::FIRST) * i as f64 / (STEPS - 1) as f64;
        let light = match slot {
            Slot::Emissive => 1.0,
            Slot::Reflectance | Slot::Unbounded => cie::D65_NORMALIZATION * cie::lookup(&cie::D65, wavelength),
        };
        let value = value(wavelength) * light;
        for (sum, table) in xyz.iter_mut().zip([&cie::X, &cie::Y, &cie::Z]) {
            *sum += value * cie::lookup(table, wavelength);
        }
    }
    let normalization = (cie::LAST - cie::FIRST) / (cie::Y_INTEGRAL * STEPS as f64);
    xyz_to_rgb(xyz.map(|sum| sum * normalization))
}

fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    XYZ_TO_RGB.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// Linear interpolation in `(wavelength, value)` pairs of increasing wavelength; zero outside.
fn interpolate(table: &[(f64, f64)], wavelength: f64) -> f64 {
    let above = table.partition_point(|(w, _)| *w < wavelength);
    match (above.checked_sub(1).map(|i| table[i]), table.get(above)) {
        (_, Some((w, v))) if *w == wavelength => *v,
        (Some((w0, v0)), Some((w1, v1))) => v0 + (v1 - v0) * (wavelength - w0) / (w1 - w0),
        _ => 0.0,
    }
}

/// The colour in the range of the slot, and whether it was outside by more than rounding.
fn clip(color: [f64; 3], slot: Slot) -> (Rgb, bool) {
    let max = if slot == Slot::Reflectance { 1.0 } else { f64::INFINITY };
    let clipped = color.iter().any(|c| *c < -1e-5 || *c > max + 1e-5);
    (Rgb::from_f64(color.map(|c| c.clamp(0.0, max))), clipped)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(a: Rgb, b: [f32; 3], relative: f32) {
        for (a, b) in a.to_array().into_iter().zip(b) {
            assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
        }
    }

    /// From reference/golden_lights.py.
    #[test]
    fn tables_as_the_reference() {
        let table = SpectrumValue::Table(vec![(400.0, 0.1), (500.0, 0.9), (600.0, 0.3), (700.0, 1.0)]);
        let wide = SpectrumValue::Table(vec![(300.0, 100.0), (900.0, 0.1)]);
        let green = SpectrumValue::Table(vec![(500.0, 1.0), (510.0, 1.0)]);
        let golden = [
            (&table, Slot::Emissive, [0.3876353, 0.6355715, 0.46352857], false),
            (&table, Slot::Reflectance, [0.27836826, 0.6754094, 0.5230798], false),
            (&table, Slot::Unbounded, [0.27836826, 0.6754094, 0.5230798], false),
            (&wide, Slot::Emissive, [53.23938, 56.344406, 70.11741], false),
            (&wide, Slot::Reflectance, [1.0, 1.0, 1.0], true),
            (&wide, Slot::Unbounded, [42.94258, 59.473537, 76.46025], false),
            (&green, Slot::Emissive, [0.0, 0.0712441, 0.013314232], true),
            (&green, Slot::Reflectance, [0.0, 0.07811082, 0.014623177], true),
        ];
        for (spectrum, slot, expected, clips) in golden {
            let (color, clipped) = to_rgb(spectrum, slot);
            assert_close(color, expected, 3e-6);
            assert_eq!(clipped, clips);
        }
    }

    #[test]
    fn the_slot_decides_what_a_uniform_spectrum_is() {
        let spectrum = SpectrumValue::Uniform(2.0);
        assert_close(to_rgb(&spectrum, Slot::Emissive).0, [2.4095878, 1.896582, 1.8178321], 1e-6);
        assert_eq!(to_rgb(&spectrum, Slot::Unbounded).0, Rgb::splat(2.0));
        // The integral gives the same but for the ends of the observer's curves.
        assert_close(Rgb::from_f64(integrate(|_| 1.0, Slot::Emissive)), [1.2047939, 0.948291, 0.90891606], 5e-4);
    }

    #[test]
    fn black_bodies() {
        // Wien's displacement law: the maximum is at 2.8978e6 nm·K / T.
        let peak = (300..2000).max_by(|a, b| planck(5000.0, *a as f64).total_cmp(&planck(5000.0, *b as f64)));
        assert_eq!(peak, Some(580));
        // Stefan and Boltzmann: the integral over wavelength is σT⁴/π.
        let total: f64 = (0..200_000).map(|i| planck(5000.0, 50.0 + i as f64)).sum();
        assert!((total / (5.670374419e-8 * 5000f64.powi(4) / std::f64::consts::PI) - 1.0).abs() < 1e-3);
        let color = |temperature| to_rgb(&SpectrumValue::Blackbody { temperature, scale: 1.0 }, Slot::Emissive).0;
        let (warm, neutral, cold) = (color(2700.0), color(6500.0), color(12000.0));
        assert!(warm.r > 2.0 * warm.b && cold.b > 1.3 * cold.r);
        assert!((neutral.r / neutral.b - 1.0).abs() < 0.05);
        assert_eq!(color(1000.0).b, 0.0);
        let doubled = to_rgb(&SpectrumValue::Blackbody { temperature: 2700.0, scale: 2.0 }, Slot::Emissive).0;
        assert_eq!(doubled, warm * 2.0);
    }
}
