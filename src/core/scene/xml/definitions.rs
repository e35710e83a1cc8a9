//! `$parameters`: values given from outside, defaults in the files, substitution in attributes.

use crate::scene::error::did_you_mean;

/// Parameters that stand in the values of others could grow without end.
const LONGEST_VALUE: usize = 1 << 20;

/// One known parameter.
struct Definition {
    name: String,
    /// None if the value was wrong and has been complained about.
    value: Option<String>,
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
            definitions.insert(name.clone(), Some(value.replace("\\$", "$")), true);
        }
        if wrong.is_empty() { Ok(definitions) } else { Err(wrong) }
    }

    /// A `<default>`: has no effect on a parameter that has a value. None stands for a value that is wrong.
    pub fn default_value(&mut self, name: String, value: Option<String>) {
        if !self.table.iter().any(|known| known.name == name) {
            self.insert(name, value, false);
        }
    }

    fn insert(&mut self, name: String, value: Option<String>, from_outside: bool) {
        let position = self.table.partition_point(|known| known.name.len() >= name.len());
        self.table.insert(position, Definition { name, value, from_outside, used: false });
    }

    /// Replaces every `$name` in `text`; `\$` stays as a dollar sign. What was put in is not searched again.
    ///
    /// # Errors
    /// The message and what to do; none where a value is missing because of an error told before.
    pub fn substitute(&mut self, text: &str) -> Result<String, Option<(String, Option<String>)>> {
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
                    result.push_str(known.value.as_deref().ok_or(None)?);
                    rest = &after[known.name.len()..];
                    if result.len() > LONGEST_VALUE {
                        let message = format!("with ${} the value is longer than {LONGEST_VALUE} bytes", known.name);
                        return Err(Some((message, None)));
                    }
                }
                None => {
                    let name: String = after.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    let meant = did_you_mean(&name, self.table.iter().map(|known| known.name.as_str()));
                    let hint = match meant {
                        Some(meant) => format!("did you mean \"${meant}\"?"),
                        None => format!("give it a value with -D {name}=… or with a <default> above"),
                    };
                    return Err(Some((format!("undefined parameter: ${name}"), Some(hint))));
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
            (known.name.as_str(), known.value.as_deref().unwrap_or_default(), did_you_mean(&known.name, others))
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
        d.default_value("spp".into(), Some("4".into()));
        d.default_value("w".into(), Some("8".into()));
        assert_eq!(d.substitute("$spp, $s$w \\$spp").as_deref(), Ok("16, 18 $spp"));
        assert_eq!(d.unused().count(), 0);
    }

    #[test]
    fn hc_i10_undefined_unused_recursive() {
        let mut d = definitions(&[("sp", "16")]).unwrap();
        d.default_value("spp".into(), Some("4".into()));
        let hint = Some("did you mean \"$spp\"?".to_owned());
        assert_eq!(d.substitute("$spq"), Ok("16q".to_owned()), "a prefix is a name, as in the reference");
        assert_eq!(d.substitute("$Spp"), Err(Some(("undefined parameter: $Spp".to_owned(), hint))));
        let d = definitions(&[("spb", "16")]).map(|mut d| {
            d.default_value("spp".into(), Some("4".into()));
            d
        });
        assert_eq!(d.unwrap().unused().collect::<Vec<_>>(), [("spb", "16", Some("spp"))]);
        let mut broken = Definitions::default();
        broken.default_value("w".into(), None);
        assert_eq!(broken.substitute("$w"), Err(None), "what is broken has been told");
        broken.default_value("a".into(), Some("x".repeat(LONGEST_VALUE)));
        assert!(broken.substitute("$a$a").is_err());
        let wrong = definitions(&[("a", "$a")]).err();
        assert_eq!(wrong, Some(vec!["the value of parameter $a refers to another parameter: \"$a\"".to_owned()]));
    }
}
