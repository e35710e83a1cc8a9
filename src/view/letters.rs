//! Letters of three by five dots, for axes of pictures.

/// Height of a line in dots, with the gap below.
pub const LINE: u32 = 6;
/// Width of a letter in dots, with the gap behind.
pub const STEP: u32 = 4;

/// Rows from the top, three dots each as an octal digit: 4 is the left one.
const LETTERS: [(char, u16); 46] = [
    ('0', 0o75557),
    ('1', 0o26227),
    ('2', 0o71747),
    ('3', 0o71717),
    ('4', 0o55711),
    ('5', 0o74717),
    ('6', 0o74757),
    ('7', 0o71122),
    ('8', 0o75757),
    ('9', 0o75717),
    ('A', 0o25755),
    ('B', 0o65656),
    ('C', 0o34443),
    ('D', 0o65556),
    ('E', 0o74647),
    ('F', 0o74644),
    ('G', 0o34553),
    ('H', 0o55755),
    ('I', 0o72227),
    ('J', 0o11152),
    ('K', 0o55655),
    ('L', 0o44447),
    ('M', 0o57755),
    ('N', 0o57775),
    ('O', 0o25552),
    ('P', 0o65644),
    ('Q', 0o25563),
    ('R', 0o65655),
    ('S', 0o34216),
    ('T', 0o72222),
    ('U', 0o55557),
    ('V', 0o55552),
    ('W', 0o55775),
    ('X', 0o55255),
    ('Y', 0o55222),
    ('Z', 0o71247),
    ('.', 0o00002),
    (',', 0o00024),
    ('-', 0o00700),
    ('+', 0o02720),
    (':', 0o02020),
    ('/', 0o11244),
    ('(', 0o24442),
    (')', 0o21112),
    ('=', 0o07070),
    ('°', 0o25200),
];

/// The dots of a text, each as (x, y). What has no letter is a gap.
pub fn dots(text: &str) -> Vec<(u32, u32)> {
    let mut dots = Vec::new();
    for (place, letter) in text.chars().enumerate() {
        let wanted = letter.to_ascii_uppercase();
        let rows = LETTERS.iter().find(|(known, _)| *known == wanted).map_or(0, |(_, rows)| *rows);
        for dot in (0..15).filter(|dot| rows >> (14 - dot) & 1 == 1) {
            dots.push((place as u32 * STEP + dot % 3, dot / 3));
        }
    }
    dots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_drawn_from_the_left_and_the_top() {
        assert_eq!(dots("l"), [(0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (1, 4), (2, 4)]);
        assert_eq!(dots(" -"), [(4, 2), (5, 2), (6, 2)]);
        let mut all: Vec<Vec<(u32, u32)>> = LETTERS.iter().map(|(letter, _)| dots(&letter.to_string())).collect();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), LETTERS.len(), "two letters look alike");
    }
}
