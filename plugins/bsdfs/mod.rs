//! All BSDFs: one file each, one line each in [`PLUGINS`].
//!
//! Shared parts stand beside them: Fresnel's equations, microfacet distributions, rough interfaces, indices of
//! refraction, turned normals, and closed forms that are made at load where nothing varies them.

mod blendbsdf;
mod bumpmap;
mod conductor;
mod conductor_materials;
mod dielectric;
mod diffuse;
mod erf;
mod form;
mod fresnel;
mod ior;
mod mask;
mod microfacet;
mod normalmap;
mod null;
mod perturbed;
mod plastic;
mod principled;
mod rough_interface;
mod roughconductor;
mod roughdielectric;
mod roughplastic;
mod thindielectric;
mod twosided;

#[cfg(test)]
mod tests;

use lucerna_core::scene::Plugin;

/// The table of all BSDFs.
pub const PLUGINS: &[Plugin] = &[
    diffuse::PLUGIN,
    dielectric::PLUGIN,
    thindielectric::PLUGIN,
    roughdielectric::PLUGIN,
    conductor::PLUGIN,
    roughconductor::PLUGIN,
    plastic::PLUGIN,
    roughplastic::PLUGIN,
    principled::PLUGIN,
    twosided::PLUGIN,
    mask::PLUGIN,
    bumpmap::PLUGIN,
    normalmap::PLUGIN,
    blendbsdf::PLUGIN,
    null::PLUGIN,
];
