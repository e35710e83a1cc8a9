//! What was learnt as bytes, and in numbers.
//!
//! | bytes | what |
//! |---|---|
//! | `u64`, `u32`, 3 `u16` | records taken in, iterations, whether the limit of memory was reached, whether paths are left to the BSDF, sets of directions (0: one) |
//! | | the tree over space: number of nodes, two children each |
//! | `u32` | trees over directions, then each: number of quads, four `u16` each |
//! | | cells of space, one more than nodes: which tree over directions (0: none), probability of the guide, fluence, records, the descent that learns the probability, shape of the sums, and the sums unless all are 0, what scattering brings, what the guide gains |
//! | | if there are two sets, what each cell keeps apart: which tree over directions, probability, fluence, records, descent, sums |
//!
//! Cells that share a tree over directions still do afterwards.

use super::Settings;
use super::field::{Field, Leaf};
use super::gain::Gain;
use super::learner::{Cell, Learner};
use super::mixing::Mixing;
use super::outlook;
use super::quadtree::{MOST_LEVELS, Quadtree};
use super::sets::{self, Apart, ApartLeaf};
use super::spatial::SpatialTree;
use super::sums::Sums;
use lucerna_core::interfaces::{FactValue, GuideFact, GuideField, GuideSets};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::Aabb;
use std::collections::HashMap;
use std::sync::Arc;

/// Bytes of a tree over directions at least: number of quads, the grid, which of its cells are divided.
const LEAST_TREE: u64 = 4 + 64 * 2 + 8;

/// What is written of a set of directions in a cell: the number of its tree (0: none), the probability that is learnt,
/// fluence, number of records, then the rest.
type Numbers = (u32, f32, f32, f64);

fn pack_set((tree, p, fluence, count): Numbers, mixing: &Mixing, sums: &Sums, to: &mut Packer) {
    to.u32(tree);
    to.f32(p);
    to.f32(fluence);
    to.f64(count);
    mixing.pack(to);
    sums.pack(to);
}

fn unpack_set(from: &mut Cursor<'_>) -> Result<(Numbers, Mixing, Sums)> {
    const WHAT: &str = "a cell";
    let (tree, p, fluence, count) = (from.u32(WHAT)?, from.f32(WHAT)?, from.f32(WHAT)?, from.f64(WHAT)?);
    if !(0.0..=f64::MAX).contains(&count) {
        return Err(IoError::new("a cell has no usable number of records"));
    }
    Ok(((tree, p, fluence, count), Mixing::unpack(from)?, Sums::unpack(from)?))
}

impl Learner {
    /// All that is known.
    pub(super) fn pack(&self) -> Vec<u8> {
        let mut to = Packer::default();
        to.u64(self.taken);
        to.u32(self.iterations);
        to.u16(self.full.into());
        to.u16((!self.field.guides).into());
        to.u16(sets::number(self.settings.sets) as u16);
        self.tree.pack(&mut to);
        let (mut trees, mut numbers) = (Vec::new(), HashMap::new());
        let of_cells = self.cells.iter().map(|cell| &cell.directions);
        for tree in of_cells.chain(self.apart.iter().map(|apart| &apart.directions)).flatten() {
            numbers.entry(Arc::as_ptr(tree)).or_insert_with(|| {
                trees.push(tree);
                trees.len() as u32
            });
        }
        to.u32(trees.len() as u32);
        trees.iter().for_each(|tree| tree.pack(&mut to));
        let number = |tree: &Option<Arc<Quadtree>>| tree.as_ref().map_or(0, |tree| numbers[&Arc::as_ptr(tree)]);
        for (cell, leaf) in self.cells.iter().zip(&self.field.leaves) {
            let numbers = (number(&cell.directions), leaf.p_guide, cell.fluence, cell.count);
            pack_set(numbers, &cell.mixing, &cell.sums, &mut to);
            outlook::pack(&cell.outlooks, &leaf.outlooks, &mut to);
            cell.gain.pack(&mut to);
        }
        for (apart, leaf) in self.apart.iter().zip(&self.field.apart) {
            let numbers = (number(&apart.directions), leaf.p, apart.fluence, apart.count);
            pack_set(numbers, &apart.mixing, &apart.sums, &mut to);
        }
        to.0
    }

    /// Goes on from what was packed, with settings that may be others.
    ///
    /// # Errors
    /// If the bytes are not what a learner packs.
    pub(super) fn unpack(mut settings: Settings, bounds: Aabb, bytes: &[u8]) -> Result<Self> {
        let mut from = Cursor::new(bytes);
        let (taken, iterations) = (from.u64("the records taken in")?, from.u32("the iterations")?);
        let full = from.u16("the limit of memory")? != 0;
        let left = from.u16("whether paths are guided")? != 0 && settings.may_leave();
        let sets = sets::of_number(from.u16("the sets of directions")?.into());
        let sets = sets.ok_or_else(|| IoError::new("has sets of directions that are not known"))?;
        if settings.sets_asked && settings.sets != sets {
            let [theirs, ours] = [sets, settings.sets].map(|sets| sets::NAMES[sets::number(sets)]);
            return Err(IoError::new(format!("was learnt with sets \"{theirs}\", not \"{ours}\"")));
        }
        settings.sets = sets;
        let tree = SpatialTree::unpack(&mut from, bounds)?;
        let count = from.count(LEAST_TREE, "trees over directions")?;
        let trees: Vec<Arc<Quadtree>> =
            (0..count).map(|_| Quadtree::unpack(&mut from).map(Arc::new)).collect::<Result<_>>()?;
        let (mut cells, mut leaves) = (Vec::new(), Vec::new());
        let numbered = |number: u32| match number {
            0 => Ok(None),
            number => {
                let found = trees.get(number as usize - 1);
                Ok(Some(found.ok_or_else(|| IoError::new("a cell has directions that are not there"))?.clone()))
            }
        };
        for _ in 0..tree.leaves() {
            let ((tree, p_guide, fluence, count), mixing, sums) = unpack_set(&mut from)?;
            let (directions, p_guide) = (numbered(tree)?, settings.p_guide.unwrap_or(p_guide));
            let (outlooks, known) = outlook::unpack(&mut from)?;
            let gain = Gain::unpack(&mut from)?;
            leaves.push(Leaf { directions: directions.clone(), p_guide, fluence, outlooks: known });
            cells.push(Cell { sums, count, mixing, gain, halved: 0, directions, fluence, outlooks });
        }
        let (mut apart, mut known) = (Vec::new(), Vec::new());
        for _ in (0..tree.leaves()).filter(|_| sets != GuideSets::One) {
            let ((tree, p, fluence, count), mixing, sums) = unpack_set(&mut from)?;
            let p = settings.p_guide.filter(|_| sets == GuideSets::PrimaryProduct).unwrap_or(p);
            let directions = numbered(tree)?;
            known.push(ApartLeaf { directions: directions.clone(), p, fluence });
            apart.push(Apart { sums, count, mixing, directions, fluence });
        }
        from.end()?;
        let mut field = Field::new(tree.clone(), leaves, settings.cosine, sets, known);
        field.guides = !left;
        field.validate().map_err(IoError::new)?;
        let field = Arc::new(field);
        Ok(Learner { settings, tree, cells, apart, field, taken, iterations, full })
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
        let mut facts = vec![
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
        facts.extend(self.gain().map(|gain| ("mean gain in nats", FactValue::Number(gain))));
        let names = match self.settings.sets {
            GuideSets::One => None,
            GuideSets::DirectIndirect => Some([
                "nodes for light met directly",
                "mean part of light met directly",
                "part of light met directly",
                "fluence of light met directly",
            ]),
            GuideSets::PrimaryProduct => Some([
                "nodes for first hits",
                "mean probability of the guide at first hits",
                "probability of the guide at first hits",
                "light scattered at first hits",
            ]),
        };
        if let Some([nodes, mean, part, fluence]) = names {
            let known = || self.field.apart.iter().filter(|leaf| leaf.directions.is_some());
            let count = known().filter_map(|leaf| leaf.directions.as_ref()).map(|tree| tree.nodes()).sum::<usize>();
            let p = self.field.apart.iter().map(|leaf| f64::from(leaf.p)).sum::<f64>() / leaves.len() as f64;
            facts.extend([
                (nodes, FactValue::Count(count as u64)),
                (mean, FactValue::Number(p)),
                (part, range(&mut known().map(|leaf| leaf.p))),
                (fluence, range(&mut known().map(|leaf| leaf.fluence))),
            ]);
        }
        facts.into_iter().map(|(name, value)| GuideFact { name, value }).collect()
    }
}
