//! `mitchell`: a cubic that weighs blur against ringing (Mitchell and Netravali 1988, "Reconstruction filters in
//! computer graphics").
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `B` | float | 1/3 | blur |
//! | `C` | float | 1/3 | ringing |
//!
//! ```xml
//! <rfilter type="mitchell"/>
//! ```

use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "mitchell",
    aliases: &[],
    summary: "cubic that weighs blur against ringing",
    params: &[&[Param::float("B", 1.0 / 3.0, "blur"), Param::float("C", 1.0 / 3.0, "ringing")]],
    build: Constructor::Rfilter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Rfilter> {
    Ok(Arc::new(Cubic { b: p.float("B"), c: p.float("C") }))
}

/// The family of cubics of Mitchell and Netravali.
pub struct Cubic {
    /// Blur.
    pub b: f32,
    /// Ringing.
    pub c: f32,
}

impl Rfilter for Cubic {
    fn radius(&self) -> f32 {
        2.0
    }

    fn eval(&self, x: f32) -> f32 {
        let Cubic { b, c } = *self;
        let x = x.abs();
        let polynomial = |c3: f32, c2: f32, c1: f32, c0: f32| (((c3 * x + c2) * x + c1) * x + c0) / 6.0;
        if x < 1.0 {
            polynomial(12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b)
        } else if x < 2.0 {
            polynomial(-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c)
        } else {
            0.0
        }
    }
}
