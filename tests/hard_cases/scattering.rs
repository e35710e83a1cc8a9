//! Scattering (S).

use super::{mean, render, scene};
use lucerna::core::stats::figures::measured;
use std::path::Path;

const INTEGRATORS: [&str; 3] = ["path", "volpath", "volpathmis"];

/// A sphere that absorbs nothing cannot be seen in front of a sky that is the same everywhere.
#[test]
fn hc_s05_lossless_materials_vanish_in_a_furnace() {
    let mut worst = (0.0_f64, String::new());
    let white = "<float name='reflectance' value='1'/>";
    let materials = [
        format!("<bsdf type='diffuse'>{white}</bsdf>"),
        "<bsdf type='dielectric'/>".to_owned(),
        "<bsdf type='thindielectric'/>".to_owned(),
        "<bsdf type='conductor'/>".to_owned(),
        "<bsdf type='null'/>".to_owned(),
        format!(
            "<bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='twosided'><bsdf type='diffuse'>{white}</bsdf>\
                 </bsdf></bsdf>"
        ),
    ];
    for integrator in INTEGRATORS {
        for material in &materials {
            let integrator = format!(
                "<integrator type='{integrator}'><integer name='max_depth' value='64'/>\
                 <integer name='rr_depth' value='64'/></integrator>"
            );
            let body = format!("<shape type='sphere'>{material}</shape><emitter type='constant'/>");
            let off = (mean(&render(&scene(&integrator, 16, "", &body), 64)) - 1.0).abs();
            if off > worst.0 {
                worst = (off, format!("{integrator} {material}"));
            }
        }
    }
    measured("hc_s05_lossless_materials_vanish_in_a_furnace", format!("mean off by at most {:.4}", worst.0));
    assert!(worst.0 < 0.01, "{} by {}", worst.0, worst.1);
}

/// An opaque sheet whose shading normals are tilted by 89° to all sides: a lamp behind it cannot be seen through it.
#[test]
fn hc_s09_no_light_passes_an_opaque_surface_of_tilted_normals() {
    let (sine, cosine) = (89f64.to_radians().sin(), 89f64.to_radians().cos());
    let mut text = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\n".to_owned();
    for (x, y) in [(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        text += &format!("vn {} {} {cosine}\n", x * sine, y * sine);
    }
    text += "f 1//1 2//2 3//3\nf 1//1 3//3 4//4\n";
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join("tilted.obj"), text).expect("a mesh");
    let lamp = "<shape type='rectangle'><transform name='to_world'><scale value='5'/><translate z='-3'/></transform>\
                <emitter type='area'/></shape><shape type='rectangle'><transform name='to_world'><scale value='5'/>\
                <rotate x='1' angle='180'/><translate z='-3.1'/></transform><emitter type='area'/></shape>";
    let materials = [
        "<bsdf type='diffuse'/>",
        "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>",
        "<bsdf type='roughplastic'><float name='alpha' value='0.5'/></bsdf>",
        "<bsdf type='twosided'><bsdf type='roughconductor'><float name='alpha' value='0.5'/></bsdf></bsdf>",
        "<bsdf type='twosided'><bsdf type='conductor'/></bsdf>",
        "<bsdf type='principled'/>",
    ];
    let mut leaked = 0.0_f64;
    for integrator in ["path", "direct", "volpath", "volpathmis"] {
        for material in materials {
            for (side, z) in [("front", 4), ("back", -1)] {
                // Behind the sheet the camera looks at it with its back to the lamp; what is lit there must stay finite.
                let eye = format!(
                    "<transform name='to_world'><lookat origin='0, 0, {z}' target='0, 0, 0' up='0, 1, 0'/></transform>"
                );
                let sheet = format!("<shape type='obj'><string name='filename' value='tilted.obj'/>{material}</shape>");
                let integrator = format!("<integrator type='{integrator}'/>");
                let light = mean(&render(&scene(&integrator, 12, &eye, &format!("{sheet}{lamp}")), 64));
                assert!(light.is_finite());
                if side == "front" {
                    leaked = leaked.max(light);
                }
            }
        }
    }
    measured("hc_s09_no_light_passes_an_opaque_surface_of_tilted_normals", format!("{leaked} of the light passes"));
    assert_eq!(leaked, 0.0);
}
