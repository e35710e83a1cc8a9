//! What was learnt as bytes, and in numbers.
//!
//! | bytes | what |
//! |---|---|
//! | `u64`, `u32`, `u16` | records taken in, iterations, whether the limit of memory was reached |
//! | | the tree over space: number of nodes, two children each |
//! | `u32` | trees over directions, then each: parts of the flux in the grid, which of its cells are divided, number of nodes, four `u16` each |
//! | | cells of space, one more than nodes: which tree over directions (0: none), probability of the guide, fluence, records, the descent that learns the probability, shape of the sums, and the sums unless all are 0, what scattering brings |
//!
//! Cells that share a tree over directions still do afterwards.

use super::Settings;
use super::field::{Field, Leaf};
use super::learner::{Cell, Learner};
use super::mixing::Mixing;
use super::outlook;
use super::quadtree::{MOST_LEVELS, Quadtree};
use super::spatial::SpatialTree;
use super::sums::Sums;
use lucerna_core::interfaces::{FactValue, GuideFact, GuideField};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::Aabb;
use std::collections::HashMap;
use std::sync::Arc;

/// Bytes of a tree over directions at least: the grid, which cells are divided, number of nodes.
const LEAST_TREE: u64 = 64 * 2 + 8 + 4;

impl Learner {
    /// All that is known.
    pub(super) fn pack(&self) -> Vec<u8> {
        let mut to = Packer::default();
        to.u64(self.taken);
        to.u32(self.iterations);
        to.u16(self.full.into());
        self.tree.pack(&mut to);
        let (mut trees, mut numbers) = (Vec::new(), HashMap::new());
        for tree in self.cells.iter().filter_map(|cell| cell.directions.as_ref()) {
            numbers.entry(Arc::as_ptr(tree)).or_insert_with(|| {
                trees.push(tree);
                trees.len() as u32
            });
        }
        to.u32(trees.len() as u32);
        trees.iter().for_each(|tree| tree.pack(&mut to));
        for (cell, leaf) in self.cells.iter().zip(&self.field.leaves) {
            to.u32(cell.directions.as_ref().map_or(0, |tree| numbers[&Arc::as_ptr(tree)]));
            to.f32(leaf.p_guide);
            to.f32(cell.fluence);
            to.f64(cell.count);
            cell.mixing.pack(&mut to);
            cell.sums.pack(&mut to);
            outlook::pack(&cell.outlooks, &leaf.outlooks, &mut to);
        }
        to.0
    }

    /// Goes on from what was packed, with settings that may be others.
    ///
    /// # Errors
    /// If the bytes are not what a learner packs.
    pub(super) fn unpack(settings: Settings, bounds: Aabb, bytes: &[u8]) -> Result<Self> {
        let mut from = Cursor::new(bytes);
        let (taken, iterations) = (from.u64("the records taken in")?, from.u32("the iterations")?);
        let full = from.u16("the limit of memory")? != 0;
        let tree = SpatialTree::unpack(&mut from, bounds)?;
        let count = from.count(LEAST_TREE, "trees over directions")?;
        let trees: Vec<Arc<Quadtree>> =
            (0..count).map(|_| Quadtree::unpack(&mut from).map(Arc::new)).collect::<Result<_>>()?;
        let (mut cells, mut leaves) = (Vec::new(), Vec::new());
        for _ in 0..tree.leaves() {
            let directions = match from.u32("a cell")? {
                0 => None,
                number => {
                    let found = trees.get(number as usize - 1);
                    Some(found.ok_or_else(|| IoError::new("a cell has directions that are not there"))?.clone())
                }
            };
            let (p_guide, fluence) = (from.f32("a cell")?, from.f32("a cell")?);
            let p_guide = settings.p_guide.unwrap_or(p_guide);
            let count = from.f64("a cell")?;
            if !(0.0..=f64::MAX).contains(&count) {
                return Err(IoError::new("a cell has no usable number of records"));
            }
            let mixing = Mixing::unpack(&mut from)?;
            let sums = Sums::unpack(&mut from)?;
            let (outlooks, known) = outlook::unpack(&mut from)?;
            leaves.push(Leaf { directions: directions.clone(), p_guide, fluence, outlooks: known });
            cells.push(Cell { sums, count, mixing, halved: 0, directions, fluence, outlooks });
        }
        from.end()?;
        let field = Arc::new(Field { tree: tree.clone(), leaves, cosine: settings.cosine });
        field.validate().map_err(IoError::new)?;
        Ok(Learner { settings, tree, cells, field, taken, iterations, full })
    }

    /// What it holds, in numbers.
    pub(super) fn tell(&self) -> Vec<GuideFact> {
        let leaves = &self.field.leaves;
        let trees = || leaves.iter().filter_map(|leaf| leaf.directions.as_deref());
        let mut spatial = vec![0; self.tree.depth() as usize + 1];
        self.tree.walk().into_iter().for_each(|(_, depth)| spatial[depth as usize] += 1);
        let mut directional = [0; MOST_LEVELS as usize + 1];
        trees().for_each(|tree| tree.leaves_per_level(&mut directional));
        let deepest = directional.iter().rposition(|count| *count > 0).unwrap_or(0);
        let lit = trees().count() as u64;
        let nodes: usize = trees().map(Quadtree::nodes).sum();
        let range = |values: &mut dyn Iterator<Item = f32>| {
            let [low, high] = values
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x.into()), high.max(x.into())]);
            FactValue::Range(if low <= high { [low, high] } else { [0.0; 2] })
        };
        let p_mean = leaves.iter().map(|leaf| f64::from(leaf.p_guide)).sum::<f64>() / leaves.len() as f64;
        let known = || leaves.iter().filter(|leaf| leaf.directions.is_some());
        let facts = [
            ("iterations", FactValue::Count(self.iterations.into())),
            ("records", FactValue::Count(self.taken)),
            ("cells of space", FactValue::Count(leaves.len() as u64)),
            ("cells with light", FactValue::Count(lit)),
            ("depth in space", FactValue::Count(self.tree.depth().into())),
            ("nodes of directions", FactValue::Count(nodes as u64)),
            ("nodes per lit cell", FactValue::Number(nodes as f64 / (lit as f64).max(1.0))),
            ("depth of directions", FactValue::Count(deepest as u64)),
            ("mean probability of the guide", FactValue::Number(p_mean)),
            ("probability of the guide", range(&mut known().map(|leaf| leaf.p_guide))),
            ("fluence", range(&mut known().map(|leaf| leaf.fluence))),
            ("memory in MiB", FactValue::Number(self.bytes() as f64 / f64::from(1 << 20))),
            ("cells of space by depth", FactValue::PerDepth(spatial)),
            ("cells of directions by depth", FactValue::PerDepth(directional[..=deepest].to_vec())),
        ];
        facts.into_iter().map(|(name, value)| GuideFact { name, value }).collect()
    }
}
