//! A continuous distribution over the unit square that interpolates a grid.

use super::warp;
use crate::math::{UVec2, Vec2, lerp};

/// A density over [0, 1]² that interpolates values at the nodes of a grid bilinearly; the first and last nodes lie on
/// the border of the square.
///
/// Sampling walks down a pyramid of sums, halving the square in each direction at each step, and ends in the closed
/// form for one bilinear patch (Clarberg et al. 2005, "Wavelet importance sampling", section 4.2). The map keeps
/// well-distributed points well distributed. About 9 bytes per node.
#[derive(Clone, Debug)]
pub struct Bilinear2d {
    size: UVec2,
    /// Values at the nodes, scaled so that the density integrates to 1.
    nodes: Vec<f32>,
    /// From the finest to the coarsest, which has one quad.
    levels: Vec<Level>,
}

/// Sums over 2 × 2 patches or blocks of patches, kept together.
#[derive(Clone, Debug)]
struct Level {
    /// Quads per row.
    width: u32,
    /// Upper left, upper right, lower left, lower right.
    quads: Vec<[f32; 4]>,
}

impl Level {
    /// A level for so many values, all zero; odd sizes are padded.
    fn new(size: UVec2) -> Self {
        let quads = UVec2::new(size.x.div_ceil(2), size.y.div_ceil(2));
        Level { width: quads.x, quads: vec![[0.0; 4]; quads.x as usize * quads.y as usize] }
    }

    fn quad(&self, x: u32, y: u32) -> usize {
        y as usize * self.width as usize + x as usize
    }

    fn value_mut(&mut self, x: u32, y: u32) -> &mut f32 {
        let quad = self.quad(x / 2, y / 2);
        &mut self.quads[quad][(y % 2 * 2 + x % 2) as usize]
    }
}

impl Bilinear2d {
    /// From non-negative finite values, row by row; there must be at least 2 × 2. `None` if the density is zero
    /// everywhere, or sums up to nothing finite.
    pub fn new(size: UVec2, mut nodes: Vec<f32>) -> Option<Self> {
        debug_assert!(size.min_element() >= 2 && nodes.len() == size.x as usize * size.y as usize);
        let patches = size - UVec2::ONE;
        let mut finest = Level::new(patches);
        let mut sum = 0.0f64;
        for (y, rows) in nodes.windows(2 * size.x as usize).step_by(size.x as usize).enumerate() {
            let (upper, lower) = rows.split_at(size.x as usize);
            for (x, (upper, lower)) in upper.windows(2).zip(lower.windows(2)).enumerate() {
                let mean = 0.25 * (upper[0] + upper[1] + lower[0] + lower[1]);
                sum += f64::from(mean);
                *finest.value_mut(x as u32, y as u32) = mean;
            }
        }
        let scale = (f64::from(patches.x) * f64::from(patches.y) / sum) as f32;
        if !(sum > 0.0 && sum.is_finite() && scale.is_finite() && scale > 0.0) {
            return None;
        }
        nodes.iter_mut().for_each(|node| *node *= scale);
        finest.quads.iter_mut().flatten().for_each(|value| *value *= scale);

        let mut levels = vec![finest];
        let mut level_size = patches;
        while let Some(below) = levels.last()
            && below.quads.len() > 1
        {
            level_size = UVec2::new(level_size.x.div_ceil(2), level_size.y.div_ceil(2));
            let mut level = Level::new(level_size);
            for y in 0..level_size.y {
                for x in 0..level_size.x {
                    let [a, b, c, d] = below.quads[below.quad(x, y)];
                    *level.value_mut(x, y) = a + b + c + d;
                }
            }
            levels.push(level);
        }
        Some(Bilinear2d { size, nodes, levels })
    }

    /// Density at a point of the unit square.
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        let patches = self.size - UVec2::ONE;
        let p = p.clamp(Vec2::ZERO, Vec2::ONE) * patches.as_vec2();
        let patch = p.as_uvec2().min(patches - UVec2::ONE);
        let t = p - patch.as_vec2();
        let [v00, v10, v01, v11] = self.corners(patch);
        lerp(lerp(v00, v10, t.x), lerp(v01, v11, t.x), t.y)
    }

    /// The point of the unit square that a uniform point is mapped to, and the density there.
    #[inline]
    pub fn sample(&self, u2: Vec2) -> (Vec2, f32) {
        let mut u = u2;
        let mut patch = UVec2::ZERO;
        for level in self.levels.iter().rev() {
            u = u.clamp(Vec2::ZERO, Vec2::ONE);
            let [v00, v10, v01, v11] = level.quads[level.quad(patch.x, patch.y)];
            let (y, v) = choose(v00 + v10, v01 + v11, u.y);
            let (left, right) = if y == 0 { (v00, v10) } else { (v01, v11) };
            let (x, u_x) = choose(left, right, u.x);
            u = Vec2::new(u_x, v);
            patch = 2 * patch + UVec2::new(x, y);
        }
        let (t, pdf) = warp::square_to_bilinear(self.corners(patch), u);
        ((patch.as_vec2() + t) / (self.size - UVec2::ONE).as_vec2(), pdf)
    }

    fn corners(&self, patch: UVec2) -> [f32; 4] {
        let width = self.size.x as usize;
        let i = patch.y as usize * width + patch.x as usize;
        [self.nodes[i], self.nodes[i + 1], self.nodes[i + width], self.nodes[i + width + 1]]
    }
}

/// Chooses one of two by weight: which, and the number stretched back to [0, 1]. Of two weights at least
/// one is positive; one that is zero is never chosen.
#[inline]
fn choose(first: f32, second: f32, u: f32) -> (u32, f32) {
    let target = u * (first + second);
    if target > first || first == 0.0 { (1, (target - first) / second) } else { (0, target / first) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    fn example(width: u32, height: u32) -> Bilinear2d {
        let mut rng = Pcg32::new(7, 3);
        let nodes = (0..width * height).map(|_| rng.next_f32().powi(3)).collect();
        Bilinear2d::new(UVec2::new(width, height), nodes).unwrap()
    }

    #[test]
    fn integrates_to_one() {
        for (width, height) in [(2, 2), (3, 2), (7, 5), (2, 9), (16, 16)] {
            let d = example(width, height);
            const N: u32 = 400;
            let mean = (0..N * N)
                .map(|i| f64::from(d.pdf((Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32)))
                .sum::<f64>()
                / f64::from(N * N);
            assert!((mean - 1.0).abs() < 1e-3, "{width} × {height}: {mean}");
        }
    }

    #[test]
    fn samples_follow_the_density() {
        for (width, height) in [(2, 2), (7, 5), (2, 9), (17, 3)] {
            let d = example(width, height);
            let mut rng = Pcg32::new(1, 1);
            const N: u32 = 100_000;
            const CELLS: usize = 12;
            let mut counts = [0u32; CELLS * CELLS];
            for _ in 0..N {
                let (p, pdf) = d.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
                assert!((pdf - d.pdf(p)).abs() <= 1e-3 * pdf + 1e-5);
                let cell = (p * CELLS as f32).as_uvec2().min(UVec2::splat(CELLS as u32 - 1));
                counts[cell.y as usize * CELLS + cell.x as usize] += 1;
            }
            let mut chi2 = 0.0;
            for (i, count) in counts.iter().enumerate() {
                const M: usize = 20;
                let corner = Vec2::new((i % CELLS) as f32, (i / CELLS) as f32);
                let inside = |j: usize| (Vec2::new((j % M) as f32, (j / M) as f32) + 0.5) / M as f32;
                let mean = (0..M * M).map(|j| d.pdf((corner + inside(j)) / CELLS as f32)).sum::<f32>() / (M * M) as f32;
                let expected = mean * N as f32 / (CELLS * CELLS) as f32;
                chi2 += (*count as f32 - expected).powi(2) / expected;
            }
            // The 0.999 quantile for 143 degrees of freedom is 199.
            assert!(chi2 < 199.0, "{width} × {height}: {chi2}");
        }
    }

    #[test]
    fn zeros_are_never_chosen() {
        let mut nodes = vec![0.0; 25];
        nodes[12] = 1e8;
        let d = Bilinear2d::new(UVec2::splat(5), nodes).unwrap();
        for u in [Vec2::ZERO, Vec2::ONE, Vec2::X, Vec2::Y, Vec2::splat(0.5)] {
            let (p, pdf) = d.sample(u);
            assert!(p.is_finite() && pdf.is_finite() && (p - 0.5).abs().max_element() <= 0.25, "{u} → {p}");
        }
        assert!(Bilinear2d::new(UVec2::splat(2), vec![0.0; 4]).is_none());
        assert!(Bilinear2d::new(UVec2::splat(2), vec![f32::NAN; 4]).is_none());
    }
}
