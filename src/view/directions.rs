//! What a guide has learnt at points of a scene, as a picture: for each point where it lies, the density of directions
//! that come from the guide, and that of the mixture with the BSDF that paths are drawn from; without the part that goes
//! to the environment where glass or masks hide it.
//!
//! Directions are mapped to a rectangle by azimuth (to the right, 0 to 360° about z from x towards y) and the cosine
//! with the z axis (upwards, −1 to 1), which keeps areas. Colours are densities over that of a uniform direction, 1/4π,
//! on a logarithmic scale.

use super::letters::{self, LINE, STEP};
use lucerna_core::image::{Image, srgb_to_linear};
use lucerna_core::interfaces::{
    Arena, GuideField, GuidedVertex, MOST_GUIDED, Sensor, SurfaceHit, Transport, is_guided,
};
use lucerna_core::math::{UVec2, Vec2, Vec3};
use lucerna_core::scene::Scene;
use std::f32::consts::{PI, TAU};

/// Size of a map in pixels.
const MAP: [u32; 2] = [320, 160];
/// Space on the left of a map, for its axis.
const LEFT: u32 = 28;
/// Space around all.
const MARGIN: u32 = 10;
/// Points along each edge of a pixel of a map.
const POINTS: u32 = 2;
/// Orders of magnitude that colours span.
const DECADES: f32 = 4.0;

/// What was learnt, in what.
pub struct Learned<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The camera that pixels belong to.
    pub sensor: &'a dyn Sensor,
    /// Size of its film in pixels.
    pub size: UVec2,
    /// The field.
    pub field: &'a dyn GuideField,
    /// Narrower lobes than this are not guided.
    pub least_roughness: f32,
}

/// The directions at a point. Densities are those of uniform directions times this.
pub struct Place {
    /// The pixel through whose centre the point is seen.
    pub pixel: UVec2,
    /// The point; `None` if nothing is seen there.
    pub hit: Option<Vec3>,
    /// Probability of the guide; `None` where paths are not guided.
    pub p_guide: Option<f32>,
    /// Where the guide's density is highest, and that.
    pub peak: Option<(Vec3, f32)>,
    /// The map of the guide's density, row by row from the top; empty if there is none.
    guide: Vec<f32>,
    /// That of the mixture, or of the BSDF alone where paths are not guided.
    mixture: Vec<f32>,
    /// Directions that are marked, with a letter.
    marks: Vec<(char, Vec3)>,
}

/// The direction at a point of a map, in [0, 1)² from the upper left.
fn direction(p: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * p.y;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * p.x).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// The point of a map where a direction lies.
fn position(d: Vec3) -> Vec2 {
    let turn = d.y.atan2(d.x) / TAU;
    Vec2::new(if turn < 0.0 { turn + 1.0 } else { turn }, 0.5 - 0.5 * d.z)
}

/// The mean of a density over each pixel of a map, times 4π.
fn map(density: impl Fn(Vec3) -> f32) -> Vec<f32> {
    let [width, height] = MAP;
    let step = 1.0 / POINTS as f32;
    let mean = |x: u32, y: u32| {
        let points = (0..POINTS * POINTS).map(|i| Vec2::new((i % POINTS) as f32 + 0.5, (i / POINTS) as f32 + 0.5));
        let at = |p: Vec2| (Vec2::new(x as f32, y as f32) + p * step) / Vec2::new(width as f32, height as f32);
        points.map(|p| density(direction(at(p)))).sum::<f32>() * step * step * 4.0 * PI
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect()
}

impl Learned<'_> {
    /// Looks at the point that is seen through the centre of a pixel.
    pub fn look(&self, pixel: UVec2) -> Place {
        let mut place = Place {
            pixel,
            hit: None,
            p_guide: None,
            peak: None,
            guide: Vec::new(),
            mixture: Vec::new(),
            marks: Vec::new(),
        };
        let mut hit = SurfaceHit::default();
        if !self.find(pixel.as_vec2() + 0.5, &mut hit) {
            return place;
        }
        let arena = Arena::new();
        let bxdf = self.scene.bsdf(&hit).resolve(&hit, &arena);
        let lobes = bxdf.lobes();
        let guided = self.field.guides() && is_guided(bxdf, lobes, self.least_roughness);
        let vertex = GuidedVertex { one_sided: lobes.is_one_sided(), primary: true };
        let guide = self.field.at(self.field.cell(hit.p), &hit, vertex, &arena);
        let p_guide = guide.filter(|_| guided).map_or(0.0, |guide| guide.p_guide().clamp(0.0, MOST_GUIDED));
        let of_bsdf = |d: Vec3| bxdf.eval_pdf(hit.wi, hit.to_local(d), Transport::Radiance).1;
        if let Some(guide) = guide {
            place.guide = map(|d| guide.pdf(d));
            let highest = place.guide.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            place.peak = highest.map(|(index, density)| {
                let (x, y) = (index as u32 % MAP[0], index as u32 / MAP[0]);
                (
                    direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / Vec2::new(MAP[0] as f32, MAP[1] as f32)),
                    *density,
                )
            });
        }
        let of_guide = |d: Vec3| guide.map_or(0.0, |guide| if p_guide > 0.0 { guide.pdf(d) } else { 0.0 });
        place.mixture = map(|d| p_guide * of_guide(d) + (1.0 - p_guide) * of_bsdf(d));
        place.p_guide = (p_guide > 0.0).then_some(p_guide);
        place.hit = Some(hit.p);
        place.marks = vec![('N', hit.frame.n), ('E', hit.to_world(hit.wi))];
        place
    }

    /// What is seen through a point of the film, in pixels.
    fn find(&self, film: Vec2, hit: &mut SurfaceHit) -> bool {
        let camera = self.sensor.ray(film / self.size.as_vec2(), Vec2::splat(0.5));
        self.scene.find_surface(&camera.ray, hit)
    }

    /// A small picture of the scene, lit from the camera.
    fn preview(&self, width: u32, height: u32) -> Vec<[f32; 3]> {
        let (mut hit, mut arena) = (SurfaceHit::default(), Arena::new());
        let mut pixels = Vec::new();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let inside = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / Vec2::new(width as f32, height as f32);
            pixels.push(match self.find(inside * self.size.as_vec2(), &mut hit) {
                false => [0.1; 3],
                true if self.scene.emitter_at(&hit).is_some() => [1.0; 3],
                true => {
                    let albedo = self.scene.bsdf(&hit).resolve(&hit, &arena).albedo(hit.wi);
                    let shade = 0.15 + 0.6 * hit.wi.z.abs();
                    albedo.to_array().map(|c| shade * (0.1 + 0.9 * c.clamp(0.0, 1.0)))
                }
            });
            arena.reset();
        }
        pixels
    }

    /// All places side by side.
    pub fn picture(&self, places: &[Place]) -> Image {
        let preview = [MAP[0], (MAP[0] * self.size.y / self.size.x.max(1)).clamp(32, MAP[0])];
        let line = LINE + 2;
        let block = line + MAP[1] + line + MARGIN;
        let column = LEFT + MAP[0] + 2 * MARGIN;
        let height = 2 * MARGIN + line + preview[1] + MARGIN + 2 * block + 2 * line + MARGIN;
        let mut canvas = Canvas::new(column * places.len().max(1) as u32, height);
        let seen = self.preview(preview[0], preview[1]);
        let highest = places
            .iter()
            .flat_map(|place| place.guide.iter().chain(&place.mixture))
            .fold(10.0, |a: f32, b| if b.is_finite() { a.max(*b) } else { a });
        let top = highest.log10().ceil();
        for (number, place) in places.iter().enumerate() {
            let left = number as u32 * column + MARGIN + LEFT;
            let mut y = MARGIN;
            let (px, py) = (place.pixel.x, place.pixel.y);
            let title = match (place.hit, place.p_guide) {
                (None, _) => format!("pixel {px},{py}: nothing is seen"),
                (_, Some(p)) => format!("pixel {px},{py}: guided with p={p:.2}"),
                (_, None) => format!("pixel {px},{py}: not guided"),
            };
            canvas.text(left, y, &title);
            y += line;
            canvas.block(left, y, preview, |x, y| seen[(y * preview[0] + x) as usize]);
            let scale = preview[0] as f32 / self.size.x as f32;
            let [mx, my] = [(px as f32 + 0.5) * scale, (py as f32 + 0.5) * preview[1] as f32 / self.size.y as f32];
            canvas.cross(left + (mx as u32).min(preview[0] - 1), y + (my as u32).min(preview[1] - 1), None);
            y += preview[1] + MARGIN;
            let mixture = if place.p_guide.is_some() { "guide and BSDF" } else { "BSDF alone" };
            for (name, values) in [("guide alone", &place.guide), (mixture, &place.mixture)] {
                canvas.text(left, y, name);
                canvas.map([left, y + line], values, top, &place.marks);
                y += block;
            }
        }
        canvas.legend(MARGIN + LEFT, height - MARGIN - 2 * line, top);
        canvas.0
    }
}

/// A picture that is drawn on, in linear sRGB.
struct Canvas(Image);

/// Colours of the scale, in sRGB, at even distances.
const SCALE: [[f32; 3]; 6] = [
    [0.03, 0.03, 0.12],
    [0.20, 0.08, 0.42],
    [0.55, 0.10, 0.45],
    [0.88, 0.30, 0.25],
    [0.99, 0.68, 0.20],
    [1.00, 0.99, 0.80],
];
const PAPER: [f32; 3] = [0.93; 3];
const INK: [f32; 3] = [0.0; 3];
const MARK: [f32; 3] = [0.1, 1.0, 0.5];
/// Where the density is 0.
const NOTHING: [f32; 3] = [0.35; 3];

/// The colour of a density over a uniform one; the scale ends at ten to the power of `top`.
fn color(density: f32, top: f32) -> [f32; 3] {
    if density.is_nan() || density <= 0.0 {
        return NOTHING.map(srgb_to_linear);
    }
    let t = ((density.log10() - top) / DECADES + 1.0).clamp(0.0, 1.0) * (SCALE.len() - 1) as f32;
    let index = (t as usize).min(SCALE.len() - 2);
    let part = t - index as f32;
    std::array::from_fn(|c| srgb_to_linear(SCALE[index][c] * (1.0 - part) + SCALE[index + 1][c] * part))
}

impl Canvas {
    fn new(width: u32, height: u32) -> Self {
        let mut image = Image::new(width, height, &["R", "G", "B"]);
        let paper = PAPER.map(srgb_to_linear);
        image.data.as_chunks_mut::<3>().0.fill(paper);
        Canvas(image)
    }

    fn set(&mut self, x: u32, y: u32, value: [f32; 3]) {
        if x < self.0.width && y < self.0.height {
            let at = (y as usize * self.0.width as usize + x as usize) * 3;
            self.0.data[at..at + 3].copy_from_slice(&value);
        }
    }

    fn block(&mut self, left: u32, top: u32, [width, height]: [u32; 2], value: impl Fn(u32, u32) -> [f32; 3]) {
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            self.set(left + x, top + y, value(x, y));
        }
    }

    fn text(&mut self, left: u32, top: u32, text: &str) {
        for (x, y) in letters::dots(text) {
            self.set(left + x, top + y, INK);
        }
    }

    /// Text that ends there.
    fn text_before(&mut self, right: u32, top: u32, text: &str) {
        let width = STEP * text.chars().count() as u32;
        self.text(right.saturating_sub(width), top, text);
    }

    /// A cross that leaves its middle free, with a letter beside it.
    fn cross(&mut self, x: u32, y: u32, letter: Option<char>) {
        let mark = MARK.map(srgb_to_linear);
        for i in 2..6 {
            for (dx, dy) in [(i, 0), (-i, 0), (0, i), (0, -i)] {
                self.set(x.wrapping_add_signed(dx), y.wrapping_add_signed(dy), mark);
            }
        }
        for (dx, dy) in letter.map_or_else(Vec::new, |letter| letters::dots(&letter.to_string())) {
            self.set(x + 5 + dx, y + 4 + dy, mark);
        }
    }

    /// A map with its axes and marks.
    fn map(&mut self, [left, top]: [u32; 2], values: &[f32], highest: f32, marks: &[(char, Vec3)]) {
        let [width, height] = MAP;
        let value = |x: u32, y: u32| values.get((y * width + x) as usize).copied();
        self.block(left, top, MAP, |x, y| value(x, y).map_or(PAPER.map(|c| 0.6 * c), |v| color(v, highest)));
        for (number, z) in ["1", "0", "-1"].into_iter().enumerate() {
            let y = top + number as u32 * (height - LINE) / 2;
            self.text_before(left - 4, y, z);
        }
        self.text_before(left - 4, top + height / 4, "cos");
        for turn in 0..=4 {
            let text = format!("{}°", 90 * turn);
            let (x, wide) = (left + turn * width / 4, STEP * text.chars().count() as u32);
            self.block(x.min(left + width - 1), top + height, [1, 3], |_, _| INK);
            // The first begins at its place, the last ends there.
            self.text(x - turn * wide / 4, top + height + 4, &text);
        }
        for (letter, d) in marks.iter().filter(|_| !values.is_empty()) {
            let p = position(*d) * Vec2::new(width as f32, height as f32);
            self.cross(left + (p.x as u32).min(width - 1), top + (p.y as u32).min(height - 1), Some(*letter));
        }
    }

    /// The scale of colours.
    fn legend(&mut self, left: u32, top: u32, highest: f32) {
        let width = MAP[0];
        self.block(left, top, [width, 10], |x, _| {
            color(10f32.powf(highest + DECADES * ((x as f32 + 0.5) / width as f32 - 1.0)), highest)
        });
        for decade in 0..=DECADES as u32 {
            let text = format!("{}", 10f32.powf(highest - DECADES + decade as f32));
            let wide = STEP * text.chars().count() as u32;
            let x = left + decade * width / DECADES as u32;
            self.text(x - decade * wide / DECADES as u32, top + 13, &text);
        }
        self.text(left + width + 8, top, "times uniform");
        self.text(left + width + 8, top + 13, "N normal  E eye");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_their_place() {
        for (x, y) in (0..9).flat_map(|y| (0..9).map(move |x| (x, y))) {
            let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / 9.0;
            assert!((position(direction(p)) - p).abs().max_element() < 1e-5, "{p}");
        }
        assert!(position(Vec3::Z).y == 0.0 && position(Vec3::Y).abs_diff_eq(Vec2::new(0.25, 0.5), 1e-6));
    }

    /// A map has the mean of its density: 1 for one that integrates to one.
    #[test]
    fn maps_keep_areas() {
        let of_lambert = map(|d| d.z.max(0.0) / PI);
        let mean = of_lambert.iter().sum::<f32>() / of_lambert.len() as f32;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
        assert!(of_lambert[0] > 3.9 && of_lambert[of_lambert.len() - 1] == 0.0, "up is up");
    }

    #[test]
    fn colours_rise_and_end() {
        assert_eq!(color(1e9, 2.0), color(100.0, 2.0));
        assert_eq!(color(1e-9, 2.0), color(0.01, 2.0));
        assert!(color(0.0, 2.0) == color(f32::NAN, 2.0) && color(0.0, 2.0) != color(1e-9, 2.0));
        let brightness = |density: f32| color(density, 2.0).iter().sum::<f32>();
        assert!(
            (-20..20).all(|i| brightness(10f32.powf(0.1 * i as f32)) < brightness(10f32.powf(0.1 * i as f32 + 0.1)))
        );
    }
}
