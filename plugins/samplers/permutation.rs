//! Permutations by hash.

/// A permutation of `0..count` chosen by `seed`, evaluated at one place (Kensler 2013, "Correlated multi-jittered
/// sampling"): a bijective hash on the next power of two, walked until it falls into the range.
#[inline]
pub fn permute(mut i: u32, count: u32, seed: u32) -> u32 {
    debug_assert!(i < count);
    if count <= 1 {
        return 0;
    }
    let mask = u32::MAX >> (count - 1).leading_zeros();
    loop {
        i ^= seed;
        i = i.wrapping_mul(0xe170_893d);
        i ^= seed >> 16;
        i ^= (i & mask) >> 4;
        i ^= seed >> 8;
        i = i.wrapping_mul(0x0929_eb3f);
        i ^= seed >> 23;
        i ^= (i & mask) >> 1;
        i = i.wrapping_mul(1 | seed >> 27);
        i = i.wrapping_mul(0x6935_fa69);
        i ^= (i & mask) >> 11;
        i = i.wrapping_mul(0x74dc_b303);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0x9e50_1cc3);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0xc860_a3df);
        i &= mask;
        i ^= i >> 5;
        if i < count {
            break;
        }
    }
    ((u64::from(i) + u64::from(seed)) % u64::from(count)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_once() {
        for count in [1, 2, 3, 5, 16, 17, 100, 257] {
            for seed in [0, 1, 0xffff_ffff, 0x1234_5678] {
                let mut seen = vec![false; count as usize];
                for i in 0..count {
                    let to = permute(i, count, seed) as usize;
                    assert!(!std::mem::replace(&mut seen[to], true), "{count} {seed}");
                }
            }
        }
    }
}
