//! What scattering has brought in a cell of space, apart for the sides that surfaces face there.

use lucerna_core::interfaces::{Outlook, VertexRecord};
use lucerna_core::io::limits::Cursor;
use lucerna_core::io::sealed::Packer;
use lucerna_core::io::{IoError, Result};
use lucerna_core::math::Vec3;

/// Sides that are told apart: both directions of the three axes.
pub const SIDES: usize = 6;

/// Records from which the means are believed.
const ENOUGH: f64 = 32.0;

/// The side to which a normal points: along its largest coordinate.
#[inline]
pub fn side(n: Vec3) -> usize {
    let a = n.abs();
    let (axis, x) = match (a.x >= a.y && a.x >= a.z, a.y >= a.z) {
        (true, _) => (0, n.x),
        (false, true) => (1, n.y),
        (false, false) => (2, n.z),
    };
    2 * axis + usize::from(x < 0.0)
}

/// Sums over the records of a cell and side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    count: f64,
    light: f64,
    square: f64,
    cost: f64,
    /// Sum over vertices that split of the variance among their branches, and the number of them.
    spread: f64,
    splits: f64,
}

impl Totals {
    /// Adds a record.
    #[inline]
    pub fn add(&mut self, record: &VertexRecord) {
        let light = f64::from(record.light);
        self.count += 1.0;
        self.light += light;
        self.square += light * light;
        self.cost += f64::from(record.cost);
        if let Some(spread) = record.spread {
            self.spread += f64::from(spread);
            self.splits += 1.0;
        }
    }

    /// Gives half to another cell.
    pub fn halve(&mut self) {
        let Totals { count, light, square, cost, spread, splits } = self;
        for sum in [count, light, square, cost, spread, splits] {
            *sum *= 0.5;
        }
    }

    fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The means, if there are enough records.
    pub fn outlook(&self) -> Option<Outlook> {
        if self.count < ENOUGH {
            return None;
        }
        let [light, square, cost] = [self.light, self.square, self.cost].map(|sum| sum / self.count);
        // Part of the variance among all vertices is that they are different. Until splits have told how much: half.
        let among_all = (square - light * light).max(0.0);
        let spread = if self.splits >= ENOUGH { self.spread / self.splits } else { 0.5 * among_all };
        let spread = spread.min(among_all) as f32;
        Some(Outlook { light: light as f32, square: square as f32, spread, cost: cost as f32 })
    }
}

/// Packs the sums of all sides, and what was known of them at the end of the last iteration: one bit for each that is
/// there, then they.
pub fn pack(totals: &[Totals; SIDES], known: &[Option<Outlook>; SIDES], to: &mut Packer) {
    let bits = |is_there: [bool; SIDES]| is_there.iter().rev().fold(0, |bits, b| 2 * bits + u16::from(*b));
    to.u16(bits(totals.map(|t| !t.is_empty())) | bits(known.map(|k| k.is_some())) << SIDES);
    for Totals { count, light, square, cost, spread, splits } in totals.iter().filter(|t| !t.is_empty()) {
        [count, light, square, cost, spread, splits].into_iter().for_each(|sum| to.f64(*sum));
    }
    for Outlook { light, square, cost, spread } in known.iter().flatten() {
        [light, square, cost, spread].into_iter().for_each(|mean| to.f32(*mean));
    }
}

/// Reads what was packed.
///
/// # Errors
/// If it is not that.
pub fn unpack(from: &mut Cursor<'_>) -> Result<([Totals; SIDES], [Option<Outlook>; SIDES])> {
    const WHAT: &str = "what scattering brings";
    let bits = from.u16(WHAT)?;
    let (mut totals, mut known) = ([Totals::default(); SIDES], [None; SIDES]);
    for (_, total) in totals.iter_mut().enumerate().filter(|(side, _)| bits >> side & 1 == 1) {
        let mut next = || from.f64(WHAT);
        let (count, light, square) = (next()?, next()?, next()?);
        let (cost, spread, splits) = (next()?, next()?, next()?);
        if [count, light, square, cost, spread, splits].iter().any(|sum| !(0.0..=f64::MAX).contains(sum)) {
            return Err(IoError::new("a cell has sums that are no sums of light"));
        }
        *total = Totals { count, light, square, cost, spread, splits };
    }
    for (_, known) in known.iter_mut().enumerate().filter(|(side, _)| bits >> (SIDES + side) & 1 == 1) {
        let mut next = || from.f32(WHAT);
        let outlook = Outlook { light: next()?, square: next()?, cost: next()?, spread: next()? };
        let Outlook { light, square, cost, spread } = outlook;
        // Squares of light may be more than a number holds.
        if [light, cost].iter().any(|mean| !(0.0..=f32::MAX).contains(mean)) || !(square >= 0.0 && spread >= 0.0) {
            return Err(IoError::new("a cell has an outlook that is none"));
        }
        *known = Some(outlook);
    }
    Ok((totals, known))
}
