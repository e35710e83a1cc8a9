//! Emitters and sensors (E).

use super::{PATH, colors, mean, render, scene};
use lucerna::core::math::Vec3;
use lucerna::core::scene::EmitterId;
use lucerna::core::stats::figures::measured;
use std::path::Path;

const FLOOR: &str =
    "<shape type='rectangle'><bsdf type='diffuse'><float name='reflectance' value='0.5'/></bsdf></shape>";

/// A scene whose sky is black, alone and beside a lamp.
#[test]
fn hc_e01_a_black_sky_is_no_light() {
    let mut file = b"PF\n4 2\n-1\n".to_vec();
    file.extend([0; 4 * 2 * 3 * 4]);
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("black.pfm"), file).expect("a picture");
    let sky = "<emitter type='envmap'><string name='filename' value='black.pfm'/></emitter>";
    assert_eq!(mean(&render(&scene(PATH, 4, "", &format!("{FLOOR}{sky}")), 16)), 0.0);
    let lamp = "<emitter type='point'><point name='position' value='0, 0, 1'/></emitter>";
    let both = scene(PATH, 4, "", &format!("{FLOOR}{sky}{lamp}"));
    let pmfs = [0, 1].map(|id| both.emitter_pmf(EmitterId(id)));
    measured("hc_e01_a_black_sky_is_no_light", format!("picked with probability {}", pmfs[0].min(pmfs[1])));
    assert_eq!((pmfs[0].min(pmfs[1]), pmfs[0].max(pmfs[1])), (0.0, 1.0));
    assert!(mean(&render(&both, 16)) > 0.0);
}

/// Lights without area, without power, and around the surface they light.
#[test]
fn hc_e03_lights_without_area_or_power_are_never_picked() {
    let flat = "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("flat.obj"), flat).expect("a mesh");
    let dark = [
        "<shape type='obj'><string name='filename' value='flat.obj'/><emitter type='area'/></shape>",
        "<shape type='sphere'><float name='radius' value='0.1'/><emitter type='area'><rgb name='radiance' value='0'/>\
         </emitter></shape>",
        "<emitter type='point'><rgb name='intensity' value='0'/></emitter>",
        "<emitter type='directional'><rgb name='irradiance' value='0'/></emitter>",
        "<emitter type='spot'><rgb name='intensity' value='0'/></emitter>",
        "<emitter type='constant'><rgb name='radiance' value='0'/></emitter>",
    ];
    let lamp = "<emitter type='point'><point name='position' value='0, 0, 1'/></emitter>";
    let expected = mean(&render(&scene(PATH, 8, "", &format!("{FLOOR}{lamp}")), 64));
    let mut picked = 0.0_f32;
    for light in dark {
        assert_eq!(mean(&render(&scene(PATH, 4, "", &format!("{FLOOR}{light}")), 8)), 0.0, "{light}");
        let both = scene(PATH, 8, "", &format!("{FLOOR}{light}{lamp}"));
        picked = picked.max((0..2).map(|id| both.emitter_pmf(EmitterId(id))).fold(1.0, f32::min));
        let light_of_lamp = mean(&render(&both, 64));
        // Spheres and lines are in the way of a few rays.
        assert!((light_of_lamp / expected - 1.0).abs() < 0.1, "{light}: {light_of_lamp} instead of {expected}");
    }
    measured("hc_e03_lights_without_area_or_power_are_never_picked", format!("picked with probability {picked}"));
    assert_eq!(picked, 0.0);
    // A white sphere inside a lamp, and a lamp that is its own diffuse surface.
    let around = "<shape type='sphere'><float name='radius' value='9'/><boolean name='flip_normals' value='true'/>\
                  <emitter type='area'/></shape><shape type='sphere'><bsdf type='diffuse'><float name='reflectance' \
                  value='1'/></bsdf></shape>";
    assert!((mean(&render(&scene(PATH, 8, "", around), 64)) - 1.0).abs() < 0.01);
}

/// A point light in a surface, in the eye, and so near that its light is as bright as numbers get.
#[test]
fn hc_e05_a_point_light_in_a_surface_or_the_eye() {
    for place in ["0, 0, 0", "0.1, 0.2, 0", "0, 0, 4"] {
        let lamp = format!("<emitter type='point'><point name='position' value='{place}'/></emitter>");
        let picture = render(&scene(PATH, 16, "", &format!("{FLOOR}{lamp}")), 64);
        assert!(colors(&picture).all(f32::is_finite), "{place}");
    }
    // At height h above the floor no point is brighter than the one below: ρ/π I/h².
    let height = 1e-3;
    let lamp = format!("<emitter type='point'><point name='position' value='0, 0, {height}'/></emitter>");
    let brightest = 0.5 / std::f64::consts::PI / (height * height);
    // The eye is so near that the brightest pixels are close to that.
    let eye = "<transform name='to_world'><lookat origin='0, 0, 0.004' target='0, 0, 0' up='0, 1, 0'/></transform>\
               <float name='fov' value='10'/><float name='near_clip' value='1e-5'/>";
    let picture = render(&scene(PATH, 16, eye, &format!("{FLOOR}{lamp}")), 256);
    let largest = colors(&picture).fold(0.0, f32::max);
    measured(
        "hc_e05_a_point_light_in_a_surface_or_the_eye",
        format!("finite; brightest pixel {largest:.0}, the analytic bound is {brightest:.0}"),
    );
    assert!((0.95..1.0001).contains(&(f64::from(largest) / brightest)));
}

#[test]
fn hc_e06_lights_that_surround_a_scene_without_extent() {
    let point = "<shape type='sphere'><float name='radius' value='1e-30'/></shape>";
    for light in ["constant", "directional", "sunsky"] {
        for body in ["", point] {
            let scene = scene(PATH, 4, "", &format!("{body}<emitter type='{light}'/>"));
            assert!(colors(&render(&scene, 4)).all(f32::is_finite), "{light}");
            let id = EmitterId(0);
            for u in [0.0, 0.5, 0.999_999] {
                let sampled = scene.sample_emitter(Vec3::ZERO, lucerna::core::math::Vec2::splat(u));
                if let Some((_, sample)) = sampled {
                    assert!(sample.pdf.is_finite() && sample.weight.is_finite() && sample.point.d.is_normalized());
                    assert!(scene.pdf_emitter(id, Vec3::ZERO, &sample.point).is_finite());
                }
            }
        }
    }
    measured("hc_e06_lights_that_surround_a_scene_without_extent", "finite");
}
