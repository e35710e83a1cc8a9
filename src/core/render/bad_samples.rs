//! Samples that cannot be used, and where they came from.

use crate::math::UVec2;

/// How many bad samples are remembered in full.
const REMEMBERED: usize = 10;

/// One sample that was dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadSample {
    /// Pixel of the full film.
    pub pixel: UVec2,
    /// Index of the sample in the pixel.
    pub sample: u32,
    /// Its value.
    pub value: [f32; 3],
}

/// All samples that were dropped: NaN, infinite or negative radiance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BadSamples {
    /// How many.
    pub count: u64,
    /// The first of them in pass and tile order.
    pub first: Vec<BadSample>,
}

impl BadSamples {
    /// Adds one.
    #[cold]
    pub fn add(&mut self, sample: BadSample) {
        self.count += 1;
        if self.first.len() < REMEMBERED {
            self.first.push(sample);
        }
    }

    /// Adds those of a later tile or pass.
    pub fn append(&mut self, later: BadSamples) {
        self.count += later.count;
        let room = REMEMBERED - self.first.len();
        self.first.extend(later.first.into_iter().take(room));
    }
}
