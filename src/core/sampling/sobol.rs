//! The first two dimensions of Sobol's sequence, which make a (0, 2)-sequence in base 2, and their Owen scrambling.
//!
//! Integers stand for binary fractions of 32 bits. Reversed ones have the first binary digit lowest, which is the
//! order in which index bits and the scrambling hash count.

use crate::math::Vec2;

/// The second coordinate of point `index`, bits reversed. (The first coordinate, reversed, is the index itself.)
///
/// Its generator matrix is Pascal's triangle modulo 2: digit k is the sum of those index bits j for which C(j, k) is
/// odd, that is (Lucas) whose number j contains all bits of k. Such a sum over supersets takes one step per bit of j.
#[inline]
pub const fn second_reversed(index: u32) -> u32 {
    let mut v = index;
    v ^= (v >> 1) & 0x5555_5555;
    v ^= (v >> 2) & 0x3333_3333;
    v ^= (v >> 4) & 0x0f0f_0f0f;
    v ^= (v >> 8) & 0x00ff_00ff;
    v ^= (v >> 16) & 0x0000_ffff;
    v
}

/// Owen's nested scrambling of a fraction whose bits are reversed: flips each digit by a hash of `seed` and of all
/// digits before it (Laine and Karras 2011, "Stratified sampling for stochastic transparency"; Burley 2020,
/// "Practical hash-based Owen scrambling"). Constants by Vegdahl 2021, "Building a better LK hash".
#[inline]
pub const fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// A fraction of 32 bits as a float below 1, rounded down.
#[inline]
pub fn to_unit(fraction: u32) -> f32 {
    (fraction >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Point `index` of the (0, 2)-sequence, Owen-scrambled by two seeds.
#[inline]
pub fn scrambled_pair(index: u32, seeds: [u32; 2]) -> Vec2 {
    let x = scramble_reversed(index, seeds[0]).reverse_bits();
    let y = scramble_reversed(second_reversed(index), seeds[1]).reverse_bits();
    Vec2::new(to_unit(x), to_unit(y))
}

/// Point `index` of the van der Corput sequence, Owen-scrambled.
#[inline]
pub fn scrambled_single(index: u32, seed: u32) -> f32 {
    to_unit(scramble_reversed(index, seed).reverse_bits())
}

/// Another order of the sequence that keeps every aligned run of 2ᵐ indices together, so that it stays a net.
/// `reversed` is the index with its bits reversed.
#[inline]
pub const fn shuffled(reversed: u32, seed: u32) -> u32 {
    scramble_reversed(reversed, seed).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_points() {
        // Joe and Kuo's tables, second dimension.
        let expected = [0.0, 0.5, 0.75, 0.25, 0.625, 0.125, 0.375, 0.875, 0.9375];
        for (index, y) in expected.into_iter().enumerate() {
            assert_eq!(to_unit(second_reversed(index as u32).reverse_bits()), y);
        }
    }

    /// Every elementary interval of every shape holds one point, for any power of two and any aligned run.
    #[test]
    fn every_power_of_two_is_a_net() {
        for seed in [1, 0x1234_5678, 0xdead_beef] {
            for (m, run) in [(4, 0), (6, 3), (8, 1), (10, 7)] {
                let points: Vec<Vec2> = (0..1u32 << m)
                    .map(|i| {
                        let index = shuffled(((run << m) + i).reverse_bits(), seed ^ 77);
                        scrambled_pair(index, [seed, seed.rotate_left(9) ^ 0x55])
                    })
                    .collect();
                for columns in 0..=m {
                    let mut hit = vec![false; 1 << m];
                    for p in &points {
                        let (nx, ny) = ((1 << columns) as f32, (1 << (m - columns)) as f32);
                        let cell = (p.x * nx) as usize + (1 << columns) * (p.y * ny) as usize;
                        assert!(!std::mem::replace(&mut hit[cell], true), "2^{m} points, 2^{columns} columns");
                    }
                }
            }
        }
    }

    #[test]
    fn never_one() {
        assert!(to_unit(u32::MAX) < 1.0);
    }

    /// A digit depends on no later one, and on every earlier one as if by chance.
    #[test]
    fn scrambling_is_nested_and_random() {
        let mut pcg = crate::sampling::Pcg32::new(1, 2);
        let rounds = 4000;
        for flipped in [0, 1, 5, 12] {
            let mut changes = [0u32; 32];
            for _ in 0..rounds {
                let (x, seed) = (pcg.next_u32(), pcg.next_u32());
                let change = scramble_reversed(x, seed) ^ scramble_reversed(x ^ (1 << flipped), seed);
                (0..32).for_each(|digit| changes[digit] += change >> digit & 1);
            }
            for (digit, count) in changes.into_iter().enumerate() {
                let share = count as f32 / rounds as f32;
                match digit.cmp(&flipped) {
                    std::cmp::Ordering::Less => assert_eq!(share, 0.0),
                    std::cmp::Ordering::Equal => assert_eq!(share, 1.0),
                    // The hash is known to favour a few pairs of digits by up to a tenth.
                    std::cmp::Ordering::Greater => {
                        assert!((share - 0.5).abs() < 0.1, "{flipped} to {digit}: {share}");
                    }
                }
            }
        }
    }
}
