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
    }

    /// Gives half to another cell.
    pub fn halve(&mut self) {
        for sum in [&mut self.count, &mut self.light, &mut self.square, &mut self.cost] {
            *sum *= 0.5;
        }
    }

    /// The means, if there are enough records.
    pub fn outlook(&self) -> Option<Outlook> {
        let mean = |sum: f64| (sum / self.count) as f32;
        (self.count >= ENOUGH).then(|| Outlook {
            light: mean(self.light),
            square: mean(self.square),
            cost: mean(self.cost),
        })
    }
}
