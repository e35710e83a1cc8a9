//! `efficiency`: a path goes on, stops or splits as the picture's error per time asks for.
//!
//! Efficiency-aware Russian roulette and splitting (Rath, Grittmann, Herholz, Weier, Slusallek 2022). With v the mean
//! relative variance of a sample and c its mean cost in rays, both of the picture, a path of throughput t in a pixel of
//! luminance i goes on from a vertex with the probability t/i · √(second moment / cost · c/v) of what scattering there
//! has brought; where that is above 1, it splits into t/i · √(variance / cost · c/v). The variance is that among the
//! branches of vertices that have split, not that among the vertices of a cell. Limits and learning are as in
//! `adjoint`, which needs no such figures. Which of them suits a scene tells
//! `lucerna compare scene.xml -m path path+roulette=adjoint path+roulette=efficiency`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `factor` | float | 1 | times as many continuations as that |
//!
//! ```xml
//! <integrator type="path">
//!     <roulette type="efficiency"/>
//! </integrator>
//! ```

use super::{limited, survival_after_branches, unlearnt};
use crate::guides::outlook_alone;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Guide, Outlook, PathState, Roulette};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "efficiency",
    aliases: &[],
    summary: "paths end or split as error per time asks for",
    params: &[&[Param::float("factor", 1.0, "times as many continuations").at_least(0.0)]],
    build: Constructor::Roulette(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Roulette> {
    Ok(Arc::new(Efficiency { factor: p.float("factor") }))
}

struct Efficiency {
    factor: f32,
}

impl Roulette for Efficiency {
    fn teacher(&self) -> Option<Arc<dyn Guide>> {
        Some(outlook_alone())
    }

    fn branches(&self, path: &PathState, albedo: Rgb, outlook: Option<Outlook>) -> f32 {
        let Some(Outlook { square, spread, cost, .. }) = outlook else { return unlearnt(path) };
        let scale = self.factor * path.goal.effort * (path.throughput * albedo).luminance() / path.goal.image;
        let ends = scale * (square / cost).sqrt();
        let splits = scale * (spread / cost).sqrt();
        if !(ends > 0.0 && ends.is_finite()) {
            return unlearnt(path);
        }
        limited(path, if ends < 1.0 { ends } else { splits.max(1.0) })
    }

    fn survival(&self, path: &PathState) -> f32 {
        survival_after_branches(path)
    }
}
