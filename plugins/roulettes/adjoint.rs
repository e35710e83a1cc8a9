//! `adjoint`: a path goes on, stops or splits by what it is expected to bring to its pixel.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `window` | float | 5 | largest weight that neither ends nor splits a path, over the smallest |
//!
//! ```xml
//! <integrator type="path">
//!     <roulette type="adjoint">
//!         <float name="window" value="3"/>
//!     </roulette>
//! </integrator>
//! ```

use super::{limited, survival, unlearnt};
use crate::guides::outlook_alone;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Guide, Outlook, PathState, Roulette};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "adjoint",
    aliases: &[],
    summary: "paths end or split by what they are expected to bring",
    params: &[&[
        Param::float("window", 5.0, "largest weight that neither ends nor splits, over the smallest").at_least(1.0)
    ]],
    build: Constructor::Roulette(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Roulette> {
    Ok(Arc::new(Adjoint { window: p.float("window") }))
}

struct Adjoint {
    window: f32,
}

impl Roulette for Adjoint {
    fn teacher(&self) -> Option<Arc<dyn Guide>> {
        Some(outlook_alone())
    }

    fn branches(&self, path: &PathState, albedo: Rgb, outlook: Option<Outlook>) -> f32 {
        let Some(outlook) = outlook else { return unlearnt(path) };
        // The weight over the centre of the window.
        let weight = (path.throughput * albedo).luminance() * outlook.light / path.goal.image;
        if !(weight > 0.0 && weight.is_finite()) {
            return unlearnt(path);
        }
        let low = 2.0 / (1.0 + self.window);
        let high = self.window * low;
        limited(path, if weight < low { weight / low } else { (weight / high).max(1.0) })
    }

    fn survival(&self, path: &PathState, delta: bool) -> f32 {
        if delta { survival(path.prospects, path.eta) } else { 1.0 }
    }
}
