//! Emitters: directions follow their density, weight times density is the radiance, densities are those of the samples,
//! from outside, inside, near and far.

mod surfaces;
mod surroundings;
mod teeth;

use crate::support::{
    assert_every_plugin_is_configured, assert_none, built_shape, close, emitter, failures, plugin_of, uniform,
};
use lucerna::core::color::Rgb;
use lucerna::core::interfaces::{Emitter, EmitterFlags, LightPoint};
use lucerna::core::math::{Vec2, Vec3};
use lucerna::core::sampling::Pcg32;
use lucerna::core::scene::ObjectKind;

#[test]
fn every_emitter_is_configured() {
    let all: Vec<String> = surroundings::environments().into_iter().chain(deltas()).collect();
    let plugins = all.iter().map(|xml| plugin_of(xml)).chain(["area"]);
    assert_every_plugin_is_configured(ObjectKind::Emitter, plugins);
}

/// The table: lights that cannot be hit by chance.
fn deltas() -> Vec<String> {
    let light = |plugin: &str, inner: &str| format!("<emitter type='{plugin}'>{inner}</emitter>");
    let placed =
        "<transform name='to_world'><lookat origin='0.3, 0.1, 2' target='0.1, 0.2, 0' up='0, 1, 0'/></transform>";
    let spot = |cutoff: &str, beam: &str| {
        let angles = format!("<float name='cutoff_angle' value='{cutoff}'/><float name='beam_width' value='{beam}'/>");
        light("spot", &format!("{placed}{angles}"))
    };
    vec![
        light("point", "<rgb name='intensity' value='3 2 1'/><point name='position' x='0.3' y='0.1' z='2'/>"),
        light("directional", "<rgb name='irradiance' value='3 2 1'/><vector name='direction' value='1, 2, -3'/>"),
        // hc_e04
        spot("60", "20"),
        spot("30", "30"),
        spot("90", "67.5"),
        spot("180", "135"),
        spot("20", "25"),
        light(
            "spot",
            &format!(
                "{placed}<float name='cutoff_angle' value='50'/><texture name='texture' type='bitmap'>\
             <string name='filename' value='textures/picture.png'/></texture>"
            ),
        ),
    ]
}

/// What is wrong about a light without extent.
fn wrong_delta(light: &dyn Emitter) -> Option<String> {
    let mut pcg = Pcg32::new(1, 3);
    let mut lit = 0;
    for _ in 0..5000 {
        let from = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) * 6.0 - 3.0;
        let Some(s) = light.sample_direct(from, uniform(&mut pcg)) else { continue };
        lit += 1;
        let again = light.sample_direct(from, uniform(&mut pcg)).is_some_and(|again| again.weight == s.weight);
        let fits = s.delta
            && s.pdf == 1.0
            && again
            && s.point.d.is_normalized()
            && fine(s.weight)
            && light.pdf_direct(from, &s.point) == 0.0;
        if !fits {
            return Some(format!("from {from}: {s:?}"));
        }
        // Half way to the light there is four times as much, or as much as before from infinitely far away.
        let Some(nearer) = light.sample_direct(from + s.point.d * (0.5 * s.point.distance.min(2.0)), Vec2::ZERO) else {
            return Some(format!("nothing half way from {from}"));
        };
        let is_near = s.point.p.is_finite() && s.weight.max_component() != nearer.weight.max_component();
        let ratio = if is_near { (nearer.point.distance / s.point.distance).powi(2) } else { 1.0 };
        if !close(nearer.weight.max_component() * ratio, s.weight.max_component(), 2e-3) {
            return Some(format!("from {from}: {s:?}, half way {nearer:?}"));
        }
    }
    (lit < 100).then(|| format!("only {lit} points are lit"))
}

#[test]
fn lights_without_extent() {
    for xml in deltas() {
        let light = emitter(&xml);
        assert!(light.flags().has(EmitterFlags::DELTA), "{xml}");
        assert_eq!(wrong_delta(&*light), None, "{xml}");
    }
}

/// A light exactly at the point it lights, and points so near that the square of the distance vanishes.
#[test]
fn hc_e05_points_on_lights() {
    for xml in deltas() {
        let light = emitter(&xml);
        let at = Vec3::new(0.3, 0.1, 2.0);
        for from in [at, at + 1e-7, at - Vec3::Z * 1e-6, Vec3::ZERO, Vec3::splat(1e-30), Vec3::splat(1e30)] {
            if let Some(s) = light.sample_direct(from, Vec2::splat(0.5)) {
                assert!(fine(s.weight) && s.point.d.is_finite(), "{xml} from {from}: {s:?}");
            }
        }
    }
}

fn fine(c: Rgb) -> bool {
    c.is_finite() && c.min_component() >= 0.0
}

/// Where a sample does not fit the density and the radiance that are asked for, seen from a point. Directions have been
/// rounded: where that alone changes the answers by more than 10⁻³, so much is granted.
fn disagreement(light: &dyn Emitter, from: Vec3, radiance: impl Fn(&LightPoint) -> Rgb) -> Option<String> {
    let mut pcg = Pcg32::new(5, 1);
    for _ in 0..5000 {
        let Some(s) = light.sample_direct(from, uniform(&mut pcg)) else { continue };
        let asked = |point: &LightPoint| {
            let Rgb { r, g, b } = radiance(point);
            [light.pdf_direct(from, point), r, g, b]
        };
        let [r, g, b] = (s.weight * s.pdf).to_array();
        let (sampled, there) = ([s.pdf, r, g, b], asked(&s.point));
        if !(s.pdf > 0.0 && s.pdf.is_finite() && s.weight.is_finite() && s.point.d.is_normalized() && !s.delta) {
            return Some(format!("{s:?}"));
        }
        if (0..4).all(|i| close(sampled[i], there[i], 1e-4)) {
            continue;
        }
        let mut granted = [0.0f32; 4];
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for sign in [1.0, -1.0] {
                let d = s.point.d + axis * (sign * 4.0 * f32::EPSILON);
                let moved = asked(&LightPoint { d, ..s.point });
                for i in 0..4 {
                    granted[i] += (moved[i] - there[i]).abs();
                }
            }
        }
        if (0..4).any(|i| (sampled[i] - there[i]).abs() > 1e-4 * sampled[i].abs() + granted[i]) {
            return Some(format!("from {from}: {s:?}: {sampled:?}, {there:?}, granted {granted:?}"));
        }
    }
    None
}
