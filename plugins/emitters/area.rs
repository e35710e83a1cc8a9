//! `area`: a surface that emits light evenly into the half-space in front of it.
//!
//! Nested in a shape; the front is the side of the normal. With the same radiance everywhere the shape samples itself
//! as seen from the lit point. A texture is sampled in proportion to its luminance and its texture coordinates are
//! found on the shape, if they are one to one there; else the shape is sampled evenly by area.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `radiance` | colour or texture | 1 | radiance in W·m⁻²·sr⁻¹ |
//! | `sampling_weight` | float | 1 | relative chance of being sampled for direct light |
//!
//! ```xml
//! <shape type="rectangle">
//!     <emitter type="area">
//!         <rgb name="radiance" value="17, 12, 4"/>
//!     </emitter>
//! </shape>
//! ```

use super::COMMON;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    AreaSample, ColorSource, Emitter, EmitterFlags, LightPoint, LightSample, Shape, SurfaceHit, Texture,
};
use lucerna_core::math::{Frame, Vec2, Vec3};
use lucerna_core::sampling::Pcg32;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::PI;
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "area",
    aliases: &[],
    summary: "a surface that emits light",
    params: &[
        COMMON,
        &[
            Param::color("radiance", Slot::Emissive, 1.0, "radiance in W/(m² sr)"),
            Param::transform("to_world", "not allowed: the light is where its shape is"),
        ],
    ],
    build: Constructor::Emitter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    let Some(shape) = p.parent_shape() else {
        return Err(p.error("", "an area light must be nested in the shape that shines"));
    };
    if p.has("to_world") {
        return Err(p.error("to_world", "an area light is where its shape is: set \"to_world\" there"));
    }
    let (shape, sampling_weight) = (shape.clone(), p.float("sampling_weight"));
    Ok(match p.color("radiance") {
        ColorSource::Constant(radiance) => Arc::new(Plain { shape, radiance, sampling_weight }),
        ColorSource::Textured(radiance) => {
            let by_texture = is_one_to_one(&*shape);
            Arc::new(Textured { shape, radiance, by_texture, sampling_weight })
        }
    })
}

/// Whether the shape finds points by their texture coordinates, and each coordinate inside the unit square belongs to
/// one point only: tried with a hundred points.
fn is_one_to_one(shape: &dyn Shape) -> bool {
    let mut rng = Pcg32::new(1, 1);
    let scale = shape.area().sqrt();
    (0..100).all(|_| {
        let Some(sample) = shape.sample_area(Vec2::new(rng.next_f32(), rng.next_f32())) else { return true };
        let inside = sample.uv.clamp(Vec2::ZERO, Vec2::ONE) == sample.uv;
        inside && shape.at_uv(sample.uv).is_some_and(|hit| hit.p.distance(sample.p) < 1e-3 * scale)
    })
}

/// Whether a light point shows its front to the point it is seen from.
fn faces(point: &LightPoint) -> bool {
    point.d.dot(point.n) < 0.0
}

/// The same radiance everywhere.
struct Plain {
    shape: Arc<dyn Shape>,
    radiance: Rgb,
    sampling_weight: f32,
}

impl Emitter for Plain {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::SURFACE
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<LightSample> {
        let (point, p_error, pdf) = self.shape.sample_direct(from, u2)?;
        (faces(&point) && pdf > 0.0).then(|| LightSample {
            point,
            p_error,
            pdf,
            weight: self.radiance / pdf,
            delta: false,
        })
    }

    fn pdf_direct(&self, from: Vec3, point: &LightPoint) -> f32 {
        if faces(point) { self.shape.pdf_direct(from, point) } else { 0.0 }
    }

    fn radiance(&self, hit: &SurfaceHit) -> Rgb {
        if hit.wi.z > 0.0 { self.radiance } else { Rgb::BLACK }
    }

    fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
        PI * self.shape.area() * self.radiance.luminance()
    }
}

/// Radiance that varies over the surface.
struct Textured {
    shape: Arc<dyn Shape>,
    radiance: Arc<dyn Texture>,
    /// Sample the texture, not the area.
    by_texture: bool,
    sampling_weight: f32,
}

/// Density per unit area of the surface for one per unit area of texture coordinates.
fn per_area(pdf_uv: f32, hit: &SurfaceHit) -> f32 {
    pdf_uv / hit.dp_du.cross(hit.dp_dv).length()
}

impl Textured {
    /// A point of the surface, with its density per unit area.
    fn sample_surface(&self, u2: Vec2) -> Option<(AreaSample, SurfaceHit)> {
        if self.by_texture {
            let (uv, pdf_uv) = self.radiance.sample_position(u2)?;
            let hit = self.shape.at_uv(uv)?;
            let pdf = per_area(pdf_uv, &hit);
            Some((AreaSample { p: hit.p, p_error: hit.p_error, n: hit.n, uv: hit.uv, pdf }, hit))
        } else {
            let sample = self.shape.sample_area(u2)?;
            let frame = Frame::from_normal(sample.n);
            Some((sample, SurfaceHit { p: sample.p, n: sample.n, frame, uv: sample.uv, ..SurfaceHit::default() }))
        }
    }
}

impl Emitter for Textured {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::SURFACE
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, from: Vec3, u2: Vec2) -> Option<LightSample> {
        let (sample, hit) = self.sample_surface(u2)?;
        let (point, pdf) = sample.as_seen_from(from)?;
        faces(&point).then(|| LightSample {
            point,
            p_error: sample.p_error,
            pdf,
            weight: self.radiance.color(&hit) / pdf,
            delta: false,
        })
    }

    fn pdf_direct(&self, _from: Vec3, point: &LightPoint) -> f32 {
        if !faces(point) {
            return 0.0;
        }
        let pdf = if self.by_texture {
            let Some(hit) = self.shape.at_uv(point.uv) else { return 0.0 };
            per_area(self.radiance.pdf_position(point.uv), &hit)
        } else {
            1.0 / self.shape.area()
        };
        let pdf = pdf * point.distance * point.distance / point.d.dot(point.n).abs();
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    fn radiance(&self, hit: &SurfaceHit) -> Rgb {
        if hit.wi.z > 0.0 { self.radiance.color(hit) } else { Rgb::BLACK }
    }

    fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
        PI * self.shape.area() * self.radiance.mean()
    }
}
