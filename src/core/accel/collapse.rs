//! From a binary tree with one primitive a leaf to nodes of eight children and packs of eight triangles.
//!
//! Dynamic programming over (subtree, number of slots it may fill), after Ylitie, Karras and Laine 2017, *Efficient
//! incoherent ray traversal on GPUs through compressed wide BVHs*, section 4.
//!
//! | Parameter | Ylitie et al. | here |
//! |---|---|---|
//! | cost of a node | 1.2 | 1 |
//! | cost of a leaf | 1 per triangle | 0.8 per pack |
//! | triangles in a leaf | at most 3 | at most 8, tested at once |

use super::builders::{BinaryNode, BinaryTree, block_len, filled};
use super::wide::{Frame, Node, WIDTH, Word};

/// Cost of testing one pack, relative to one node.
const PACK_COST: f32 = 0.8;
/// Subtrees smaller than this are treated by the thread that found them.
const FORK: usize = 4096;
/// In [`Choice::left`]: the subtree fills one slot fewer than it may.
const FEWER: u8 = 0;
/// In [`Choice::left`], for one slot: a leaf, not a node.
const LEAF: u8 = u8::MAX;

/// The wide tree before the triangles are copied into it.
pub struct Collapsed {
    pub nodes: Vec<Node>,
    /// Primitives of each pack; the first `n` places count, the others are `u32::MAX`.
    pub packs: Vec<[u32; WIDTH]>,
    pub root: Word,
}

/// How best to place one subtree into 1 … 8 slots.
#[derive(Clone, Copy)]
struct Choice {
    /// `cost[j]`: the least cost of the subtree in at most `j + 1` slots.
    cost: [f32; WIDTH],
    /// `left[j]`: how many of `j + 1` slots go to the left child. Of one slot: [`LEAF`], or an inner node.
    left: [u8; WIDTH],
    /// How many of the eight slots of an own node go to the left child.
    inner: u8,
    /// Whether all primitives are triangles.
    triangles: bool,
}

impl Choice {
    const UNSET: Self = Self { cost: [f32::INFINITY; WIDTH], left: [FEWER; WIDTH], inner: 0, triangles: false };

    fn leaf(area: f32, is_triangle: bool) -> Self {
        let left = std::array::from_fn(|j| if j == 0 { LEAF } else { FEWER });
        Self { cost: [PACK_COST * area; WIDTH], left, inner: 0, triangles: is_triangle }
    }

    fn join(area: f32, count: u32, a: &Self, b: &Self) -> Self {
        let mut best = Self { triangles: a.triangles && b.triangles, ..Self::UNSET };
        // Costs of exactly filling 2 … 8 slots with the two children.
        let mut shared = [(f32::INFINITY, 1_u8); WIDTH];
        for slots in 2..=WIDTH {
            for k in 1..slots {
                let cost = a.cost[k - 1] + b.cost[slots - k - 1];
                if cost < shared[slots - 1].0 {
                    shared[slots - 1] = (cost, k as u8);
                }
            }
        }
        let as_node = area + shared[WIDTH - 1].0;
        best.inner = shared[WIDTH - 1].1;
        best.cost[0] = as_node;
        best.left[0] = FEWER;
        let as_pack = PACK_COST * area;
        if best.triangles && count as usize <= WIDTH && as_pack <= as_node {
            best.cost[0] = as_pack;
            best.left[0] = LEAF;
        }
        for (j, (cost, k)) in shared.into_iter().enumerate().skip(1) {
            (best.cost[j], best.left[j]) = if cost < best.cost[j - 1] { (cost, k) } else { (best.cost[j - 1], FEWER) };
        }
        best
    }
}

/// Collapses `tree`, which must not be empty. `analytic` tells triangles (`None`) from the others
/// (`Some`: their index).
pub fn collapse(tree: &BinaryTree, frame: &Frame, analytic: &(dyn Fn(u32) -> Option<u32> + Sync)) -> Collapsed {
    let mut choices = filled(Choice::UNSET, tree.nodes.len());
    let (root, block) = choices.split_at_mut(1);
    // Areas relative to the whole, so that they neither overflow nor vanish.
    let unit = tree.nodes[0].bounds.half_area();
    let scale = if unit.is_normal() { 1.0 / unit } else { 1.0 };
    choose(&tree.nodes, 0, &mut root[0], block, &|node| node.bounds.half_area() * scale, analytic);

    let mut emit = Emit { tree: &tree.nodes, choices: &choices, frame, analytic, nodes: Vec::new(), packs: Vec::new() };
    let root = emit.one_slot(0);
    Collapsed { nodes: emit.nodes, packs: emit.packs, root }
}

/// Fills in the choices of the subtree at `at` and of the block below it.
fn choose(
    nodes: &[BinaryNode],
    at: usize,
    choice: &mut Choice,
    block: &mut [Choice],
    area: &(dyn Fn(&BinaryNode) -> f32 + Sync),
    analytic: &(dyn Fn(u32) -> Option<u32> + Sync),
) {
    let node = &nodes[at];
    if node.is_leaf() {
        *choice = Choice::leaf(area(node), analytic(node.index).is_none());
        return;
    }
    let child = node.index as usize;
    let (children, rest) = block.split_at_mut(2);
    let (a, b) = children.split_at_mut(1);
    let (a_block, b_block) = rest.split_at_mut(block_len(nodes[child].count as usize));
    let mut left = || choose(nodes, child, &mut a[0], a_block, area, analytic);
    let mut right = || choose(nodes, child + 1, &mut b[0], b_block, area, analytic);
    if (node.count as usize) < FORK {
        left();
        right();
    } else {
        rayon::join(left, right);
    }
    *choice = Choice::join(area(node), node.count, &children[0], &children[1]);
}

struct Emit<'a> {
    tree: &'a [BinaryNode],
    choices: &'a [Choice],
    frame: &'a Frame,
    analytic: &'a (dyn Fn(u32) -> Option<u32> + Sync),
    nodes: Vec<Node>,
    packs: Vec<[u32; WIDTH]>,
}

impl Emit<'_> {
    /// Emits the subtree as one child and returns where it is.
    fn one_slot(&mut self, at: usize) -> Word {
        let node = self.tree[at];
        if node.is_leaf()
            && let Some(index) = (self.analytic)(node.index)
        {
            return Word::primitive(index);
        }
        if self.choices[at].left[0] == LEAF {
            let mut pack = [u32::MAX; WIDTH];
            self.gather(at, &mut pack, &mut 0);
            pack[..node.count as usize].sort_unstable();
            self.packs.push(pack);
            return Word::pack(self.packs.len() as u32 - 1);
        }
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let (child, k) = (node.index as usize, self.choices[at].inner as usize);
        let mut slot = 0;
        self.spread(child, k, index, &mut slot);
        self.spread(child + 1, WIDTH - k, index, &mut slot);
        Word::node(index as u32)
    }

    /// Emits the subtree into at most `slots` slots of the node `into`, from `slot` on.
    fn spread(&mut self, at: usize, mut slots: usize, into: usize, slot: &mut usize) {
        while slots > 1 && self.choices[at].left[slots - 1] == FEWER {
            slots -= 1;
        }
        if slots > 1 {
            let (child, k) = (self.tree[at].index as usize, self.choices[at].left[slots - 1] as usize);
            self.spread(child, k, into, slot);
            self.spread(child + 1, slots - k, into, slot);
            return;
        }
        let word = self.one_slot(at);
        self.nodes[into].set(*slot, &self.frame.enclose(&self.tree[at].bounds), word);
        *slot += 1;
    }

    fn gather(&self, at: usize, pack: &mut [u32; WIDTH], filled: &mut usize) {
        let node = &self.tree[at];
        if node.is_leaf() {
            pack[*filled] = node.index;
            *filled += 1;
        } else {
            self.gather(node.index as usize, pack, filled);
            self.gather(node.index as usize + 1, pack, filled);
        }
    }
}
