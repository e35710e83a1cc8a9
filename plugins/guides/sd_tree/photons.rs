//! Photons among what paths have found.
//!
//! A cell knows where photons that arrived in it came from. A part of its flux goes there, by which the guide samples it from
//! then on, and paths find it as bright as it is; what they find then tells how much of the light in the cell it is. So the part
//! is as large as what [both have in common](super::sums::Sums::common), but never so small that light paths have not met yet
//! is left out. There is no published source for this rule.

use super::learner::{Learner, put_from};
use lucerna_core::interfaces::Photon;
use rayon::prelude::*;

/// The part that photons have where paths have met nothing of their light.
const LEAST: f64 = 0.05;

impl Learner {
    /// Gives a part of the flux of each cell to the photons in it.
    pub(super) fn join_photons(&mut self, photons: &[Photon]) {
        let mut of_cells: Vec<Vec<u32>> = vec![Vec::new(); self.cells.len()];
        (0..).zip(photons).for_each(|(index, photon)| of_cells[self.tree.at(photon.p)].push(index));
        let (usual, filter, most) = (self.usual(), self.settings.directional_filter, self.settings.photons);
        self.cells.par_iter_mut().zip(of_cells).filter(|(_, photons)| !photons.is_empty()).for_each(
            |(cell, of_cell)| {
                let mut light = cell.sums.emptied();
                for index in of_cell {
                    let Photon { d, power, .. } = photons[index as usize];
                    put_from(&mut light, d, power.into(), filter);
                }
                let found = cell.sums.total();
                let (part, flux) = if found > 0.0 {
                    (cell.sums.common(&light).max(LEAST).min(most), found)
                } else {
                    (1.0, usual * cell.count)
                };
                cell.sums.give(part, flux, &light);
            },
        );
    }
}
