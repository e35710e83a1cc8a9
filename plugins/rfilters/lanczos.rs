//! `lanczos`: the ideal low-pass filter in a window of itself: `sinc(x) sinc(x / lobes)`. The sharpest, and rings most.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `lobes` | integer | 3 | radius in pixels |
//!
//! ```xml
//! <rfilter type="lanczos"/>
//! ```

use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::f32::consts::PI;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "lanczos",
    aliases: &[],
    summary: "windowed sinc, the sharpest",
    params: &[&[Param::int("lobes", 3, "radius in pixels").range(1.0, 64.0)]],
    build: Constructor::Rfilter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Rfilter> {
    Ok(Arc::new(Lanczos { lobes: p.int("lobes") as f32 }))
}

struct Lanczos {
    lobes: f32,
}

fn sinc(x: f32) -> f32 {
    let x = PI * x;
    if x.abs() < 1e-4 { 1.0 } else { x.sin() / x }
}

impl Rfilter for Lanczos {
    fn radius(&self) -> f32 {
        self.lobes
    }

    fn eval(&self, x: f32) -> f32 {
        if x.abs() < self.lobes { sinc(x) * sinc(x / self.lobes) } else { 0.0 }
    }
}
