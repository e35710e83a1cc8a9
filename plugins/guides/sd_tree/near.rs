//! What vertices ask for, close together.
//!
//! A vertex may lie in any cell, so that each question waits for memory, once for each thing that has to be found before
//! the next one can be. Here that is a short entry of the cell, and its tree over directions with all its nodes behind it.

use super::field::Leaf;
use super::quadtree::{Quad, Quads, Quadtree};
use std::collections::HashMap;
use std::sync::Arc;

/// The trees over directions of all cells.
#[derive(Default)]
pub struct Near {
    cells: Vec<Entry>,
    quads: Vec<Quad>,
}

#[derive(Clone, Copy)]
struct Entry {
    /// Where the tree begins; [`NONE`] if nothing is known.
    tree: u32,
    p_guide: f32,
}

const NONE: u32 = u32::MAX;

impl Near {
    /// Those of the leaves. Trees that leaves share are there once.
    pub fn new(leaves: &[Leaf]) -> Self {
        let mut quads: Vec<Quad> = Vec::new();
        let mut places = HashMap::new();
        let mut place = |tree: &Arc<Quadtree>| {
            *places.entry(Arc::as_ptr(tree)).or_insert_with(|| {
                let place = u32::try_from(quads.len()).unwrap_or(NONE);
                quads.extend_from_slice(tree.quads());
                place
            })
        };
        let entry =
            |leaf: &Leaf| Entry { tree: leaf.directions.as_ref().map_or(NONE, &mut place), p_guide: leaf.p_guide };
        let cells = leaves.iter().map(entry).collect();
        Near { cells, quads }
    }

    /// The tree of a cell, and the probability of the guide.
    #[inline]
    pub fn get(&self, cell: usize) -> Option<(Quads<'_>, f32)> {
        let Entry { tree, p_guide } = self.cells[cell];
        // Nothing begins at `NONE`.
        Some((Quads::new(self.quads.get(tree as usize..)?)?, p_guide))
    }
}
