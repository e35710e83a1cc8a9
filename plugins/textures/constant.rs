//! What the plugins share that are the same everywhere.

use lucerna_core::color::{Rgb, spectrum};
use lucerna_core::interfaces::{SurfaceHit, Texture};
use lucerna_core::scene::{Failed, Properties, Slot, SpectrumValue};

/// A colour that is the same everywhere.
pub(super) struct Constant(pub Rgb);

impl Texture for Constant {
    fn color(&self, _hit: &SurfaceHit) -> Rgb {
        self.0
    }

    fn scalar(&self, _hit: &SurfaceHit) -> f32 {
        self.0.luminance()
    }

    fn mean(&self) -> f32 {
        self.0.luminance()
    }

    fn constant(&self) -> Option<Rgb> {
        Some(self.0)
    }
}

/// A spectrum that is the same everywhere. The slot it is put in decides about its colour; where nobody asks for a
/// slot, it is taken as light.
pub(super) struct Spectrum {
    spectrum: SpectrumValue,
    color: Rgb,
}

impl Spectrum {
    /// From a spectrum.
    pub fn new(spectrum: SpectrumValue) -> Self {
        let (color, _) = spectrum::to_rgb(&spectrum, Slot::Emissive);
        Spectrum { spectrum, color }
    }
}

impl Texture for Spectrum {
    fn color(&self, _hit: &SurfaceHit) -> Rgb {
        self.color
    }

    fn scalar(&self, _hit: &SurfaceHit) -> f32 {
        self.color.luminance()
    }

    fn mean(&self) -> f32 {
        self.color.luminance()
    }

    fn constant(&self) -> Option<Rgb> {
        Some(self.color)
    }

    fn spectrum(&self) -> Option<&SpectrumValue> {
        Some(&self.spectrum)
    }
}

/// The finite, non-negative numbers of a list with blanks or commas between them.
pub(super) fn numbers(p: &Properties<'_>, name: &str) -> Result<Vec<f64>, Failed> {
    p.string(name)
        .split(|c: char| c == ',' || c.is_ascii_whitespace())
        .filter(|word| !word.is_empty())
        .map(|word| match word.parse() {
            Ok(v) if f64::is_finite(v) && v >= 0.0 => Ok(v),
            _ => Err(p.error(name, format!("\"{word}\" in \"{name}\" is not a number from 0 on"))),
        })
        .collect()
}
