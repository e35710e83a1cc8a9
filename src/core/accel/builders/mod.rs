//! Binary trees over boxes, one builder a file.
//!
//! Every builder yields the same layout, in which a subtree of k primitives owns 2k − 1 consecutive slots given by
//! position and not by the order in which threads arrive. So a tree depends on its boxes only, and later steps can split
//! the node array between threads without locks.

mod binned_sah;
mod ploc;

pub use binned_sah::BinnedSah;
pub use ploc::Ploc;

use crate::math::Aabb;
use rayon::iter::ParallelIterator;

/// No builder returns a deeper tree (the root alone has depth 0), so traversal needs a small fixed stack.
pub const MAX_DEPTH: usize = 64;

/// Builds a binary tree with one primitive in each leaf.
pub trait Builder {
    /// The tree over `bounds`, whose boxes must be finite and not empty. It has `2 bounds.len() − 1` nodes (none for no
    /// boxes), at most [`MAX_DEPTH`] levels below the root, and is the same for any number of threads.
    fn build(&self, bounds: &[Aabb]) -> BinaryTree;
}

/// One node: the box of a subtree, and where it goes on.
#[derive(Clone, Copy, Debug)]
pub struct BinaryNode {
    /// Holds all primitives of the subtree.
    pub bounds: Aabb,
    /// Number of primitives in the subtree.
    pub count: u32,
    /// `count == 1`: the primitive. Otherwise the first of two children, which are neighbours.
    pub index: u32,
}

impl BinaryNode {
    const UNSET: Self = Self { bounds: Aabb::EMPTY, count: 0, index: 0 };

    /// Whether the subtree is one primitive.
    #[must_use]
    pub fn is_leaf(&self) -> bool {
        self.count == 1
    }
}

/// A binary tree whose root is node 0.
///
/// Below a node of k primitives whose children stand at c and c + 1, the block `c .. c + 2k − 2` holds the children, then
/// the left child's block, then the right child's.
#[derive(Clone, Debug, Default)]
pub struct BinaryTree {
    /// All nodes; empty when there are no primitives.
    pub nodes: Vec<BinaryNode>,
}

impl BinaryTree {
    /// Levels below the root. Assumes that children stand behind their parents.
    #[must_use]
    pub fn depth(&self) -> usize {
        let mut depth = vec![0_u32; self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
            depth[node.index as usize] = depth[i] + 1;
            depth[node.index as usize + 1] = depth[i] + 1;
        }
        depth.into_iter().max().unwrap_or(0) as usize
    }
}

/// So many of the same. By all threads: what takes time is the first touch of the memory.
pub(super) fn filled<T: Copy + Send + Sync>(value: T, count: usize) -> Vec<T> {
    rayon::iter::repeat_n(value, count).collect()
}

/// Length of the node block below a subtree of `count` primitives.
pub(super) const fn block_len(count: usize) -> usize {
    2 * count - 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn check(tree: &BinaryTree, bounds: &[Aabb]) {
        assert_eq!(tree.nodes.len(), (2 * bounds.len()).saturating_sub(1));
        assert!(tree.depth() <= MAX_DEPTH, "depth {}", tree.depth());
        let mut seen = vec![false; bounds.len()];
        for node in &tree.nodes {
            if node.is_leaf() {
                assert!(!std::mem::replace(&mut seen[node.index as usize], true));
                assert_eq!(node.bounds, bounds[node.index as usize]);
            } else {
                let [a, b] = [tree.nodes[node.index as usize], tree.nodes[node.index as usize + 1]];
                assert_eq!(node.count, a.count + b.count);
                assert_eq!(node.bounds, a.bounds.union(b.bounds));
            }
        }
        assert!(seen.into_iter().all(|s| s));
    }

    fn boxes(n: usize, place: impl Fn(usize) -> Vec3) -> Vec<Aabb> {
        (0..n).map(|i| Aabb { min: place(i), max: place(i) + Vec3::ONE }).collect()
    }

    #[test]
    fn every_builder_yields_a_complete_tree() {
        let scatter = |i: usize| Vec3::new((i * 7919 % 1013) as f32, (i * 104_729 % 997) as f32, (i * 31 % 503) as f32);
        for builder in [&BinnedSah as &dyn Builder, &Ploc] {
            for n in [0, 1, 2, 3, 7, 1000, 20_000] {
                let bounds = boxes(n, scatter);
                check(&builder.build(&bounds), &bounds);
            }
        }
    }

    #[test]
    fn hc_g09_coincident_evenly_spaced_and_geometric_boxes_stay_shallow() {
        let n = 100_000;
        for builder in [&BinnedSah as &dyn Builder, &Ploc] {
            for bounds in [
                boxes(n, |_| Vec3::ONE),
                boxes(n, |i| Vec3::new(i as f32, 0.0, 0.0)),
                boxes(n, |i| Vec3::splat(2.0_f32.powi((i % 240) as i32 - 120))),
            ] {
                check(&builder.build(&bounds), &bounds);
            }
        }
    }

    #[test]
    fn hc_g10_flat_and_huge_boxes_build() {
        let big = Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) };
        let flat = Aabb { min: Vec3::ZERO, max: Vec3::new(1e38, 0.0, 0.0) };
        let point = Aabb { min: Vec3::ONE, max: Vec3::ONE };
        let bounds: Vec<_> = [big, flat, point].into_iter().cycle().take(500).collect();
        for builder in [&BinnedSah as &dyn Builder, &Ploc] {
            check(&builder.build(&bounds), &bounds);
        }
    }
}
