//! Geometry (G).

use super::{PATH, colors, mean, render, scene, support};
use lucerna::core::stats::figures::measured;
use std::path::Path;

/// A closed room of edge 1 with a lamp, seen from within, at `place`.
fn room(place: f64) -> (f64, usize) {
    let at = |x: f64, y: f64, z: f64| format!("{}, {}, {}", place + x, place + y, place + z);
    let (eye, target, lamp) = (at(0.0, 0.0, 0.4375), at(0.0, 0.0, 0.0), at(0.125, 0.1875, 0.0));
    let middle = at(0.0, 0.0, 0.0);
    let sensor = format!(
        "<transform name='to_world'><lookat origin='{eye}' target='{target}' up='0, 1, 0'/></transform>\
         <float name='fov' value='70'/><float name='near_clip' value='0.001'/>"
    );
    let body = format!(
        "<shape type='cube'><transform name='to_world'><scale value='0.5'/><translate value='{middle}'/></transform>\
         <bsdf type='twosided'><bsdf type='diffuse'><float name='reflectance' value='0.5'/></bsdf></bsdf></shape>\
         <emitter type='point'><point name='position' value='{lamp}'/></emitter>"
    );
    let picture = render(&scene(PATH, 24, &sensor, &body), 64);
    (mean(&picture), colors(&picture).filter(|v| *v == 0.0).count())
}

#[test]
fn hc_g05_a_room_far_away_looks_as_here() {
    let ((here, _), (there, black)) = (room(0.0), room(1e5));
    measured(
        "hc_g05_a_room_far_away_looks_as_here",
        format!("mean off by {:.2} %, {black} black pixels", 100.0 * (there / here - 1.0).abs()),
    );
    // A step between two numbers is 0.8 % of the room there, and hits are rounded to them.
    assert!((there / here - 1.0).abs() < 0.015, "{there} instead of {here}");
    assert_eq!(black, 0);
}

#[test]
fn hc_g11_lights_alone_render() {
    for light in [
        "<emitter type='constant'/>",
        "<shape type='rectangle'><transform name='to_world'><scale value='5'/></transform>\
                   <emitter type='area'/></shape>",
    ] {
        let picture = render(&scene(PATH, 4, "", light), 4);
        assert!(colors(&picture).all(|v| v == 1.0), "{light}");
    }
    for light in ["", "<emitter type='point'/>", "<emitter type='directional'/>"] {
        let picture = render(&scene(PATH, 4, "", light), 4);
        assert!(colors(&picture).all(|v| v == 0.0), "{light}");
    }
    measured("hc_g11_lights_alone_render", "what shines is seen, all else is black");
}

/// Writes a square of four triangles around a middle vertex; `normals` are those of the corners and of the middle.
fn sheet(name: &str, normals: [&str; 5], reversed: bool) -> String {
    let mut text = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 0\n".to_owned();
    normals.iter().for_each(|n| text += &format!("vn {n}\n"));
    for (a, b) in [(1, 2), (2, 3), (3, 4), (4, 1)] {
        let (a, b) = if reversed { (b, a) } else { (a, b) };
        text += &format!("f {a}//{a} {b}//{b} 5//5\n");
    }
    std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), text).expect("a mesh");
    format!("<shape type='obj'><string name='filename' value='{name}'/><bsdf type='diffuse'/></shape>")
}

/// Black pixels of a mesh under a sky that is white everywhere.
fn black_pixels(mesh: &str) -> usize {
    let near = "<transform name='to_world'><lookat origin='0, 0, 2' target='0, 0, 0' up='0, 1, 0'/></transform>";
    let body = format!("{mesh}<emitter type='constant'/>");
    let picture = render(&scene(PATH, 16, near, &body), 64);
    colors(&picture).filter(|v| *v < 0.1).count()
}

#[test]
fn hc_g07_normals_that_are_none_or_opposite_are_replaced() {
    let up = "0 0 1";
    let mut black = Vec::new();
    for (name, middle) in [("zero.obj", "0 0 0"), ("opposite.obj", "0 0 -1")] {
        black.push(black_pixels(&sheet(name, [up, up, up, up, middle], false)));
    }
    // A mesh that is wound the wrong way altogether has good normals, which count: it is seen as the others are.
    black.push(black_pixels(&sheet("reversed.obj", [up; 5], true)));
    measured("hc_g07_normals_that_are_none_or_opposite_are_replaced", format!("{black:?} black pixels"));
    assert_eq!(black, [0; 3]);
}

#[test]
fn hc_g16_mirroring_leaves_normals_where_the_reference_has_them() {
    // The reference of `mesh_transforms`, compared sample for sample by tests/exact.rs, has mirrored meshes.
    let names = ["shapes/mesh_transforms", "shapes/instances_mirrored"];
    for name in names {
        let entries = support::manifest("exact");
        assert!(entries.iter().any(|entry| entry.name.starts_with(name)), "{name} has no exact reference");
    }
}
