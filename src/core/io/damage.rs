//! Damages valid files in many ways to prove that readers survive (tests only).

/// A small deterministic generator (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators").
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }
}

/// Calls `read` with every truncation of `valid` (up to 512 of them) and with `count` mutations: flipped bits, extreme
/// bytes, extreme 32-bit numbers, removed and doubled stretches.
pub fn for_each_damaged(valid: &[u8], count: usize, mut read: impl FnMut(&[u8])) {
    let step = valid.len().div_ceil(512).max(1);
    (0..valid.len()).step_by(step).for_each(|end| read(&valid[..end]));
    let mut random = SplitMix(valid.len() as u64);
    for _ in 0..count {
        let mut bytes = valid.to_vec();
        for _ in 0..1 + random.below(3) {
            let at = random.below(bytes.len());
            match random.below(6) {
                0 | 1 => bytes[at] ^= 1 << random.below(8),
                2 => bytes[at] = [0, 1, 0x7F, 0x80, 0xFF, b'-', b'9', b'\n'][random.below(8)],
                3 => {
                    let extreme = [0u32, 1, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0x7FC0_0000][random.below(6)];
                    let bytes_of = extreme.to_le_bytes();
                    bytes.iter_mut().skip(at).zip(bytes_of).for_each(|(byte, new)| *byte = new);
                }
                4 => {
                    let end = (at + 1 + random.below(8)).min(bytes.len());
                    bytes.drain(at..end);
                }
                _ => {
                    let end = (at + 1 + random.below(8)).min(bytes.len());
                    let copy = bytes[at..end].to_vec();
                    bytes.splice(at..at, copy);
                }
            }
            if bytes.is_empty() {
                break;
            }
        }
        read(&bytes);
    }
}
