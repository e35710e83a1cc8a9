//! The one error type of scene loading: where, what, and what to do about it.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

/// A place in a scene file. Lines and columns count from 1; a column counts characters, not bytes.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Location {
    /// The file as the user would name it.
    pub file: Arc<str>,
    /// Line, from 1; 0 where the whole file is meant.
    pub line: u32,
    /// Column in characters, from 1; 0 where the whole line or file is meant.
    pub column: u32,
}

impl Location {
    /// The file as a whole.
    pub fn file(file: impl Into<Arc<str>>) -> Self {
        Location { file: file.into(), line: 0, column: 0 }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, self.column) {
            (0, _) => write!(f, "{}", self.file),
            (line, 0) => write!(f, "{}:{line}", self.file),
            (line, column) => write!(f, "{}:{line}:{column}", self.file),
        }
    }
}

/// One thing that is wrong with a scene, printed as one line:
/// `error: scene.xml:12:9: unknown parameter "radianse" (did you mean "radiance"?), in emitter "area", included from …`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// Where it was noticed, if a file position is to blame.
    pub at: Option<Location>,
    /// What is wrong, without a full stop.
    pub message: String,
    /// What to do about it.
    pub hint: Option<String>,
    /// From the inside out: the objects and includes that led here.
    pub chain: Vec<String>,
}

impl SceneError {
    /// An error at a place.
    pub fn at(at: &Location, message: impl Into<String>) -> Self {
        SceneError { at: Some(at.clone()), message: message.into(), hint: None, chain: Vec::new() }
    }

    /// An error that has no place in a file, such as an unused command-line definition.
    pub fn anywhere(message: impl Into<String>) -> Self {
        SceneError { at: None, message: message.into(), hint: None, chain: Vec::new() }
    }

    /// Adds what the user can do.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds one more enclosing object or file.
    pub fn within(mut self, what: impl Into<String>) -> Self {
        self.chain.push(what.into());
        self
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = String::new();
        if let Some(at) = &self.at {
            line += &format!("{at}: ");
        }
        line += &shortened(&self.message, LONGEST_MESSAGE);
        if let Some(hint) = &self.hint {
            line += &format!(" ({hint})");
        }
        for link in &self.chain {
            line += &format!(", {link}");
        }
        f.write_str(&one_line(&line))
    }
}

impl std::error::Error for SceneError {}

/// Letters of a message that are shown at most; a list of includes may be long.
const LONGEST_MESSAGE: usize = 4000;

/// A text of at most `longest` letters: of a longer one the middle is left out.
pub fn shortened(text: &str, longest: usize) -> Cow<'_, str> {
    let count = text.chars().count();
    if count <= longest {
        return text.into();
    }
    let start: String = text.chars().take(longest * 2 / 3).collect();
    let end: String = text.chars().skip(count - longest / 3).collect();
    format!("{start} … {end}").into()
}

/// A text from a file as one line that does nothing to a terminal: control characters become `?`.
pub fn one_line(text: &str) -> Cow<'_, str> {
    if text.contains(char::is_control) { text.replace(char::is_control, "?").into() } else { text.into() }
}

/// All that is wrong with a scene, in file order as far as it could be found out in one go. Never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneErrors(pub Vec<SceneError>);

impl From<SceneError> for SceneErrors {
    fn from(error: SceneError) -> Self {
        SceneErrors(vec![error])
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, error) in self.0.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "error: {error}")?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneErrors {}

/// The candidate nearest to `word` by edit distance, if it is near enough to be what was meant.
///
/// At most a third of the letters (rounded) and not all may differ; letter case and underscores do not count.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |s: &str| s.chars().filter(|c| *c != '_').flat_map(char::to_lowercase).collect::<Vec<_>>();
    let word = plain(word);
    candidates
        .into_iter()
        .map(|candidate| (edit_distance(&word, &plain(candidate)), candidate))
        .filter(|(distance, candidate)| {
            *distance <= 1.max((candidate.len().max(word.len()) + 1) / 3) && *distance < word.len()
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Levenshtein distance with transpositions of neighbours counted once (optimal string alignment).
fn edit_distance(a: &[char], b: &[char]) -> usize {
    let mut rows: [Vec<usize>; 3] = [vec![0; b.len() + 1], (0..=b.len()).collect(), vec![0; b.len() + 1]];
    for i in 0..a.len() {
        rows[2][0] = i + 1;
        for j in 0..b.len() {
            let substitution = rows[1][j] + usize::from(a[i] != b[j]);
            let mut best = substitution.min(rows[1][j + 1] + 1).min(rows[2][j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                best = best.min(rows[0][j - 1] + 1);
            }
            rows[2][j + 1] = best;
        }
        rows.rotate_left(1);
    }
    rows[1][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_what_was_meant() {
        assert_eq!(did_you_mean("radianse", ["radiance", "scale"]), Some("radiance"));
        assert_eq!(did_you_mean("toWorld", ["to_world", "to_uv"]), Some("to_world"));
        assert_eq!(did_you_mean("difuse", ["diffuse", "plastic"]), Some("diffuse"));
        assert_eq!(did_you_mean("alfa", ["alpha", "eta"]), Some("alpha"));
        assert_eq!(did_you_mean("disk", ["mask", "box"]), None);
        assert_eq!(did_you_mean("z", ["x", "y"]), None);
        assert_eq!(did_you_mean("zzz", ["diffuse", "plastic"]), None);
        assert_eq!(edit_distance(&['a', 'b'], &['b', 'a']), 1);
    }

    #[test]
    fn long_texts_and_control_characters_are_not_repeated() {
        assert_eq!(shortened("abcdefghi", 9), "abcdefghi");
        assert_eq!(shortened("abcdefghij", 9), "abcdef … hij");
        let error = SceneError::at(&Location::file("a\nb.xml"), "bad \u{1b}[31m");
        assert_eq!(error.to_string(), "a?b.xml: bad ?[31m");
    }

    #[test]
    fn prints_one_line() {
        let at = Location { file: "a.xml".into(), line: 3, column: 7 };
        let error = SceneError::at(&at, "bad").hint("do good").within("in bsdf \"m\" (a.xml:2:1)");
        assert_eq!(error.to_string(), "a.xml:3:7: bad (do good), in bsdf \"m\" (a.xml:2:1)");
    }
}
