//! `$parameters`: values given from outside, defaults in the files, substitution in attributes.

use crate::scene::error::did_you_mean;

/// One known parameter.
struct Definition {
    name: String,
    value: String,
    from_outside: bool,
    used: bool,
}

/// All parameters known so far; one table for all files of a scene.
#[derive(Default)]
pub(super) struct Definitions {
    /// Longest names first, so that `$spp_high` is not taken for `$spp`.
    table: Vec<Definition>,
}

impl Definitions {
    /// The parameters given on the command line or by the caller. A later one of the same name wins.
    ///
    /// # Errors
    /// A message per value that refers to a parameter itself.
    pub fn from_outside(defines: &[(String, String)]) -> Result<Self, Vec<String>> {
        let mut definitions = Definitions::default();
        let mut wrong = Vec::new();
        for (name, value) in defines {
            if name.is_empty() {
                wrong.push(format!("a parameter without a name was given the value \"{value}\""));
            } else if value.replace("\\$", "").contains('$') {
                wrong.push(format!("the value of parameter ${name} refers to another parameter: \"{value}\""));
            }
            definitions.table.retain(|known| known.name != *name);
            definitions.insert(name.clone(), value.replace("\\$", "$"), true);
        }
        if wrong.is_empty() { Ok(definitions) } else { Err(wrong) }
    }

    /// A `<default>`: has no effect on a parameter that has a value.
    pub fn default_value(&mut self, name: String, value: String) {
        if !self.table.iter().any(|known| known.name == name) {
            self.insert(name, value, false);
        }
    }

    fn insert(&mut self, name: String, value: String, from_outside: bool) {
        let position = self.table.partition_point(|known| known.name.len() >= name.len());
        self.table.insert(position, Definition { name, value, from_outside, used: false });
    }

    /// Replaces every `$name` in `text`; `\$` stays as a dollar sign. What was put in is not searched again.
    ///
    /// # Errors
    /// The message, and the name that was probably meant.
    pub fn substitute(&mut self, text: &str) -> Result<String, (String, Option<String>)> {
        let mut result = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(dollar) = rest.find('$') {
            let (before, after) = (&rest[..dollar], &rest[dollar + 1..]);
            rest = after;
            if let Some(before) = before.strip_suffix('\\') {
                result.push_str(before);
                result.push('$');
                continue;
            }
            result.push_str(before);
            match self.table.iter_mut().find(|known| after.starts_with(&known.name)) {
                Some(known) => {
                    known.used = true;
                    result.push_str(&known.value);
                    rest = &after[known.name.len()..];
                }
                None => {
                    let name: String = after.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    let meant = did_you_mean(&name, self.table.iter().map(|known| known.name.as_str()));
                    let hint = meant.map(|meant| format!("did you mean \"${meant}\"?"));
                    return Err((format!("undefined parameter: ${name}"), hint));
                }
            }
        }
        result.push_str(rest);
        Ok(result)
    }

    /// Parameters from outside that nothing referred to, as `(name, value, what was probably meant)`.
    pub fn unused(&self) -> impl Iterator<Item = (&str, &str, Option<&str>)> {
        self.table.iter().filter(|known| known.from_outside && !known.used).map(|known| {
            let others = self.table.iter().filter(|other| !other.from_outside).map(|other| other.name.as_str());
            (known.name.as_str(), known.value.as_str(), did_you_mean(&known.name, others))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn definitions(list: &[(&str, &str)]) -> Result<Definitions, Vec<String>> {
        let list: Vec<_> = list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
        Definitions::from_outside(&list)
    }

    #[test]
    fn substitutes_longest_names_first() {
        let mut d = definitions(&[("s", "1"), ("spp", "16")]).unwrap();
        d.default_value("spp".into(), "4".into());
        d.default_value("w".into(), "8".into());
        assert_eq!(d.substitute("$spp, $s$w \\$spp").as_deref(), Ok("16, 18 $spp"));
        assert_eq!(d.unused().count(), 0);
    }

    #[test]
    fn hc_i10_undefined_unused_recursive() {
        let mut d = definitions(&[("sp", "16")]).unwrap();
        d.default_value("spp".into(), "4".into());
        let hint = Some("did you mean \"$spp\"?".to_owned());
        assert_eq!(d.substitute("$spq"), Ok("16q".to_owned()), "a prefix is a name, as in the reference");
        assert_eq!(d.substitute("$Spp"), Err(("undefined parameter: $Spp".to_owned(), hint)));
        let d = definitions(&[("spb", "16")]).map(|mut d| {
            d.default_value("spp".into(), "4".into());
            d
        });
        assert_eq!(d.unwrap().unused().collect::<Vec<_>>(), [("spb", "16", Some("spp"))]);
        let wrong = definitions(&[("a", "$a")]).err();
        assert_eq!(wrong, Some(vec!["the value of parameter $a refers to another parameter: \"$a\"".to_owned()]));
    }
}
