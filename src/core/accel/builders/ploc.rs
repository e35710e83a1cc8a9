//! Parallel locally-ordered clustering with reinsertion, from the crate `obvhs`.
//!
//! Meister and Bittner 2018, *Parallel locally-ordered clustering for bounding volume hierarchy construction*, and
//! Meister and Bittner 2018, *Parallel reinsertion for bounding volume hierarchy optimization*. The neighbour search
//! covers 14 primitives to each side in Morton order; reinsertion visits 5 % of the nodes in each of its rounds.
//!
//! Where many neighbours cost the same to merge, only one pair merges in each round: time grows with the square of the
//! number of primitives, and the tree becomes a list. Such input, and what overflows, goes to [`BinnedSah`] instead.

use super::{BinaryNode, BinaryTree, BinnedSah, Builder, MAX_DEPTH, block_len};
use crate::math::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision, morton::morton_encode_u64_unorm};

/// Locally-ordered clustering and reinsertion, or [`BinnedSah`] where that would be slow.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ploc;

/// Longest run of neighbours with the same cost that is left to the clustering.
const MAX_TIES: usize = 512;
/// Areas of boxes beyond this overflow somewhere in the clustering.
const MAX_EXTENT: f32 = 1e17;

impl Builder for Ploc {
    fn build(&self, bounds: &[Aabb]) -> BinaryTree {
        if bounds.len() < 3 || longest_tie(bounds) > MAX_TIES {
            return BinnedSah.build(bounds);
        }
        let boxes: Vec<_> = bounds.iter().map(|b| obvhs::aabb::Aabb::new(b.min.into(), b.max.into())).collect();
        let indices = (0..bounds.len() as u32).collect();
        let mut builder = PlocBuilder::with_capacity(boxes.len());
        let mut tree = builder.build(PlocSearchDistance::Medium, &boxes, indices, SortPrecision::U64, 3);
        ReinsertionOptimizer::default().run(&mut tree, 0.05, None);
        convert(&tree, bounds).unwrap_or_else(|| BinnedSah.build(bounds))
    }
}

/// Length of the longest run of equal merge costs between neighbours in Morton order; `usize::MAX` if areas overflow.
fn longest_tie(bounds: &[Aabb]) -> usize {
    let total = bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
    let extent = total.max - total.min;
    if extent.max_element() > MAX_EXTENT {
        return usize::MAX;
    }
    let scale = extent.as_dvec3().map(|e| if e > 0.0 { 1.0 / e } else { 0.0 });
    let mut order: Vec<_> = bounds
        .iter()
        .enumerate()
        .map(|(i, b)| (morton_encode_u64_unorm((b.center() - total.min).as_dvec3() * scale), i as u32))
        .collect();
    order.sort_unstable();
    let cost = |w: &[(u64, u32)]| bounds[w[0].1 as usize].union(bounds[w[1].1 as usize]).half_area();
    let (mut longest, mut run, mut last) = (0, 0, f32::NAN);
    for pair in order.windows(2) {
        let c = cost(pair);
        run = if (c - last).abs() <= 1e-5 * last.abs() { run + 1 } else { 1 };
        longest = longest.max(run);
        last = c;
    }
    longest
}

/// The same tree in the layout of [`BinaryTree`]; `None` if it is too deep or does not hold every primitive once.
fn convert(tree: &Bvh2, bounds: &[Aabb]) -> Option<BinaryTree> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut pending = vec![(0, 0)];
    while let Some((at, depth)) = pending.pop() {
        let node = tree.nodes.get(at as usize)?;
        order.push(at);
        if order.len() > tree.nodes.len() || depth > MAX_DEPTH {
            return None;
        }
        if !node.is_leaf() {
            pending.extend([(node.first_index, depth + 1), (node.first_index + 1, depth + 1)]);
        }
    }
    // Parents come before their children in `order`, so counts and boxes gather from the back.
    let mut gathered = vec![BinaryNode::UNSET; tree.nodes.len()];
    for &at in order.iter().rev() {
        let node = &tree.nodes[at as usize];
        gathered[at as usize] = if node.is_leaf() {
            let prim = *tree.primitive_indices.get(node.first_index as usize)?;
            BinaryNode { bounds: *bounds.get(prim as usize)?, count: node.prim_count, index: prim }
        } else {
            let [a, b] = [gathered[node.first_index as usize], gathered[node.first_index as usize + 1]];
            BinaryNode { bounds: a.bounds.union(b.bounds), count: a.count + b.count, index: node.first_index }
        };
        if node.prim_count > 1 {
            return None;
        }
    }
    if gathered[0].count as usize != bounds.len() {
        return None;
    }

    let mut nodes = vec![BinaryNode::UNSET; block_len(bounds.len()) + 1];
    let mut pending = vec![(0, 0, 1)];
    while let Some((from, to, base)) = pending.pop() {
        let node = gathered[from];
        if node.is_leaf() {
            nodes[to] = node;
            continue;
        }
        nodes[to] = BinaryNode { index: base as u32, ..node };
        let child = node.index as usize;
        let left_block = base + 2;
        pending.push((child, base, left_block));
        pending.push((child + 1, base + 1, left_block + block_len(gathered[child].count as usize)));
    }
    Some(BinaryTree { nodes })
}
