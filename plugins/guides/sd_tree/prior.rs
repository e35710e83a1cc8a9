//! What cells of space expect before they are asked: the light that arrives in the larger cells around them.
//!
//! In a noisy scene a few records may have nearly all the flux of a cell. Taken at their word, directions that happened
//! not to be found would never be sampled by the guide, and the light from there, found by the BSDF at last, would count
//! for many times of what it should. So each cell is asked together with some records distributed as in the cell that it
//! is half of, and so on up to the root, which expects light from everywhere (the mean of a Dirichlet distribution given
//! its records, applied from the root to the leaves).

use super::quadtree::{CELLS, blend};
use super::spatial::{Child, SpatialTree};
use super::sums::{Found, Sums};

/// What was found in a cell of space, in each cell of the grid.
type Grid = [Found; CELLS];

/// The part of the flux that each cell of the grid has in each leaf of the tree, if expectations are worth so many records.
pub fn grids<'a>(tree: &SpatialTree, leaf: impl Fn(usize) -> &'a Sums, prior: f64) -> Vec<[f32; CELLS]> {
    let inner = tree.inner();
    // Children stand after their parents.
    let mut sums: Vec<Grid> = vec![[Found::default(); CELLS]; inner.len()];
    for (index, children) in inner.iter().enumerate().rev() {
        let [a, b] = children.map(|child| match child {
            Child::Inner(i) => sums[i],
            Child::Leaf(i) => leaf(i).cells(),
        });
        sums[index] = std::array::from_fn(|cell| a[cell].and(b[cell]));
    }
    let everywhere = [1.0 / CELLS as f64; CELLS];
    let mut expected = vec![everywhere; inner.len()];
    let mut grids = vec![[0.0; CELLS]; tree.leaves()];
    if inner.is_empty() {
        grids[0] = blended(&leaf(0).cells(), &everywhere, prior).map(|part| part as f32);
    }
    for (index, children) in inner.iter().enumerate() {
        let here = blended(&sums[index], &expected[index], prior);
        for child in children {
            match *child {
                Child::Inner(i) => expected[i] = here,
                Child::Leaf(i) => grids[i] = blended(&leaf(i).cells(), &here, prior).map(|part| part as f32),
            }
        }
    }
    grids
}

fn blended(grid: &Grid, expected: &[f64; CELLS], prior: f64) -> [f64; CELLS] {
    let total = grid.iter().fold(Found::default(), |total, found| total.and(*found));
    let worth = total.worth();
    std::array::from_fn(|i| blend(grid[i].flux / total.flux, worth, expected[i], prior))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna_core::math::{Aabb, Vec2, Vec3};

    /// Two halves: one has seen much from one side, the other a single record from elsewhere.
    #[test]
    fn few_records_are_asked_together_with_those_around() {
        let mut tree = SpatialTree::new(Aabb { min: Vec3::ZERO, max: Vec3::ONE });
        tree.split(|_, depth| depth < 1, |_, _| ());
        let mut sums = vec![Sums::default(); 2];
        (0..1000).for_each(|_| sums[0].add(Vec2::splat(0.01), 1.0));
        sums[1].add(Vec2::splat(0.99), 1.0);
        let grids = grids(&tree, |i| &sums[i], 8.0);
        for grid in &grids {
            assert!((grid.iter().sum::<f32>() - 1.0).abs() < 1e-5 && grid.iter().all(|part| *part > 0.0));
        }
        assert!(grids[0][0] > 0.98 && grids[0][CELLS - 1] < 2e-3, "{:?}", grids[0]);
        // One record against eight: a ninth is its own.
        assert!((grids[1][CELLS - 1] - 1.0 / 9.0).abs() < 2e-3 && grids[1][0] > 0.85, "{:?}", grids[1]);
    }

    #[test]
    fn without_a_prior_cells_stand_for_themselves() {
        let tree = SpatialTree::new(Aabb { min: Vec3::ZERO, max: Vec3::ONE });
        let mut sums = Sums::default();
        sums.add(Vec2::splat(0.01), 3.0);
        let grid = grids(&tree, |_| &sums, 0.0)[0];
        assert!(grid[0] == 1.0 && grid[1..].iter().all(|part| *part == 0.0));
    }
}
