//! Fills the tree with what paths found, and refines it between iterations.
//!
//! Published are Müller, Gross, Novák 2017, and Müller 2019 with its public code:
//!
//! | what | published | here |
//! |---|---|---|
//! | records until a cell is halved, times √samples | 12000, with filters 4000 | 500: pictures here have fewer pixels |
//! | what a cell knows | its own records of the last iteration | those together with [what larger cells know](super::prior), and half of what was found before |
//! | part of the flux until directions are divided, depth | 0.01, 20 | the same; but not where few records have nearly all of it |
//! | what a record counts | what it found | as much as all others in its cell together, at most: one that met a sun by chance would hide for many iterations what was found before and after (not with two `sets`) |
//! | where a bright environment is hidden by glass | found by chance | a part of the directions [goes there](lucerna_core::interfaces::Training::to_environment) |
//! | light through glass and off mirrors | found by chance | [photons](super::photons) tell of it |
//! | upper levels of quadtrees | as the flux asks | always three, as a table that the cosine can weight |
//! | filter of directions | cut off at the edges | goes round in the azimuth, is moved inside at the poles |
//! | probability of the guide | any | from 0.05 to 0.7 if learnt, at most 0.95 if given |
//! | where the guide gains little | guided all the same | [the whole picture](super::gain) is left to the BSDF |
//! | gradient of that probability | as large as the radiance | over its mean, or the regularisation would depend on it |
//! | descent: rate, decays, regularisation | 0.01, 0.9 and 0.999, 0.01 | the same |
//! | light that emitter sampling finds | not learnt, or by its weight | by its weight |
//! | weights of iterations | inverse mean variance of themselves | of the other half of the pixels, and no sample counts more than a later one |
//! | roulette | none, or by the light ahead | by the light ahead, learnt for each side of surfaces in a cell |
//! | iterations at the start, then | 8 of 1 sample, then 1, 2, 4, … | 8 of 1 sample, then as many as all before: 8, 16, 32, … |
//! | the last iteration | as long as two would be, guided by an eighth of all samples | begins once an iteration more would have learning go beyond a fifth of the budget (a tenth, where paths are left to the BSDF), since samples that are learnt from take longer |

use super::cylinder;
use super::field::{Field, Leaf};
use super::gain::{self, Gain};
use super::mixing::Mixing;
use super::outlook::{SIDES, Totals, side};
use super::prior;
use super::quadtree::Quadtree;
use super::sets::Apart;
use super::spatial::{self, SpatialTree};
use super::sums::{Refinement, Sums};
use super::{DirectionalFilter, Settings, SpatialFilter};
use lucerna_core::interfaces::{
    GuideFact, GuideField, GuideLearner, GuideRecord, GuideSets, Photon, RecordKind, VertexRecord, mix,
};
use lucerna_core::math::{Aabb, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Above the limit of memory the threshold of quadtrees is doubled, so often at most.
const MOST_COARSENINGS: u32 = 10;

/// A cell of directions is divided if its flux is worth so many records for each one that the prior is.
const LEAST_WORTH: f64 = 0.5;

/// Smaller parts of a record than this are taken with a probability, and count as much.
const LEAST_SHARE: f32 = 0.25;

/// The tree that is filled.
pub struct Learner {
    pub(super) settings: Settings,
    pub(super) tree: SpatialTree,
    pub(super) cells: Vec<Cell>,
    /// What cells keep apart, as many; empty if nothing.
    pub(super) apart: Vec<Apart>,
    pub(super) field: Arc<Field>,
    /// Records taken in, over all iterations: what their random numbers depend on.
    pub(super) taken: u64,
    pub(super) iterations: u32,
    /// The limit of memory was reached.
    pub(super) full: bool,
}

/// A cell of space that is filled.
#[derive(Clone, Default)]
pub(super) struct Cell {
    pub sums: Sums,
    /// Records, each counted by the part of it that lies here.
    pub count: f64,
    pub mixing: Mixing,
    pub gain: Gain,
    /// How often it was halved since its sums were.
    pub halved: u32,
    /// What was learnt before.
    pub directions: Option<Arc<Quadtree>>,
    pub fluence: f32,
    pub outlooks: [Totals; SIDES],
}

/// A record's part in a cell: which cell, tile and record, and how much of it.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub cell: u32,
    pub tile: u32,
    pub record: u32,
    pub share: f32,
}

impl Learner {
    pub fn new(settings: Settings, bounds: Aabb) -> Self {
        let tree = SpatialTree::new(bounds);
        let sets = settings.sets;
        let cells = vec![Cell::default()];
        let apart = vec![Apart::default(); usize::from(sets != GuideSets::One)];
        let field = Arc::new(Field::new(
            tree.clone(),
            vec![Leaf::default()],
            settings.cosine,
            sets,
            apart.iter().map(|apart| apart.leaf(&cells[0], &settings)).collect(),
        ));
        Learner { settings, tree, cells, apart, field, taken: 0, iterations: 0, full: false }
    }

    /// Where the record goes, with the part of it in each cell.
    fn place(&self, record: &GuideRecord, number: u64, put: &mut dyn FnMut(u32, f32)) {
        const EDGE: u32 = 1 << 20;
        let cell = self.tree.cell(record.p);
        let (leaf, depth) = self.tree.leaf(cell);
        if self.settings.spatial_filter == SpatialFilter::Nearest || depth == 0 {
            return put(leaf, 1.0);
        }
        // A box as large as the leaf with the point in its middle, moved into the cube.
        let size = SpatialTree::extent(depth);
        let low = [0, 1, 2].map(|axis: usize| cell[axis].saturating_sub(size[axis] / 2).min(EDGE - size[axis]));
        if self.settings.spatial_filter == SpatialFilter::Box {
            // Of many small parts some are taken, for all: they would cost more than the rest of learning.
            return self.tree.overlaps(low, size, &mut |leaf, share| {
                let taken = (mix(number ^ u64::from(leaf) << 40) >> 40) as f32 / (1 << 24) as f32 * LEAST_SHARE < share;
                if taken {
                    put(leaf, share.max(LEAST_SHARE));
                }
            });
        }
        let random = mix(number);
        let jittered = [0, 1, 2].map(|axis: usize| {
            let u = random >> (21 * axis) & 0xf_ffff;
            low[axis] + ((u * u64::from(size[axis])) >> 20) as u32
        });
        put(self.tree.leaf(jittered).0, 1.0);
    }

    /// All parts of all records, ordered by cell, then by tile and record.
    fn parts<T: Sync>(&self, tiles: &[Vec<T>], place: impl Fn(&T, u64, &mut dyn FnMut(u32, f32)) + Sync) -> Vec<Part> {
        let numbered = tiles.iter().scan(self.taken, |next, tile| {
            let first = *next;
            *next = next.wrapping_add(tile.len() as u64);
            Some(first)
        });
        let firsts: Vec<u64> = numbered.collect();
        let placed: Vec<Vec<Part>> = tiles
            .par_iter()
            .enumerate()
            .map(|(tile, records)| {
                let mut parts = Vec::with_capacity(records.len());
                for (index, record) in records.iter().enumerate() {
                    let (tile, number) = (tile as u32, firsts[tile].wrapping_add(index as u64));
                    let record_index = index as u32;
                    place(record, number, &mut |cell, share| {
                        parts.push(Part { cell, tile, record: record_index, share })
                    });
                }
                parts
            })
            .collect();
        // Counted, then moved to their places: the order of the records of a cell stays.
        let mut next = vec![0; self.cells.len()];
        placed.iter().flatten().for_each(|part| next[part.cell as usize] += 1);
        let mut sum = 0;
        next.iter_mut().for_each(|count| sum += std::mem::replace(count, sum));
        let mut sorted = vec![Part { cell: 0, tile: 0, record: 0, share: 0.0 }; sum];
        for part in placed.iter().flatten() {
            let place = &mut next[part.cell as usize];
            sorted[*place] = *part;
            *place += 1;
        }
        sorted
    }

    /// Mean flux of the records that the cells know of.
    pub(super) fn usual(&self) -> f64 {
        let (flux, count) =
            self.cells.iter().fold((0.0, 0.0), |(flux, count), cell| (flux + cell.sums.total(), count + cell.count));
        if count > 0.0 { flux / count } else { 0.0 }
    }

    /// What is gained over the BSDF, in nats, if that is known.
    pub(super) fn gain(&self) -> Option<f64> {
        gain::mean(self.cells.iter().map(|cell| &cell.gain))
    }

    /// Bytes of everything.
    pub(super) fn bytes(&self) -> usize {
        let cells = self.cells.iter().map(|cell| self.bytes_of(cell)).sum::<usize>();
        2 * self.tree.bytes() + cells + self.apart.iter().map(Apart::bytes).sum::<usize>()
    }

    /// Bytes of a cell, with its leaf.
    fn bytes_of(&self, cell: &Cell) -> usize {
        // Where nothing is kept apart, there is a second tree of directions to sample from.
        let copies = if self.apart.is_empty() { 2 } else { 1 };
        let trees = copies * cell.directions.as_ref().map_or(0, |tree| tree.bytes());
        size_of::<Cell>() + size_of::<Leaf>() + cell.sums.bytes() + trees
    }

    /// Divides cells of space which got many records. Both halves go on with what is known in the whole.
    fn split(&mut self, spp: u32) {
        let left = self.settings.max_bytes.saturating_sub(self.bytes());
        let mut most = self.settings.spatial_threshold * f64::from(spp).sqrt();
        // Where it cannot be as fine as asked for it is coarser everywhere, not in what happens to come last.
        while self.bytes_of_halves(most) > left {
            most *= 2.0;
            self.full = true;
        }
        let cells = std::cell::RefCell::new((&mut self.cells, &mut self.apart));
        let wanted = |leaf: u32, _| {
            let (cells, apart) = &*cells.borrow();
            records(&cells[leaf as usize], apart.get(leaf as usize)) > most
        };
        self.tree.split(wanted, |old, _| {
            let (cells, apart) = &mut *cells.borrow_mut();
            if let Some(half) = apart.get_mut(old as usize).map(Apart::halve) {
                apart.push(half);
            }
            cells[old as usize].count *= 0.5;
            cells[old as usize].gain.fade(0.5);
            cells[old as usize].outlooks.iter_mut().for_each(Totals::halve);
            cells[old as usize].halved += 1;
            let half = cells[old as usize].clone();
            cells.push(half);
        });
    }

    /// Bytes that cells take which come from halving those with more records than this, until they have no more.
    fn bytes_of_halves(&self, most: f64) -> usize {
        let bytes = |(index, cell): (usize, &Cell)| {
            let apart = self.apart.get(index);
            let halvings = (records(cell, apart) / most).log2().ceil().clamp(0.0, f64::from(spatial::DEEPEST));
            let each = self.bytes_of(cell) + apart.map_or(0, Apart::bytes) + 2 * size_of::<[u32; 2]>();
            each.saturating_mul((1_usize << halvings as u32) - 1)
        };
        self.cells.iter().enumerate().map(bytes).fold(0, usize::saturating_add)
    }

    /// Leaves a part of the sums; their trees follow the flux that was found.
    fn fade(&mut self) {
        let mut how = Refinement {
            threshold: self.settings.directional_threshold,
            depth: self.settings.depth,
            worth: LEAST_WORTH * self.settings.prior,
            kept: self.settings.memory,
        };
        let old: Vec<Sums> = self.cells.iter_mut().map(|cell| std::mem::take(&mut cell.sums)).collect();
        let old_apart: Vec<Sums> = self.apart.iter_mut().map(|apart| std::mem::take(&mut apart.sums)).collect();
        for coarsening in 1..=MOST_COARSENINGS {
            self.cells.par_iter_mut().zip(&old).for_each(|(cell, old)| {
                let kept = how.kept * cell.left();
                cell.sums = old.refined(Refinement { kept, ..how });
            });
            self.refine_apart(&old_apart, how);
            if self.bytes() <= self.settings.max_bytes {
                break;
            }
            self.full = true;
            // In the end, no cell of directions is divided at all.
            how.threshold = if coarsening + 1 < MOST_COARSENINGS { 2.0 * how.threshold } else { f64::INFINITY };
        }
        self.cells.iter_mut().for_each(|cell| cell.halved = 0);
    }
}

/// Records of a cell, with those that are kept apart.
fn records(cell: &Cell, apart: Option<&Apart>) -> f64 {
    cell.count + apart.map_or(0.0, |apart| apart.count)
}

/// Each cell that has parts, with them.
pub(super) fn filled<'a, T>(cells: &'a mut [T], parts: &'a [Part]) -> Vec<(&'a mut T, &'a [Part])> {
    let by_cell: Vec<&[Part]> = parts.chunk_by(|a, b| a.cell == b.cell).collect();
    let mut filled: Vec<(&mut T, &[Part])> = Vec::with_capacity(by_cell.len());
    let mut rest = cells;
    let mut passed = 0;
    for parts in by_cell {
        let (_, from) = std::mem::take(&mut rest).split_at_mut(parts[0].cell as usize - passed);
        let Some((cell, after)) = from.split_first_mut() else { break };
        (rest, passed) = (after, parts[0].cell as usize + 1);
        filled.push((cell, parts));
    }
    filled
}

impl GuideLearner for Learner {
    fn learn(&mut self, tiles: &[Vec<GuideRecord>]) {
        let parts = self.parts(tiles, |record, number, put| self.place(record, number, put));
        self.taken = tiles.iter().fold(self.taken, |taken, tile| taken.wrapping_add(tile.len() as u64));
        if !self.apart.is_empty() {
            return self.learn_apart(tiles, &parts);
        }
        let usual = self.usual();
        let filled = filled(&mut self.cells, &parts);
        let (filter, learns_mixing) = (self.settings.directional_filter, self.settings.p_guide.is_none());
        let learns_gain = self.settings.may_leave();
        filled.into_par_iter().for_each(|(cell, parts)| {
            let records =
                || parts.iter().map(|part| (&tiles[part.tile as usize][part.record as usize], f64::from(part.share)));
            let all = cell.sums.total() + records().map(|(record, share)| share * flux(record)).sum::<f64>();
            for (record, share) in records() {
                cell.take(record, share, Most { all, usual }, filter);
                if learns_mixing {
                    cell.mixing.step(record);
                }
                if learns_gain {
                    cell.gain.add(record);
                }
            }
        });
    }

    fn learn_outlook(&mut self, tiles: &[Vec<VertexRecord>]) {
        let parts = self.parts(tiles, |record, _, put| put(self.tree.leaf(self.tree.cell(record.p)).0, 1.0));
        let alone = !self.settings.directions || !self.field.guides;
        filled(&mut self.cells, &parts).into_par_iter().for_each(|(cell, parts)| {
            for part in parts {
                let record = &tiles[part.tile as usize][part.record as usize];
                cell.outlooks[side(record.n)].add(record);
            }
            cell.count += if alone { parts.len() as f64 } else { 0.0 };
        });
    }

    fn learn_photons(&mut self, photons: &[Photon]) {
        self.join_photons(photons);
    }

    fn refine(&mut self, spp: u32) {
        let too_little =
            self.gain().is_some_and(|gain| gain < self.settings.asked_gain(self.iterations.saturating_add(1)));
        let guides = self.field.guides && !too_little;
        let p_guide = self.settings.p_guide;
        let total: f64 = self.cells.iter().map(|cell| cell.sums.total()).sum();
        if total > 0.0 && total.is_finite() {
            let prior = self.settings.prior;
            let grids = prior::grids(&self.tree, |leaf| &self.cells[leaf].sums, prior);
            self.cells.par_iter_mut().zip(grids).for_each(|(cell, grid)| {
                cell.fluence = (cell.sums.total() / cell.count.max(1.0)).min(f64::from(f32::MAX)) as f32;
                cell.directions = Some(Arc::new(Quadtree::new(grid, &cell.sums, prior)));
            });
        }
        self.know_apart();
        self.split(spp);
        self.fade();
        self.cells.iter_mut().for_each(|cell| {
            cell.count *= self.settings.memory;
            // By what the guide was judged is told as long as nothing more is found.
            if guides {
                cell.gain.fade(self.settings.memory);
            }
        });
        self.apart.iter_mut().for_each(|apart| apart.count *= self.settings.memory);
        let leaf = |cell: &Cell| Leaf {
            directions: cell.directions.clone(),
            p_guide: p_guide.unwrap_or_else(|| cell.mixing.p_guide()),
            fluence: cell.fluence,
            outlooks: std::array::from_fn(|side| cell.outlooks[side].outlook()),
        };
        let leaves = self.cells.iter().map(leaf).collect();
        let Settings { cosine, sets, .. } = self.settings;
        let mut field = Field::new(self.tree.clone(), leaves, cosine, sets, self.apart_leaves());
        field.guides = guides;
        self.field = Arc::new(field);
        self.iterations = self.iterations.saturating_add(1);
    }

    fn field(&self) -> Arc<dyn GuideField> {
        self.field.clone()
    }

    fn summary(&self) -> Vec<String> {
        let mib = self.bytes() as f64 / f64::from(1 << 20);
        let leaves = &self.field.leaves;
        let nodes: usize = leaves.iter().filter_map(|leaf| leaf.directions.as_ref()).map(|tree| tree.nodes()).sum();
        let count = leaves.len() as f64;
        let p_guide = leaves.iter().map(|leaf| f64::from(leaf.p_guide)).sum::<f64>() / count;
        let mut lines = vec![format!(
            "sd_tree: {} iterations, {} cells of space (depth {}), {:.0} nodes each, mean probability of the guide {p_guide:.2}, {mib:.1} MiB",
            self.iterations,
            leaves.len(),
            self.tree.depth(),
            nodes as f64 / count,
        )];
        lines.extend(self.apart_summary());
        if !self.field.guides {
            lines.push("sd_tree: it gains too little here, and leaves the picture to the BSDF (least_gain)".to_owned());
        }
        if self.full {
            lines.push("sd_tree: the limit of memory was reached, the tree is coarser than it should be".to_owned());
        }
        lines
    }

    fn save(&self) -> Vec<u8> {
        self.pack()
    }

    fn facts(&self) -> Vec<GuideFact> {
        self.tell()
    }
}

impl Cell {
    /// Takes a part of a record in.
    #[inline]
    pub(super) fn take(&mut self, record: &GuideRecord, share: f64, most: Most, filter: DirectionalFilter) {
        self.count += share;
        put(&mut self.sums, record, most.of(share * flux(record)), filter);
    }

    /// The part of its sums that each half has, after it was halved.
    pub(super) fn left(&self) -> f64 {
        (-f64::from(self.halved)).exp2()
    }
}

/// What a record in a cell may count.
#[derive(Clone, Copy)]
pub(super) struct Most {
    /// The flux of all records of the cell, those included that are about to be taken in.
    pub all: f64,
    /// The mean flux of a record in all cells.
    pub usual: f64,
}

impl Most {
    /// No limit.
    pub const NONE: Most = Most { all: f64::INFINITY, usual: 0.0 };

    /// What a record of this flux counts: as much as all others of its cell together, at most.
    fn of(self, flux: f64) -> f64 {
        let most = (self.all - flux).max(self.usual);
        if most > 0.0 { flux.min(most) } else { flux }
    }
}

/// A record's estimate of the flux, its radiance over its density; 0 if it is none.
fn flux(record: &GuideRecord) -> f64 {
    let flux = f64::from(record.radiance) / f64::from(record.pdf);
    if flux.is_finite() && record.kind != RecordKind::Delta { flux.max(0.0) } else { 0.0 }
}

/// Adds flux from a record's direction, if it is any. What a delta lobe found is none: its direction has a probability, and
/// no density.
#[inline]
pub(super) fn put(sums: &mut Sums, record: &GuideRecord, flux: f64, filter: DirectionalFilter) {
    if flux > 0.0 && flux.is_finite() && record.kind != RecordKind::Delta {
        put_from(sums, record.d, flux, filter);
    }
}

/// Adds flux from a world direction.
#[inline]
pub(super) fn put_from(sums: &mut Sums, d: Vec3, flux: f64, filter: DirectionalFilter) {
    let p = cylinder::of_direction(d);
    match filter {
        DirectionalFilter::Nearest => sums.add(p, flux),
        DirectionalFilter::Box => sums.add_box(p, flux),
    }
}

#[cfg(test)]
mod tests {
    use super::super::OUTLOOK;
    use super::super::mixing::tests::found_in_a_part;
    use super::*;
    use lucerna_core::sampling::Pcg32;

    /// Where cells are small beside the one that a record lies in, few of them get a part of it, and all what is due to them
    /// in the mean.
    #[test]
    fn small_parts_are_taken_by_a_few_cells_for_all() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let settings = Settings { spatial_filter: SpatialFilter::Box, spatial_threshold: 100.0, ..OUTLOOK };
        let (mut learner, mut pcg) = (Learner::new(settings, bounds), Pcg32::new(1, 2));
        let mut record = found_in_a_part(0.5, 0.1, 1.0, &mut pcg);
        for _ in 0..12 {
            let mut near_the_middle = |_| 0.5 - 0.2 * pcg.next_f32();
            let at = |p| GuideRecord { p: Vec3::from_array(p), ..record };
            let records = (0..2000).map(|_| at([0, 1, 2].map(&mut near_the_middle))).collect();
            learner.learn(&[records]);
            learner.refine(1);
        }
        record.p = Vec3::splat(0.51);
        let cell = learner.tree.cell(record.p);
        let size = SpatialTree::extent(learner.tree.leaf(cell).1);
        let mut due = vec![0.0; learner.cells.len()];
        learner
            .tree
            .overlaps([0, 1, 2].map(|i: usize| cell[i] - size[i] / 2), size, |leaf, share| due[leaf as usize] = share);
        let overlapped = due.iter().filter(|share| **share > 0.0).count();
        const RECORDS: u64 = 20_000;
        let (mut parts, mut found) = (0, vec![0.0; due.len()]);
        for number in 0..RECORDS {
            learner.place(&record, number, &mut |leaf, share| {
                parts += 1;
                found[leaf as usize] += share / RECORDS as f32;
            });
        }
        let each = f64::from(parts) / RECORDS as f64;
        assert!(overlapped >= 20 && each < 5.0, "{each} parts of {overlapped}");
        for (due, found) in due.iter().zip(&found) {
            let error = (due * LEAST_SHARE / RECORDS as f32).sqrt();
            assert!((due - found).abs() <= 4.5 * error + 1e-3 * due, "{due} {found}");
        }
    }
}
