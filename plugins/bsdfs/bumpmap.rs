//! `bumpmap`: turns a material's normal by the slope of a height map.
//!
//! The map is a displacement along the normal in scene units; only its slope matters. The change of the base
//! surface's own normal is left out, as is usual (Blinn 1978).
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | (nested) | a texture of any name | required | height; a bitmap needs `raw` = true |
//! | (nested) | one BSDF | required | the material |
//! | `scale` | float | 1 | factor on the height |
//! | `flip_invalid_normals` | boolean | true | mirror normals that face away from the viewer |
//! | `use_shadowing_function` | boolean | true | soften the terminator by microfacet shadowing |
//!
//! ```xml
//! <bsdf type="bumpmap">
//!     <texture type="checkerboard"/>
//!     <float name="scale" value="0.1"/>
//!     <bsdf type="roughplastic"/>
//! </bsdf>
//! ```

use super::perturbed::{PARAMS, Perturbation, Perturbed};
use lucerna_core::interfaces::{Bsdf, SurfaceHit, Texture};
use lucerna_core::math::Vec3;
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "bumpmap",
    aliases: &[],
    summary: "turns the normal by a height map",
    params: &[
        PARAMS,
        &[
            Param::child(ObjectKind::Texture, 1, 1, "height along the normal, in scene units"),
            Param::float("scale", 1.0, "factor on the height"),
        ],
    ],
    build: Constructor::Bsdf(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Bsdf> {
    let Some((_, height)) = p.free_textures().pop() else {
        return Err(p.error("texture", "a nested height texture is required"));
    };
    Ok(Arc::new(Perturbed::from(p, Relief { height, scale: p.float("scale") })?))
}

struct Relief {
    height: Arc<dyn Texture>,
    scale: f32,
}

impl Perturbation for Relief {
    fn normal(&self, hit: &SurfaceHit) -> Vec3 {
        let slope = self.scale * self.height.gradient(hit);
        let n = hit.frame.n;
        // The tangents of the displaced surface: what they had along the normal is replaced by the slope.
        let dp_du = hit.dp_du + n * (slope.x - n.dot(hit.dp_du));
        let dp_dv = hit.dp_dv + n * (slope.y - n.dot(hit.dp_dv));
        let turned = dp_du.cross(dp_dv);
        hit.to_local(if turned.dot(hit.n) < 0.0 { -turned } else { turned })
    }

    /// World-space `dp_du`, although the normal is local: what the reference renderer does, and visible only where
    /// the nested material is anisotropic.
    fn tangent(&self, hit: &SurfaceHit) -> Vec3 {
        hit.dp_du
    }
}
