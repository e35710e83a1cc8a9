//! What was found in each direction, in a quadtree of the same form as that of [`super::quadtree`].

use super::quadtree::{CELLS, EDGE, GRID_LEVEL, MOST_LEVELS, MOST_NODES, cell, descend};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::Vec2;
use std::collections::VecDeque;

/// What was found in a cell: its flux, and how far that can be relied on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Found {
    /// Sum of the records' radiance over density.
    pub flux: f64,
    /// Sum of the squares of that, each by the part of the record that lies here.
    pub squares: f64,
}

impl Found {
    fn add(&mut self, flux: f64, part: f64) {
        self.flux += flux * part;
        self.squares += flux * flux * part;
    }

    /// Both together.
    pub fn and(self, other: Found) -> Found {
        Found { flux: self.flux + other.flux, squares: self.squares + other.squares }
    }

    /// A part of it.
    pub fn part(self, part: f64) -> Found {
        Found { flux: part * self.flux, squares: part * self.squares }
    }

    /// The number of equal records that would be as reliable: 1 where one firefly is brighter than all the rest (Kish
    /// 1965, *Survey Sampling*, section 11.7).
    pub fn worth(self) -> f64 {
        let worth = self.flux * (self.flux / self.squares);
        if worth.is_finite() { worth } else { 0.0 }
    }
}

/// What was found in four children, and their nodes (0: a leaf), numbered as in [`descend`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Node {
    value: [Found; 4],
    child: [u16; 4],
}

/// A tree that is filled. Only leaves are added to.
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    grid: [Found; CELLS],
    pub(super) roots: [u16; CELLS],
    /// The first one is not used.
    pub(super) nodes: Vec<Node>,
}

/// How a tree is refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// A cell with more than this part of the flux is divided.
    pub threshold: f64,
    /// Levels below the square at most.
    pub depth: u32,
    /// A cell whose flux has a lower [worth](Found::worth) is not divided.
    pub worth: f64,
    /// Part of what was found that goes on to count.
    pub kept: f64,
}

impl Default for Sums {
    fn default() -> Self {
        Sums { grid: [Found::default(); CELLS], roots: [0; CELLS], nodes: vec![Node::default()] }
    }
}

impl Sums {
    /// Adds to the leaf at a point.
    #[inline]
    pub fn add(&mut self, mut p: Vec2, value: f64) {
        let cell = cell(&mut p);
        let mut node = self.roots[cell];
        if node == 0 {
            self.grid[cell].add(value, 1.0);
            return;
        }
        loop {
            let child = descend(&mut p);
            let Node { value: sums, child: children } = &mut self.nodes[usize::from(node)];
            node = children[child];
            if node == 0 {
                sums[child].add(value, 1.0);
                return;
            }
        }
    }

    /// Level of the leaf at a point, counted from the square.
    fn level(&self, mut p: Vec2) -> u32 {
        let mut node = self.roots[cell(&mut p)];
        let mut level = GRID_LEVEL;
        while node != 0 {
            node = self.nodes[usize::from(node)].child[descend(&mut p)];
            level += 1;
        }
        level
    }

    /// Adds to all leaves that a square overlaps which is as large as the leaf at the point and has the point in its
    /// middle, to each by area. It goes round in the angle, and is moved inside at the poles: nothing is lost.
    pub fn add_box(&mut self, p: Vec2, value: f64) {
        let size = (-f64::from(self.level(p))).exp2();
        let low_u = (f64::from(p.x) - 0.5 * size).clamp(0.0, 1.0 - size);
        let low_v = f64::from(p.y) - 0.5 * size;
        for turn in [-1.0, 0.0, 1.0] {
            let (from, to) = ((low_v + turn).max(0.0), (low_v + turn + size).min(1.0));
            if from < to {
                self.spread(&Patch { from: [low_u, from], to: [low_u + size, to], value, part: 1.0 / (size * size) });
            }
        }
    }

    /// Adds a record over a rectangle inside the square.
    fn spread(&mut self, patch: &Patch) {
        const SIZE: f64 = 1.0 / EDGE as f64;
        let range = |axis: usize| {
            let first = (patch.from[axis] / SIZE) as usize;
            first.min(EDGE - 1)..=((patch.to[axis] / SIZE) as usize).min(EDGE - 1)
        };
        for j in range(1) {
            for i in range(0) {
                let low = [i as f64 * SIZE, j as f64 * SIZE];
                let part = patch.part_in(low, SIZE);
                let cell = j * EDGE + i;
                match self.roots[cell] {
                    _ if part <= 0.0 => {}
                    0 => self.grid[cell].add(patch.value, part),
                    root => self.spread_below(root, low, 0.5 * SIZE, patch),
                }
            }
        }
    }

    fn spread_below(&mut self, node: u16, low: [f64; 2], half: f64, patch: &Patch) {
        for child in 0..4 {
            let at = [low[0] + half * (child & 1) as f64, low[1] + half * (child >> 1) as f64];
            let part = patch.part_in(at, half);
            match self.nodes[usize::from(node)].child[child] {
                _ if part <= 0.0 => {}
                0 => self.nodes[usize::from(node)].value[child].add(patch.value, part),
                below => self.spread_below(below, at, 0.5 * half, patch),
            }
        }
    }

    /// What was found below a node.
    pub(super) fn total_below(&self, node: u16) -> Found {
        let ([a, b, c, d], _) = self.parts(node);
        a.and(b).and(c).and(d)
    }

    /// What was found in a cell of the grid.
    pub(super) fn cell_total(&self, cell: usize) -> Found {
        if self.roots[cell] == 0 { self.grid[cell] } else { self.total_below(self.roots[cell]) }
    }

    /// What was found in the parts of a node, and their nodes.
    pub(super) fn parts(&self, node: u16) -> ([Found; 4], [u16; 4]) {
        let Node { value, child } = self.nodes[usize::from(node)];
        let found = |i: usize| if child[i] == 0 { value[i] } else { self.total_below(child[i]) };
        ([0, 1, 2, 3].map(found), child)
    }

    /// What was found in the cells of the grid.
    pub fn cells(&self) -> [Found; CELLS] {
        std::array::from_fn(|cell| self.cell_total(cell))
    }

    /// Flux of all.
    pub fn total(&self) -> f64 {
        self.cells().iter().map(|found| found.flux).sum()
    }

    /// The same tree, in which nothing was found.
    pub fn emptied(&self) -> Sums {
        let nodes = self.nodes.iter().map(|node| Node { child: node.child, ..Node::default() }).collect();
        Sums { grid: [Found::default(); CELLS], roots: self.roots, nodes }
    }

    /// The part of the flux that is distributed alike in two trees of the same form: 1 if all is, 0 if one has nothing where
    /// the other has something.
    pub fn common(&self, other: &Sums) -> f64 {
        let parts = [1.0 / self.total(), 1.0 / other.total()];
        let of_leaves = |a: &Found, b: &Found| (parts[0] * a.flux).min(parts[1] * b.flux);
        let grid = self.grid.iter().zip(&other.grid).map(|(a, b)| of_leaves(a, b)).sum::<f64>();
        let nodes = self.nodes.iter().zip(&other.nodes).flat_map(|(a, b)| a.value.iter().zip(&b.value));
        // What is no leaf has nothing of its own.
        grid + nodes.map(|(a, b)| of_leaves(a, b)).sum::<f64>()
    }

    /// Leaves only the rest of the flux, and adds a part of this flux as it is distributed in a tree of the same form, which has
    /// some.
    pub fn give(&mut self, part: f64, flux: f64, other: &Sums) {
        let times = part * flux / other.total();
        let blend = |to: &mut Found, from: &Found| {
            let other = Found { flux: times * from.flux, squares: times * times * from.squares };
            *to = to.part(1.0 - part).and(other);
        };
        self.grid.iter_mut().zip(&other.grid).for_each(|(to, from)| blend(to, from));
        for (to, from) in self.nodes.iter_mut().zip(&other.nodes) {
            to.value.iter_mut().zip(&from.value).for_each(|(to, from)| blend(to, from));
        }
    }

    /// A tree whose leaves have about the same flux each, if that is distributed as here, with a part of what was found.
    /// Cells in which few records have nearly all the flux stay whole: where exactly it lies is not known.
    pub fn refined(&self, how: Refinement) -> Sums {
        let total = self.total();
        let mut new = Sums::default();
        if !(total > 0.0 && total.is_finite()) {
            return new;
        }
        // From the top downwards, so that a tree that is full is balanced: the place of a child, its node here if it has
        // one, what was found in it and its level.
        let mut open: VecDeque<(Option<u16>, usize, u16, Found, u32)> = VecDeque::new();
        for cell in 0..CELLS {
            open.push_back((None, cell, self.roots[cell], self.cell_total(cell), GRID_LEVEL));
        }
        while let Some((parent, place, old, found, level)) = open.pop_front() {
            let divided = found.flux > how.threshold * total && found.worth() >= how.worth;
            if !divided || level >= how.depth || new.nodes.len() >= MOST_NODES {
                let kept = match parent {
                    None => &mut new.grid[place],
                    Some(parent) => &mut new.nodes[usize::from(parent)].value[place],
                };
                *kept = found.part(how.kept);
                continue;
            }
            let index = new.nodes.len() as u16;
            new.nodes.push(Node::default());
            match parent {
                None => new.roots[place] = index,
                Some(parent) => new.nodes[usize::from(parent)].child[place] = index,
            }
            for child in 0..4 {
                let (below, part) = match old {
                    0 => (0, found.part(0.25)),
                    old => {
                        let Node { value, child: children } = &self.nodes[usize::from(old)];
                        match children[child] {
                            0 => (0, value[child]),
                            below => (below, self.total_below(below)),
                        }
                    }
                };
                open.push_back((Some(index), child, below, part, level + 1));
            }
        }
        new
    }

    /// Writes it; sums that are all 0 are not written.
    pub fn pack(&self, to: &mut Packer) {
        pack_shape(&self.roots, &self.nodes, to);
        let sums = || self.grid.iter().chain(self.nodes[1..].iter().flat_map(|node| &node.value));
        let filled = sums().any(|found| *found != Found::default());
        to.u16(filled.into());
        if filled {
            sums().for_each(|Found { flux, squares }| [flux, squares].into_iter().for_each(|sum| to.f64(*sum)));
        }
    }

    /// Reads what was written.
    ///
    /// # Errors
    /// If it is no tree of sums.
    pub fn unpack(from: &mut Cursor<'_>) -> Result<Self> {
        let (roots, mut nodes) = unpack_shape(from)?;
        let mut grid = [Found::default(); CELLS];
        if from.u16("sums")? != 0 {
            for sum in grid.iter_mut().chain(nodes[1..].iter_mut().flat_map(|node| &mut node.value)) {
                *sum = Found { flux: from.f64("sums")?, squares: from.f64("sums")? };
                // Infinite sums come from infinite radiance; they are left out when the tree is refined.
                if [sum.flux, sum.squares].iter().any(|sum| sum.is_nan() || *sum < 0.0) {
                    return Err(IoError::new("a sum of flux is negative or no number"));
                }
            }
        }
        Ok(Sums { grid, roots, nodes })
    }

    /// Bytes it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.nodes.len() * size_of::<Node>()
    }
}

/// Writes the shape of a tree: its roots and the children of its nodes.
fn pack_shape(roots: &[u16; CELLS], nodes: &[Node], to: &mut Packer) {
    to.u32(nodes.len() as u32 - 1);
    roots.iter().chain(nodes[1..].iter().flat_map(|node| &node.child)).for_each(|child| to.u16(*child));
}

/// Reads the shape of a tree, in which every node stands behind the one above it and is below it once.
///
/// # Errors
/// If it is none.
fn unpack_shape(from: &mut Cursor<'_>) -> Result<([u16; CELLS], Vec<Node>)> {
    let count = from.count(8, "nodes of directions")?;
    let mut levels = vec![0; count + 1];
    let mut nodes = vec![Node::default(); count + 1];
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

/// A record over a rectangle of the square.
struct Patch {
    from: [f64; 2],
    to: [f64; 2],
    value: f64,
    /// Part of the record per area.
    part: f64,
}

impl Patch {
    /// The part of the record in a square.
    fn part_in(&self, low: [f64; 2], size: f64) -> f64 {
        self.part * overlap(self.from, self.to, low, size)
    }
}

/// Area that a rectangle shares with a square.
fn overlap(from: [f64; 2], to: [f64; 2], low: [f64; 2], size: f64) -> f64 {
    let side = |axis: usize| (to[axis].min(low[axis] + size) - from[axis].max(low[axis])).max(0.0);
    side(0) * side(1)
}
