//! Where a guide gains too little over the BSDF to be worth its time.
//!
//! The measure is the divergence that the [probability of the guide](super::mixing) is learnt by (Müller 2019, section
//! 10.5): by how much the mixture q of guide and BSDF is closer, in the sense of Kullback and Leibler, to the light p that
//! is scattered than the BSDF b alone is, ∫p log(q/b) in nats. Being a mean of logarithms it is known from few records,
//! where the variances themselves drown in the noise of what lies further along the path.
//!
//! In a cell where it is low most vertices are left to the BSDF, and record nothing. The rest are guided as ever, and
//! their records count for all, so that the cell finds out when it was wrong. Which ones is decided by their position
//! alone: it is the same for sampling and densities, so that no picture is biased.

use lucerna_core::interfaces::{GuideRecord, RecordKind, mix};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::Vec3;

/// One vertex in so many is guided where the gain is low.
pub const TRIED: u32 = 4;

/// Records from which the gain is believed.
const ENOUGH: f64 = 1000.0;

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

    /// Whether it is known to be less than so many nats.
    pub fn is_below(&self, least: f64) -> bool {
        self.count >= ENOUGH && self.sum < least * self.light
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

/// Whether a vertex is guided where few are.
#[inline]
pub fn is_tried(p: Vec3) -> bool {
    let [x, y, z] = p.to_array().map(|x| u64::from(x.to_bits()));
    mix(x ^ y << 32 ^ mix(z)).is_multiple_of(u64::from(TRIED))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna_core::sampling::Pcg32;

    /// The gain in a cell where all light comes from a `part` of the directions, at an even mixture of a uniform BSDF and a
    /// guide that knows this.
    fn gain(part: f32, records: u32) -> Gain {
        let (mut gain, mut pcg) = (Gain::default(), Pcg32::new(3, 3));
        for _ in 0..records {
            let (choice, x) = (pcg.next_f32(), pcg.next_f32());
            let x = if choice < 0.5 { part * x } else { x };
            let pdf_guide = if x < part { 1.0 / part } else { 0.0 };
            let pdf = 0.5 * pdf_guide + 0.5;
            let radiance = if x < part { 1.0 / part } else { 0.0 };
            let (scattered, kind) = (radiance / pdf, RecordKind::Mixed);
            let (p, d, direct, primary) = (Vec3::ZERO, Vec3::Z, 0.0, false);
            let (pdf_bsdf, pdf_sets) = (1.0, [0.0; 2]);
            gain.add(&GuideRecord {
                p,
                d,
                radiance,
                direct,
                scattered,
                pdf,
                pdf_bsdf,
                pdf_guide,
                pdf_sets,
                kind,
                primary,
            });
        }
        gain
    }

    /// In closed form: log of the density of the mixture over that of the BSDF, where the light is.
    #[test]
    fn gains_are_those_in_closed_form() {
        for part in [1.0, 0.5, 0.1, 0.01] {
            let (gain, exact) = (gain(part, 20_000), f64::from(0.5 / part + 0.5).ln());
            assert!(gain.is_below(1.001 * exact + 1e-6) && !gain.is_below(0.999 * exact - 1e-6), "{part}: {gain:?}");
        }
    }

    #[test]
    fn few_records_say_nothing() {
        assert!(!gain(1.0, 999).is_below(0.1) && gain(1.0, 1000).is_below(0.1));
        let mut half = gain(1.0, 1000);
        half.fade(0.5);
        assert!(!half.is_below(0.1));
        assert!(!Gain::default().is_below(1.0));
    }

    /// As many as should be, of points anywhere, on planes and on lines, also where coordinates are round numbers.
    #[test]
    fn one_vertex_in_so_many_is_tried() {
        const POINTS: u32 = 1 << 14;
        let mut pcg = Pcg32::new(5, 5);
        let mut u = || pcg.next_f32();
        let points: [&mut dyn FnMut() -> Vec3; 4] = [
            &mut || 2.0 * Vec3::new(u(), u(), u()) - 1.0,
            &mut {
                let mut i = 0.0;
                move || {
                    i += 1.0;
                    Vec3::new(i / 128.0, 0.0, 1.0)
                }
            },
            &mut {
                let mut i = 0;
                move || {
                    i += 1;
                    Vec3::new(0.0, (i % 128) as f32, (i / 128) as f32)
                }
            },
            &mut {
                let mut i = 0.0;
                move || {
                    i += 1.0;
                    Vec3::new(0.5, 0.25, -i)
                }
            },
        ];
        for (i, point) in points.into_iter().enumerate() {
            let tried = (0..POINTS).filter(|_| is_tried(point())).count() as f64;
            let (mean, p) = (f64::from(POINTS) / f64::from(TRIED), 1.0 / f64::from(TRIED));
            let sigma = (f64::from(POINTS) * p * (1.0 - p)).sqrt();
            assert!((tried - mean).abs() < 4.0 * sigma, "{i}: {tried}");
        }
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
