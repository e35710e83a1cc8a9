//! `aov`: properties of the visible surface as extra channels.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `aovs` | string | required | list of `name:type`, separated by commas or blanks |
//! | nested integrators | | | any number; channels `<name>.R .G .B .A`, before all others |
//!
//! Types and channels: `albedo` (`.R .G .B`), `depth` (`.T`, as the integrator `depth`), `position`, `geo_normal`,
//! `sh_normal`, `dp_du`, `dp_dv` (`.X .Y .Z`), `uv`, `duv_dx`, `duv_dy` (`.U .V`, the latter two for a step of one
//! pixel over the square root of the samples per pixel), `prim_index`, `shape_index` (`.I`; shapes count from 1 in file
//! order, 0 is the background). All are 0 where nothing is hit. Indices are filtered like colours: use a box filter.
//! The picture's colour is that of the first nested integrator, black without one.
//!
//! ```xml
//! <integrator type="aov">
//!     <string name="aovs" value="dd:depth,nn:sh_normal"/>
//!     <integrator type="path" name="image"/>
//! </integrator>
//! ```

use super::common::{COMMON, HIDE_IGNORED, Nested, forward_integrator, timeout};
use lucerna_core::accel::Ray;
use lucerna_core::interfaces::{Arena, CameraRay, Integrator, Radiance, RadianceEstimator, SurfaceHit};
use lucerna_core::math::Vec2;
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Scene, did_you_mean};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "aov",
    aliases: &[],
    summary: "properties of the visible surface as extra channels",
    params: &[
        COMMON,
        HIDE_IGNORED,
        &[
            Param::string_opt("aovs", "list of name:type").required(),
            Param::child(ObjectKind::Integrator, 0, usize::MAX, "integrators whose images come first"),
        ],
    ],
    build: Constructor::Integrator(build),
};

/// One property of the visible surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Albedo,
    Depth,
    Position,
    Uv,
    GeoNormal,
    ShNormal,
    DpDu,
    DpDv,
    DuvDx,
    DuvDy,
    PrimIndex,
    ShapeIndex,
}

/// Name in the scene file, what it is, and the suffixes of its channels.
const KINDS: &[(&str, Kind, &[&str])] = &[
    ("albedo", Kind::Albedo, &["R", "G", "B"]),
    ("depth", Kind::Depth, &["T"]),
    ("position", Kind::Position, &["X", "Y", "Z"]),
    ("uv", Kind::Uv, &["U", "V"]),
    ("geo_normal", Kind::GeoNormal, &["X", "Y", "Z"]),
    ("sh_normal", Kind::ShNormal, &["X", "Y", "Z"]),
    ("dp_du", Kind::DpDu, &["X", "Y", "Z"]),
    ("dp_dv", Kind::DpDv, &["X", "Y", "Z"]),
    ("duv_dx", Kind::DuvDx, &["U", "V"]),
    ("duv_dy", Kind::DuvDy, &["U", "V"]),
    ("prim_index", Kind::PrimIndex, &["I"]),
    ("shape_index", Kind::ShapeIndex, &["I"]),
];

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    let nested = Nested::all(p)?;
    let images = nested.iter().flat_map(|n| ["R", "G", "B", "A"].map(|c| format!("{}.{c}", n.name)));
    let mut names: Vec<String> = images.chain(nested.iter().flat_map(Nested::aov_names)).collect();
    let mut kinds = Vec::new();
    for item in p.string("aovs").split([',', ' ', '\t', '\n']).filter(|s| !s.is_empty()) {
        let Some((name, kind)) = item.split_once(':').filter(|(n, k)| !n.is_empty() && !k.is_empty()) else {
            return Err(p.error("aovs", format!("\"{item}\" is not of the form name:type")));
        };
        let Some((_, kind, channels)) = KINDS.iter().find(|(text, ..)| *text == kind) else {
            let all = KINDS.iter().map(|(text, ..)| *text);
            let hint = did_you_mean(kind, all.clone()).map_or_else(
                || format!("one of {}", all.collect::<Vec<_>>().join(", ")),
                |meant| format!("did you mean \"{meant}\"?"),
            );
            return Err(p.error("aovs", format!("unknown type \"{kind}\" in \"{item}\" ({hint})")));
        };
        kinds.push(*kind);
        names.extend(channels.iter().map(|c| format!("{name}.{c}")));
    }
    Ok(Arc::new(Aov { nested, kinds, names, timeout: timeout(p) }))
}

struct Aov<'a> {
    nested: Vec<Nested<'a>>,
    kinds: Vec<Kind>,
    names: Vec<String>,
    timeout: Option<f64>,
}

forward_integrator!(Aov<'static>, |this| this.names.clone());

impl RadianceEstimator for Aov<'_> {
    fn prepare(&self, scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        let nested = Nested::prepare(&self.nested, scene)?;
        let (kinds, names) = (self.kinds.clone(), self.names.clone());
        Some(Box::new(Aov { nested, kinds, names, timeout: self.timeout }))
    }

    fn wants_differentials(&self) -> bool {
        let own = self.kinds.iter().any(|kind| matches!(kind, Kind::DuvDx | Kind::DuvDy));
        own || Nested::want_differentials(&self.nested)
    }

    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
    ) -> Radiance {
        let mut found = Radiance::default();
        let (images, mut rest) = aovs.split_at_mut(4 * self.nested.len());
        for (i, inner) in self.nested.iter().enumerate() {
            let (own, others) = rest.split_at_mut(inner.aovs.len());
            rest = others;
            let Some(estimator) = inner.estimator() else { continue };
            let seen = estimator.radiance(scene, camera, stream, arena, own);
            images[4 * i..4 * i + 3].copy_from_slice(&seen.rgb.to_array());
            images[4 * i + 3] = seen.alpha;
            found.rays += seen.rays;
            if i == 0 {
                (found.rgb, found.alpha) = (seen.rgb, seen.alpha);
            }
        }
        found.rays += 1;
        let Some(hit) = scene.intersect_surface(&camera.ray) else { return found };
        for kind in &self.kinds {
            let (out, others) = rest.split_at_mut(channels(*kind));
            write(*kind, scene, camera, &hit, arena, out);
            rest = others;
        }
        found
    }
}

fn channels(kind: Kind) -> usize {
    KINDS.iter().find(|(_, k, _)| *k == kind).map_or(0, |(.., suffixes)| suffixes.len())
}

fn write(kind: Kind, scene: &Scene, camera: &CameraRay, hit: &SurfaceHit, arena: &Arena, out: &mut [f32]) {
    match kind {
        Kind::Albedo => out.copy_from_slice(&scene.bsdf(hit).diffuse_reflectance(hit, arena).to_array()),
        Kind::Depth => out[0] = hit.t,
        Kind::Position => out.copy_from_slice(&hit.p.to_array()),
        Kind::Uv => out.copy_from_slice(&hit.uv.to_array()),
        Kind::GeoNormal => out.copy_from_slice(&hit.n.to_array()),
        Kind::ShNormal => out.copy_from_slice(&hit.frame.n.to_array()),
        Kind::DpDu => out.copy_from_slice(&hit.dp_du.to_array()),
        Kind::DpDv => out.copy_from_slice(&hit.dp_dv.to_array()),
        Kind::DuvDx => out.copy_from_slice(&uv_change(hit, camera.offsets.map(|o| o[0])).to_array()),
        Kind::DuvDy => out.copy_from_slice(&uv_change(hit, camera.offsets.map(|o| o[1])).to_array()),
        Kind::PrimIndex => out[0] = hit.prim as f32,
        Kind::ShapeIndex => out[0] = (hit.shape + 1) as f32,
    }
}

/// How far the texture coordinates are from those of the hit where an offset ray meets the tangent plane: the least
/// squares solution of `dp = dp_du · du + dp_dv · dv` (Igehy 1999, "Tracing ray differentials"; zero where it has
/// none).
fn uv_change(hit: &SurfaceHit, offset: Option<Ray>) -> Vec2 {
    let Some(ray) = offset else { return Vec2::ZERO };
    let t = hit.n.dot(hit.p - ray.o) / hit.n.dot(ray.d);
    let dp = ray.o + ray.d * t - hit.p;
    let (a00, a01, a11) = (hit.dp_du.dot(hit.dp_du), hit.dp_du.dot(hit.dp_dv), hit.dp_dv.dot(hit.dp_dv));
    let (b0, b1) = (hit.dp_du.dot(dp), hit.dp_dv.dot(dp));
    let change = Vec2::new(a11 * b0 - a01 * b1, a00 * b1 - a01 * b0) / (a00 * a11 - a01 * a01);
    if change.is_finite() { change } else { Vec2::ZERO }
}
