//! What is kept of the samples: weighted sums per pixel, in double precision.

use super::Window;
use crate::color::Rgb;
use crate::image::Image;
use crate::interfaces::{FilmSettings, PixelFormat, Radiance, Rfilter};
use crate::math::{UVec2, Vec2};
use glam::IVec2;

/// Colour, alpha and weight come first in every pixel.
const FIXED: usize = 5;

/// The film while it is rendered: for each pixel the sums of filter weight times value, and of the weights.
///
/// Sums are in double precision: 10⁶ samples drift by less than 10⁻⁹, and the sums of disjoint sample ranges add up.
#[derive(Clone)]
pub struct FilmStore {
    size: UVec2,
    aovs: Vec<String>,
    /// Row by row; each pixel has r, g, b, alpha, weight, then the AOVs.
    sums: Vec<f64>,
}

impl FilmStore {
    /// An empty film. `aovs` names the channels after colour and alpha.
    pub fn new(size: UVec2, aovs: Vec<String>) -> Self {
        let pixels = size.x as usize * size.y as usize;
        let sums = vec![0.0; pixels * (FIXED + aovs.len())];
        FilmStore { size, aovs, sums }
    }

    /// Bytes a film of that size takes.
    pub fn bytes(size: UVec2, aovs: usize) -> u64 {
        u64::from(size.x) * u64::from(size.y) * (FIXED + aovs) as u64 * size_of::<f64>() as u64
    }

    /// Size in pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Names of the channels after colour and alpha.
    pub fn aovs(&self) -> &[String] {
        &self.aovs
    }

    /// All sums.
    pub(super) fn sums(&self) -> &[f64] {
        &self.sums
    }

    /// All sums, to be written over.
    pub(super) fn sums_mut(&mut self) -> &mut [f64] {
        &mut self.sums
    }

    fn stride(&self) -> usize {
        FIXED + self.aovs.len()
    }

    /// Adds another film of the same layout, of disjoint samples.
    pub fn add(&mut self, other: &FilmStore) {
        debug_assert!(self.size == other.size && self.aovs == other.aovs);
        for (sum, more) in self.sums.iter_mut().zip(&other.sums) {
            *sum += more;
        }
    }

    /// Adds another film of the same layout, each pixel (counted row by row) times a factor.
    pub(crate) fn add_weighted(&mut self, other: &FilmStore, factor: impl Fn(usize) -> f64) {
        debug_assert!(self.size == other.size && self.aovs == other.aovs);
        let stride = self.stride();
        let pixels = self.sums.chunks_exact_mut(stride).zip(other.sums.chunks_exact(stride));
        for (pixel, (sums, more)) in pixels.enumerate() {
            let factor = factor(pixel);
            for (sum, more) in sums.iter_mut().zip(more) {
                *sum += factor * more;
            }
        }
    }

    /// Adds one sample to one pixel, as a box filter does.
    #[cfg(test)]
    pub(crate) fn add_sample(&mut self, pixel: UVec2, value: Radiance) {
        let at = (pixel.y as usize * self.size.x as usize + pixel.x as usize) * self.stride();
        let values = [value.rgb.r, value.rgb.g, value.rgb.b, value.alpha, 1.0];
        for (sum, v) in self.sums[at..at + FIXED].iter_mut().zip(values) {
            *sum += f64::from(v);
        }
    }

    pub(crate) fn add_tile(&mut self, tile: &TileStore) {
        let stride = self.stride();
        debug_assert_eq!(stride, tile.stride);
        let min = tile.window.min.max(IVec2::ZERO);
        let max = (tile.window.min + tile.window.size.as_ivec2()).min(self.size.as_ivec2());
        for y in min.y..max.y {
            let count = (max.x - min.x).max(0) as usize * stride;
            let from = tile.offset(IVec2::new(min.x, y));
            let to = (y as usize * self.size.x as usize + min.x as usize) * stride;
            for (sum, more) in self.sums[to..to + count].iter_mut().zip(&tile.sums[from..from + count]) {
                *sum += more;
            }
        }
    }

    /// Radiance and alpha of a pixel; black where no sample counts.
    pub fn pixel(&self, x: u32, y: u32) -> Radiance {
        let at = (y as usize * self.size.x as usize + x as usize) * self.stride();
        let weight = self.sums[at + 4];
        let value = |i: usize| if weight == 0.0 { 0.0 } else { (self.sums[at + i] / weight) as f32 };
        Radiance { rgb: Rgb::new(value(0), value(1), value(2)), alpha: value(3), rays: 0 }
    }

    /// The finished picture, with channels as [`develop`](Self::develop) gives them.
    pub fn picture(&self, film: &FilmSettings) -> Image {
        let (channels, data) = self.develop(film);
        Image { width: self.size.x, height: self.size.y, channels, data }
    }

    /// The values of the finished picture: names of the channels, and interleaved values row by row. Channels are those of the
    /// film's pixel format; if there are AOVs, they follow.
    pub fn develop(&self, film: &FilmSettings) -> (Vec<String>, Vec<f32>) {
        type Append = fn(Radiance, &mut Vec<f32>);
        let (names, colour): (&[&str], Append) = match film.pixel_format {
            PixelFormat::Luminance => (&["Y"], |r, out| out.push(r.rgb.luminance())),
            PixelFormat::LuminanceAlpha => (&["Y", "A"], |r, out| out.extend([r.rgb.luminance(), r.alpha])),
            PixelFormat::Rgb => (&["R", "G", "B"], |r, out| out.extend(r.rgb.to_array())),
            PixelFormat::Rgba => (&["R", "G", "B", "A"], |r, out| {
                out.extend(r.rgb.to_array());
                out.push(r.alpha);
            }),
            PixelFormat::Xyz => (&["X", "Y", "Z"], |r, out| out.extend(r.rgb.to_xyz())),
            PixelFormat::Xyza => (&["X", "Y", "Z", "A"], |r, out| {
                out.extend(r.rgb.to_xyz());
                out.push(r.alpha);
            }),
        };
        let names = names.iter().map(|n| (*n).to_owned()).chain(self.aovs.iter().cloned()).collect::<Vec<_>>();
        let mut data = Vec::with_capacity(names.len() * self.size.x as usize * self.size.y as usize);
        for (i, sums) in self.sums.chunks_exact(self.stride()).enumerate() {
            colour(self.pixel(i as u32 % self.size.x, i as u32 / self.size.x), &mut data);
            let weight = sums[4];
            data.extend(sums[FIXED..].iter().map(|s| if weight == 0.0 { 0.0 } else { (s / weight) as f32 }));
        }
        (names, data)
    }
}

/// The part of the film one tile can reach: its pixels and a border as wide as the filter.
pub(crate) struct TileStore {
    window: Window,
    stride: usize,
    sums: Vec<f64>,
}

impl TileStore {
    pub(crate) fn new(pixels: Window, filter: &dyn Rfilter, aovs: usize) -> Self {
        let border = if filter.is_box() { 0 } else { (filter.radius() - 0.5).ceil().max(0.0) as u32 };
        let window = Window { min: pixels.min - IVec2::splat(border as i32), size: pixels.size + 2 * border };
        let stride = FIXED + aovs;
        TileStore { window, stride, sums: vec![0.0; window.size.x as usize * window.size.y as usize * stride] }
    }

    fn offset(&self, p: IVec2) -> usize {
        let p = p - self.window.min;
        (p.y as usize * self.window.size.x as usize + p.x as usize) * self.stride
    }

    /// Adds a sample at film position `position` (pixels, relative to the crop window) that was taken for `pixel`.
    #[inline]
    pub(crate) fn splat(&mut self, filter: &dyn Rfilter, pixel: IVec2, position: Vec2, value: Radiance, aovs: &[f32]) {
        if filter.is_box() {
            return self.add(pixel, 1.0, value, aovs);
        }
        let radius = filter.radius();
        let last = self.window.min + self.window.size.as_ivec2() - IVec2::ONE;
        let low = (position - radius - 0.5).ceil().as_ivec2().max(self.window.min);
        let high = (position + radius - 0.5).floor().as_ivec2().min(last);
        for y in low.y..=high.y {
            let wy = filter.eval(y as f32 + 0.5 - position.y);
            for x in low.x..=high.x {
                let weight = wy * filter.eval(x as f32 + 0.5 - position.x);
                self.add(IVec2::new(x, y), weight, value, aovs);
            }
        }
    }

    #[inline]
    fn add(&mut self, pixel: IVec2, weight: f32, value: Radiance, aovs: &[f32]) {
        let weight = f64::from(weight);
        let at = self.offset(pixel);
        let sums = &mut self.sums[at..at + self.stride];
        sums[0] += weight * f64::from(value.rgb.r);
        sums[1] += weight * f64::from(value.rgb.g);
        sums[2] += weight * f64::from(value.rgb.b);
        sums[3] += weight * f64::from(value.alpha);
        sums[4] += weight;
        for (sum, aov) in sums[FIXED..].iter_mut().zip(aovs) {
            *sum += weight * f64::from(*aov);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::figures::measured;

    struct Pixel;

    impl Rfilter for Pixel {
        fn radius(&self) -> f32 {
            0.5
        }

        fn eval(&self, _x: f32) -> f32 {
            1.0
        }

        fn is_box(&self) -> bool {
            true
        }
    }

    /// A million samples of a number that has no end in binary, as a tile adds them and as passes do.
    #[test]
    fn hc_x06_a_million_samples_do_not_drift() {
        let window = Window { min: IVec2::ZERO, size: UVec2::ONE };
        let value = Radiance { rgb: Rgb::new(0.1, 1e-6, 12345.678), alpha: 1.0, rays: 0 };
        let mut film = FilmStore::new(UVec2::ONE, Vec::new());
        for _ in 0..1000 {
            let mut tile = TileStore::new(window, &Pixel, 0);
            (0..1000).for_each(|_| tile.splat(&Pixel, IVec2::ZERO, Vec2::splat(0.5), value, &[]));
            film.add_tile(&tile);
        }
        let sums = [value.rgb.r, value.rgb.g, value.rgb.b].map(|v| f64::from(v) * 1e6);
        let drift = (0..3).map(|i| (film.sums[i] / sums[i] - 1.0).abs()).fold(0.0, f64::max);
        measured("hc_x06_a_million_samples_do_not_drift", format!("relative drift {drift:.0e}"));
        assert!(drift < 1e-9, "{drift}");
        assert_eq!(film.pixel(0, 0).rgb, value.rgb);
    }
}
