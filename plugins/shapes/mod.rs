//! All shapes: one file each, one line each in [`PLUGINS`].
//!
//! Every hit carries a bound on the error of its point (Pharr, Jakob, Humphreys 2023, section 6.8), so that a ray
//! leaves the surface without a constant that depends on the size of the scene. Analytic shapes find their hits in
//! double precision and project them onto the surface.

mod cube;
mod mesh;
mod plane;
mod rectangle;

use lucerna_core::scene::description::ObjectKind;
use lucerna_core::scene::{Param, Plugin};

/// The table of all shapes.
pub const PLUGINS: &[Plugin] = &[cube::PLUGIN, rectangle::PLUGIN];

/// What every shape accepts. Material, light and media are hung on the shape by the scene, not by the constructor.
const COMMON: &[Param] = &[
    Param::transform("to_world", "placement; baked into meshes"),
    Param::ignored("silhouette_sampling_weight", "for differentiable rendering only"),
    Param::child(ObjectKind::Bsdf, 0, 1, "material; by default grey `diffuse`, black if the shape is a light"),
    Param::child(ObjectKind::Emitter, 0, 1, "light that the surface gives off"),
    Param::child(ObjectKind::Medium, 0, 2, "what is inside and outside"),
    Param::child(ObjectKind::Texture, 0, usize::MAX, "named attributes of the surface"),
];

/// What shapes with an orientation accept.
const ORIENTED: &[Param] = &[Param::bool("flip_normals", false, "turn the surface inside out")];

/// What meshes accept.
const MESH: &[Param] = &[Param::bool("face_normals", false, "shade flat, without normals per vertex")];
