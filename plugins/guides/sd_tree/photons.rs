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

#[cfg(test)]
mod tests {
    use super::super::mixing::tests::found_in_a_part;
    use super::super::{OUTLOOK, Settings};
    use super::*;
    use lucerna_core::interfaces::{GuideLearner, GuideRecord};
    use lucerna_core::math::{Aabb, Vec3};
    use lucerna_core::sampling::Pcg32;

    const MOST: f64 = 0.5;

    /// One that has one record from above.
    fn learner() -> Learner {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let mut learner = Learner::new(Settings { photons: MOST, ..OUTLOOK }, bounds);
        let record = found_in_a_part(0.5, 0.1, 1.0, &mut Pcg32::new(1, 2));
        learner.learn(&[vec![GuideRecord { p: Vec3::splat(0.5), d: Vec3::Z, ..record }]]);
        learner
    }

    /// The flux of the only cell, and the part of it that comes from above.
    fn flux(learner: &Learner) -> (f64, f64) {
        let cells = learner.cells[0].sums.cells();
        let total = learner.cells[0].sums.total();
        let above: f64 = (0..cells.len()).filter(|cell| cell % 8 == 7).map(|cell| cells[cell].flux).sum();
        (total, above / total)
    }

    /// Light that no path has met gets the least part, light that all have met the most; the sum stays as it is.
    #[test]
    fn their_part_is_what_paths_have_met() {
        for (d, power, part) in [(Vec3::NEG_Z, 3.0, LEAST), (Vec3::Z, 1e-20, MOST)] {
            let mut learner = learner();
            let before = flux(&learner).0;
            learner.learn_photons(&[Photon { p: Vec3::splat(0.4), d, power }; 100]);
            let (after, above) = flux(&learner);
            assert!((after / before - 1.0).abs() < 1e-6, "{d}: {before} {after}");
            let expected = if d.z > 0.0 { 1.0 } else { 1.0 - part };
            assert!((above - expected).abs() < 1e-6, "{d}: {above} {expected}");
            // A hundred photons are worth more than the record beside them.
            let worth = learner.cells[0].sums.cells().map(|found| found.worth());
            assert!(worth.iter().any(|worth| *worth > 1.5), "{worth:?}");
        }
    }

    /// Nothing is known of how bright it is anywhere: nothing to compare them with.
    #[test]
    fn where_no_path_has_found_anything_they_wait() {
        let bounds = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let mut learner = Learner::new(Settings { photons: MOST, ..OUTLOOK }, bounds);
        learner.learn_photons(&[Photon { p: Vec3::splat(0.4), d: Vec3::Z, power: 1.0 }]);
        assert_eq!(learner.cells[0].sums.total(), 0.0);
        learner.refine(1);
        assert!(learner.field().validate().is_ok());
    }
}
