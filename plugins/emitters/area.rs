//! `area`: a surface that emits light evenly into the half-space in front of it.
//!
//! Nested in a shape; the front is the side of the normal. With the same radiance everywhere the shape samples itself
//! as seen from the lit point. A texture is sampled in proportion to its luminance and its texture coordinates are
//! found on the shape, if they are one to one there; else the shape is sampled evenly by area.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `radiance` | colour or texture | 1 | radiance in W·m⁻²·sr⁻¹ |
//! | `to_world` | transform | identity | an error: the light is where its shape is |
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
use lucerna_core::accel::Geometry;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    AreaSample, ColorSource, Emitter, EmitterFlags, LightBounds, LightPoint, LightSample, Shape, SurfaceHit, Texture,
};
use lucerna_core::math::{Aabb, Frame, Vec2, Vec3};
use lucerna_core::sampling::Pcg32;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties, Slot};
use std::f32::consts::{FRAC_PI_2, PI};
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
        ColorSource::Constant(radiance) => {
            Arc::new(Plain { parts: part_count(&*shape), shape, radiance, sampling_weight })
        }
        ColorSource::Textured(radiance) => {
            let by_texture = is_one_to_one(&*shape);
            let parts = if by_texture { 1 } else { part_count(&*shape) };
            Arc::new(Textured { shape, radiance, by_texture, parts, sampling_weight })
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

/// Triangles that can be sampled apart: those of a mesh. Other shapes are whole, also if they are traced as triangles.
fn part_count(shape: &dyn Shape) -> u32 {
    let has_triangles =
        (0..shape.primitive_count() as u32).any(|i| shape.sample_triangle(i, Vec2::splat(0.5)).is_some());
    if has_triangles { shape.primitive_count() as u32 } else { 1 }
}

/// Bounds of a part of a light that gives off this radiance.
fn part_bounds(shape: &dyn Shape, parts: u32, part: u32, radiance: f32) -> Option<LightBounds> {
    let (bounds, area, (axis, theta_o)) = match (parts, shape.geometry()) {
        (2.., Geometry::Mesh { positions, triangles }) => {
            let corners = triangles.get(part as usize)?.map(|i| positions[i as usize]);
            let sample = shape.sample_triangle(part, Vec2::splat(0.5));
            let (area, n) = sample.map_or((0.0, Vec3::Z), |sample| (1.0 / sample.pdf, sample.n));
            (Aabb::of_points(corners), area, (n, 0.0))
        }
        _ => (shape.bounds(), shape.area(), shape.normal_cone()),
    };
    // Seen from its front a flat light has its whole area, a convex one from anywhere a quarter of it (Cauchy 1832).
    let seen = if theta_o < FRAC_PI_2 { area } else { 0.25 * area };
    Some(LightBounds { bounds, axis, theta_o, theta_e: FRAC_PI_2, intensity: seen * radiance })
}

/// Whether a light point shows its front to the point it is seen from.
fn faces(point: &LightPoint) -> bool {
    point.d.dot(point.n) < 0.0
}

/// The same radiance everywhere.
struct Plain {
    shape: Arc<dyn Shape>,
    parts: u32,
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

    fn part_count(&self) -> u32 {
        self.parts
    }

    fn part_bounds(&self, part: u32) -> Option<LightBounds> {
        part_bounds(&*self.shape, self.parts, part, self.radiance.luminance())
    }

    fn sample_part(&self, part: u32, from: Vec3, u2: Vec2) -> Option<LightSample> {
        if self.parts == 1 {
            return self.sample_direct(from, u2);
        }
        let sample = self.shape.sample_triangle(part, u2)?;
        let (point, pdf) = sample.as_seen_from(from)?;
        let weight = self.radiance / pdf;
        faces(&point).then_some(LightSample { point, p_error: sample.p_error, pdf, weight, delta: false })
    }

    fn pdf_part(&self, part: u32, from: Vec3, point: &LightPoint) -> f32 {
        if self.parts == 1 { self.pdf_direct(from, point) } else { pdf_of_triangle(&*self.shape, part, point) }
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
    /// More than one only where the shape is sampled by area: what belongs to a triangle of a texture is not known.
    parts: u32,
    sampling_weight: f32,
}

/// What a texture needs to know of a sampled point.
fn as_hit(sample: &AreaSample) -> SurfaceHit {
    let frame = Frame::from_normal(sample.n);
    SurfaceHit { p: sample.p, n: sample.n, frame, uv: sample.uv, ..SurfaceHit::default() }
}

/// Density per solid angle of a point of a triangle that is sampled by area.
fn pdf_of_triangle(shape: &dyn Shape, triangle: u32, point: &LightPoint) -> f32 {
    // Any point of the triangle has the same density per area.
    let pdf_area = shape.sample_triangle(triangle, Vec2::splat(0.5)).map_or(0.0, |sample| sample.pdf);
    let pdf = pdf_area * point.distance * point.distance / point.d.dot(point.n).abs();
    if faces(point) && pdf.is_finite() { pdf } else { 0.0 }
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
            let SurfaceHit { p, p_error, n, uv, triangle, .. } = hit;
            Some((AreaSample { p, p_error, n, uv, pdf, triangle }, hit))
        } else {
            let sample = self.shape.sample_area(u2)?;
            Some((sample, as_hit(&sample)))
        }
    }

    fn sample_of(&self, point: LightPoint, sample: &AreaSample, pdf: f32, hit: &SurfaceHit) -> LightSample {
        let weight = self.radiance.color(hit) / pdf;
        LightSample { point, p_error: sample.p_error, pdf, weight, delta: false }
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
        faces(&point).then(|| self.sample_of(point, &sample, pdf, &hit))
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

    fn part_count(&self) -> u32 {
        self.parts
    }

    fn part_bounds(&self, part: u32) -> Option<LightBounds> {
        part_bounds(&*self.shape, self.parts, part, self.radiance.mean())
    }

    fn sample_part(&self, part: u32, from: Vec3, u2: Vec2) -> Option<LightSample> {
        if self.parts == 1 {
            return self.sample_direct(from, u2);
        }
        let sample = self.shape.sample_triangle(part, u2)?;
        let (point, pdf) = sample.as_seen_from(from)?;
        faces(&point).then(|| self.sample_of(point, &sample, pdf, &as_hit(&sample)))
    }

    fn pdf_part(&self, part: u32, from: Vec3, point: &LightPoint) -> f32 {
        if self.parts == 1 { self.pdf_direct(from, point) } else { pdf_of_triangle(&*self.shape, part, point) }
    }

    fn radiance(&self, hit: &SurfaceHit) -> Rgb {
        if hit.wi.z > 0.0 { self.radiance.color(hit) } else { Rgb::BLACK }
    }

    fn power(&self, _scene_center: Vec3, _scene_radius: f32) -> f32 {
        PI * self.shape.area() * self.radiance.mean()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use lucerna_core::accel::{Geometry, Hit, NO_TRIANGLE, Ray};
    use lucerna_core::image;
    use lucerna_core::math::{Aabb, DMat4};

    /// The rectangle of reference/golden_lights.py: 3 × 1, facing −z, with v growing towards −y.
    struct Rectangle {
        /// Whether points are found by their texture coordinates.
        invertible: bool,
    }

    const DP_DU: Vec3 = Vec3::new(3.0, 0.0, 0.0);
    const DP_DV: Vec3 = Vec3::new(0.0, -1.0, 0.0);

    impl Rectangle {
        fn point(uv: Vec2) -> Vec3 {
            DP_DU * (uv.x - 0.5) + DP_DV * (uv.y - 0.5)
        }
    }

    impl Shape for Rectangle {
        fn geometry(&self) -> Geometry<'_> {
            unreachable!("lights do not look at it")
        }

        fn bounds(&self) -> Aabb {
            Aabb::of_points([Self::point(Vec2::ZERO), Self::point(Vec2::ONE)])
        }

        fn area(&self) -> f32 {
            3.0
        }

        fn surface(&self, _ray: &Ray, _hit: &Hit, _into: &mut SurfaceHit) {
            unreachable!("lights do not trace rays")
        }

        fn sample_area(&self, u2: Vec2) -> Option<AreaSample> {
            Some(AreaSample {
                p: Self::point(u2),
                p_error: Vec3::ZERO,
                n: -Vec3::Z,
                uv: u2,
                pdf: 1.0 / 3.0,
                triangle: NO_TRIANGLE,
            })
        }

        fn at_uv(&self, uv: Vec2) -> Option<SurfaceHit> {
            self.invertible.then(|| SurfaceHit {
                p: Self::point(uv),
                n: -Vec3::Z,
                uv,
                dp_du: DP_DU,
                dp_dv: DP_DV,
                ..SurfaceHit::default()
            })
        }
    }

    fn textured(radiance: Arc<dyn Texture>, invertible: bool) -> Textured {
        let shape: Arc<dyn Shape> = Arc::new(Rectangle { invertible });
        let by_texture = is_one_to_one(&*shape);
        assert_eq!(by_texture, invertible);
        Textured { shape, radiance, by_texture, parts: 1, sampling_weight: 1.0 }
    }

    fn plain() -> Plain {
        let shape = Arc::new(Rectangle { invertible: false });
        Plain { shape, parts: 1, radiance: Rgb::new(3.0, 2.0, 1.0), sampling_weight: 1.0 }
    }

    #[test]
    fn samples_as_the_reference() {
        testing::assert_golden(&plain(), "area");
        for filter in ["bilinear", "nearest"] {
            let slide = crate::textures::slide(filter == "nearest");
            testing::assert_golden(&textured(slide, true), &format!("area_{filter}"));
        }
    }

    #[test]
    fn on_real_shapes_as_the_reference() {
        use testing::{float, matrix, rgb, text};
        let axis = lucerna_core::math::DVec3::new(0.6, 0.8, 0.0);
        let turned = DMat4::from_axis_angle(axis, 30f64.to_radians()) * DMat4::from_scale([0.2; 3].into());
        let shapes = [
            ("sphere", vec![float("radius", 0.3)]),
            ("cylinder", vec![float("radius", 0.3)]),
            ("cube", vec![matrix("to_world", turned)]),
        ];
        for (shape, parameters) in shapes {
            let light = testing::light_of((shape, parameters), vec![rgb("radiance", [3.0, 2.0, 1.0])], None);
            testing::assert_golden(&*light, &format!("shape_{shape}"));
        }

        let facing = DMat4::from_rotation_x(std::f64::consts::PI);
        let path = std::env::temp_dir().join(format!("lucerna-slide-{}.pfm", std::process::id()));
        let mut picture = image::Image::new(4, 3, &["R", "G", "B"]);
        picture.data = testing::pattern(4, 3, 3);
        image::write(&path, &picture).unwrap();
        let shapes = [
            ("rectangle", matrix("to_world", facing)),
            ("disk", matrix("to_world", facing)),
            ("sphere", float("radius", 0.3)),
        ];
        let name = path.to_str().unwrap();
        let lights = shapes.map(|(shape, parameter)| {
            (shape, testing::light_of((shape, vec![parameter]), vec![], Some(vec![text("filename", name)])))
        });
        std::fs::remove_file(&path).unwrap();
        for (shape, light) in lights {
            testing::assert_golden(&*light, &format!("slide_{shape}"));
        }
    }

    #[test]
    fn densities_agree_and_the_irradiance_is_the_same_whatever_is_sampled() {
        let from = Vec3::new(0.3, -0.2, -1.0);
        let slide = crate::textures::slide(false);
        let (by_texture, by_area) = (textured(slide.clone(), true), textured(slide, false));
        let lights: [&dyn Emitter; 3] = [&by_texture, &by_area, &plain()];
        let irradiance = lights.map(|light| {
            let mut rng = Pcg32::new(4, 1);
            let mut sum = 0.0;
            const N: usize = 40_000;
            for _ in 0..N {
                let sample = light.sample_direct(from, Vec2::new(rng.next_f32(), rng.next_f32())).unwrap();
                let pdf = light.pdf_direct(from, &sample.point);
                assert!((pdf - sample.pdf).abs() <= 1e-3 * pdf, "{pdf} is not {}", sample.pdf);
                let hit = SurfaceHit { uv: sample.point.uv, ..SurfaceHit::default() };
                let difference = light.radiance(&hit).luminance() - sample.weight.luminance() * sample.pdf;
                assert!(difference.abs() < 1e-4);
                sum += sample.weight.luminance() * sample.point.d.z / N as f32;
            }
            sum
        });
        assert!((irradiance[0] / irradiance[1] - 1.0).abs() < 0.01, "{irradiance:?}");
        // Cosine at the light times area over the square of the distance, from afar.
        let far = Vec3::new(0.0, 0.0, -1000.0);
        let sample = plain().sample_direct(far, Vec2::splat(0.5)).unwrap();
        assert!((sample.weight.r / 3.0 - 3e-6).abs() < 1e-9);
    }

    #[test]
    fn the_back_is_dark() {
        let light = plain();
        let behind = Vec3::new(0.0, 0.0, 1.0);
        assert!(light.sample_direct(behind, Vec2::splat(0.3)).is_none());
        let hit = SurfaceHit { n: -Vec3::Z, ..SurfaceHit::default() };
        let point = LightPoint::of_hit(behind, &hit, -Vec3::Z);
        assert_eq!(light.pdf_direct(behind, &point), 0.0);
        assert!(light.radiance(&SurfaceHit { wi: -Vec3::Z, ..hit }).is_black());
    }

    #[test]
    fn needs_a_shape() {
        assert!(testing::errors("area", vec![]).contains("nested in the shape"));
    }
}
