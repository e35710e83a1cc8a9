//! `catmullrom`: the interpolating cubic (Catmull and Rom 1974): sharp, with some ringing. No parameters.
//!
//! ```xml
//! <rfilter type="catmullrom"/>
//! ```

use super::mitchell::Cubic;
use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Built, Constructor, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "catmullrom",
    aliases: &[],
    summary: "interpolating cubic, sharp",
    params: &[],
    build: Constructor::Rfilter(build),
};

fn build(_p: &Properties<'_>) -> Built<dyn Rfilter> {
    Ok(Arc::new(Cubic { b: 0.0, c: 0.5 }))
}
