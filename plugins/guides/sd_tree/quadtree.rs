//! Directions in a quadtree over the [cylinder](super::cylinder)'s square, to sample from. The one that is filled is in
//! [`super::sums`].
//!
//! The upper three levels are a grid of 8 × 8 that every tree has: it is sampled like a table, and may be weighted by the
//! cosine at a vertex. Each of its cells is a leaf or the root of a quadtree.

use super::sums::{Found, Sums};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2};
use std::f32::consts::PI;

/// Cells of the grid along an edge.
pub const EDGE: usize = 8;
/// Cells of the grid.
pub const CELLS: usize = EDGE * EDGE;
/// Level of the grid's cells.
pub(super) const GRID_LEVEL: u32 = 3;

/// Levels below the square at most.
pub const MOST_LEVELS: u32 = 20;

/// Nodes of a tree at most, for they are numbered with 16 bits and 0 means none.
pub(super) const MOST_NODES: usize = u16::MAX as usize;

/// Density per solid angle of a uniform direction.
pub const UNIFORM: f32 = 0.25 / PI;

/// A node of either tree: values of four children, and their nodes (0: a leaf). Child `2 j + i` is right for odd `i`
/// (u above one half), upper for odd `j`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Node<T> {
    pub(super) value: [T; 4],
    pub(super) child: [u16; 4],
}

/// The child in which a point lies, which becomes a point of that child.
#[inline]
pub(super) fn descend(p: &mut Vec2) -> usize {
    *p *= 2.0;
    let (i, j) = (usize::from(p.x >= 1.0), usize::from(p.y >= 1.0));
    *p -= Vec2::new(i as f32, j as f32);
    2 * j + i
}

/// The cell of the grid in which a point lies, which becomes a point of that cell. Cells are numbered along u.
#[inline]
pub(super) fn cell(p: &mut Vec2) -> usize {
    *p *= EDGE as f32;
    let (i, j) = ((p.x as usize).min(EDGE - 1), (p.y as usize).min(EDGE - 1));
    *p -= Vec2::new(i as f32, j as f32);
    j * EDGE + i
}

/// Writes the shape of a tree: its roots and the children of its nodes.
pub(super) fn pack_shape<T>(roots: &[u16; CELLS], nodes: &[Node<T>], to: &mut Packer) {
    to.u32(nodes.len() as u32 - 1);
    roots.iter().chain(nodes[1..].iter().flat_map(|node| &node.child)).for_each(|child| to.u16(*child));
}

/// Reads the shape of a tree, in which every node stands behind the one above it and is below it once.
///
/// # Errors
/// If it is none.
pub(super) fn unpack_shape<T: Copy + Default>(from: &mut Cursor<'_>) -> Result<([u16; CELLS], Vec<Node<T>>)> {
    let count = from.count(8, "nodes of directions")?;
    let mut levels = vec![0; count + 1];
    let mut nodes = vec![Node::<T>::default(); count + 1];
    let mut below = |above: usize, level: u32, levels: &mut [u32]| {
        let child = from.u16("a node of directions")?;
        let place = usize::from(child);
        match levels.get_mut(place) {
            _ if child == 0 => {}
            Some(free) if *free == 0 && place > above && level < MOST_LEVELS => *free = level,
            _ => return Err(IoError::new("a tree over directions is too deep or does not have every node once")),
        }
        Ok(child)
    };
    let mut roots = [0; CELLS];
    for root in &mut roots {
        *root = below(0, GRID_LEVEL, &mut levels)?;
    }
    for index in 1..=count {
        if levels[index] == 0 || count >= MOST_NODES {
            return Err(IoError::new("a tree over directions has too many nodes"));
        }
        for child in 0..4 {
            nodes[index].child[child] = below(index, levels[index] + 1, &mut levels)?;
        }
    }
    Ok((roots, nodes))
}

/// A part that was found by records of such a worth, if `prior` others would have had the part `expected`.
pub fn blend(part: f64, worth: f64, expected: f64, prior: f64) -> f64 {
    if worth > 0.0 { (worth * part + prior * expected) / (worth + prior) } else { expected }
}

/// A tree to sample from.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadtree {
    /// Part of the flux in each cell; they sum to 1.
    pub grid: [f32; CELLS],
    roots: [u16; CELLS],
    /// Part of the flux in each child. The first one is not used.
    nodes: Vec<Node<f32>>,
}

impl Quadtree {
    /// With these parts of the flux in the cells of the grid, and inside them as was summed. Where that was found by few
    /// records, what they say counts less than a uniform distribution.
    pub fn new(grid: [f32; CELLS], sums: &Sums, prior: f64) -> Self {
        let mut nodes = Vec::with_capacity(sums.nodes.len());
        for node in &sums.nodes {
            let parts = [0, 1, 2, 3].map(|i: usize| match node.child[i] {
                0 => node.value[i],
                below => sums.total_below(below),
            });
            let total = parts.iter().fold(Found::default(), |total, part| total.and(*part));
            let worth = total.worth();
            let value = parts.map(|part| blend(part.flux / total.flux, worth, 0.25, prior) as f32);
            nodes.push(Node { value, child: node.child });
        }
        Quadtree { grid, roots: sums.roots, nodes }
    }

    /// The cell of a point, and its density relative to a uniform one inside this cell.
    #[inline]
    pub fn pdf_in_cell(&self, mut p: Vec2) -> (usize, f32) {
        let cell = cell(&mut p);
        let mut node = self.roots[cell];
        let mut density = 1.0;
        while node != 0 {
            let child = descend(&mut p);
            let Node { value, child: children } = &self.nodes[usize::from(node)];
            density *= 4.0 * value[child];
            node = children[child];
        }
        (cell, density)
    }

    /// A point of a cell in the whole square, and its density relative to a uniform one inside this cell. Both numbers
    /// are used again on every level; double precision keeps what they have.
    #[inline]
    pub fn sample_in_cell(&self, cell: usize, u: [f64; 2]) -> (Vec2, f32) {
        let [mut x, mut y] = u;
        let mut low = [(cell % EDGE) as f64, (cell / EDGE) as f64].map(|i| i / EDGE as f64);
        let mut size = 1.0 / EDGE as f64;
        let mut node = self.roots[cell];
        let mut density = 1.0;
        while node != 0 {
            let Node { value, child: children } = &self.nodes[usize::from(node)];
            size *= 0.5;
            let lower = value[0] + value[1];
            let (j, rest) = choose(y, lower / (lower + value[2] + value[3]));
            let (a, b) = (value[2 * j], value[2 * j + 1]);
            let (i, rest_x) = choose(x, a / (a + b));
            (x, y) = (rest_x, rest);
            low = [low[0] + size * i as f64, low[1] + size * j as f64];
            density *= 4.0 * value[2 * j + i];
            node = children[2 * j + i];
        }
        let p = Vec2::new((low[0] + size * x) as f32, (low[1] + size * y) as f32);
        (p.min(Vec2::splat(ONE_MINUS_EPSILON)), density)
    }

    /// Writes it.
    pub fn pack(&self, to: &mut Packer) {
        pack_shape(&self.roots, &self.nodes, to);
        let parts = self.grid.iter().chain(self.nodes[1..].iter().flat_map(|node| &node.value));
        parts.for_each(|part| to.f32(*part));
    }

    /// Reads what was written.
    ///
    /// # Errors
    /// If it is no tree of probabilities.
    pub fn unpack(from: &mut Cursor<'_>) -> Result<Self> {
        let (roots, nodes) = unpack_shape(from)?;
        let mut tree = Quadtree { grid: [0.0; CELLS], roots, nodes };
        for part in tree.grid.iter_mut().chain(tree.nodes[1..].iter_mut().flat_map(|node| &mut node.value)) {
            *part = from.f32("probabilities")?;
        }
        tree.validate().map_err(IoError::new)?;
        Ok(tree)
    }

    /// Leaves at each level below the square, which is level 0.
    pub fn leaves_per_level(&self, counts: &mut [u64; MOST_LEVELS as usize + 1]) {
        let mut levels = vec![GRID_LEVEL; self.nodes.len()];
        let roots = self.roots.iter().filter(|root| **root == 0).count();
        counts[GRID_LEVEL as usize] += roots as u64;
        // A node comes after the one above it.
        for (index, node) in self.nodes.iter().enumerate().skip(1) {
            let level = levels[index] + 1;
            for child in node.child {
                match child {
                    0 => counts[level as usize] += 1,
                    below => levels[usize::from(below)] = level,
                }
            }
        }
    }

    /// Nodes below the grid.
    pub fn nodes(&self) -> usize {
        self.nodes.len() - 1
    }

    /// Bytes it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.nodes.len() * size_of::<Node<f32>>()
    }

    /// Checks that all parts are probabilities and sum to one, and that every node is reached once.
    ///
    /// # Errors
    /// What does not hold.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let is_distribution = |parts: &[f32]| {
            let sum: f32 = parts.iter().sum();
            parts.iter().all(|p| *p >= 0.0) && (sum - 1.0).abs() < 1e-4
        };
        if !is_distribution(&self.grid) {
            return Err("the grid of a quadtree does not sum to 1".to_owned());
        }
        let mut reached = vec![0; self.nodes.len()];
        let children = self.nodes.iter().skip(1).flat_map(|node| node.child);
        for child in self.roots.iter().copied().chain(children).filter(|child| *child != 0) {
            match reached.get_mut(usize::from(child)) {
                Some(times) => *times += 1,
                None => return Err(format!("a quadtree refers to node {child}, which it does not have")),
            }
        }
        if reached.iter().skip(1).any(|times| *times != 1) {
            return Err("a node of a quadtree is not reached exactly once".to_owned());
        }
        match self.nodes.iter().skip(1).all(|node| is_distribution(&node.value)) {
            true => Ok(()),
            false => Err("the children of a quadtree's node do not sum to 1".to_owned()),
        }
    }
}

/// 0 with this probability or else 1, and what is left of the number.
#[inline]
fn choose(u: f64, p: f32) -> (usize, f64) {
    let p = f64::from(p);
    if u < p { (0, u / p) } else { (1, ((u - p) / (1.0 - p)).min(1.0 - f64::EPSILON)) }
}

#[cfg(test)]
mod tests {
    use super::super::sums::Refinement;
    use super::*;
    use lucerna_core::sampling::Pcg32;

    const HOW: Refinement = Refinement { threshold: 0.01, depth: 20, worth: 0.0, kept: 0.0 };

    /// As it was summed.
    fn tree(sums: &Sums) -> Quadtree {
        let total = sums.total();
        Quadtree::new(sums.cells().map(|found| (found.flux / total) as f32), sums, 0.0)
    }

    /// Sums of points that gather in two places, after two rounds of refinement.
    fn trained(box_filter: bool) -> Sums {
        let mut sums = Sums::default();
        for round in 0..4 {
            let mut pcg = Pcg32::new(3, round);
            for i in 0..20_000 {
                let mut next = || pcg.next_f32();
                let p = match i % 3 {
                    0 => Vec2::new(next(), next()),
                    1 => Vec2::new(0.3 + 0.001 * next(), 0.999 + 0.001 * next()),
                    _ => Vec2::new(0.9 + 0.1 * next(), 0.02 * next()),
                };
                let p = p.min(Vec2::splat(ONE_MINUS_EPSILON));
                if box_filter { sums.add_box(p, 1.0) } else { sums.add(p, 1.0) }
            }
            if round < 3 {
                sums = sums.refined(HOW);
            }
        }
        sums
    }

    #[test]
    fn nothing_is_lost_by_either_filter() {
        for filter in [false, true] {
            let total = trained(filter).total();
            assert!((total / 20_000.0 - 1.0).abs() < 1e-9, "{filter}: {total}");
        }
    }

    /// What lies at an angle of nearly 2π also adds to those near 0.
    #[test]
    fn the_box_goes_round() {
        let mut sums = Sums::default();
        sums.add_box(Vec2::new(0.99, 0.999), 1.0);
        let (first, last) = (sums.cell_total(EDGE - 1).flux, sums.cell_total(CELLS - 1).flux);
        assert!((first - 0.492).abs() < 1e-6 && (last - 0.508).abs() < 1e-6, "{first} {last}");
    }

    #[test]
    fn cells_with_much_flux_are_divided() {
        let tree = tree(&trained(false));
        tree.validate().unwrap();
        assert!(tree.nodes() > 20 && tree.nodes() < 600, "{}", tree.nodes());
        let (_, peak) = tree.pdf_in_cell(Vec2::new(0.3005, 0.9995));
        assert!(peak > 1000.0, "{peak}");
    }

    #[test]
    fn hc_p02_sums_of_nothing_one_and_extremes_are_usable() {
        let uniform = Quadtree::new([1.0 / CELLS as f32; CELLS], &Sums::default(), 8.0);
        assert_eq!(uniform.pdf_in_cell(Vec2::splat(0.3)).1, 1.0);
        assert_eq!(Sums::default().refined(HOW), Sums::default());
        for value in [1e30, 1e-30, 1.0] {
            let mut sums = Sums::default();
            for _ in 0..30 {
                sums.add(Vec2::new(0.2, 0.7), value);
                let tree = tree(&sums);
                tree.validate().unwrap();
                assert!(tree.pdf_in_cell(Vec2::new(0.2, 0.7)).1.is_finite());
                let mut next = sums.refined(HOW);
                next.add_box(Vec2::new(0.2, 0.7), value);
                self::tree(&next).validate().unwrap();
                sums = sums.refined(HOW);
            }
        }
    }

    /// What is kept is where it was, in finer cells and in coarser ones.
    #[test]
    fn a_part_is_kept_when_the_tree_changes() {
        let old = trained(true);
        for how in [HOW, Refinement { threshold: 0.3, ..HOW }, Refinement { threshold: 0.001, ..HOW }] {
            let new = old.refined(Refinement { kept: 0.5, ..how });
            for (old, new) in old.cells().iter().zip(new.cells()) {
                assert!((0.5 * old.flux - new.flux).abs() < 1e-6 * old.flux, "{old:?} {new:?}");
            }
        }
    }

    /// A thousand equal records divide a cell; one that outshines them does not, and says little.
    #[test]
    fn one_firefly_is_not_believed() {
        let (place, how) = (Vec2::splat(0.3), Refinement { worth: 4.0, ..HOW });
        let mut sums = Sums::default();
        (0..1000).for_each(|_| sums.add(place, 1.0));
        assert!((sums.cells()[18].worth() - 1000.0).abs() < 1e-6);
        assert!(sums.refined(how).nodes.len() > 1);
        sums.add(place, 1e9);
        assert!((sums.cells()[18].worth() - 1.0).abs() < 1e-5);
        assert_eq!(sums.refined(how), sums.refined(Refinement { depth: 3, ..how }));
        assert!((blend(1.0, 1.0, 0.1, 8.0) - 0.2).abs() < 1e-12 && blend(f64::NAN, 0.0, 0.1, 0.0) == 0.1);
    }

    /// The density of samples is that of the same point, and the cell too.
    #[test]
    fn samples_have_their_density() {
        let tree = tree(&trained(true));
        let mut pcg = Pcg32::new(1, 1);
        for _ in 0..20_000 {
            let from = (pcg.next_below(CELLS as u32)) as usize;
            let (p, density) = tree.sample_in_cell(from, [pcg.next_f32(), pcg.next_f32()].map(f64::from));
            let (cell, expected) = tree.pdf_in_cell(p);
            assert!(cell == from && (density / expected - 1.0).abs() < 1e-5, "{p}: {density} {expected}");
        }
    }
}
