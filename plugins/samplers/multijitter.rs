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
use super::strata::Strata;
use super::{COMMON, Common, JITTER, in_stratum};
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
        Some(Box::new(Points { strata: Strata { seed, count: grid.element_product(), jitter: self.jitter }, grid }))
    }
}

struct Points {
    strata: Strata,
    grid: UVec2,
}

impl PointSet for Points {
    fn singles(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [f32]) {
        self.strata.singles(pixel, sample, first, out);
    }

    fn pairs(&self, pixel: UVec2, sample: u32, first: u32, out: &mut [Vec2]) {
        let UVec2 { x: columns, y: rows } = self.grid;
        let count = self.strata.count;
        self.strata.pairs((pixel, sample), first, out, |key, cell, offset| {
            let (column, row) = (cell % columns, cell / columns);
            // Within its cell a point lies in the fine column that belongs to its row, and the other way round.
            let inner = mix(key);
            let fine_column = permute(row, rows, inner as u32);
            let fine_row = permute(column, columns, (inner >> 32) as u32);
            Vec2::new(
                in_stratum(column * rows + fine_column, offset.x, count),
                in_stratum(row * columns + fine_row, offset.y, count),
            )
        });
    }
}
