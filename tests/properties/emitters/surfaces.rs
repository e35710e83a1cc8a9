//! Lights on surfaces: `area` on every shape there is.
//!
//! What is claimed is a density of points per solid angle. Over the cells of a grid of directions it is integrated by
//! points uniform in area, of which the tests of shapes know that they are.

use super::*;
use crate::shapes;
use lucerna::core::interfaces::{AreaSample, Shape, SurfaceHit};
use lucerna::core::math::Frame;
use lucerna::core::scene::BuiltShape;
use lucerna::core::stats::chi2::{Chi2, pearson_with_rest};
use rayon::prelude::*;
use std::f32::consts::TAU;

const SAMPLES: usize = 200_000;
/// Of the integral. Their error is a tenth of the noise of the samples.
const POINTS: u32 = 1 << 19;

/// The table: even and textured lights on every shape.
fn lamps() -> Vec<String> {
    let plain = "<emitter type='area'><rgb name='radiance' value='3 2 1'/></emitter>";
    let textured = "<emitter type='area'><texture name='radiance' type='bitmap'>\
        <string name='filename' value='textures/picture.exr'/></texture></emitter>";
    let shapes = [plain, textured].into_iter().flat_map(shapes::shapes);
    // A group cannot contain a light.
    shapes.filter(|xml| plugin_of(xml) != "shapegroup").collect()
}

/// Directions in which a shape may be seen: a cone around its bounding sphere, or all.
struct Outlook {
    frame: Frame,
    /// Cosine of the cone's half angle.
    rim: f32,
}

impl Outlook {
    const CELLS: (usize, usize) = (10, 20);
    const COUNT: usize = Self::CELLS.0 * Self::CELLS.1;

    fn new(shape: &dyn Shape, from: Vec3) -> Self {
        let (center, radius) = shape.bounds().bounding_sphere();
        let away = (center - from).length();
        let rim = if away > radius { (1.0 - (radius / away).powi(2)).sqrt() - 1e-4 } else { -1.0 };
        Outlook { frame: Frame::from_normal((center - from) / away), rim }
    }

    fn cell(&self, d: Vec3) -> usize {
        let local = self.frame.to_local(d);
        let row = (local.z - self.rim) / (1.0 - self.rim) * Self::CELLS.0 as f32;
        let turn = local.y.atan2(local.x) / TAU;
        let column = (if turn < 0.0 { turn + 1.0 } else { turn }) * Self::CELLS.1 as f32;
        (row as usize).min(Self::CELLS.0 - 1) * Self::CELLS.1 + (column as usize).min(Self::CELLS.1 - 1)
    }
}

/// Evenly spread points of the unit square (additive recurrence, Roberts 2018).
fn spread(i: u32) -> Vec2 {
    let u = |step: f64| (((0.5 + step * f64::from(i)) % 1.0) as f32).min(1.0 - f32::EPSILON);
    Vec2::new(u(0.754_877_666_246_692_8), u(0.569_840_290_998_053_2))
}

/// A point of a shape and its density per unit area, from one of the unit square.
type Chart<'a> = &'a dyn Fn(Vec2) -> Option<AreaSample>;

/// Through texture coordinates: for spheres and disks, whose coordinates meet in poles, where a texture is sampled so
/// often that points uniform in area would miss it.
fn by_coordinates(shape: &dyn Shape, uv: Vec2) -> Option<AreaSample> {
    let hit = shape.at_uv(uv)?;
    let pdf = 1.0 / hit.dp_du.cross(hit.dp_dv).length();
    Some(AreaSample { p: hit.p, p_error: hit.p_error, n: hit.n, uv, pdf, triangle: hit.triangle })
}

pub fn chi_square(light: &dyn Emitter, shape: &dyn Shape, chart: Chart<'_>, from: Vec3) -> Chi2 {
    let outlook = Outlook::new(shape, from);
    let mut expected = vec![0.0; Outlook::COUNT];
    for sample in (0..POINTS).filter_map(|i| chart(spread(i))) {
        if let Some((point, pdf)) = sample.as_seen_from(from) {
            let share = f64::from(light.pdf_direct(from, &point)) / f64::from(pdf);
            expected[outlook.cell(point.d)] += share * SAMPLES as f64 / f64::from(POINTS);
        }
    }
    let mut observed = vec![0u64; Outlook::COUNT + 1];
    let mut pcg = Pcg32::new(6, 7);
    for _ in 0..SAMPLES {
        let sample = light.sample_direct(from, uniform(&mut pcg));
        observed[sample.map_or(Outlook::COUNT, |s| outlook.cell(s.point.d))] += 1;
    }
    pearson_with_rest(&observed, expected, SAMPLES)
}

/// The radiance a lamp sends from a point of its surface to where it is seen from.
pub fn sent(light: &dyn Emitter, point: &LightPoint) -> Rgb {
    let frame = Frame::from_normal(point.n);
    let hit = SurfaceHit { p: point.p, n: point.n, frame, uv: point.uv, ..SurfaceHit::default() };
    light.radiance(&SurfaceHit { wi: frame.to_local(-point.d), ..hit })
}

fn light_of(built: &BuiltShape) -> &dyn Emitter {
    &**built.emitter.as_ref().expect("a lamp")
}

#[test]
fn directions_follow_their_density() {
    let cases: Vec<(String, usize)> =
        lamps().into_iter().flat_map(|xml| [0, 1, 2, 3].map(|v| (xml.clone(), v))).collect();
    assert_none(&failures(
        &cases,
        |(xml, view)| format!("{xml} from {view}"),
        |(xml, view)| {
            let built = built_shape(xml);
            let from = shapes::viewpoints(&*built.shape)[*view];
            let shape = &*built.shape;
            let has_poles = ["sphere", "disk"].contains(&plugin_of(xml)) && xml.contains("texture");
            let chart = |u2| if has_poles { by_coordinates(shape, u2) } else { shape.sample_area(u2) };
            chi_square(light_of(&built), shape, &chart, from)
        },
    ));
}

#[test]
fn samples_agree_with_what_is_asked() {
    let found: Vec<String> = lamps()
        .par_iter()
        .filter_map(|xml| {
            let built = built_shape(xml);
            let light = light_of(&built);
            assert!(light.flags().has(EmitterFlags::SURFACE), "{xml}");
            let views = shapes::viewpoints(&*built.shape);
            let found = views.into_iter().find_map(|from| disagreement(light, from, |point| sent(light, point)));
            found.map(|found| format!("{xml}: {found}"))
        })
        .collect();
    assert_none(&found);
}

#[test]
fn hc_g19_on_near_and_in_a_lamp_all_is_finite() {
    let mut pcg = Pcg32::new(1, 6);
    for xml in lamps() {
        let built = built_shape(&xml);
        let light = light_of(&built);
        for _ in 0..500 {
            let on = built.shape.sample_area(uniform(&mut pcg)).expect("a point");
            for height in [0.0, 1e-6, -1e-6, 1e-3, -1e-3] {
                let from = on.p + on.n * height;
                let Some(s) = light.sample_direct(from, uniform(&mut pcg)) else { continue };
                let pdf = light.pdf_direct(from, &s.point);
                assert!(s.pdf > 0.0 && s.pdf.is_finite() && fine(s.weight) && pdf.is_finite(), "{xml}: {s:?}");
            }
        }
    }
}
