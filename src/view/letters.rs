//! Letters of eight by eight dots, for axes of pictures.

use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts};

/// Height of a line in dots, with the gap below.
pub const LINE: u32 = 12;
/// Width of a letter in dots, with the gap behind.
pub const STEP: u32 = 8;

/// The dots of a text, each as (x, y). What has no letter is a gap.
pub fn dots(text: &str) -> Vec<(u32, u32)> {
    let mut dots = Vec::new();
    for (place, letter) in text.chars().enumerate() {
        let rows = BASIC_FONTS.get(letter).or_else(|| LATIN_FONTS.get(letter)).unwrap_or_default();
        for (y, row) in rows.into_iter().enumerate() {
            let row = (0..STEP).filter(|x| row >> x & 1 == 1);
            dots.extend(row.map(|x| (place as u32 * STEP + x, y as u32)));
        }
    }
    dots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_drawn_from_the_left_and_the_top() {
        // The upright of an L is on the left, its foot at the bottom.
        let dots_of_l = dots("L");
        let [left, right] = [0..3, 4..7].map(|columns| dots_of_l.iter().filter(|(x, _)| columns.contains(x)).count());
        let [top, bottom] = [0..3, 4..7].map(|rows| dots_of_l.iter().filter(|(_, y)| rows.contains(y)).count());
        assert!(left > right && bottom > top && !dots_of_l.is_empty(), "{dots_of_l:?}");
        let moved: Vec<(u32, u32)> = dots_of_l.iter().map(|(x, y)| (x + 2 * STEP, *y)).collect();
        assert_eq!(dots("\u{10ffff} L"), moved);
    }

    /// All that pictures say can be read.
    #[test]
    fn letters_are_there_and_differ() {
        let mut all: Vec<_> =
            "0123456789abcdefghijklmnopqrstuvwxyzBDEFNS.,-+:/()=°".chars().map(|c| dots(&c.to_string())).collect();
        let count = all.len();
        all.sort();
        all.dedup();
        assert!(all.len() == count && !all[0].is_empty(), "{} of {count}", all.len());
    }
}
