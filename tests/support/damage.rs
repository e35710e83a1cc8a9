//! Damages valid files in many ways, the same ones in every run.

use std::ops::Range;

/// A small deterministic generator (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").
pub struct Random(pub u64);

impl Random {
    /// A number in `0..end`, or 0 if there is none.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }

    /// One of a list.
    pub fn pick<'a, T: ?Sized>(&mut self, list: &[&'a T]) -> &'a T {
        list[self.below(list.len())]
    }
}

/// Damages a file in one way: cut off, a flipped bit, an extreme byte or 32-bit number of either order, a stretch that
/// is lost or doubled.
pub fn damage_bytes(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    let end = bytes.len().min(at + 1 + random.below(16));
    match random.below(7) {
        0 => bytes.truncate(at),
        1 | 2 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << random.below(8);
            }
        }
        3 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = [0, 1, 0x7F, 0x80, 0xFF, b'-', b'9', b'\n'][random.below(8)];
            }
        }
        4 => {
            let floats = [f32::NAN, f32::INFINITY, -1e38, 3.4e38, 1e-45, -1.0].map(f32::to_bits);
            let integers = [0, 1, 0xFFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF];
            let value = [floats, integers].concat()[random.below(12)];
            let new = if random.below(2) == 0 { value.to_le_bytes() } else { value.to_be_bytes() };
            bytes.iter_mut().skip(at).zip(new).for_each(|(byte, new)| *byte = new);
        }
        5 => drop(bytes.drain(at..end)),
        _ => {
            let copy = bytes[at..end].to_vec();
            drop(bytes.splice(at..at, copy));
        }
    }
}

/// Numbers at the edges of what types can hold and what makes sense.
const NUMBERS: &[&str] = &[
    "nan",
    "0.1",
    "0.9",
    "1e-3",
    "3",
    "100",
    "",
    "x",
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "0.5",
    "1e-45",
    "1e-38",
    "1e-20",
    "-1e-20",
    "1e20",
    "1e38",
    "-1e38",
    "3.4e38",
    "1e39",
    "1e308",
    "7",
    "360",
    "65536",
    "65537",
    "2147483647",
    "-2147483648",
    "4294967296",
    "9223372036854775807",
    "0, 0, 0",
    "1e30, 1, 1",
    "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0",
    "400:1, 500:1e38",
    "true",
];

/// The quoted values of `text` that stand behind `before`, as byte ranges.
fn values(text: &str, before: &str) -> Vec<Range<usize>> {
    let opening = format!("{before}\"");
    let starts = text.match_indices(&opening).map(|(at, _)| at + opening.len());
    starts.filter_map(|start| text[start..].find('"').map(|length| start..start + length)).collect()
}

/// Damages a scene in one way; `plugins` are the names that a type may become.
pub fn damage_scene(text: &mut String, plugins: &[&str], random: &mut Random) {
    match random.below(10) {
        // Most often a single number: what gets past the parser reaches deepest.
        0..=4 => {
            let places = [values(text, "value="), values(text, "x="), values(text, "y=")].concat();
            if let Some(place) = places.get(random.below(places.len())) {
                text.replace_range(place.clone(), random.pick(NUMBERS));
            }
        }
        5 => {
            let places = values(text, "type=");
            if let Some(place) = places.get(random.below(places.len())) {
                text.replace_range(place.clone(), random.pick(plugins));
            }
        }
        6 => {
            let places = values(text, "=");
            let (a, b) = (random.below(places.len()), random.below(places.len()));
            if a < b {
                let later = text[places[b].clone()].to_owned();
                let earlier = text[places[a].clone()].to_owned();
                text.replace_range(places[b].clone(), &earlier);
                text.replace_range(places[a].clone(), &later);
            }
        }
        7 | 8 => {
            let mut lines: Vec<&str> = text.lines().collect();
            let (from, to) = (random.below(lines.len()), random.below(lines.len()));
            let Some(&line) = lines.get(from) else { return };
            match random.below(3) {
                0 => drop(lines.remove(from)),
                1 => lines.insert(to, line),
                _ => lines.swap(from, to),
            }
            *text = lines.join("\n");
        }
        _ => {
            let mut bytes = std::mem::take(text).into_bytes();
            damage_bytes(&mut bytes, random);
            *text = String::from_utf8_lossy(&bytes).into_owned();
        }
    }
}
