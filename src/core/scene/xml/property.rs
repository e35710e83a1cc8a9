//! The values of property elements.

use super::attributes::Attributes;
use super::numbers::{self, Wrong};
use crate::scene::{Description, SpectrumValue, Value};

/// The elements that are properties.
pub(super) const PROPERTIES: [&str; 9] =
    ["float", "integer", "boolean", "string", "point", "vector", "rgb", "spectrum", "ref"];

/// Elements of old files that are read as properties, or as transforms.
pub(super) const OLD_PROPERTIES: [&str; 3] = ["srgb", "blackbody", "animation"];

/// The attributes of a property element.
pub(super) fn allowed(tag: &str) -> &'static [&'static str] {
    match tag {
        "point" | "vector" => &["name", "x", "y", "z", "value"],
        "spectrum" => &["name", "value", "filename"],
        "ref" => &["id", "name"],
        "blackbody" => &["name", "temperature", "scale"],
        _ => &["name", "value"],
    }
}

/// The value of a property element in a file of that version, and a note if it is written in an old way.
pub(super) fn value(
    attributes: &Attributes,
    version: [u32; 3],
    description: &Description,
) -> Result<(Value, Option<String>), (String, Option<String>)> {
    let owned = |(message, hint): Wrong| (message, hint.map(str::to_owned));
    match attributes.tag.as_str() {
        "spectrum" if attributes.get("filename").is_some() => {
            spectrum_file(attributes, description).map(|value| (value, None))
        }
        _ if version < [3, 0, 0] => old_value(attributes, version).map_err(owned),
        _ => todays_value(attributes).map(|value| (value, None)).map_err(owned),
    }
}

fn todays_value(attributes: &Attributes) -> Result<Value, Wrong> {
    let text = || attributes.required("value");
    Ok(match attributes.tag.as_str() {
        "float" => Value::Float(numbers::float(text()?)?),
        "integer" => Value::Integer(numbers::integer(text()?)?),
        "boolean" => Value::Boolean(numbers::boolean(text()?)?),
        "string" => Value::String(text()?.to_owned()),
        "point" | "vector" => Value::Vector(vector(attributes)?),
        "rgb" => Value::Rgb(rgb(text()?)?),
        "spectrum" => Value::Spectrum(spectrum(text()?)?),
        _ => Value::Reference(attributes.required("id")?.to_owned()),
    })
}

fn vector(attributes: &Attributes) -> Result<[f64; 3], Wrong> {
    let axes = ["x", "y", "z"];
    match attributes.get("value") {
        Some(value) if axes.iter().all(|axis| attributes.get(axis).is_none()) => {
            numbers::triple(value, &attributes.tag)
        }
        Some(_) => Err((format!("<{}> has both \"value\" and x, y, z", attributes.tag), Some("give one of them"))),
        None => {
            let mut vector = [0.0; 3];
            for (component, axis) in vector.iter_mut().zip(axes) {
                *component = numbers::float(attributes.required(axis)?)?;
            }
            Ok(vector)
        }
    }
}

fn rgb(text: &str) -> Result<[f64; 3], Wrong> {
    if text.trim_start().starts_with('#') {
        let hint = "hexadecimal colours are not allowed; give three numbers from 0 to 1";
        return Err((format!("could not parse RGB value \"{}\"", numbers::shown(text)), Some(hint)));
    }
    numbers::triple(text, "RGB")
}

fn spectrum(text: &str) -> Result<SpectrumValue, Wrong> {
    let mut items = numbers::items(text);
    match (items.next(), items.next()) {
        (None, _) => Err((format!("could not parse spectrum value \"{text}\""), Some("the value is empty"))),
        (Some(one), None) if !one.contains(':') => Ok(SpectrumValue::Uniform(numbers::float(one)?)),
        _ => numbers::spectrum_table(text).map(SpectrumValue::Table),
    }
}

fn spectrum_file(attributes: &Attributes, description: &Description) -> Result<Value, (String, Option<String>)> {
    let filename = attributes.get("filename").unwrap_or_default();
    if attributes.get("value").is_some() {
        let hint = "give one of them".to_owned();
        return Err(("<spectrum> has both \"value\" and \"filename\"".to_owned(), Some(hint)));
    }
    let unreadable = |reason| (format!("could not read the spectrum file \"{filename}\""), Some(reason));
    let path = description.locate(filename).map_err(unreadable)?;
    let bytes = crate::io::read_bytes(&path).map_err(|error| unreadable(error.message))?;
    let text = String::from_utf8(bytes).map_err(|_| unreadable("is not text in UTF-8".to_owned()))?;
    let table = numbers::spectrum_file(&text).map_err(|(line, (message, hint))| {
        let place = if line == 0 { filename.to_owned() } else { format!("{filename}:{line}") };
        (format!("{message}, in {place}"), hint.map(str::to_owned))
    })?;
    Ok(Value::Spectrum(SpectrumValue::Table(table)))
}

/// Ways of writing a value that are gone since 3.0.
fn old_value(attributes: &Attributes, version: [u32; 3]) -> Result<(Value, Option<String>), Wrong> {
    let text = attributes.get("value").unwrap_or_default().trim();
    let hexadecimal = hexadecimal(text);
    let note = |text: &str| Some(text.to_owned());
    match (attributes.tag.as_str(), hexadecimal) {
        ("srgb", colour) => {
            let encoded = match colour {
                Some(colour) => colour,
                None => rgb(attributes.required("value")?)?,
            };
            Ok((Value::Rgb(encoded.map(srgb_to_linear)), note("<srgb> is read as <rgb>, decoded to linear values")))
        }
        ("rgb", Some(colour)) => {
            Ok((Value::Rgb(colour), note("a hexadecimal colour in <rgb> is read as three linear values")))
        }
        ("spectrum", Some(colour)) => {
            let linear = colour.map(srgb_to_linear);
            Ok((
                Value::Rgb(linear),
                note("a hexadecimal colour in <spectrum> is read as <rgb>, decoded to linear values"),
            ))
        }
        ("spectrum", None) if !text.contains(':') => match numbers::floats(text)?[..] {
            [x, y, z] => Ok((Value::Rgb([x, y, z]), note("<spectrum> with three numbers is read as <rgb>"))),
            [x] if version < [2, 0, 0] => {
                Ok((Value::Float(x), note("<spectrum> with one number is read as <float>: white in RGB, as it was")))
            }
            _ => Ok((Value::Spectrum(spectrum(text)?), None)),
        },
        ("blackbody", _) => {
            let kelvin = attributes.required("temperature")?.trim();
            let temperature = numbers::float(kelvin.trim_end_matches(['K', 'k']))?;
            let scale = attributes.get("scale").map_or(Ok(1.0), numbers::float)?;
            if temperature <= 0.0 {
                return Err(("the temperature of <blackbody> must be positive".to_owned(), None));
            }
            Ok((Value::Spectrum(SpectrumValue::Blackbody { temperature, scale }), None))
        }
        _ => Ok((todays_value(attributes)?, None)),
    }
}

/// `#rrggbb` as three numbers from 0 to 1.
fn hexadecimal(text: &str) -> Option<[f64; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let packed = u32::from_str_radix(digits, 16).ok()?;
    Some([16, 8, 0].map(|shift| f64::from(packed >> shift & 0xff) / 255.0))
}

/// The sRGB transfer curve (IEC 61966-2-1), decoded.
fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}
