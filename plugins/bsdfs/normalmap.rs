//! `normalmap`: takes a material's normal from a texture.
//!
//! Colours are mapped from [0, 1] to [-1, 1] and read as a normal in the local shading frame (tangent, bitangent,
//! normal). A texture of (0.5, 0.5, 1) everywhere changes nothing.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `normalmap` | texture | required | normals; a bitmap needs `raw` = true |
//! | (nested) | one BSDF | required | the material |
//! | `flip_invalid_normals` | boolean | true | mirror normals that face away from the viewer |
//! | `use_shadowing_function` | boolean | true | soften the terminator by microfacet shadowing |
//!
//! ```xml
//! <bsdf type="normalmap">
//!     <rgb name="normalmap" value="0.6, 0.5, 0.9"/>
//!     <bsdf type="roughplastic"/>
//! </bsdf>
//! ```

use super::perturbed::{PARAMS, Perturbation, Perturbed};
use lucerna_core::interfaces::{Bsdf, ColorSource, SurfaceHit};
use lucerna_core::math::Vec3;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "normalmap",
    aliases: &[],
    summary: "takes the normal from a texture",
    params: &[PARAMS, &[Param::color("normalmap", Slot::Reflectance, 0.5, "normals, mapped to [0, 1]").required()]],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    Ok(Arc::new(Perturbed::from(p, Normals(p.color("normalmap")))?))
}

struct Normals(ColorSource);

impl Perturbation for Normals {
    fn normal(&self, hit: &SurfaceHit) -> Vec3 {
        2.0 * Vec3::from_array(self.0.at(hit).to_array()) - Vec3::ONE
    }
}
