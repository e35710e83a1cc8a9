//! Whether a guide gains enough over the BSDF to be worth its time.
//!
//! The measure is the divergence that the [probability of the guide](super::mixing) is learnt by (Müller 2019, section
//! 10.5): by how much the mixture q of guide and BSDF is closer, in the sense of Kullback and Leibler, to the light p that
//! is scattered than the BSDF b alone is, ∫p log(q/b) in nats. Being a mean of logarithms it is known from few records,
//! where the variances themselves drown in the noise of what lies further along the path. It is taken in each cell of
//! space by the light there, and then over all cells by their records, so that dark places count as bright ones.
//!
//! `lucerna guide info` tells it. After `lucerna render SCENE --size 96x54 --sampler sobol --spp 16 --guide sd_tree --guide-file
//! FILE` it was 0.81 in dining-room, 0.34 in kitchen, 0.29 in veach-bidir, 0.25 in veach-mis, 0.20 in veach-ajar (all by
//! Bitterli, version 3), 0.30 in kitchen.xml as published with `guided_path` (`--lenient --integrator path`) and 0.20 in the torus
//! of `scenes/make_torus.py`; 0.08 in cornell-box, 0.07 in staircase, 0.01 under the sky of `tests/guiding/open.xml`, 0.00 in
//! living-room-2 and classroom, -0.01 in `scenes/bathroom.xml`. What guiding is worth beside the roulette it comes with is
//! another question, which this only helps to answer, and `lucerna compare SCENE -m path path+roulette=adjoint path+guide=sd_tree`
//! does.

use lucerna_core::interfaces::{GuideRecord, RecordKind};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};

/// Records of all cells together from which the mean gain is believed.
const ENOUGH: f64 = 20_000.0;

/// One record tells at most this: light where the BSDF alone would never have looked.
const MOST: f32 = 20.0;

/// Sums over the records of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gain {
    count: f64,
    light: f64,
    /// The gain of each, times its light.
    sum: f64,
}

impl Gain {
    /// Takes in a record, if it comes from a mixture.
    #[inline]
    pub fn add(&mut self, record: &GuideRecord) {
        let GuideRecord { scattered, pdf, pdf_bsdf, kind, .. } = *record;
        if kind == RecordKind::Unguided {
            return;
        }
        self.count += 1.0;
        if scattered > 0.0 && scattered.is_finite() && pdf > 0.0 {
            self.light += f64::from(scattered);
            self.sum += f64::from(scattered) * f64::from((pdf / pdf_bsdf).ln().clamp(-MOST, MOST));
        }
    }

    /// Forgets all but a part.
    pub fn fade(&mut self, left: f64) {
        for sum in [&mut self.count, &mut self.light, &mut self.sum] {
            *sum *= left;
        }
    }

    /// In nats; 0 where no light was scattered.
    fn nats(&self) -> f64 {
        if self.light > 0.0 { self.sum / self.light } else { 0.0 }
    }

    /// Writes it.
    pub fn pack(&self, to: &mut Packer) {
        [self.count, self.light, self.sum].into_iter().for_each(|sum| to.f64(sum));
    }

    /// Reads what was written.
    ///
    /// # Errors
    /// If these are no sums.
    pub fn unpack(from: &mut Cursor<'_>) -> Result<Self> {
        const WHAT: &str = "what the guide gains";
        let (count, light, sum) = (from.f64(WHAT)?, from.f64(WHAT)?, from.f64(WHAT)?);
        let usable = [count, light, sum.abs()].into_iter().all(|x| (0.0..=f64::MAX).contains(&x));
        match usable {
            true => Ok(Gain { count, light, sum }),
            false => Err(IoError::new("a cell has gains that are no numbers")),
        }
    }
}

/// The mean over the records of all cells, in nats, if they are enough to tell.
pub fn mean<'a>(cells: impl Iterator<Item = &'a Gain>) -> Option<f64> {
    let (sum, count) =
        cells.fold((0.0, 0.0), |(sum, count), gain| (sum + gain.count * gain.nats(), count + gain.count));
    (count >= ENOUGH).then_some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::super::mixing::tests::found_in_a_part;
    use super::*;
    use lucerna_core::sampling::Pcg32;

    /// The gain in a cell where all light comes from a `part` of the directions, at an even mixture of a uniform BSDF and a
    /// guide that knows this.
    fn gain(part: f32, records: u32) -> Gain {
        let (mut gain, mut pcg) = (Gain::default(), Pcg32::new(3, 3));
        for _ in 0..records {
            gain.add(&found_in_a_part(0.5, part, 1.0, &mut pcg));
        }
        gain
    }

    /// In closed form: log of the density of the mixture over that of the BSDF, where the light is.
    #[test]
    fn gains_are_those_in_closed_form() {
        for part in [1.0, 0.5, 0.1, 0.01] {
            let (found, exact) = (mean([gain(part, 20_000)].iter()), f64::from(0.5 / part + 0.5).ln());
            assert!(found.is_some_and(|found| (found - exact).abs() < 1e-3 * exact + 1e-6), "{part}: {found:?}");
        }
    }

    /// Cells count by their records, whatever light they have; those without any gain nothing.
    #[test]
    fn dark_cells_count_as_bright_ones() {
        let (some, none) = (gain(0.1, 20_000), gain(1.0, 20_000));
        let bright = Gain { light: 1e6 * none.light, sum: 1e6 * none.sum, ..none };
        let found = mean([some, bright, Gain { count: 10_000.0, ..Gain::default() }].iter());
        let exact = 0.4 * 5.5_f64.ln();
        assert!(found.is_some_and(|found| (found - exact).abs() < 1e-3), "{found:?}");
    }

    #[test]
    fn few_records_say_nothing() {
        assert!(mean([gain(1.0, 19_999)].iter()).is_none() && mean([gain(1.0, 20_000)].iter()).is_some());
        let mut half = gain(1.0, 20_000);
        half.fade(0.5);
        assert!(mean([half].iter()).is_none() && mean([half, half].iter()).is_some());
        assert!(mean([].iter()).is_none());
    }

    #[test]
    fn what_is_packed_comes_back() {
        let gain = gain(0.3, 100);
        let mut bytes = Packer::default();
        gain.pack(&mut bytes);
        assert_eq!(Gain::unpack(&mut Cursor::new(&bytes.0)).ok(), Some(gain));
        let mut bytes = Packer::default();
        [1.0, -1.0, 0.0].into_iter().for_each(|x| bytes.f64(x));
        assert!(Gain::unpack(&mut Cursor::new(&bytes.0)).is_err());
    }
}
