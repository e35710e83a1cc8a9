//! `adjoint`: a path goes on, stops or splits by what it is expected to bring to its pixel.
//!
//! Adjoint-driven Russian roulette and splitting (Vorba, Křivánek 2016; the course "Path Guiding in Production", 2019,
//! sections 7.7 and 10.6). Expected is the throughput times what scattering at a vertex has brought so far; the goal is
//! what the samples before have found for the pixel. If their ratio is within a window about 1 the path goes on; below,
//! it goes on with a probability that makes up for it, not less than 0.05; above, it splits, into 20 at most. This is
//! decided before light is sampled at a vertex, not at the first one, nor where there are delta lobes alone: from
//! `rr_depth` on these go by what they have left of the light since the last vertex that has others. What a guided `path`
//! does without a roulette. Where nothing is known it is as `throughput`, and behind a guide as `albedo`, but no probability is below 0.05.
//!
//! Published are the pixel alone as the goal, and a window of 5. Here the goal is brought nearer to the mean of the picture,
//! so that it is not the relative error of every pixel alone that counts, and the window is 8.5, so that fewer paths end and
//! split. Which window suits a scene tells `lucerna compare scene.xml -m path+roulette=adjoint path+roulette=adjoint:window=5`.
//!
//! What scattering brings is learnt in a tree over space while the picture forms, in the tree of the guide `sd_tree` if
//! there is one; it is the same for all directions on one side of a surface, relative to the albedo. Pictures are
//! unbiased. All samples count alike where there is no guide, and what they teach is over in iterations that begin within the
//! first tenth of the budget: means are known sooner than directions.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `window` | float | 8.5 | upper end of the window over the lower; 1 is the middle of both |
//!
//! Limits. It pays where light is bounced often or arrives from places that few paths see, as in a room that is lit
//! through a door ajar, and the more, the more samples there are to learn from. In simple scenes under light that is
//! sampled well it gains nothing, or loses what learning costs. What it is worth in a scene tells
//! `lucerna compare scene.xml -m path path+roulette=adjoint`.
//!
//! ```xml
//! <integrator type="path">
//!     <roulette type="adjoint">
//!         <float name="window" value="3"/>
//!     </roulette>
//! </integrator>
//! ```

use super::{limited, survival_after_branches, unlearnt};
use crate::guides::outlook_alone;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Guide, Outlook, PathState, Roulette};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// The window's default.
const WINDOW: f64 = 8.5;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "adjoint",
    aliases: &[],
    summary: "paths end or split by what they are expected to bring",
    params: &[&[
        Param::float("window", WINDOW, "largest weight that neither ends nor splits, over the smallest").at_least(1.0)
    ]],
    build: Constructor::Roulette(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Roulette> {
    Ok(Arc::new(Adjoint { window: p.float("window") }))
}

/// What guided paths go by unless another roulette is named.
pub(crate) fn by_default() -> Arc<dyn Roulette> {
    Arc::new(Adjoint { window: WINDOW as f32 })
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

    fn survival(&self, path: &PathState) -> f32 {
        survival_after_branches(path)
    }
}
