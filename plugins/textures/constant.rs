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

    /// As the reference renderer: the luminance is for textures that vary.
    fn scalar(&self, _hit: &SurfaceHit) -> f32 {
        self.0.mean()
    }

    fn mean(&self) -> f32 {
        self.0.mean()
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
        self.color.mean()
    }

    fn mean(&self) -> f32 {
        self.color.mean()
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

#[cfg(test)]
mod tests {
    use crate::emitters::testing::{self, assert_close, float, rgb, text, vector};
    use lucerna_core::color::{Rgb, spectrum};
    use lucerna_core::scene::{Object, ObjectKind, Parameter, Slot, SpectrumValue};

    fn constant(plugin: &str, parameters: Vec<Parameter>) -> Result<Rgb, String> {
        match testing::build(ObjectKind::Texture, plugin, parameters) {
            Ok(Object::Texture(texture)) => Ok(texture.constant().expect("it is the same everywhere")),
            Ok(_) => unreachable!("a texture was asked for"),
            Err(errors) => Err(errors.to_string()),
        }
    }

    #[test]
    fn colours_as_the_reference() {
        let color = Rgb::new(0.1, 0.2, 0.3);
        assert_eq!(constant("uniform", vec![float("value", 0.7)]), Ok(Rgb::splat(0.7)));
        assert_eq!(constant("d65", vec![float("scale", 2.0)]), Ok(Rgb::splat(2.0)));
        assert_eq!(constant("d65", vec![rgb("color", [0.1, 0.2, 0.3]), float("scale", 2.0)]), Ok(color * 2.0));
        assert_eq!(constant("srgb", vec![rgb("color", [0.1, 0.2, 0.3])]), Ok(color));
        assert!(constant("srgb", vec![rgb("color", [0.1, 2.0, 0.3])]).unwrap_err().contains("[0, 1]"));
        assert_eq!(constant("rawconstant", vec![float("value", 0.3)]), Ok(Rgb::splat(0.3)));
        assert_eq!(constant("rawconstant", vec![vector("value", [0.1, 0.2, 0.3])]), Ok(color));
        assert!(constant("rawconstant", vec![text("value", "red")]).is_err());
    }

    #[test]
    fn tables_mean_what_they_mean_as_properties() {
        let table = SpectrumValue::Table(vec![(400.0, 1.0), (500.0, 2.0), (600.0, 3.0)]);
        let expected = spectrum::to_rgb(&table, Slot::Emissive).0;
        let range = [float("wavelength_min", 400.0), float("wavelength_max", 600.0)];
        let regular = range.iter().cloned().chain([text("values", "1, 2 3")]).collect();
        assert_eq!(constant("regular", regular), Ok(expected));
        let irregular = vec![text("wavelengths", "400,500,600"), text("values", "1 2 3")];
        assert_eq!(constant("irregular", irregular), Ok(expected));
        let unordered = vec![text("wavelengths", "400,300"), text("values", "1 2")];
        assert!(constant("irregular", unordered).unwrap_err().contains("increase"));
        let short = vec![text("wavelengths", "400,500"), text("values", "1")];
        assert!(constant("irregular", short).unwrap_err().contains("found 1 and 2"));
        let word = vec![text("wavelengths", "400,500"), text("values", "1 x")];
        assert!(constant("irregular", word).unwrap_err().contains("\"x\""));
    }

    #[test]
    fn a_black_body_may_be_cut() {
        let whole = constant("blackbody", vec![float("temperature", 3200.0)]).unwrap();
        let all = vec![float("temperature", 3200.0), float("wavelength_min", 360.5)];
        assert_close(&constant("blackbody", all).unwrap().to_array(), &whole.to_array(), "nearly all of it");
        let red = vec![float("temperature", 3200.0), float("wavelength_min", 600.0)];
        // Without its green the light is redder than sRGB can show.
        let red = constant("blackbody", red).unwrap();
        assert!(red.r > 0.5 * whole.r && (red.g, red.b) == (0.0, 0.0), "{red:?}");
    }
}
