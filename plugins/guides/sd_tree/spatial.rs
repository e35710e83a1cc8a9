//! A binary tree over a cube: each split halves a cell, along x, y and z in turn.

use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::{Aabb, Vec3};

/// Set in the number of a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// Bits of a coordinate. More splits than three times as many are not made.
const BITS: u32 = 20;

/// Splits above a leaf at most.
pub const DEEPEST: u32 = 3 * BITS;

/// Bits of each coordinate by which a search begins: what is above that many levels is looked up.
const TOP_BITS: u32 = 4;

/// Splits that one look-up goes down.
const TOP: u32 = 3 * TOP_BITS;

/// The tree. Leaves are numbered from 0.
#[derive(Clone, Debug, PartialEq)]
pub struct SpatialTree {
    min: Vec3,
    /// One over the edge of the cube.
    scale: f32,
    root: u32,
    nodes: Vec<[u32; 2]>,
    leaves: u32,
    /// Where the search goes on for each cell of a grid of 16 × 16 × 16,
    top: Vec<u32>,
    /// and how many splits are above: twelve, or as many as the leaf has.
    above: Vec<u8>,
}

/// One half of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Not divided: the number of the leaf.
    Leaf(usize),
    /// Divided: its place among the [inner](SpatialTree::inner) cells.
    Inner(usize),
}

/// A position in the cube, in whole numbers of `BITS` bits.
pub type Cell = [u32; 3];

impl SpatialTree {
    /// One leaf: the smallest cube around the box.
    pub fn new(bounds: Aabb) -> Self {
        let extent = (bounds.max - bounds.min).max_element();
        let usable = bounds.is_finite() && !bounds.is_empty() && extent > 0.0 && (1.0 / extent).is_finite();
        let (min, scale) = if usable { (bounds.min, 1.0 / extent) } else { (Vec3::ZERO, 1.0) };
        let (top, above) = (vec![LEAF; 1 << TOP], vec![0; 1 << TOP]);
        SpatialTree { min, scale, root: LEAF, nodes: Vec::new(), leaves: 1, top, above }
    }

    /// Writes it; bounds are not part of it.
    pub fn pack(&self, to: &mut Packer) {
        to.u32(self.nodes.len() as u32);
        self.nodes.iter().flatten().for_each(|child| to.u32(*child));
    }

    /// Reads what was written of a tree over these bounds.
    ///
    /// # Errors
    /// If it is not a tree, in one line.
    pub fn unpack(from: &mut Cursor<'_>, bounds: Aabb) -> Result<Self> {
        let wrong = |why: &str| Err(IoError::new(format!("the tree over space {why}")));
        let count = from.count(8, "nodes of space")?;
        let mut tree = SpatialTree::new(bounds);
        let mut found = vec![false; count + 1];
        let mut depths = vec![0; count];
        tree.nodes.reserve_exact(count);
        for index in 0..count {
            let children = [from.u32("a node of space")?, from.u32("a node of space")?];
            for child in children {
                // A node comes after the one above it, so that there is an end.
                let number = (child & !LEAF) as usize;
                if child & LEAF != 0 {
                    match found.get_mut(number) {
                        Some(found) if !*found => *found = true,
                        _ => return wrong("does not have every leaf once"),
                    }
                } else if number <= index || number >= count || depths[number] != 0 {
                    return wrong("does not have every node once");
                } else {
                    depths[number] = depths[index] + 1;
                }
            }
            if (index > 0 && depths[index] == 0) || depths[index] >= DEEPEST {
                return wrong("is too deep or in pieces");
            }
            tree.nodes.push(children);
        }
        tree.root = if count == 0 { LEAF } else { 0 };
        tree.leaves = count as u32 + 1;
        tree.look_up();
        Ok(tree)
    }

    /// The position of a point; outside it is on the edge.
    #[inline]
    pub fn cell(&self, p: Vec3) -> Cell {
        let size = (1u32 << BITS) as f32;
        let p = (p - self.min) * self.scale * size;
        // Conversion saturates, and takes what is not a number for 0.
        [p.x, p.y, p.z].map(|x| (x as u32).min((1 << BITS) - 1))
    }

    /// The leaf at a position, and how many splits are above it.
    #[inline]
    pub fn leaf(&self, cell: Cell) -> (u32, u32) {
        let top = Self::top(cell);
        // Where the table ends in the tree, twelve splits are above, four of each coordinate.
        let (node, depth) = (self.top[top], u32::from(self.above[top]));
        let (leaf, depth) = self.search(node, depth, None, cell.map(|x| x << (32 - BITS + TOP_BITS)));
        (leaf & !LEAF, depth)
    }

    /// The leaf in which a point lies.
    #[inline]
    pub fn at(&self, p: Vec3) -> usize {
        self.leaf(self.cell(p)).0 as usize
    }

    /// Where the table tells of a position.
    #[inline]
    fn top(cell: Cell) -> usize {
        let [x, y, z] = cell.map(|x| (x >> (BITS - TOP_BITS)) as usize);
        (((z << TOP_BITS) + y) << TOP_BITS) + x
    }

    /// The leaf at or below a node with so many splits above, or the node where that many `most` are reached. The bits
    /// of coordinates that decide are the highest, and the next decision is that of the first coordinate.
    #[inline(always)]
    fn search(&self, mut node: u32, mut depth: u32, most: Option<u32>, [mut a, mut b, mut c]: Cell) -> (u32, u32) {
        while node & LEAF == 0 && most.is_none_or(|most| depth < most) {
            node = self.nodes[node as usize][(a >> 31) as usize];
            (a, b, c) = (b, c, a << 1);
            depth += 1;
        }
        (node, depth)
    }

    /// Fills the table by which searches begin.
    fn look_up(&mut self) {
        for index in 0..1 << TOP {
            let coordinate = |axis: u32| (index >> (axis * TOP_BITS)) as u32 & ((1 << TOP_BITS) - 1);
            let cell = [0, 1, 2].map(|axis| coordinate(axis) << (32 - TOP_BITS));
            let (node, depth) = self.search(self.root, 0, Some(TOP), cell);
            (self.top[index], self.above[index]) = (node, depth as u8);
        }
    }

    /// Extent of a leaf below so many splits, in whole numbers.
    pub fn extent(depth: u32) -> Cell {
        [0, 1, 2].map(|axis| 1 << (BITS - (depth + 2 - axis) / 3))
    }

    /// Number of leaves.
    pub fn leaves(&self) -> usize {
        self.leaves as usize
    }

    /// Deepest leaf.
    pub fn depth(&self) -> u32 {
        self.walk().into_iter().map(|(_, depth)| depth).max().unwrap_or(0)
    }

    /// All leaves with the splits above them, in the order of their numbers.
    pub fn walk(&self) -> Vec<(u32, u32)> {
        let (mut open, mut found) = (vec![(self.root, 0)], Vec::with_capacity(self.leaves()));
        while let Some((node, depth)) = open.pop() {
            match node & LEAF {
                0 => open.extend(self.nodes[node as usize].map(|child| (child, depth + 1))),
                _ => found.push((node & !LEAF, depth)),
            }
        }
        found.sort_unstable();
        found
    }

    /// Splits leaves where `wanted` (told the leaf and the splits above it) says so; `split` is told which leaf has
    /// given its other half to which new one. A new leaf may be split in turn.
    pub fn split(&mut self, mut wanted: impl FnMut(u32, u32) -> bool, mut split: impl FnMut(u32, u32)) {
        // Where the number of a leaf stands: in the root, or in a node and side.
        type Place = Option<(usize, usize)>;
        let mut open: Vec<(Place, u32, u32)> = vec![(None, self.root, 0)];
        while let Some((place, node, depth)) = open.pop() {
            if node & LEAF == 0 {
                let children = self.nodes[node as usize];
                open.extend([1, 0].map(|side| (Some((node as usize, side)), children[side], depth + 1)));
                continue;
            }
            let old = node & !LEAF;
            if depth >= DEEPEST || !wanted(old, depth) {
                continue;
            }
            let new = self.leaves;
            self.leaves += 1;
            split(old, new);
            let index = self.nodes.len();
            self.nodes.push([old | LEAF, new | LEAF]);
            match place {
                Some((parent, side)) => self.nodes[parent][side] = index as u32,
                None => self.root = index as u32,
            }
            open.extend([1, 0].map(|side| (Some((index, side)), self.nodes[index][side], depth + 1)));
        }
        self.look_up();
    }

    /// All leaves that overlap a box of whole numbers, with the part of the box's volume in each. The box lies inside
    /// the cube.
    pub fn overlaps(&self, low: Cell, size: Cell, mut visit: impl FnMut(u32, f32)) {
        let volume: f64 = size.iter().map(|s| f64::from(*s)).product();
        let mut open = vec![(self.root, [0; 3], [1u32 << BITS; 3], 0)];
        while let Some((node, min, extent, depth)) = open.pop() {
            let mut part = 1.0 / volume;
            for axis in 0..3 {
                let from = low[axis].max(min[axis]);
                let to = (low[axis] + size[axis]).min(min[axis] + extent[axis]);
                part *= f64::from(to.saturating_sub(from));
            }
            if part == 0.0 {
                continue;
            }
            if node & LEAF != 0 {
                visit(node & !LEAF, part as f32);
                continue;
            }
            let axis = depth % 3;
            let mut half = extent;
            half[axis] /= 2;
            let mut upper = min;
            upper[axis] += half[axis];
            let [first, second] = self.nodes[node as usize];
            open.push((second, upper, half, depth + 1));
            open.push((first, min, half, depth + 1));
        }
    }

    /// All cells that are divided, by their halves. The first one is the root, and halves stand after what they are of.
    pub fn inner(&self) -> Vec<[Child; 2]> {
        let child = |node: u32| match node & LEAF {
            0 => Child::Inner(node as usize),
            _ => Child::Leaf((node & !LEAF) as usize),
        };
        self.nodes.iter().map(|children| children.map(child)).collect()
    }

    /// Bytes it takes.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<[u32; 2]>() + self.top.len() * (size_of::<u32>() + size_of::<u8>())
    }

    /// Checks that every leaf is there once and every node is reached.
    ///
    /// # Errors
    /// What does not hold.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let leaves = self.walk();
        let numbered = leaves.iter().enumerate().all(|(i, (leaf, _))| i as u32 == *leaf);
        if !numbered || leaves.len() != self.leaves() || self.nodes.len() + 1 != leaves.len() {
            return Err("the spatial tree does not have every leaf once".to_owned());
        }
        match leaves.iter().all(|(_, depth)| *depth <= DEEPEST) {
            true => Ok(()),
            false => Err("the spatial tree is too deep".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna_core::sampling::Pcg32;

    fn unit() -> SpatialTree {
        SpatialTree::new(Aabb { min: Vec3::ZERO, max: Vec3::ONE })
    }

    /// Splits the leaf with a point until it is deep.
    fn split_at(tree: &mut SpatialTree, p: Vec3, depth: u32) {
        while tree.leaf(tree.cell(p)).1 < depth {
            let (leaf, _) = tree.leaf(tree.cell(p));
            tree.split(|l, d| l == leaf && d < depth, |_, _| ());
        }
    }

    #[test]
    fn halves_lie_where_they_should() {
        let mut tree = unit();
        tree.split(|_, depth| depth < 3, |_, _| ());
        tree.validate().unwrap();
        let leaf = |x: f32, y: f32, z: f32| tree.leaf(tree.cell(Vec3::new(x, y, z))).0;
        let mut all: Vec<u32> =
            (0..8).map(|i| leaf([0.2, 0.7][i & 1], [0.3, 0.6][i >> 1 & 1], [0.1, 0.9][i >> 2])).collect();
        assert_eq!(leaf(0.2, 0.3, 0.1), leaf(0.49, 0.49, 0.49));
        all.sort_unstable();
        assert_eq!(all, (0..8).collect::<Vec<_>>());
        assert_eq!(SpatialTree::extent(0), [1 << BITS; 3]);
        assert_eq!(SpatialTree::extent(1), [1 << (BITS - 1), 1 << BITS, 1 << BITS]);
        assert_eq!(SpatialTree::extent(5), [1 << (BITS - 2), 1 << (BITS - 2), 1 << (BITS - 1)]);
    }

    #[test]
    fn hc_p04_points_anywhere_find_a_leaf_and_splits_end() {
        let mut tree = unit();
        split_at(&mut tree, Vec3::splat(0.3), DEEPEST);
        tree.validate().unwrap();
        assert_eq!(tree.depth(), DEEPEST);
        tree.split(|_, depth| depth >= DEEPEST, |_, _| panic!("too deep"));
        for p in [Vec3::splat(1e18), Vec3::splat(-1e30), Vec3::NAN, Vec3::INFINITY] {
            assert!((tree.leaf(tree.cell(p)).0 as usize) < tree.leaves(), "{p}");
        }
        let point = Aabb { min: Vec3::ONE, max: Vec3::ONE };
        for bounds in [point, Aabb::EMPTY, Aabb { min: Vec3::splat(-1e38), max: Vec3::splat(3e38) }] {
            let tree = SpatialTree::new(bounds);
            assert_eq!(tree.leaf(tree.cell(Vec3::ONE)), (0, 0));
        }
    }

    /// Parts of a box sum to one, and each is what random points of the box find.
    #[test]
    fn overlaps_are_volumes() {
        let mut tree = unit();
        for p in [Vec3::splat(0.3), Vec3::new(0.9, 0.1, 0.5), Vec3::new(0.26, 0.3, 0.31)] {
            split_at(&mut tree, p, 9);
        }
        let (low, size) = ([200_000, 240_000, 260_000], [131_072, 131_072, 65_536]);
        let mut parts = vec![0.0; tree.leaves()];
        tree.overlaps(low, size, |leaf, part| parts[leaf as usize] += f64::from(part));
        assert!((parts.iter().sum::<f64>() - 1.0).abs() < 1e-5);
        let (mut pcg, n) = (Pcg32::new(1, 1), 20_000);
        let mut counts = vec![0.0; tree.leaves()];
        for _ in 0..n {
            let cell = [0, 1, 2].map(|i: usize| low[i] + pcg.next_below(size[i]));
            counts[tree.leaf(cell).0 as usize] += 1.0 / f64::from(n);
        }
        for (part, count) in parts.iter().zip(counts) {
            assert!((part - count).abs() < 4.0 * (part / f64::from(n)).sqrt() + 1e-9, "{part} {count}");
        }
    }
}
