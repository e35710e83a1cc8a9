//! `bitmap`: a picture.
//!
//! (0, 0) is the upper left corner of the picture and (1, 1) the lower right one. 8-bit pictures are decoded from
//! sRGB before they are interpolated. A picture of one channel gives the same value in all channels; in a scalar slot
//! a picture of three gives its luminance. Opacity is left out.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `filename` | file name | required | PNG, JPEG, BMP, TGA, PNM, PFM, Radiance or EXR |
//! | `raw` | boolean | false | take values as they are, without decoding sRGB: for normals, roughness and such |
//! | `filter_type` | bilinear, nearest | bilinear | how texels are interpolated |
//! | `wrap_mode` | repeat, mirror, clamp | repeat | what is outside of [0, 1] |
//! | `to_uv` | transform | identity | applied to texture coordinates; x and y of the transform count |
//! | `format` | auto, variant, float16, fp16, uint8 | auto | how texels are kept; `auto` and `uint8` as in the file |
//! | `accel` | anything | | accepted, without effect |
//!
//! A texel that is not finite is an error. As a textured light, texels are sampled in proportion to their luminance,
//! unless `to_uv` is set; then texture coordinates are sampled evenly.
//!
//! ```xml
//! <texture type="bitmap">
//!     <string name="filename" value="wood.jpg"/>
//!     <string name="wrap_mode" value="mirror"/>
//! </texture>
//! ```

mod texels;

use super::UvTransform;
use lucerna_core::color::Rgb;
use lucerna_core::image::{self, ReadLimits};
use lucerna_core::interfaces::{SurfaceHit, Texture};
use lucerna_core::math::{IVec2, UVec2, Vec2, lerp};
use lucerna_core::sampling::{Discrete2d, warp};
use lucerna_core::scene::{Built, Constructor, Param, Plugin, Properties};
use std::sync::{Arc, OnceLock};
use texels::{Format, Texels};

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "bitmap",
    aliases: &[],
    summary: "a picture",
    params: &[&[
        Param::file("filename", "the picture"),
        Param::bool("raw", false, "take values as they are, without decoding sRGB"),
        Param::choice("filter_type", &["bilinear", "nearest"], "bilinear", "how texels are interpolated"),
        Param::choice("wrap_mode", &["repeat", "mirror", "clamp"], "repeat", "what is outside of [0, 1]"),
        Param::transform("to_uv", "applied to texture coordinates"),
        Param::choice("format", &["auto", "variant", "float16", "fp16", "uint8"], "auto", "how texels are kept"),
        Param::ignored("accel", "hint for the reference renderer"),
    ]],
    build: Constructor::Texture(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Texture> {
    let path = p.file("filename")?;
    let told = |message: String| p.error("filename", format!("\"{}\": {message}", p.string("filename")));
    let picture = image::read(&path, &ReadLimits::default()).map_err(|e| told(e.message))?;
    let format = match p.choice("format") {
        "variant" => Format::Single,
        "float16" | "fp16" => Format::Half,
        _ => Format::Auto,
    };
    let texels = Texels::new(picture, p.bool("raw"), format).map_err(told)?;
    let filter = if p.choice("filter_type") == "nearest" { Filter::Nearest } else { Filter::Bilinear };
    let wrap = match p.choice("wrap_mode") {
        "mirror" => Wrap::Mirror,
        "clamp" => Wrap::Clamp,
        _ => Wrap::Repeat,
    };
    Ok(Arc::new(Bitmap::new(texels, filter, wrap, UvTransform::new(p.matrix("to_uv")))))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Filter {
    Bilinear,
    Nearest,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

impl Wrap {
    /// The texel that stands at index `i` of `n`, which may be outside.
    #[inline]
    fn index(self, i: i32, n: u32) -> u32 {
        if (i as u32) < n {
            return i as u32;
        }
        let n = i64::from(n);
        let i = i64::from(i);
        let wrapped = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n);
                i.min(2 * n - 1 - i)
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        wrapped as u32
    }
}

struct Bitmap {
    texels: Texels,
    filter: Filter,
    wrap: Wrap,
    to_uv: UvTransform,
    mean: f32,
    /// Smallest and largest value in any channel.
    range: [f32; 2],
    /// Made when a light first asks for it. `None` inside if the picture is black.
    distribution: OnceLock<Option<Discrete2d>>,
}

/// Where a bilinear lookup falls: the upper left of four texels and the weights of the right and lower ones.
struct Footprint {
    texel: IVec2,
    t: Vec2,
}

impl Bitmap {
    fn new(texels: Texels, filter: Filter, wrap: Wrap, to_uv: UvTransform) -> Self {
        let (mean, range) = (texels.mean(), texels.range());
        Bitmap { texels, filter, wrap, to_uv, mean, range, distribution: OnceLock::new() }
    }

    /// Position in texels; with `shift` of a half, counted from the centre of the first. Finite for any input.
    #[inline]
    fn position(&self, uv: Vec2, shift: f32) -> Vec2 {
        // Rounded once, at the end, as the reference renderer does: in large pictures it shows.
        let p = (uv.as_dvec2() * self.texels.size.as_dvec2() - f64::from(shift)).as_vec2();
        if p.is_finite() { p } else { Vec2::ZERO }
    }

    fn footprint(&self, uv: Vec2) -> Footprint {
        let p = self.position(uv, 0.5);
        let floor = p.floor();
        // The cast ends at the largest integers, far beyond where single precision has any fraction left.
        Footprint { texel: floor.as_ivec2(), t: p - floor }
    }

    #[inline]
    fn wrapped(&self, texel: IVec2) -> UVec2 {
        let UVec2 { x, y } = self.texels.size;
        UVec2::new(self.wrap.index(texel.x, x), self.wrap.index(texel.y, y))
    }

    fn nearest(&self, uv: Vec2) -> UVec2 {
        self.wrapped(self.position(uv, 0.0).floor().as_ivec2())
    }

    /// The four texels of a footprint: upper left, upper right, lower left, lower right.
    #[inline]
    fn corners<T>(&self, at: &Footprint, value: impl Fn(u32, u32) -> T) -> [T; 4] {
        let UVec2 { x: x0, y: y0 } = self.wrapped(at.texel);
        let UVec2 { x: x1, y: y1 } = self.wrapped(at.texel.saturating_add(IVec2::ONE));
        [value(x0, y0), value(x1, y0), value(x0, y1), value(x1, y1)]
    }

    fn distribution(&self) -> Option<&Discrete2d> {
        let make = || Discrete2d::new(self.texels.size, self.texels.scalars().map(|v| v.max(0.0)));
        self.distribution.get_or_init(make).as_ref()
    }
}

#[inline]
fn bilinear([v00, v10, v01, v11]: [f32; 4], t: Vec2) -> f32 {
    lerp(lerp(v00, v10, t.x), lerp(v01, v11, t.x), t.y)
}

impl Texture for Bitmap {
    fn color(&self, hit: &SurfaceHit) -> Rgb {
        if self.texels.is_grey() {
            return Rgb::splat(self.scalar(hit));
        }
        let uv = self.to_uv.apply(hit.uv);
        match self.filter {
            Filter::Nearest => {
                let texel = self.nearest(uv);
                self.texels.color(texel.x, texel.y)
            }
            Filter::Bilinear => {
                let at = self.footprint(uv);
                let [v00, v10, v01, v11] = self.corners(&at, |x, y| self.texels.color(x, y));
                let upper = v00 * (1.0 - at.t.x) + v10 * at.t.x;
                let lower = v01 * (1.0 - at.t.x) + v11 * at.t.x;
                upper * (1.0 - at.t.y) + lower * at.t.y
            }
        }
    }

    fn scalar(&self, hit: &SurfaceHit) -> f32 {
        if !self.texels.is_grey() {
            return self.color(hit).luminance();
        }
        let uv = self.to_uv.apply(hit.uv);
        match self.filter {
            Filter::Nearest => {
                let texel = self.nearest(uv);
                self.texels.scalar(texel.x, texel.y)
            }
            Filter::Bilinear => {
                let at = self.footprint(uv);
                bilinear(self.corners(&at, |x, y| self.texels.scalar(x, y)), at.t)
            }
        }
    }

    fn gradient(&self, hit: &SurfaceHit) -> Vec2 {
        if self.filter == Filter::Nearest {
            return Vec2::ZERO;
        }
        let at = self.footprint(self.to_uv.apply(hit.uv));
        let [v00, v10, v01, v11] = self.corners(&at, |x, y| self.texels.scalar(x, y));
        let per_texel = Vec2::new(lerp(v10 - v00, v11 - v01, at.t.y), lerp(v01 - v00, v11 - v10, at.t.x));
        self.to_uv.pull_back(per_texel * self.texels.size.as_vec2())
    }

    fn mean(&self) -> f32 {
        self.mean
    }

    fn maximum(&self) -> Option<f32> {
        Some(self.range[1])
    }

    fn minimum(&self) -> Option<f32> {
        Some(self.range[0])
    }

    fn sample_position(&self, u2: Vec2) -> Option<(Vec2, f32)> {
        if !self.to_uv.is_identity() {
            return Some((u2, 1.0));
        }
        let (texel, _, rest) = self.distribution()?.sample(u2);
        let size = self.texels.size.as_vec2();
        let uv = match self.filter {
            Filter::Nearest => (texel.as_vec2() + rest) / size,
            Filter::Bilinear => {
                // A bilinear lookup spreads each texel over a tent; what is beyond the border belongs to the other
                // side, or is folded back onto the texel itself.
                let tent = Vec2::new(warp::interval_to_tent(rest.x), warp::interval_to_tent(rest.y));
                let fold = |v: f32| match self.wrap {
                    Wrap::Repeat if v < 0.0 => v + 1.0,
                    Wrap::Repeat if v > 1.0 => v - 1.0,
                    Wrap::Mirror | Wrap::Clamp if v < 0.0 => -v,
                    Wrap::Mirror | Wrap::Clamp if v > 1.0 => 2.0 - v,
                    _ => v,
                };
                let uv = (texel.as_vec2() + 0.5 + tent) / size;
                Vec2::new(fold(uv.x), fold(uv.y))
            }
        };
        let pdf = self.pdf_position(uv);
        (pdf > 0.0).then_some((uv, pdf))
    }

    fn pdf_position(&self, uv: Vec2) -> f32 {
        if !self.to_uv.is_identity() {
            return 1.0;
        }
        let Some(distribution) = self.distribution() else { return 0.0 };
        let pmf = match self.filter {
            Filter::Nearest => distribution.pmf(self.nearest(uv)),
            Filter::Bilinear => {
                let at = self.footprint(uv);
                bilinear(self.corners(&at, |x, y| distribution.pmf(UVec2::new(x, y))), at.t)
            }
        };
        pmf * (self.texels.size.x as f32 * self.texels.size.y as f32)
    }
}

#[cfg(test)]
pub(super) mod tests;
