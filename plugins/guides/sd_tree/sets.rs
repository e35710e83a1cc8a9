//! The second set of directions that each cell of space may have, for what is kept apart from the rest.
//!
//! | `sets` | kept apart | its density at a vertex | source |
//! |---|---|---|---|
//! | `direct_indirect` | light of emitters that a scattered ray runs into, by its weight against emitter sampling | times c, and that of the rest times 1 − c; c is learnt | Vorba et al. 2019, *Path Guiding in Production*, section 7.4 |
//! | `primary_product` | at first hits, the light that they scatter towards the camera: radiance times BSDF times cosine | all of the guide at first hits; never multiplied by the cosine | section 7.6 |
//!
//! The text leaves open how c is learnt. Here it follows the divergence of the whole mixture, of both sets and the BSDF, just
//! as the probability of the BSDF does: both go towards what is ideal together. It begins at the part of the flux, with which
//! both sets are what one would be, instead of at one half: where little light is met directly, that costs much at first.
//! Light through surfaces that let rays straight through is not met directly: emitter sampling cannot see it either.

use super::Settings;
use super::field::Leaf;
use super::learner::{Cell, Learner, Most, Part, filled, put};
use super::mixing::{LIMITS, Mixing};
use super::prior;
use super::quadtree::Quadtree;
use super::sums::{Refinement, Sums};
use lucerna_core::interfaces::{GuideRecord, GuideSets};
use rayon::prelude::*;
use std::sync::Arc;

/// What a cell of space keeps apart, while it is filled.
#[derive(Clone, Default)]
pub(super) struct Apart {
    pub sums: Sums,
    /// Records that went here alone, each counted by the part of it that lies in the cell. Of `direct_indirect`, none: a
    /// record goes to both sets.
    pub count: f64,
    /// Of `direct_indirect`, learns the part of this set in the guide; of `primary_product`, the probability of the guide.
    pub mixing: Mixing,
    /// What was learnt before.
    pub directions: Option<Arc<Quadtree>>,
    pub fluence: f32,
}

/// What is known of that.
#[derive(Clone, Default)]
pub struct ApartLeaf {
    /// Nothing where nothing of it was found anywhere.
    pub directions: Option<Arc<Quadtree>>,
    /// The probability that [`Apart::mixing`] learns.
    pub p: f32,
    /// Mean times 4π of what arrived (or, of `primary_product`, was scattered).
    pub fluence: f32,
}

/// The choices, in the order of [`NAMES`]. Files hold their numbers.
const CHOICES: [GuideSets; 3] = [GuideSets::One, GuideSets::DirectIndirect, GuideSets::PrimaryProduct];

/// Their names, as scenes write them.
pub(super) const NAMES: [&str; CHOICES.len()] = ["one", "direct_indirect", "primary_product"];

/// The choice of a number.
pub(super) fn of_number(number: usize) -> Option<GuideSets> {
    CHOICES.get(number).copied()
}

/// The choice of a name; the first one if there is none.
pub(super) fn of_name(name: &str) -> GuideSets {
    NAMES.iter().position(|known| *known == name).and_then(of_number).unwrap_or_default()
}

/// The number of a choice.
pub(super) fn number(sets: GuideSets) -> usize {
    CHOICES.iter().position(|known| *known == sets).unwrap_or(0)
}

impl Apart {
    /// A half of the cell has this.
    pub fn halve(&mut self) -> Self {
        self.count *= 0.5;
        self.clone()
    }

    /// Bytes of it, with a leaf.
    pub fn bytes(&self) -> usize {
        let tree = self.directions.as_ref().map_or(0, |tree| tree.bytes());
        size_of::<Apart>() + size_of::<ApartLeaf>() + self.sums.bytes() + tree
    }

    /// Where the descent begins: at the part of the flux that is here. Then both sets together are what one would be.
    fn origin(&self, cell: &Cell) -> f32 {
        let part = self.fluence / (self.fluence + cell.fluence);
        let part = if part.is_finite() { part.clamp(LIMITS.0, LIMITS.1) } else { 0.5 };
        (part / (1.0 - part)).ln()
    }

    /// What can be sampled.
    pub fn leaf(&self, cell: &Cell, settings: &Settings) -> ApartLeaf {
        let p = match settings.sets {
            GuideSets::PrimaryProduct => settings.p_guide.unwrap_or_else(|| self.mixing.p_guide()),
            _ => self.mixing.p_first(self.origin(cell)),
        };
        ApartLeaf { directions: self.directions.clone(), p, fluence: self.fluence }
    }

    /// Takes a part of a record in, whose light goes to either set.
    fn take_light(&mut self, cell: &mut Cell, origin: f32, (record, share): (&GuideRecord, f64), settings: &Settings) {
        let filter = settings.directional_filter;
        let GuideRecord { radiance, direct, pdf_sets: [first, second], .. } = *record;
        cell.take(&GuideRecord { radiance: (radiance - direct).max(0.0), ..*record }, share, Most::NONE, filter);
        put(&mut self.sums, record, share * f64::from(direct) / f64::from(record.pdf), filter);
        let p_guide = settings.p_guide.unwrap_or_else(|| cell.mixing.p_guide());
        if settings.p_guide.is_none() {
            let c = self.mixing.p_first(origin);
            cell.mixing.step(&GuideRecord { pdf_guide: c * first + (1.0 - c) * second, ..*record });
        }
        self.mixing.step_sets(record, p_guide, origin);
    }

    /// Takes a part of the record of a first hit in.
    fn take_product(&mut self, record: &GuideRecord, share: f64, settings: &Settings) {
        self.count += share;
        // Over its density already.
        put(&mut self.sums, record, share * f64::from(record.scattered), settings.directional_filter);
        if settings.p_guide.is_none() {
            self.mixing.step(record);
        }
    }
}

impl Learner {
    /// Takes in the parts of records, ordered by cell, where something is kept apart.
    pub(super) fn learn_apart(&mut self, tiles: &[Vec<GuideRecord>], parts: &[Part]) {
        let settings = &self.settings;
        let both: Vec<_> = filled(&mut self.cells, parts).into_iter().zip(filled(&mut self.apart, parts)).collect();
        both.into_par_iter().for_each(|((cell, parts), (apart, _))| {
            let origin = apart.origin(cell);
            for part in parts {
                let record = &tiles[part.tile as usize][part.record as usize];
                let share = f64::from(part.share);
                if settings.sets == GuideSets::DirectIndirect {
                    apart.take_light(cell, origin, (record, share), settings);
                } else if record.primary {
                    apart.take_product(record, share, settings);
                } else {
                    cell.take(record, share, Most::NONE, settings.directional_filter);
                    if settings.p_guide.is_none() {
                        cell.mixing.step(record);
                    }
                }
            }
        });
    }

    /// Makes trees of what was taken in.
    pub(super) fn know_apart(&mut self) {
        let total: f64 = self.apart.iter().map(|apart| apart.sums.total()).sum();
        if !(total > 0.0 && total.is_finite()) {
            return;
        }
        let (prior, sets) = (self.settings.prior, self.settings.sets);
        let grids = prior::grids(&self.tree, |leaf| &self.apart[leaf].sums, prior);
        self.apart.par_iter_mut().zip(&self.cells).zip(grids).for_each(|((apart, cell), grid)| {
            let count = if sets == GuideSets::DirectIndirect { cell.count } else { apart.count };
            apart.fluence = (apart.sums.total() / count.max(1.0)).min(f64::from(f32::MAX)) as f32;
            apart.directions = Some(Arc::new(Quadtree::new(grid, &apart.sums, prior)));
        });
    }

    /// Refines sums that were, with a part of what was found.
    pub(super) fn refine_apart(&mut self, old: &[Sums], how: Refinement) {
        self.apart.par_iter_mut().zip(old).zip(&self.cells).for_each(|((apart, old), cell)| {
            apart.sums = old.refined(Refinement { kept: how.kept * cell.left(), ..how });
        });
    }

    /// What is known apart, if anything.
    pub(super) fn apart_leaves(&self) -> Vec<ApartLeaf> {
        self.apart.iter().zip(&self.cells).map(|(apart, cell)| apart.leaf(cell, &self.settings)).collect()
    }

    /// A few words about it.
    pub(super) fn apart_summary(&self) -> Option<String> {
        let leaves = &self.field.apart;
        let what = match self.settings.sets {
            GuideSets::One => return None,
            GuideSets::DirectIndirect => "light met directly apart, mean part of the guide",
            GuideSets::PrimaryProduct => "first hits apart, mean probability of the guide there",
        };
        let count = (leaves.len() as f64).max(1.0);
        let nodes: usize = leaves.iter().filter_map(|leaf| leaf.directions.as_ref()).map(|tree| tree.nodes()).sum();
        let p = leaves.iter().map(|leaf| f64::from(leaf.p)).sum::<f64>() / count;
        Some(format!("sd_tree: {what} {p:.2}, {:.0} nodes each", nodes as f64 / count))
    }
}

/// Whether a cell knows where light comes from, with what is kept apart.
pub(super) fn is_lit(leaf: &Leaf, apart: Option<&ApartLeaf>) -> bool {
    leaf.directions.is_some() || apart.is_some_and(|apart| apart.directions.is_some())
}
