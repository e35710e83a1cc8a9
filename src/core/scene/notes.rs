//! What was rewritten on the way, told once per kind of rewrite however often it happened.

use super::error::Location;
use std::collections::HashMap;

/// Collects notes; equal texts are counted and keep the place of the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Notes {
    lines: Vec<(String, Location, usize)>,
    known: HashMap<String, usize>,
}

impl Notes {
    /// Notes `text` about something at `at`.
    pub fn add(&mut self, text: impl Into<String>, at: &Location) {
        let text = text.into();
        match self.known.get(&text) {
            Some(&line) => self.lines[line].2 += 1,
            None => {
                self.known.insert(text.clone(), self.lines.len());
                self.lines.push((text, at.clone(), 1));
            }
        }
    }

    /// One line per text, in the order of first appearance: `text (a.xml:3:7 and 4 more)`.
    pub fn into_lines(self) -> impl Iterator<Item = String> {
        self.lines.into_iter().map(|(text, at, count)| match count {
            1 => format!("{text} ({at})"),
            _ => format!("{text} ({at} and {} more)", count - 1),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_repeats() {
        let at = |line| Location { file: "a.xml".into(), line, column: 1 };
        let mut notes = Notes::default();
        for line in [3, 4, 5] {
            notes.add("x is read as y", &at(line));
        }
        notes.add("z is left out", &at(9));
        let lines: Vec<_> = notes.into_lines().collect();
        assert_eq!(lines, ["x is read as y (a.xml:3:1 and 2 more)", "z is left out (a.xml:9:1)"]);
    }
}
