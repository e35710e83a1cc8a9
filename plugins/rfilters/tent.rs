//! `tent`: weights fall linearly to zero.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `radius` | float | 1 | where the weight reaches zero, in pixels |
//!
//! ```xml
//! <rfilter type="tent"/>
//! ```

use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "tent",
    aliases: &[],
    summary: "weights fall linearly to zero",
    params: &[&[Param::float("radius", 1.0, "where the weight reaches zero, in pixels").between(0.0, 64.0)]],
    build: Constructor::Rfilter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Rfilter> {
    Ok(Arc::new(Tent { radius: p.float("radius") }))
}

struct Tent {
    radius: f32,
}

impl Rfilter for Tent {
    fn radius(&self) -> f32 {
        self.radius
    }

    fn eval(&self, x: f32) -> f32 {
        (1.0 - x.abs() / self.radius).max(0.0)
    }
}
