//! The order in which the reference renderer's `scalar_rgb` spends random numbers.
//!
//! Its image is cut into square blocks that are visited in a spiral from the middle; each pixel gets a seed from the
//! number of its block and its Morton index inside the block, and all samples of the pixel use one generator in turn.
//! Following this order reproduces the reference's *noise*, so that images can be compared at one sample per pixel.

use crate::math::UVec2;
use crate::sampling::Pcg32;

/// Seeds of all pixels of an image.
pub struct ReferenceOrder {
    size: UVec2,
    block_edge: u32,
    /// Number of each block in the spiral, row by row.
    block_ids: Vec<u32>,
    blocks: UVec2,
    base: u32,
}

impl ReferenceOrder {
    /// For an image of `size` pixels (the sampled window), rendered by the reference with so many threads
    /// (workers + 1). `offset` is the sampler's own seed.
    pub fn new(size: UVec2, seed: u32, offset: u32, threads: u32) -> Self {
        let mut block_edge = 32;
        while block_edge > 1 && size.x.div_ceil(block_edge) * size.y.div_ceil(block_edge) < threads {
            block_edge /= 2;
        }
        let blocks = UVec2::new(size.x.div_ceil(block_edge), size.y.div_ceil(block_edge));
        let base = seed.wrapping_mul(size.x.wrapping_mul(size.y)).wrapping_add(offset);
        ReferenceOrder { size, block_edge, block_ids: spiral(blocks), blocks, base }
    }

    /// The generator of a pixel, given relative to the sampled window.
    pub fn generator(&self, pixel: UVec2) -> Pcg32 {
        debug_assert!(pixel.x < self.size.x && pixel.y < self.size.y);
        let block = pixel / self.block_edge;
        let id = self.block_ids[(block.y * self.blocks.x + block.x) as usize];
        let inside = pixel % self.block_edge;
        let index = id.wrapping_mul(self.block_edge * self.block_edge).wrapping_add(morton(inside));
        Pcg32::new(u64::from(self.base.wrapping_add(index)), Pcg32::DEFAULT_STREAM)
    }
}

/// Position of each block in a spiral that starts at the middle block and goes right, down, left, up with runs of
/// 1, 1, 2, 2, 3, 3, … steps; positions outside the image are skipped.
fn spiral(blocks: UVec2) -> Vec<u32> {
    let (width, height) = (blocks.x as i32, blocks.y as i32);
    let mut ids = vec![0; (width * height) as usize];
    let (mut x, mut y) = (width / 2, height / 2);
    let mut next = 0;
    let mut directions = [(1, 0), (0, 1), (-1, 0), (0, -1)].into_iter().cycle();
    let mut run = 1;
    while next < width * height {
        for _ in 0..2 {
            let (dx, dy) = directions.next().unwrap_or((1, 0));
            for _ in 0..run {
                if (0..width).contains(&x) && (0..height).contains(&y) {
                    ids[(y * width + x) as usize] = next as u32;
                    next += 1;
                }
                (x, y) = (x + dx, y + dy);
            }
        }
        run += 1;
    }
    ids
}

/// Interleaves the bits of both coordinates, x in the even places.
fn morton(p: UVec2) -> u32 {
    let spread = |mut v: u32| {
        v = (v | (v << 8)) & 0x00ff_00ff;
        v = (v | (v << 4)) & 0x0f0f_0f0f;
        v = (v | (v << 2)) & 0x3333_3333;
        (v | (v << 1)) & 0x5555_5555
    };
    spread(p.x) | (spread(p.y) << 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spiral_counts_every_block_once() {
        for size in [UVec2::new(1, 1), UVec2::new(2, 2), UVec2::new(3, 3), UVec2::new(7, 2), UVec2::new(1, 5)] {
            let mut ids = spiral(size);
            ids.sort_unstable();
            assert_eq!(ids, (0..size.x * size.y).collect::<Vec<_>>());
        }
        assert_eq!(spiral(UVec2::new(3, 3)), [6, 7, 8, 5, 0, 1, 4, 3, 2]);
    }

    #[test]
    fn morton_interleaves() {
        assert_eq!(morton(UVec2::new(0b101, 0b011)), 0b01_10_11);
    }
}
