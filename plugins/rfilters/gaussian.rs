//! `gaussian`: a bell curve cut off at four standard deviations; the default.
//!
//! Lowered by its value at the cut, so that it ends at zero: `exp(−x²/2σ²) − exp(−8)`. Never rings.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `stddev` | float | 0.5 | standard deviation σ in pixels |
//!
//! ```xml
//! <rfilter type="gaussian">
//!     <float name="stddev" value="0.4"/>
//! </rfilter>
//! ```

use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "gaussian",
    aliases: &[],
    summary: "bell curve, the default",
    params: &[&[Param::float("stddev", 0.5, "standard deviation in pixels").between(0.0, 16.0)]],
    build: Constructor::Rfilter(build),
};

/// Standard deviations from the middle to the cut.
const REACH: f32 = 4.0;

fn build(p: &Properties<'_>) -> Built<dyn Rfilter> {
    let stddev = p.float("stddev");
    Ok(Arc::new(Gaussian {
        radius: REACH * stddev,
        exponent: -0.5 / (stddev * stddev),
        at_cut: (-0.5 * REACH * REACH).exp(),
    }))
}

struct Gaussian {
    radius: f32,
    exponent: f32,
    at_cut: f32,
}

impl Rfilter for Gaussian {
    fn radius(&self) -> f32 {
        self.radius
    }

    fn eval(&self, x: f32) -> f32 {
        ((self.exponent * x * x).exp() - self.at_cut).max(0.0)
    }
}
