//! Textures: means and bounds, positions that follow their density, slopes, and finite values everywhere.

use crate::support::{
    assert_every_plugin_is_configured, assert_found, assert_none, close, failures, part, plugin_of, texture, uniform,
};
use lucerna::core::color::Rgb;
use lucerna::core::interfaces::{SurfaceHit, Texture};
use lucerna::core::math::Vec2;
use lucerna::core::sampling::Pcg32;
use lucerna::core::scene::ObjectKind;
use lucerna::core::stats::chi2::{Chi2, pearson_with_rest};

const SAMPLES: usize = 1_000_000;
/// Cells along each axis: twice the texels of the pictures, so that an interpolated picture is bilinear in each.
const CELLS: usize = 32;

/// The table: configurations of every texture.
fn textures() -> Vec<String> {
    let texture = |plugin: &str, inner: &str| format!("<texture type='{plugin}'>{inner}</texture>");
    let float = |name: &str, value: &str| format!("<float name='{name}' value='{value}'/>");
    let string = |name: &str, value: &str| format!("<string name='{name}' value='{value}'/>");
    let colors = "<rgb name='color0' value='0.1 0.2 0.3'/><rgb name='color1' value='0.9 0.6 0.7'/>";
    let to_uv = "<transform name='to_uv'><scale x='3' y='-2'/><translate x='0.3' y='0.1'/></transform>";
    let mut all = vec![
        texture("blackbody", &float("temperature", "3200")),
        texture("checkerboard", colors),
        texture("checkerboard", &format!("{colors}{to_uv}")),
        texture("d65", &float("scale", "2")),
        texture("irregular", &(string("wavelengths", "400 500 600") + &string("values", "0.1 0.2 0.3"))),
        texture("rawconstant", "<vector name='value' x='0.1' y='0.2' z='0.3'/>"),
        texture(
            "regular",
            &(float("wavelength_min", "400") + &float("wavelength_max", "600") + &string("values", "1 2 3")),
        ),
        texture("srgb", "<rgb name='color' value='0.1 0.2 0.3'/>"),
        texture("uniform", &float("value", "0.7")),
    ];
    for filter in ["bilinear", "nearest"] {
        for (wrap, file) in [("repeat", "picture.png"), ("mirror", "ramp.png"), ("clamp", "picture.exr")] {
            let picture = string("filename", &format!("textures/{file}"));
            let options = picture + &string("filter_type", filter) + &string("wrap_mode", wrap);
            all.push(texture("bitmap", &options));
            if wrap == "repeat" {
                all.push(texture("bitmap", &(options + to_uv)));
            }
        }
    }
    all
}

#[test]
fn every_texture_is_configured() {
    let textures = textures();
    assert_every_plugin_is_configured(ObjectKind::Texture, textures.iter().map(|xml| plugin_of(xml)));
}

fn at(uv: Vec2) -> SurfaceHit {
    SurfaceHit { uv, ..SurfaceHit::default() }
}

/// Points spread evenly over each cell of the unit square, with the cell.
fn grid(steps: usize) -> impl Iterator<Item = (usize, Vec2)> {
    let side = CELLS * steps;
    (0..side * side).map(move |i| {
        let (x, y) = (i % side, i / side);
        let uv = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32;
        (x / steps + CELLS * (y / steps), uv)
    })
}

/// What is wrong about the constants and bounds that a texture tells.
fn wrong_summary(texture: &dyn Texture) -> Option<String> {
    let mut sum = 0.0;
    for (_, uv) in grid(8) {
        let (color, scalar) = (texture.color(&at(uv)), texture.scalar(&at(uv)));
        let bounds = [texture.minimum(), Some(color.min_component()), Some(color.max_component()), texture.maximum()];
        if !bounds.iter().flatten().is_sorted_by(|a, b| **a <= **b + 1e-6 * b.abs()) {
            return Some(format!("{color:?} at {uv} is out of bounds: {bounds:?}"));
        }
        if texture.constant().is_some_and(|constant| constant != color) {
            return Some(format!("{color:?} at {uv} is not the constant"));
        }
        sum += f64::from(scalar);
    }
    let mean = (sum / ((8 * CELLS) as f64).powi(2)) as f32;
    // Midpoints are exact for pictures and boards.
    (!close(mean, texture.mean(), 1e-4)).then(|| format!("the mean is {mean}, not {}", texture.mean()))
}

#[test]
fn means_and_bounds_are_true() {
    for xml in textures() {
        assert_eq!(wrong_summary(&*texture(&xml)), None, "{xml}");
    }
}

/// Whether the density of positions is that of the samples, and even or in proportion to the texture.
fn wrong_density(texture: &dyn Texture) -> Option<String> {
    let mut pcg = Pcg32::new(1, 7);
    for _ in 0..10_000 {
        let Some((uv, pdf)) = texture.sample_position(uniform(&mut pcg)) else { return Some("no sample".to_owned()) };
        if !(close(texture.pdf_position(uv), pdf, 1e-4) && uv == uv.clamp(Vec2::ZERO, Vec2::ONE)) {
            return Some(format!("{uv}: {pdf}, not {}", texture.pdf_position(uv)));
        }
    }
    let proportional = |uv: Vec2| close(texture.pdf_position(uv) * texture.mean(), texture.scalar(&at(uv)), 1e-3);
    let even = |uv: Vec2| texture.pdf_position(uv) == 1.0;
    (!(grid(8).all(|(_, uv)| even(uv)) || grid(8).all(|(_, uv)| proportional(uv))))
        .then(|| "neither even nor proportional".to_owned())
}

fn chi_square(texture: &dyn Texture) -> Chi2 {
    let mut expected = vec![0.0; CELLS * CELLS];
    for (cell, uv) in grid(8) {
        expected[cell] += f64::from(texture.pdf_position(uv)) * SAMPLES as f64 / ((8 * CELLS) as f64).powi(2);
    }
    let mut observed = vec![0u64; CELLS * CELLS + 1];
    let mut pcg = Pcg32::new(2, 7);
    for _ in 0..SAMPLES {
        let uv = texture.sample_position(uniform(&mut pcg)).map(|(uv, _)| uv);
        observed[uv.map_or(CELLS * CELLS, |uv| part(uv.x, CELLS) + CELLS * part(uv.y, CELLS))] += 1;
    }
    pearson_with_rest(&observed, expected, SAMPLES)
}

#[test]
fn positions_follow_their_density() {
    let textures = textures();
    for xml in &textures {
        assert_eq!(wrong_density(&*texture(xml)), None, "{xml}");
    }
    assert_none(&failures(&textures, Clone::clone, |xml| chi_square(&*texture(xml))));
}

/// Slopes against differences, where those to both sides agree: pictures have kinks, and boards have jumps.
fn wrong_slope(texture: &dyn Texture) -> Option<String> {
    let mut pcg = Pcg32::new(4, 7);
    let (h, mut compared) = (1.0 / 1024.0, 0);
    for uv in (0..3000).map(|_| uniform(&mut pcg)) {
        let slope = texture.gradient(&at(uv));
        for (axis, told) in [(Vec2::X, slope.x), (Vec2::Y, slope.y)] {
            let [left, middle, right] = [-h, 0.0, h].map(|step| texture.scalar(&at(uv + axis * step)));
            let [before, after] = [(middle - left) / h, (right - middle) / h];
            // Rounding of the three values.
            let rounding = 4.0 * f32::EPSILON * middle.abs().max(1e-3) / h;
            if (before - after).abs() > 2.0 * rounding + 1e-3 * before.abs() {
                continue;
            }
            compared += 1;
            if (told - 0.5 * (before + after)).abs() > 2.0 * rounding + 1e-3 * told.abs() {
                return Some(format!("{told} at {uv}, but {before} and {after}"));
            }
        }
    }
    (compared < 2000).then(|| format!("only {compared} of 6000"))
}

#[test]
fn slopes_are_those_of_the_values() {
    for xml in textures() {
        assert_eq!(wrong_slope(&*texture(&xml)), None, "{xml}");
    }
}

#[test]
fn hc_e07_any_coordinate_gives_a_finite_value() {
    let ends = [0.0, 1.0, -1.0, 1e-30, 1e7, -1e7, 1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    for xml in textures() {
        let texture = texture(&xml);
        for uv in ends.iter().flat_map(|x| ends.map(|y| Vec2::new(*x, y))) {
            let (color, scalar, slope) = (texture.color(&at(uv)), texture.scalar(&at(uv)), texture.gradient(&at(uv)));
            assert!(color.is_finite() && scalar.is_finite() && slope.is_finite(), "{xml} at {uv}");
            assert!((0.0..f32::INFINITY).contains(&texture.pdf_position(uv)), "{xml} at {uv}");
        }
    }
}

/// A right texture that is made wrong in one way.
struct Wrong<'a> {
    right: &'a dyn Texture,
    error: Error,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Error {
    None,
    Mean,
    Bounds,
    /// 1 % too high.
    Density,
    /// 1 % too high everywhere, with samples and without.
    BothDensities,
    /// Samples a hundredth off to the right.
    Shifted,
    Slope,
}

impl Texture for Wrong<'_> {
    fn color(&self, hit: &SurfaceHit) -> Rgb {
        self.right.color(hit)
    }

    fn scalar(&self, hit: &SurfaceHit) -> f32 {
        self.right.scalar(hit)
    }

    fn gradient(&self, hit: &SurfaceHit) -> Vec2 {
        self.right.gradient(hit) * if self.error == Error::Slope { 1.01 } else { 1.0 }
    }

    fn mean(&self) -> f32 {
        self.right.mean() * if self.error == Error::Mean { 1.01 } else { 1.0 }
    }

    fn maximum(&self) -> Option<f32> {
        self.right.maximum().map(|m| if self.error == Error::Bounds { 0.99 * m } else { m })
    }

    fn sample_position(&self, u2: Vec2) -> Option<(Vec2, f32)> {
        let (uv, pdf) = self.right.sample_position(u2)?;
        Some(match self.error {
            Error::BothDensities => (uv, 1.01 * pdf),
            Error::Shifted => {
                let uv = Vec2::new((uv.x + 0.01).fract(), uv.y);
                (uv, self.pdf_position(uv))
            }
            _ => (uv, pdf),
        })
    }

    fn pdf_position(&self, uv: Vec2) -> f32 {
        let wrong = matches!(self.error, Error::Density | Error::BothDensities);
        self.right.pdf_position(uv) * if wrong { 1.01 } else { 1.0 }
    }
}

#[test]
fn planted_errors_are_found() {
    let right = texture("<texture type='bitmap'><string name='filename' value='textures/picture.exr'/></texture>");
    let level = lucerna::core::stats::chi2::sidak(crate::support::SIGNIFICANCE, textures().len());
    let found = |error| {
        let wrong = Wrong { right: &*right, error };
        let by_density = wrong_density(&wrong).is_some();
        [wrong_summary(&wrong).is_some(), by_density, !chi_square(&wrong).accepts(level), wrong_slope(&wrong).is_some()]
    };
    let planted: &[(Error, &[usize])] = &[
        (Error::Mean, &[0]),
        (Error::Bounds, &[0]),
        (Error::Density, &[1]),
        (Error::BothDensities, &[2]),
        (Error::Shifted, &[2]),
        (Error::Slope, &[3]),
    ];
    assert_found(found, Error::None, planted);
}
