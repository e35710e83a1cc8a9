//! Every rewrite, in the order in which they are tried. To read one more old plugin, add a row.

use super::super::description::{Node, NodeId, ObjectKind};
use super::{Editor, emitters, materials, media, others, textures};
use ObjectKind::{
    Bsdf, Emitter, Film, Integrator, Medium, Phase, Rfilter, Sampler, Scene, Sensor, Shape, Texture, Volume,
};
use Rewrite::{Drop, Keep, Plugin, Real, Rename, Whole, With, Words};

/// What is done to an object.
#[derive(Clone, Copy)]
pub(super) enum Rewrite {
    /// Another plugin.
    Plugin(&'static str),
    /// Another name for a parameter; if both are given the new one counts.
    Rename(&'static str, &'static str),
    /// Parameters that are left out.
    Drop(&'static [&'static str]),
    /// All parameters but these are left out; nested objects stay.
    Keep(&'static [&'static str]),
    /// Other words for the text of a parameter, whatever the letter case.
    Words(&'static str, &'static [(&'static str, &'static str)]),
    /// Whole numbers that may have been written as `<float>`.
    Whole(&'static [&'static str]),
    /// Numbers that may have been written as `<integer>` but must be `<float>` today.
    Real(&'static [&'static str]),
    /// Anything else; gives the note if there was something to do.
    With(fn(&mut Editor, NodeId) -> Option<String>),
}

/// One row: for these plugins of that kind, the rewrite, and the reason as the note gives it.
pub(super) struct Row {
    pub kind: ObjectKind,
    /// Empty for all plugins of the kind.
    pub plugins: &'static [&'static str],
    pub rewrite: Rewrite,
    pub why: &'static str,
}

impl Row {
    pub fn concerns(&self, node: &Node) -> bool {
        self.kind == node.kind && (self.plugins.is_empty() || self.plugins.contains(&node.plugin.as_str()))
    }
}

const ALL: &[&str] = &[];
const MESHES: &[&str] = &["obj", "ply", "serialized"];
const SMOOTH_SHAPES: &[&str] = &["sphere", "rectangle", "disk", "cylinder"];
const ROUGH: &[&str] = &["roughconductor", "roughdielectric", "roughplastic"];
const NOT_TODAY: &str = "today has no such setting";
const NEAREST: &str = "the nearest that there is today";

const fn row(kind: ObjectKind, plugins: &'static [&'static str], rewrite: Rewrite, why: &'static str) -> Row {
    Row { kind, plugins, rewrite, why }
}

/// Rows for files of 0.x and 2.x.
#[rustfmt::skip]
pub(super) const TABLE: &[Row] = &[
    row(Scene, ALL, With(emitters::join_sun_to_sky), ""),

    row(Integrator, &["irrcache", "adaptive", "multichannel"], With(others::unwrap_integrator), ""),
    row(Integrator, &["volpath_simple"], Plugin("volpath"), ""),
    row(Integrator, &["guided_path"], With(others::guided_path), ""),
    row(Integrator, ALL, With(others::unknown_integrator), NEAREST),
    row(Integrator, &["direct"], Rename("luminaire_samples", "emitter_samples"), ""),
    row(Integrator, &["direct"], With(others::shading_samples), ""),
    row(Integrator, ALL, Keep(&["max_depth", "rr_depth", "hide_emitters", "shading_samples", "emitter_samples", "bsdf_samples", "aovs", "use_spectral_mis", "timeout", "block_size"]), NOT_TODAY),
    row(Integrator, ALL, Whole(&["max_depth", "rr_depth", "shading_samples", "emitter_samples", "bsdf_samples"]), ""),
    row(Integrator, ALL, With(others::positive_rr_depth), ""),

    row(Sampler, &["halton", "hammersley"], Plugin("sobol"), "a low-discrepancy sequence too"),
    row(Sampler, ALL, Keep(&["sample_count", "seed", "jitter", "strength"]), NOT_TODAY),
    row(Sampler, ALL, Whole(&["sample_count", "seed"]), ""),

    row(Film, &["ldrfilm", "mfilm", "tiledhdrfilm"], Plugin("hdrfilm"), "the image stays linear"),
    row(Film, ALL, Rename("high_quality_edges", "sample_border"), ""),
    row(Film, ALL, Words("pixel_format", &[("luminanceAlpha", "luminance_alpha"), ("spectrum", "rgb"), ("spectrumAlpha", "rgba")]), ""),
    row(Film, ALL, Words("component_format", &[("half", "float16"), ("float", "float32"), ("single", "float32"), ("uint", "uint32")]), ""),
    row(Film, ALL, With(others::file_format), "a film holds linear values"),
    row(Film, &["hdrfilm"], Keep(&["width", "height", "crop_offset_x", "crop_offset_y", "crop_width", "crop_height", "sample_border", "component_format", "file_format", "pixel_format"]), NOT_TODAY),
    row(Film, ALL, Whole(&["width", "height", "crop_offset_x", "crop_offset_y", "crop_width", "crop_height"]), ""),

    row(Rfilter, &["windowed-sinc", "windowed_sinc", "wsinc", "sinc"], Plugin("lanczos"), ""),
    row(Rfilter, &["gaussian"], Keep(&["stddev"]), NOT_TODAY),
    row(Rfilter, ALL, Whole(&["lobes"]), ""),

    row(Sensor, &["perspective_rdist"], Plugin("perspective"), "without the distortion"),
    row(Sensor, &["telecentric"], Plugin("orthographic"), "without the blur"),
    row(Sensor, &["perspective"], Drop(&["kc", "aperture_radius", "focus_depth"]), NOT_TODAY),
    row(Sensor, &["orthographic"], Drop(&["aperture_radius"]), NOT_TODAY),
    row(Sensor, ALL, Rename("focus_depth", "focus_distance"), ""),

    row(Emitter, &["area", "point", "spot", "directional", "constant"], With(emitters::fold_scale), ""),
    row(Emitter, &["sky"], With(emitters::only_the_sky), ""),
    row(Emitter, &["sun"], With(emitters::only_the_sun), ""),
    row(Emitter, &["sunsky"], With(emitters::scale_both), ""),
    row(Emitter, &["sunsky"], With(emitters::sun_aperture), ""),
    row(Emitter, &["sunsky"], With(emitters::turbidity), ""),
    row(Emitter, &["sunsky"], With(emitters::upright), ""),
    row(Emitter, &["sunsky"], Drop(&["stretch", "resolution"]), NOT_TODAY),
    row(Emitter, &["sunsky"], Whole(&["year", "month", "day"]), ""),
    row(Emitter, &["envmap"], Drop(&["gamma", "cache"]), NOT_TODAY),

    row(Shape, MESHES, Drop(&["max_smooth_angle", "collapse", "load_materials", "srgb"]), NOT_TODAY),
    row(Shape, &["obj"], Drop(&["shape_index"]), "all parts of the file are taken"),
    row(Shape, SMOOTH_SHAPES, Drop(&["subdiv", "face_normals"]), "the shape is exact"),
    row(Shape, ALL, Whole(&["shape_index"]), ""),
    row(Shape, ALL, With(media::invisible_boundary), "as it was: the boundary of a medium"),

    row(Bsdf, &["lambertian"], Plugin("diffuse"), ""),
    row(Bsdf, &["roughdiffuse", "difftrans", "hk", "irawan"], With(materials::to_diffuse), NEAREST),
    row(Bsdf, &["phong"], With(materials::phong), NEAREST),
    row(Bsdf, &["ward"], With(materials::ward), NEAREST),
    row(Bsdf, &["coating", "roughcoating"], With(materials::coating), NEAREST),
    row(Bsdf, &["mixturebsdf"], With(materials::mixture), ""),
    row(Bsdf, &["bumpmap"], With(materials::bump_scale), ""),
    row(Bsdf, &["normalmap"], With(materials::normal_map), ""),
    row(Bsdf, &["diffuse"], Rename("diffuse_reflectance", "reflectance"), ""),
    row(Bsdf, &["conductor", "roughconductor"], With(materials::outer_index), ""),
    row(Bsdf, &["conductor", "roughconductor"], With(materials::copper), "as it was without parameters"),
    row(Bsdf, &["dielectric", "roughdielectric", "thindielectric", "plastic", "roughplastic"], Real(&["int_ior", "ext_ior"]), ""),
    row(Bsdf, ROUGH, Words("distribution", &[("phong", "beckmann"), ("as", "beckmann"), ("trowbridge-reitz", "ggx")]), ""),
    row(Bsdf, ROUGH, Drop(&["exponent", "exponent_u", "exponent_v", "specular_sampling_weight"]), NOT_TODAY),
    row(Bsdf, &["plastic", "roughplastic", "diffuse", "blendbsdf"], Drop(&["specular_sampling_weight", "ensure_energy_conservation"]), NOT_TODAY),
    row(Bsdf, &["roughplastic"], With(materials::plain_alpha), "it takes a number only"),

    row(Medium, &["homogeneous", "heterogeneous"], With(media::extinction), ""),
    row(Medium, &["homogeneous", "heterogeneous"], With(media::henyey_greenstein), ""),
    row(Medium, &["heterogeneous"], Rename("density", "sigma_t"), ""),
    row(Medium, &["homogeneous", "heterogeneous"], Drop(&["strategy", "method", "step_size", "material", "sampling_density", "density_multiplier"]), NOT_TODAY),
    row(Phase, &["microflake", "kkay"], With(media::isotropic), NEAREST),
    row(Phase, &["mixturephase"], With(media::mixture), ""),
    row(Volume, &["gridvolume"], Drop(&["send_data", "min", "max"]), NOT_TODAY),

    row(Texture, &["scale"], With(textures::fold_scale), ""),
    row(Texture, &["ldrtexture", "exrtexture"], Plugin("bitmap"), ""),
    row(Texture, &["vertexcolors"], With(textures::vertex_colours), ""),
    row(Texture, &["gridtexture", "wireframe", "curvature"], With(textures::to_plain), NEAREST),
    row(Texture, &["bitmap", "checkerboard"], With(textures::uv_transform), ""),
    row(Texture, &["bitmap"], Words("filter_type", &[("trilinear", "bilinear"), ("ewa", "bilinear"), ("isotropic", "bilinear"), ("anisotropic", "bilinear")]), "pictures have no MIP maps"),
    row(Texture, &["bitmap"], Rename("wrap_mode_u", "wrap_mode"), ""),
    row(Texture, &["bitmap"], Words("wrap_mode", &[("zero", "clamp"), ("one", "clamp"), ("black", "clamp"), ("white", "clamp")]), NEAREST),
    row(Texture, &["bitmap"], With(textures::gamma), ""),
    row(Texture, &["bitmap"], Drop(&["wrap_mode_v", "channel", "max_anisotropy", "cache", "gamma"]), NOT_TODAY),
    row(Texture, &["checkerboard"], Rename("bright_color", "color0"), ""),
    row(Texture, &["checkerboard"], Rename("dark_color", "color1"), ""),
    row(Texture, &["uniform", "regular", "blackbody"], Rename("lambda_min", "wavelength_min"), ""),
    row(Texture, &["uniform", "regular", "blackbody"], Rename("lambda_max", "wavelength_max"), ""),
];

/// Rows for files of 3.x: private plugins in published scenes.
#[rustfmt::skip]
pub(super) const LEFTOVERS: &[Row] = &[
    row(Integrator, &["path_guiding_integrator"], Plugin("path"), "a private plugin"),
];
