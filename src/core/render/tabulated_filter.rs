//! A reconstruction filter as the reference's scalar variants look it up.

use crate::interfaces::Rfilter;

/// 31 values over the radius; the nearest lower one counts.
pub(super) struct TabulatedFilter {
    radius: f32,
    values: [f32; Self::STEPS + 1],
}

impl TabulatedFilter {
    const STEPS: usize = 31;

    pub fn new(filter: &dyn Rfilter) -> Self {
        let radius = filter.radius();
        let mut values = [0.0; Self::STEPS + 1];
        for (i, value) in values.iter_mut().take(Self::STEPS).enumerate() {
            *value = filter.eval(radius * i as f32 / Self::STEPS as f32);
        }
        TabulatedFilter { radius, values }
    }
}

impl Rfilter for TabulatedFilter {
    fn radius(&self) -> f32 {
        self.radius
    }

    fn eval(&self, x: f32) -> f32 {
        self.values[((x.abs() * Self::STEPS as f32 / self.radius) as usize).min(Self::STEPS)]
    }
}
