//! `box`: every sample counts for the pixel it falls in.
//!
//! The fastest and the sharpest filter, and the only one whose pixels do not depend on each other. No parameters.
//!
//! ```xml
//! <rfilter type="box"/>
//! ```

use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "box",
    aliases: &[],
    summary: "every sample counts for the pixel it falls in",
    params: &[],
    build: Constructor::Rfilter(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn Rfilter> {
    Ok(Arc::new(Box))
}

struct Box;

impl Rfilter for Box {
    fn radius(&self) -> f32 {
        0.5
    }

    fn eval(&self, x: f32) -> f32 {
        if (-0.5..0.5).contains(&x) { 1.0 } else { 0.0 }
    }

    fn is_box(&self) -> bool {
        true
    }
}
