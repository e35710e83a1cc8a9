//! `multijitter`: one point in each cell of a grid, and one in each fine row and column
//! (Kensler 2013, "Correlated multi-jittered sampling").
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `sample_count` | integer | 4 | samples per pixel, rounded up to rows times columns that differ little |
//! | `seed` | integer | 0 | another number gives other noise |
//! | `jitter` | boolean | true | random places within the strata, not their centres |
//!
//! ```xml
//! <sampler type="multijitter">
//!     <integer name="sample_count" value="64"/>
//! </sampler>
//! ```

use super::permutation::permute;
use super::{COMMON, Common, Counted, JITTER, dimension_key, in_stratum, jitters, pixel_key};
use lucerna_core::interfaces::{Sampler, mix};
use lucerna_core::math::{UVec2, Vec2};
use lucerna_core::sampling::PointSet;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "multijitter",
    aliases: &[],
    summary: "correlated multi-jittered points",
    params: &[COMMON, JITTER],
    build: Constructor::Sampler(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Sampler> {
    let common = Common::new(p, |asked| grid(asked).element_product());
    Ok(Arc::new(MultiJitter { common, jitter: p.bool("jitter") }))
}

/// Columns and rows of the grid: the root rounded down, and as many of them as it takes. Their product fits 32 bits.
fn grid(asked: u32) -> UVec2 {
    let rows = f64::from(asked.max(1)).sqrt() as u32;
    UVec2::new(asked.max(1).div_ceil(rows).min(u32::MAX / rows), rows)
}

struct MultiJitter {
    common: Common,
    jitter: bool,
}

impl Sampler for MultiJitter {
    fn sample_count(&self) -> u32 {
        self.common.sample_count
    }

    fn seed(&self) -> u32 {
        self.common.seed
    }

    fn round_spp(&self, asked: u32) -> u32 {
        grid(asked).element_product()
    }

    fn point_set(&self, seed: u32, spp: u32, _film_size: UVec2) -> Option<Box<dyn PointSet>> {
        let grid = grid(spp);
        Some(Box::new(Points { seed, grid, count: grid.element_product(), jitter: self.jitter }))
    }
}

struct Points {
    seed: u32,
    grid: UVec2,
    count: u32,
    jitter: bool,
}

impl Points {
    fn offset(&self, key: u64, sample: u32) -> Vec2 {
        if self.jitter { jitters(key, sample).into() } else { Vec2::splat(0.5) }
    }
}

impl PointSet for Points {
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        let sample = sample % self.count;
        for (dimension, out) in (first..).zip(out) {
            let key = dimension_key(pixel, Counted::Singles, dimension);
            let stratum = permute(sample, self.count, key as u32);
            *out = in_stratum(stratum, self.offset(key, sample).x, self.count);
        }
    }

    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]) {
        let pixel = pixel_key(self.seed, pixel, sample / self.count);
        let sample = sample % self.count;
        let UVec2 { x: columns, y: rows } = self.grid;
        for (dimension, out) in (first..).zip(out) {
            let key = dimension_key(pixel, Counted::Pairs, dimension);
            let cell = permute(sample, self.count, key as u32);
            let (column, row) = (cell % columns, cell / columns);
            // Within its cell a point lies in the fine column that belongs to its row, and the other way round.
            let inner = mix(key);
            let fine_column = permute(row, rows, inner as u32);
            let fine_row = permute(column, columns, (inner >> 32) as u32);
            let offset = self.offset(key, sample);
            *out = Vec2::new(
                in_stratum(column * rows + fine_column, offset.x, self.count),
                in_stratum(row * columns + fine_row, offset.y, self.count),
            );
        }
    }
}
