//! What scattering has brought in a cell of space, apart for the sides that surfaces face there.

use lucerna_core::interfaces::{Outlook, VertexRecord};
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
