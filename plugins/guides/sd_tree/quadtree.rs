//! Directions in a quadtree over the [cylinder](super::cylinder)'s square, to sample from. The one that is filled is in
//! [`super::sums`].
//!
//! The upper three levels are a grid of 8 × 8 that every tree has: it is sampled like a table, and may be weighted by the
//! cosine at a vertex. Each of its cells is a leaf or the root of a quadtree.
//!
//! Vertices ask for cells anywhere in space, so most questions wait for memory: numbers are as short as they may be. Parts
//! of the flux have the 16 upper bits of a float in the grid, and 16 bits below it; a node takes 8 bytes. What is rounded is
//! what is sampled and what is told as the density alike.

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

/// Nodes of a tree at most, for they are numbered with 12 bits.
pub(super) const MOST_NODES: usize = (1 << 12) - 1;

/// Density per solid angle of a uniform direction.
pub const UNIFORM: f32 = 0.25 / PI;

/// The child in which a point lies, which becomes a point of that child. Child `2 j + i` is right for odd `i` (u above one
/// half), upper for odd `j`.
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

/// A part that was found by records of such a worth, if `prior` others would have had the part `expected`.
pub fn blend(part: f64, worth: f64, expected: f64, prior: f64) -> f64 {
    if worth > 0.0 { (worth * part + prior * expected) / (worth + prior) } else { expected }
}

/// The upper half of a float, rounded: three decimal digits.
fn short(value: f32) -> u16 {
    let bits = value.to_bits();
    ((bits + 0x7fff + (bits >> 16 & 1)) >> 16) as u16
}

/// The float of which this is the upper half.
#[inline(always)]
pub fn long(short: u16) -> f32 {
    f32::from_bits(u32::from(short) << 16)
}

/// A cell that is divided into four.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Node {
    /// The part of the flux in the lower two children, over all; in 65535ths.
    lower: u16,
    /// The part in the left child of the lower two, and of the upper two.
    left: [u16; 2],
    /// A bit for each child that is divided, and above them the number of the first one's node; those of the others follow.
    below: u16,
}

/// What [`Node`] calls 1.
const WHOLE: u16 = u16::MAX;

impl Node {
    /// The part of the flux in a child, times 4.
    #[inline]
    fn density(self, child: usize) -> f32 {
        const SCALE: f32 = 4.0 / (WHOLE as f32 * WHOLE as f32);
        let part = |of: u16, other: bool| f32::from(if other { WHOLE - of } else { of });
        let (i, j) = (child & 1, child >> 1);
        part(self.lower, j == 1) * part(self.left[j], i == 1) * SCALE
    }

    /// The node of a child; `None` of a leaf.
    #[inline]
    fn child(self, child: usize) -> Option<usize> {
        /// Bits that are set in each number of four bits.
        const SET: u64 = 0x4332_3221_3221_2110;
        let mask = usize::from(self.below & 0xf);
        let before = mask & ((1 << child) - 1);
        (mask >> child & 1 == 1).then(|| usize::from(self.below >> 4) + (SET >> (4 * before) & 0xf) as usize)
    }

    /// How many children are divided.
    fn divided(self) -> usize {
        (self.below & 0xf).count_ones() as usize
    }
}

/// A part of a whole in [`WHOLE`]ths. What is not nothing or all does not become it; what is no part is one half.
fn share(part: f64, whole: f64) -> u16 {
    let share = part / whole;
    match share {
        _ if !(0.0..=1.0).contains(&share) => WHOLE / 2,
        0.0 => 0,
        1.0 => WHOLE,
        _ => ((share * f64::from(WHOLE)).round() as u16).clamp(1, WHOLE - 1),
    }
}

/// A tree to sample from: the grid (16 quads), a bit for each of its cells that is divided (one), and the nodes, those of
/// the divided cells first.
#[derive(Clone, Debug, PartialEq)]
pub struct Quadtree(Vec<Quad>);

/// Four numbers of 16 bits.
pub type Quad = [u16; 4];

/// A [`Quadtree`], wherever it lies. What stands behind it does not matter.
#[derive(Clone, Copy)]
pub struct Quads<'a>(&'a [Quad]);

/// Quads of the grid.
const GRID_QUADS: usize = CELLS / 4;

impl<'a> Quads<'a> {
    /// The tree that begins there.
    #[inline]
    pub fn new(quads: &'a [Quad]) -> Option<Self> {
        (quads.len() > GRID_QUADS).then_some(Quads(quads))
    }

    /// Part of the flux in each cell of the grid; they sum to 1, but for rounding.
    #[inline]
    pub fn grid(self) -> &'a [u16; CELLS] {
        self.0.as_flattened().first_chunk().unwrap_or(&[0; CELLS])
    }

    /// Part of the flux in a cell of the grid.
    #[inline]
    pub fn part(self, cell: usize) -> f32 {
        long(self.grid()[cell])
    }

    #[inline]
    fn divided(self) -> u64 {
        self.0[GRID_QUADS].iter().rev().fold(0, |bits, part| bits << 16 | u64::from(*part))
    }

    #[inline]
    fn node(self, index: usize) -> Node {
        let [lower, a, b, below] = self.0[GRID_QUADS + 1 + index];
        Node { lower, left: [a, b], below }
    }

    /// The node of a cell of the grid.
    #[inline]
    fn root(self, cell: usize) -> Option<usize> {
        let divided = self.divided();
        let before = divided & ((1 << cell) - 1);
        (divided >> cell & 1 == 1).then(|| before.count_ones() as usize)
    }

    /// The cell of a point, and its density relative to a uniform one inside this cell.
    #[inline]
    pub fn pdf_in_cell(self, mut p: Vec2) -> (usize, f32) {
        let cell = cell(&mut p);
        let mut below = self.root(cell);
        let mut density = 1.0;
        while let Some(node) = below {
            let child = descend(&mut p);
            let node = self.node(node);
            density *= node.density(child);
            below = node.child(child);
        }
        (cell, density)
    }

    /// A point of a cell in the whole square, and its density relative to a uniform one inside this cell. Both numbers
    /// are used again on every level; double precision keeps what they have.
    #[inline]
    pub fn sample_in_cell(self, cell: usize, u: [f64; 2]) -> (Vec2, f32) {
        let [mut x, mut y] = u;
        let mut low = [(cell % EDGE) as f64, (cell / EDGE) as f64].map(|i| i / EDGE as f64);
        let mut size = 1.0 / EDGE as f64;
        let mut below = self.root(cell);
        let mut density = 1.0;
        while let Some(node) = below {
            let node = self.node(node);
            size *= 0.5;
            let (j, rest) = choose(y, node.lower);
            let (i, rest_x) = choose(x, node.left[j]);
            (x, y) = (rest_x, rest);
            low = [low[0] + size * i as f64, low[1] + size * j as f64];
            density *= node.density(2 * j + i);
            below = node.child(2 * j + i);
        }
        let p = Vec2::new((low[0] + size * x) as f32, (low[1] + size * y) as f32);
        (p.min(Vec2::splat(ONE_MINUS_EPSILON)), density)
    }
}

impl Quadtree {
    /// With these parts of the flux in the cells of the grid, and inside them as was summed. Where that was found by few
    /// records, what they say counts less than a uniform distribution, which is worth `prior` records.
    pub fn new(grid: [f32; CELLS], sums: &Sums, prior: f64) -> Self {
        let mut quads = grid.map(short).as_chunks().0.to_vec();
        let roots = || sums.roots.iter().enumerate().filter(|(_, root)| **root != 0);
        let divided = roots().fold(0u64, |bits, (cell, _)| bits | 1 << cell);
        quads.push([0, 16, 32, 48].map(|shift| (divided >> shift) as u16));
        // Nodes of the sums in the order of the nodes here: all of a level, then those below.
        let mut open: Vec<u16> = roots().map(|(_, root)| *root).collect();
        let mut done = 0;
        while let Some(node) = open.get(done).copied() {
            done += 1;
            let (parts, below) = sums.parts(node);
            let total = parts.iter().fold(Found::default(), |total, part| total.and(*part));
            let worth = total.worth();
            let [a, b, c, d] = parts.map(|part| blend(part.flux / total.flux, worth, 0.25, prior));
            let first = (open.len() as u16) << 4;
            let mut bits = 0;
            for (child, node) in below.iter().enumerate().filter(|(_, node)| **node != 0) {
                bits |= 1 << child;
                open.push(*node);
            }
            let below = if bits == 0 { 0 } else { first | bits };
            quads.push([share(a + b, a + b + c + d), share(a, a + b), share(c, c + d), below]);
        }
        Quadtree(quads)
    }

    /// To sample from.
    #[inline]
    pub fn view(&self) -> Quads<'_> {
        Quads(&self.0)
    }

    /// All of it.
    pub fn quads(&self) -> &[Quad] {
        &self.0
    }

    /// Writes it.
    pub fn pack(&self, to: &mut Packer) {
        to.u32(self.0.len() as u32);
        self.0.as_flattened().iter().for_each(|part| to.u16(*part));
    }

    /// Reads what was written.
    ///
    /// # Errors
    /// If it is no tree of probabilities.
    pub fn unpack(from: &mut Cursor<'_>) -> Result<Self> {
        const WHAT: &str = "a tree over directions";
        let mut quads = vec![Quad::default(); from.count(size_of::<Quad>() as u64, WHAT)?];
        for part in quads.as_flattened_mut() {
            *part = from.u16(WHAT)?;
        }
        let tree = Quadtree(quads);
        tree.validate().map_err(IoError::new)?;
        Ok(tree)
    }

    fn each_node(&self) -> impl Iterator<Item = Node> {
        (0..self.nodes()).map(|index| self.view().node(index))
    }

    /// The level of the cell that each node divides.
    fn levels(&self) -> Vec<u32> {
        let mut levels = vec![GRID_LEVEL; self.view().divided().count_ones() as usize];
        for (index, node) in self.each_node().enumerate() {
            let level = levels.get(index).map_or(GRID_LEVEL, |level| level + 1);
            levels.extend(std::iter::repeat_n(level, node.divided()));
        }
        levels
    }

    /// Leaves at each level below the square, which is level 0.
    pub fn leaves_per_level(&self, counts: &mut [u64; MOST_LEVELS as usize + 1]) {
        counts[GRID_LEVEL as usize] += u64::from(self.view().divided().count_zeros());
        for (node, level) in self.each_node().zip(self.levels()) {
            counts[level as usize + 1] += 4 - node.divided() as u64;
        }
    }

    /// Nodes below the grid.
    pub fn nodes(&self) -> usize {
        self.0.len().saturating_sub(GRID_QUADS + 1)
    }

    /// Bytes it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.0.len() * size_of::<Quad>()
    }

    /// Checks that all parts are probabilities and sum to one, and that every node is reached once.
    ///
    /// # Errors
    /// What does not hold.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let Some(view) = Quads::new(&self.0) else { return Err("a quadtree has no grid".to_owned()) };
        let parts = || view.grid().iter().map(|part| long(*part));
        if !(parts().all(|part| part >= 0.0) && (parts().sum::<f32>() - 1.0).abs() < 0.01) {
            return Err("the grid of a quadtree does not sum to 1".to_owned());
        }
        let mut reached = view.divided().count_ones() as usize;
        for (index, node) in self.each_node().enumerate() {
            let first = usize::from(node.below >> 4);
            if index >= reached || (node.divided() > 0 && first != reached) || reached > MOST_NODES {
                return Err("a node of a quadtree is not reached exactly once".to_owned());
            }
            reached += node.divided();
        }
        if reached != self.nodes() {
            return Err("a quadtree refers to nodes that it does not have".to_owned());
        }
        match self.levels().iter().all(|level| *level < MOST_LEVELS) {
            true => Ok(()),
            false => Err("a quadtree is too deep".to_owned()),
        }
    }
}

/// 0 with this probability, in [`WHOLE`]ths, or else 1; and what is left of the number.
#[inline]
fn choose(u: f64, p: u16) -> (usize, f64) {
    let u = u * f64::from(WHOLE);
    let (p, q) = (f64::from(p), f64::from(WHOLE - p));
    if u < p { (0, u / p) } else { (1, ((u - p) / q).min(1.0 - f64::EPSILON)) }
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
        let (_, peak) = tree.view().pdf_in_cell(Vec2::new(0.3005, 0.9995));
        assert!(peak > 1000.0, "{peak}");
    }

    #[test]
    fn hc_p02_sums_of_nothing_one_and_extremes_are_usable() {
        let uniform = Quadtree::new([1.0 / CELLS as f32; CELLS], &Sums::default(), 8.0);
        assert_eq!(uniform.view().pdf_in_cell(Vec2::splat(0.3)).1, 1.0);
        assert_eq!(Sums::default().refined(HOW), Sums::default());
        for value in [1e30, 1e-30, 1.0] {
            let mut sums = Sums::default();
            for _ in 0..30 {
                sums.add(Vec2::new(0.2, 0.7), value);
                let tree = tree(&sums);
                tree.validate().unwrap();
                assert!(tree.view().pdf_in_cell(Vec2::new(0.2, 0.7)).1.is_finite());
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
            let (p, density) = tree.view().sample_in_cell(from, [pcg.next_f32(), pcg.next_f32()].map(f64::from));
            let (cell, expected) = tree.view().pdf_in_cell(p);
            assert!(cell == from && (density / expected - 1.0).abs() < 1e-5, "{p}: {density} {expected}");
        }
    }
}
