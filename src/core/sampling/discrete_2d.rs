//! A discrete distribution over the cells of a grid.

use crate::math::{ONE_MINUS_EPSILON, UVec2, Vec2};

/// A distribution over the cells of a grid: first the row from the marginal, then the column from the row's own
/// distribution. What is left of the random numbers is stretched back to [0, 1) for use inside the cell.
///
/// One number of 4 bytes per cell. The sums are rounded to single precision after they are taken in double, so that
/// the chances of sampling are exactly those that [`pmf`](Self::pmf) tells.
#[derive(Clone, Debug)]
pub struct Discrete2d {
    size: UVec2,
    /// Sums along each row, up to and including a cell.
    conditional: Vec<f32>,
    /// Sums of whole rows, up to and including a row.
    marginal: Vec<f32>,
    sum: f32,
    normalization: f32,
}

impl Discrete2d {
    /// From non-negative finite weights, row by row; their number is `size.x · size.y`. `None` if they sum up to
    /// zero, or to nothing finite.
    pub fn new(size: UVec2, weights: impl IntoIterator<Item = f32>) -> Option<Self> {
        let cells = size.x as usize * size.y as usize;
        let (mut conditional, mut marginal) = (Vec::with_capacity(cells), Vec::with_capacity(size.y as usize));
        let (mut row, mut sum) = (0.0f64, 0.0f64);
        for weight in weights {
            row += f64::from(weight);
            conditional.push(row as f32);
            if conditional.len().is_multiple_of(size.x as usize) {
                sum += row;
                marginal.push(sum as f32);
                row = 0.0;
            }
        }
        debug_assert_eq!(conditional.len(), cells);
        let normalization = (1.0 / sum) as f32;
        (sum > 0.0 && (sum as f32).is_finite() && normalization.is_finite()).then_some(Discrete2d {
            size,
            conditional,
            marginal,
            sum: sum as f32,
            normalization,
        })
    }

    /// Columns and rows.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Probability of a cell.
    #[inline]
    pub fn pmf(&self, cell: UVec2) -> f32 {
        let (below, up_to) = bracket(self.row(cell.y), cell.x as usize);
        (up_to - below) * self.normalization
    }

    /// The cell that two numbers in [0, 1) fall on (x chooses the column, y the row), its probability, and the
    /// position inside the cell in [0, 1)².
    #[inline]
    pub fn sample(&self, u2: Vec2) -> (UVec2, f32, Vec2) {
        let u2 = u2.min(Vec2::splat(ONE_MINUS_EPSILON));
        let (row, v) = invert(&self.marginal, u2.y * self.sum);
        let sums = self.row(row as u32);
        let (column, u) = invert(sums, u2.x * sums[sums.len() - 1]);
        let cell = UVec2::new(column as u32, row as u32);
        (cell, self.pmf(cell), Vec2::new(u, v))
    }

    fn row(&self, y: u32) -> &[f32] {
        let width = self.size.x as usize;
        &self.conditional[y as usize * width..][..width]
    }
}

/// The sums below and up to an entry.
#[inline]
fn bracket(sums: &[f32], index: usize) -> (f32, f32) {
    (if index == 0 { 0.0 } else { sums[index - 1] }, sums[index])
}

/// The first entry whose sum reaches the target, and how far into it the target lies.
#[inline]
fn invert(sums: &[f32], target: f32) -> (usize, f32) {
    // A target of exactly 0 would choose a leading entry without weight.
    let target = target.max(f32::from_bits(1));
    let index = sums.partition_point(|sum| *sum < target).min(sums.len() - 1);
    let (below, up_to) = bracket(sums, index);
    let rest = if up_to > below { (target - below) / (up_to - below) } else { 0.0 };
    (index, rest.clamp(0.0, ONE_MINUS_EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    #[test]
    fn cells_come_as_often_as_told() {
        let weights = [0.0, 3.0, 1.0, 0.0, 0.0, 0.0, 5.0, 0.0, 2.5];
        let d = Discrete2d::new(UVec2::new(3, 3), weights).unwrap();
        let mut rng = Pcg32::new(1, 2);
        let (mut counts, mut positions) = ([0u32; 9], [Vec2::ZERO; 9]);
        const N: u32 = 100_000;
        for _ in 0..N {
            let (cell, pmf, rest) = d.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
            let index = (cell.y * 3 + cell.x) as usize;
            assert_eq!(pmf, d.pmf(cell));
            assert!((pmf - weights[index] / 11.5).abs() < 1e-6);
            counts[index] += 1;
            positions[index] += rest;
        }
        for (index, weight) in weights.iter().enumerate() {
            let expected = weight / 11.5 * N as f32;
            assert!((counts[index] as f32 - expected).abs() <= 4.0 * expected.sqrt());
            if counts[index] > 0 {
                let mean = positions[index] / counts[index] as f32;
                assert!((mean - Vec2::splat(0.5)).length() < 2.0 / (counts[index] as f32).sqrt());
            }
        }
    }

    #[test]
    fn never_an_impossible_cell() {
        let d = Discrete2d::new(UVec2::new(3, 3), [0.0, 0.0, 0.0, 0.0, 1e-20, 0.0, 0.0, 0.0, 0.0]).unwrap();
        for u in [0.0, 0.5, ONE_MINUS_EPSILON, 1.0] {
            assert_eq!(d.sample(Vec2::splat(u)).0, UVec2::new(1, 1));
        }
        assert!(Discrete2d::new(UVec2::new(2, 1), [0.0, 0.0]).is_none());
        assert!(Discrete2d::new(UVec2::new(2, 1), [1.0, f32::INFINITY]).is_none());
    }
}
