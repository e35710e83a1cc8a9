use crate::testing::Draft;
use lucerna_core::interfaces::Sensor;
use lucerna_core::math::{DMat4, Vec2, Vec3};
use lucerna_core::scene::{BuiltSensor, Object, ObjectKind};
use std::sync::Arc;

fn sensor(draft: Draft) -> Arc<dyn Sensor> {
    match draft.build() {
        Ok(Object::Sensor(BuiltSensor { sensor, .. })) => sensor,
        Ok(_) => panic!("not a sensor"),
        Err(errors) => panic!("{errors}"),
    }
}

fn draft(plugin: &str, size: (i64, i64)) -> Draft {
    let film = Draft::new(ObjectKind::Film, "hdrfilm").int("width", size.0).int("height", size.1);
    Draft::new(ObjectKind::Sensor, plugin).child(film)
}

/// Turned about y and moved; mirrored in x if asked.
fn placement(mirrored: bool) -> DMat4 {
    let x = if mirrored { -1.0 } else { 1.0 };
    DMat4::from_cols_array(&[
        0.8 * x,
        0.0,
        -0.6 * x,
        0.0, //
        0.0,
        1.0,
        0.0,
        0.0, //
        0.6,
        0.0,
        0.8,
        0.0, //
        1.0,
        2.0,
        3.0,
        1.0,
    ])
}

type Golden = (&'static str, &'static [&'static str], bool, [f32; 3], [f32; 3], f32);

/// Plugin, parameters, whether the film is upright and the camera mirrored; then origin, direction and end of the
/// reference renderer's ray through (0.3, 0.6) of the film and (0.2, 0.9) of the lens.
#[rustfmt::skip]
const GOLDEN: &[Golden] = &[
    ("perspective", &["principal_point_offset_x=0.1", "principal_point_offset_y=-0.2", "fov=50", "fov_axis=y"], false, [1.34974, 2.046631, 3.362695], [0.6911793, 0.09215494, 0.7167836], 100.6948),
    ("perspective", &["principal_point_offset_x=0.1", "principal_point_offset_y=-0.2", "fov=50", "fov_axis=y"], true, [1.285078, 2.046631, 3.411191], [0.5673016, 0.0927946, 0.8182653], 100.0007),
    ("perspective", &[], false, [1.355381, 1.97404, 3.358464], [0.7031173, -0.05136144, 0.7092165], 100.5819),
    ("perspective", &[], true, [1.27429, 1.959828, 3.419283], [0.5456989, -0.07992214, 0.8341614], 100.0253),
    ("perspective", &["fov=60", "fov_axis=diagonal"], false, [1.373901, 1.965359, 3.344574], [0.7336562, -0.06797146, 0.6761128], 101.4184),
    ("perspective", &["fov=60", "fov_axis=diagonal"], true, [1.265692, 1.946394, 3.425731], [0.526446, -0.1062148, 0.8435479], 100.4334),
    ("perspective", &["fov=60", "fov_axis=smaller"], false, [1.423168, 1.942265, 3.307624], [0.8039776, -0.1096908, 0.5844552], 104.7423),
    ("perspective", &["fov=60", "fov_axis=smaller"], true, [1.207624, 1.855662, 3.469282], [0.3894852, -0.2707651, 0.8803338], 106.0815),
    ("perspective", &["fov=60", "fov_axis=larger"], false, [1.392376, 1.956699, 3.330718], [0.7619192, -0.08408276, 0.642191], 102.4818),
    ("perspective", &["fov=60", "fov_axis=larger"], true, [1.26305, 1.942265, 3.427713], [0.5204398, -0.1142279, 0.8462236], 100.582),
    ("perspective", &["focal_length=24mm"], false, [1.415378, 1.945917, 3.313467], [0.7939367, -0.1033727, 0.5991482], 104.1143),
    ("perspective", &["focal_length=24mm"], true, [1.246437, 1.916308, 3.440172], [0.4819271, -0.1636656, 0.8607904], 101.7602),
    ("thinlens", &["aperture_radius=0.3", "focus_distance=4", "fov=50"], false, [1.281273, 2.139636, 3.414045], [0.7526498, -0.1162455, 0.648078], 102.5718),
    ("thinlens", &["aperture_radius=0.3", "focus_distance=4", "fov=50"], true, [1.318727, 2.058032, 3.385955], [0.399247, -0.2664462, 0.8772733], 105.6974),
    ("orthographic", &[], false, [1.62, 1.85, 3.16], [0.6, 0.0, 0.8], 99.5),
    ("orthographic", &[], true, [0.98, 1.5, 3.64], [0.6, 0.0, 0.8], 99.5),
];

#[test]
fn rays_as_the_reference() {
    for (plugin, parameters, upright, o, d, end) in GOLDEN {
        let mut draft = draft(plugin, if *upright { (20, 50) } else { (40, 30) })
            .to_world(placement(*upright))
            .float("near_clip", 0.5)
            .float("far_clip", 100.0);
        for (name, value) in parameters.iter().filter_map(|p| p.split_once('=')) {
            draft = match value.parse() {
                Ok(number) => draft.float(name, number),
                Err(_) => draft.string(name, value),
            };
        }
        let sensor = sensor(draft);
        let found = sensor.ray(Vec2::new(0.3, 0.6), Vec2::new(0.2, 0.9)).ray;
        let error = (found.o - Vec3::from(*o)).length() + (found.d - Vec3::from(*d)).length();
        assert!(error < 2e-6, "{plugin} {parameters:?}: {found:?} instead of {o:?} {d:?}");
        assert!((found.t_max - end).abs() < 2e-4 && found.t_min == 0.0, "{plugin} {parameters:?}: {found:?}");
        assert_eq!(sensor.needs_lens(), *plugin == "thinlens");
    }
}

#[test]
fn hc_e08_extreme_angles_are_finite() {
    for fov in [0.001, 179.9] {
        let sensor = sensor(draft("perspective", (64, 64)).float("fov", fov));
        for film in [Vec2::ZERO, Vec2::splat(0.5), Vec2::splat(0.999_999)] {
            let ray = sensor.ray(film, Vec2::ZERO).ray;
            assert!(ray.d.is_normalized() && ray.o.is_finite() && ray.t_max > 0.0, "{fov}: {ray:?}");
        }
    }
}

#[test]
fn a_closed_aperture_is_a_pinhole() {
    let lens = sensor(draft("thinlens", (40, 30)).float("fov", 50.0).float("aperture_radius", 0.0));
    let hole = sensor(draft("perspective", (40, 30)).float("fov", 50.0));
    let film = Vec2::new(0.7, 0.1);
    let (a, b) = (lens.ray(film, Vec2::new(0.9, 0.2)).ray, hole.ray(film, Vec2::ZERO).ray);
    assert!((a.d - b.d).length() < 1e-6 && (a.o - b.o).length() < 1e-6);
}

#[test]
fn hc_e08_senseless_cameras_are_refused() {
    let camera = || draft("perspective", (4, 4));
    assert!(camera().float("fov", 0.0).errors().contains("fov"));
    assert!(camera().float("fov", 180.0).errors().contains("fov"));
    assert!(camera().float("near_clip", 2.0).float("far_clip", 2.0).errors().contains("near_clip"));
    assert!(camera().float("fov", 40.0).string("focal_length", "50mm").errors().contains("exclude"));
    assert!(camera().string("focal_length", "long").errors().contains("focal_length"));
    assert!(camera().to_world(DMat4::from_scale(glam::DVec3::splat(2.0))).errors().contains("scale"));
    assert!(camera().float("shutter_open", 1.0).errors().contains("shutter"));
    assert!(draft("thinlens", (4, 4)).errors().contains("aperture_radius"));
}
