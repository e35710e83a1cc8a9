//! `envmap`: light from all directions, from a panorama.
//!
//! The picture is in latitude and longitude: its top row is +y, its middle column +z, its left edge −z, and a quarter
//! from the left is +x. It is interpolated bilinearly, around the horizon without a seam; its first and last row lie
//! on the poles. Directions are sampled in proportion to luminance times the sine of the angle to +y, interpolated
//! alike.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `filename` | file name | required | PNG, JPEG, BMP, TGA, PNM, PFM, Radiance or EXR; integers are decoded from sRGB |
//! | `scale` | float | 1 | factor on the radiance |
//! | `mis_compensation` | boolean | false | sample only what is brighter than the mean (Karlík et al. 2019) |
//! | `to_world` | transform | identity | turns or mirrors it; even scales and translations have no effect |
//! | `sampling_weight` | float | 1 | relative chance of being sampled for direct light |
//!
//! A negative texel or one that is not finite is an error. A black picture is never sampled.
//!
//! ```xml
//! <emitter type="envmap">
//!     <string name="filename" value="museum.exr"/>
//!     <transform name="to_world"><rotate y="1" angle="90"/></transform>
//! </emitter>
//! ```

use super::COMMON;
use lucerna_core::color::Rgb;
use lucerna_core::image::{self, PixelData, ReadLimits};
use lucerna_core::interfaces::{Emitter, EmitterFlags, LightPoint, LightSample};
use lucerna_core::math::{Transform, UVec2, Vec2, Vec3};
use lucerna_core::sampling::Bilinear2d;
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "envmap",
    aliases: &[],
    summary: "light from all directions, from a panorama",
    params: &[
        COMMON,
        &[
            Param::file("filename", "panorama in latitude and longitude"),
            Param::float("scale", 1.0, "factor on the radiance").at_least(0.0),
            Param::bool("mis_compensation", false, "sample only what is brighter than the mean"),
            Param::transform("to_world", "turns or mirrors it"),
        ],
    ],
    build: Constructor::Emitter(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    let to_world = p.transform("to_world")?;
    if !to_world.is_similarity() {
        return Err(p.error("to_world", "an environment can be turned, mirrored and scaled evenly, but not distorted"));
    }
    let path = p.file("filename")?;
    let told = |message: String| p.error("filename", format!("\"{}\": {message}", p.string("filename")));
    let picture = image::read(&path, &ReadLimits::default()).map_err(|e| told(e.message))?;
    let options = Options {
        scale: p.float("scale"),
        mis_compensation: p.bool("mis_compensation"),
        to_world,
        sampling_weight: p.float("sampling_weight"),
    };
    Ok(Arc::new(EnvMap::new(&picture, options).map_err(told)?))
}

struct Options {
    scale: f32,
    mis_compensation: bool,
    to_world: Transform,
    sampling_weight: f32,
}

struct EnvMap {
    /// Width and height of the picture.
    size: UVec2,
    /// Radiance, scale included, row by row from the top.
    texels: Vec<Rgb>,
    /// Over the square that starts half a texel to the right of the picture's left edge and ends as much beyond its
    /// right one. `None` if there is nothing to sample.
    distribution: Option<Bilinear2d>,
    /// Mean luminance over the sphere.
    mean: f32,
    to_world: Transform,
    sampling_weight: f32,
}

impl EnvMap {
    /// From a picture of any size; a message if a texel is no radiance.
    fn new(picture: &PixelData, options: Options) -> Result<Self, String> {
        let values = picture.to_f32(false);
        if let Some(i) = values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            let pixel = i / picture.channels as usize;
            let (x, y) = (pixel % picture.width as usize, pixel / picture.width as usize);
            return Err(format!("pixel ({x}, {y}) is {}: radiance must be finite and not negative", values[i]));
        }
        let size = UVec2::new(picture.width, picture.height);
        let texels: Vec<Rgb> = match picture.channels {
            1 => values.iter().map(|v| Rgb::splat(v * options.scale)).collect(),
            n => values.chunks_exact(n as usize).map(|c| Rgb::new(c[0], c[1], c[2]) * options.scale).collect(),
        };
        let (size, texels) = with_three_rows(size, texels);
        let luminance: Vec<f32> = texels.iter().map(|c| c.luminance()).collect();
        let offset = if options.mis_compensation { compensation(&luminance) } else { 0.0 };
        let (mut nodes, mut sum, mut sines) = (Vec::with_capacity(luminance.len() + size.y as usize), 0.0f64, 0.0f64);
        for (y, row) in luminance.chunks_exact(size.x as usize).enumerate() {
            // Rounding makes the sine of π slightly negative.
            let sin_theta = (y as f32 * (PI / (size.y - 1) as f32)).sin().max(0.0);
            sum += row.iter().map(|l| f64::from(l * sin_theta)).sum::<f64>();
            sines += f64::from(sin_theta) * f64::from(size.x);
            nodes.extend(row.iter().chain(&row[..1]).map(|l| (l - offset).max(0.0) * sin_theta));
        }
        let distribution = Bilinear2d::new(UVec2::new(size.x + 1, size.y), nodes);
        let mean = (sum / sines) as f32;
        Ok(EnvMap {
            size,
            sampling_weight: options.sampling_weight,
            texels,
            distribution,
            mean,
            to_world: options.to_world,
        })
    }

    /// Radiance at texture coordinates, `u` counted from the middle of the first column.
    fn lookup(&self, uv: Vec2) -> Rgb {
        let UVec2 { x: width, y: height } = self.size;
        let p = wrapped(uv) * Vec2::new(width as f32, (height - 1) as f32);
        let (x, y) = ((p.x as u32).min(width - 1), (p.y as u32).min(height - 2));
        let t = p - Vec2::new(x as f32, y as f32);
        let next = if x + 1 == width { 0 } else { x + 1 };
        let texel = |x: u32, y: u32| self.texels[y as usize * width as usize + x as usize];
        let row = |y: u32| texel(x, y) * (1.0 - t.x) + texel(next, y) * t.x;
        row(y) * (1.0 - t.y) + row(y + 1) * t.y
    }

    fn half_texel(&self) -> f32 {
        0.5 / self.size.x as f32
    }

    /// Texture coordinates of a local direction, `u` counted from the middle of the first column.
    fn uv_of(&self, d: Vec3) -> Vec2 {
        let u = d.x.atan2(-d.z) * (0.5 * FRAC_1_PI) - self.half_texel();
        // Not the arc cosine of y, of which little is left near the poles, where the density depends on it.
        let theta = (d.x * d.x + d.z * d.z).sqrt().atan2(d.y);
        Vec2::new(u, theta * FRAC_1_PI)
    }

    fn to_local(&self, d: Vec3) -> Vec3 {
        self.to_world.inverse_vector(d).normalize_or(Vec3::Y)
    }
}

/// The same place with `u` in [0, 1): it goes around, while `v` ends at the poles.
fn wrapped(uv: Vec2) -> Vec2 {
    Vec2::new(uv.x - uv.x.floor(), uv.y)
}

/// Repeats and interpolates rows where there are fewer than three. The picture looks the same, and there is a row
/// that is not on a pole.
fn with_three_rows(size: UVec2, texels: Vec<Rgb>) -> (UVec2, Vec<Rgb>) {
    if size.y >= 3 {
        return (size, texels);
    }
    let (first, last) = (&texels[..size.x as usize], &texels[texels.len() - size.x as usize..]);
    let middle = first.iter().zip(last).map(|(a, b)| (*a + *b) * 0.5);
    let rows = first.iter().copied().chain(middle).chain(last.iter().copied()).collect();
    (UVec2::new(size.x, 3), rows)
}

/// What is taken off the luminance so that only what is brighter than the mean is sampled (Karlík et al. 2019, "MIS
/// compensation", section 4.4); nothing where the picture is nearly uniform.
fn compensation(luminance: &[f32]) -> f32 {
    let mean = (luminance.iter().map(|l| f64::from(*l)).sum::<f64>() / luminance.len() as f64) as f32;
    let min = luminance.iter().copied().fold(f32::INFINITY, f32::min);
    if mean - min <= 0.01 * mean { 0.0 } else { mean }
}

/// `∂(u, v)/∂ω` without the sine: from densities over the picture to densities over the sphere.
const PER_STERADIAN: f32 = 0.5 * FRAC_1_PI * FRAC_1_PI;

impl Emitter for EnvMap {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::ENVIRONMENT
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, _from: Vec3, u2: Vec2) -> Option<LightSample> {
        let (uv, pdf) = self.distribution.as_ref()?.sample(u2);
        let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
        let (sin_phi, cos_phi) = ((uv.x + self.half_texel()) * TAU).sin_cos();
        let d = Vec3::new(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta);
        let pdf = pdf * PER_STERADIAN / sin_theta.max(0.5 * f32::EPSILON);
        let weight = self.lookup(uv) / pdf;
        (pdf > 0.0 && weight.is_finite()).then(|| LightSample {
            point: LightPoint::of_environment(self.to_world.vector(d).normalize()),
            p_error: Vec3::ZERO,
            pdf,
            weight,
            delta: false,
        })
    }

    fn pdf_direct(&self, _from: Vec3, point: &LightPoint) -> f32 {
        let Some(distribution) = &self.distribution else { return 0.0 };
        let d = self.to_local(point.d);
        let uv = self.uv_of(d);
        let sin_theta = (d.x * d.x + d.z * d.z).sqrt().max(0.5 * f32::EPSILON);
        distribution.pdf(wrapped(uv)) * PER_STERADIAN / sin_theta
    }

    fn background(&self, d: Vec3) -> Rgb {
        self.lookup(self.uv_of(self.to_local(d)))
    }

    fn power(&self, _scene_center: Vec3, scene_radius: f32) -> f32 {
        4.0 * PI * PI * scene_radius * scene_radius * self.mean
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use lucerna_core::image::Samples;
    use lucerna_core::math::DMat4;

    fn picture(width: u32, height: u32, channels: u32, values: Vec<f32>) -> PixelData {
        PixelData { width, height, channels, samples: Samples::F32(values), alpha: None, srgb: false }
    }

    fn options() -> Options {
        Options { scale: 1.0, mis_compensation: false, to_world: Transform::default(), sampling_weight: 1.0 }
    }

    /// The picture of reference/golden_lights.py.
    fn example() -> PixelData {
        picture(6, 5, 3, testing::pattern(6, 5, 3))
    }

    #[test]
    fn samples_as_the_reference() {
        let turn = DMat4::from_rotation_y(0.5) * DMat4::from_rotation_x(1.0);
        let turned = Options { scale: 2.5, to_world: Transform::new(turn).unwrap(), ..options() };
        let compensated = Options { mis_compensation: true, ..options() };
        let cases = [("envmap", options()), ("envmap_turned", turned), ("envmap_compensated", compensated)];
        for (name, options) in cases {
            let light = EnvMap::new(&example(), options).unwrap();
            testing::assert_golden(&light, name);
        }
    }

    #[test]
    fn axes() {
        // Four columns, three rows; the middle row holds its column's number.
        let mut values = vec![0.0; 12];
        values[4..8].copy_from_slice(&[0.0, 1.0, 2.0, 3.0]);
        values[..4].fill(10.0);
        values[8..].fill(20.0);
        let light = EnvMap::new(&picture(4, 3, 1, values), options()).unwrap();
        let golden =
            [(Vec3::Y, 10.0), (-Vec3::Y, 20.0), (Vec3::X, 0.5), (Vec3::Z, 1.5), (-Vec3::X, 2.5), (-Vec3::Z, 1.5)];
        for (d, expected) in golden {
            assert!((light.background(d).r - expected).abs() < 1e-5, "{d}: {}", light.background(d).r);
        }
    }

    #[test]
    fn hc_e01_black_is_never_chosen() {
        let light = EnvMap::new(&picture(4, 4, 1, vec![0.0; 16]), options()).unwrap();
        // The scene picks no light without power.
        assert_eq!(light.power(Vec3::ZERO, 1.0), 0.0);
        assert!(light.sample_direct(Vec3::ZERO, Vec2::splat(0.5)).is_none());
        assert_eq!(light.pdf_direct(Vec3::ZERO, &LightPoint::of_environment(Vec3::X)), 0.0);
    }

    #[test]
    fn hc_e01_what_is_no_radiance_is_told_with_its_pixel() {
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            let mut values = vec![1.0; 5 * 4 * 3];
            values[(2 * 5 + 3) * 3 + 1] = bad;
            let message = EnvMap::new(&picture(5, 4, 3, values), options()).err().unwrap();
            assert!(message.contains("pixel (3, 2)"), "{message}");
        }
    }
}
