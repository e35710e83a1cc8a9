//! Numbers, lists of numbers and spectra as the scene language writes them.
//!
//! Stricter than the reference, which takes `nan`, `inf`, `1e400` and the empty string for numbers: whatever is read
//! here is finite, also after rounding to single precision.

use crate::scene::error::shortened;
use std::borrow::Cow;

/// What is wrong with a value: a message and, where there is one, a way out.
pub(super) type Wrong = (String, Option<&'static str>);

/// A value as messages show it.
pub(super) fn shown(text: &str) -> Cow<'_, str> {
    shortened(text, 60)
}

/// The parts of a list: separated by blanks and commas, any number of them.
pub(super) fn items(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_ascii_whitespace()).filter(|item| !item.is_empty())
}

/// A finite decimal number; blanks around it do not matter.
pub(super) fn float(text: &str) -> Result<f64, Wrong> {
    let number = text.trim_matches(|c: char| c.is_ascii_whitespace());
    let wrong = |hint| Err((format!("could not parse floating point value \"{}\"", shown(text)), hint));
    if !is_decimal(number) {
        return wrong(match number.to_ascii_lowercase().trim_start_matches(['+', '-']) {
            "nan" | "inf" | "infinity" => Some("only finite numbers are allowed"),
            "" if number.is_empty() => Some("the value is empty"),
            other if other.starts_with("0x") => Some("only decimal numbers are allowed"),
            _ if items(number).count() > 1 && items(number).all(is_decimal) => {
                Some("one number is needed, with a point before its fraction")
            }
            _ => Some("a number such as 0.5 or 1e-3 is needed"),
        });
    }
    match number.parse::<f64>() {
        Ok(value) if (value as f32).is_finite() => Ok(value),
        _ => wrong(Some("the number is too large")),
    }
}

/// Sign, digits with at most one point among or around them, exponent.
fn is_decimal(text: &str) -> bool {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent.strip_prefix(['+', '-']).unwrap_or(exponent))),
        None => (unsigned, None),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit());
    let some_digits = |part: &str| !part.is_empty() && digits(part);
    digits(whole) && digits(fraction) && whole.len() + fraction.len() > 0 && exponent.is_none_or(some_digits)
}

/// A whole number of 64 bits; blanks around it do not matter.
pub(super) fn integer(text: &str) -> Result<i64, Wrong> {
    text.trim_matches(|c: char| c.is_ascii_whitespace()).parse().map_err(|_| {
        let number = text.trim_matches(|c: char| c.is_ascii_whitespace());
        let digits = number.strip_prefix(['+', '-']).unwrap_or(number);
        let hint = match digits {
            "" if number.is_empty() => "the value is empty",
            _ if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) => "the number is too large",
            _ => "a whole number is needed",
        };
        (format!("could not parse integer value \"{}\"", shown(text)), Some(hint))
    })
}

/// `true` or `false` in any case.
pub(super) fn boolean(text: &str) -> Result<bool, Wrong> {
    match text.trim_matches(|c: char| c.is_ascii_whitespace()).to_ascii_lowercase().as_str() {
        "true" => Ok(true),
        "false" => Ok(false),
        _ => Err((format!("could not parse boolean value \"{}\"", shown(text)), Some("must be \"true\" or \"false\""))),
    }
}

/// A list of numbers.
pub(super) fn floats(text: &str) -> Result<Vec<f64>, Wrong> {
    items(text).map(float).collect()
}

/// Three numbers, or one that stands for all three. `what` names the value in the message.
pub(super) fn triple(text: &str, what: &str) -> Result<[f64; 3], Wrong> {
    match floats(text)?[..] {
        [x] => Ok([x; 3]),
        [x, y, z] => Ok([x, y, z]),
        _ => {
            let message = format!("could not parse {what} value \"{}\"", shown(text));
            Err((message, Some("one or three numbers are needed")))
        }
    }
}

/// Pairs `wavelength:value`, strictly increasing in wavelength, at least two.
pub(super) fn spectrum_table(text: &str) -> Result<Vec<(f64, f64)>, Wrong> {
    let pairs = items(text).map(|item| match item.split_once(':') {
        Some((wavelength, value)) => Ok((float(wavelength)?, float(value)?)),
        None => Err((
            format!("could not parse spectrum value \"{}\"", shown(text)),
            Some("give one number, or pairs such as \"400:0.1, 700:0.5\"; a colour is an <rgb>"),
        )),
    });
    increasing(pairs.collect::<Result<_, Wrong>>()?)
}

/// The text of an `.spd` file: a wavelength and a value per line, `#` comments and blank lines skipped.
///
/// # Errors
/// The line number from 1 (0 if the whole file is to blame) and what is wrong.
pub(super) fn spectrum_file(text: &str) -> Result<Vec<(f64, f64)>, (u32, Wrong)> {
    let mut table = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let content = line.split('#').next().unwrap_or_default();
        // The content is not repeated: any file can be named as a spectrum.
        match floats(content).as_deref() {
            Ok([]) => {}
            Ok(&[wavelength, value]) => table.push((wavelength, value)),
            _ => {
                let message = "a line of a spectrum file holds a wavelength and a value, both finite numbers";
                return Err((number, (message.to_owned(), None)));
            }
        }
    }
    increasing(table).map_err(|wrong| (0, wrong))
}

fn increasing(table: Vec<(f64, f64)>) -> Result<Vec<(f64, f64)>, Wrong> {
    if table.len() < 2 {
        return Err(("a spectrum needs at least two wavelengths".to_owned(), None));
    }
    match table.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        Some(pair) => Err((format!("wavelengths must increase strictly: {} follows {}", pair[1].0, pair[0].0), None)),
        None => Ok(table),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hc_i07_good_numbers() {
        for (text, value) in
            [(" 1 ", 1.0), ("+2", 2.0), (".5", 0.5), ("1.", 1.0), ("-4.37113e-008", -4.37113e-8), ("1E+2", 100.0)]
        {
            assert_eq!(float(text), Ok(value), "{text}");
        }
        assert_eq!(integer(" -7 "), Ok(-7));
        assert_eq!(integer("+7"), Ok(7));
        assert_eq!(boolean("True"), Ok(true));
    }

    #[test]
    fn hc_i07_bad_numbers() {
        let finite = Some("only finite numbers are allowed");
        let one = Some("one number is needed, with a point before its fraction");
        let such = Some("a number such as 0.5 or 1e-3 is needed");
        for (text, hint) in [
            ("nan", finite),
            ("-inf", finite),
            ("1e400", Some("the number is too large")),
            ("1e39", Some("the number is too large")),
            ("", Some("the value is empty")),
            ("0x10", Some("only decimal numbers are allowed")),
            ("1,5", one),
            ("1 2", one),
            ("1f", such),
            (".", such),
            ("-", such),
            ("1e", such),
            ("--1", such),
            ("1.2.3", such),
        ] {
            assert_eq!(float(text), Err((format!("could not parse floating point value \"{text}\""), hint)));
        }
        let wrong = ("could not parse integer value \"5.0\"".to_owned(), Some("a whole number is needed"));
        assert_eq!(integer("5.0"), Err(wrong));
        assert!(integer("9223372036854775808").is_err());
        assert!(boolean("1").is_err());
    }

    #[test]
    fn lists() {
        assert_eq!(floats("1, 2,3\t4\n,5"), Ok(vec![1.0, 2.0, 3.0, 4.0, 5.0]));
        assert_eq!(triple("2", "vector"), Ok([2.0; 3]));
        assert_eq!(triple("0.3 0.4", "RGB").unwrap_err().0, "could not parse RGB value \"0.3 0.4\"");
    }

    #[test]
    fn spectra() {
        assert_eq!(spectrum_table("400:1, 500:2"), Ok(vec![(400.0, 1.0), (500.0, 2.0)]));
        let message = |text| spectrum_table(text).unwrap_err().0;
        assert_eq!(message("400:1 400:2"), "wavelengths must increase strictly: 400 follows 400");
        assert_eq!(message("400:1"), "a spectrum needs at least two wavelengths");
        assert_eq!(message("1 2 3"), "could not parse spectrum value \"1 2 3\"");
        assert_eq!(spectrum_file("# a\n\n400 1 # b\n500 2"), Ok(vec![(400.0, 1.0), (500.0, 2.0)]));
        assert_eq!(spectrum_file("400 1\n500").unwrap_err().0, 2);
    }
}
