//! `volpathmis`: as `volpath`, with spectral multiple importance sampling inside media.
//!
//! Where a scene holds no medium both are the same estimator, but light samples and BSDF samples are weighted by the
//! balance heuristic (Miller, Georgiev, Jarosz 2019, section 4).
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `max_depth`, `rr_depth`, `hide_emitters` | | -1, 5, false | as `volpath` |
//! | nested `light_sampler` | | by the scene's weights | which light a vertex samples |
//! | `use_spectral_mis` | anything | | accepted, without effect as long as there are no media |
//!
//! ```xml
//! <integrator type="volpathmis">
//!     <integer name="max_depth" value="16"/>
//! </integrator>
//! ```

use super::common::{COMMON, PATH};
use super::lights::LIGHTS;
use super::volpath::{Variant, VolPath};
use lucerna_core::interfaces::Integrator;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "volpathmis",
    aliases: &[],
    summary: "as volpath, with spectral multiple importance sampling inside media",
    params: &[COMMON, PATH, &[LIGHTS, Param::ignored("use_spectral_mis", "of no effect without media")]],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    Ok(Arc::new(VolPath::new(p, Variant::SpectralMis)))
}
