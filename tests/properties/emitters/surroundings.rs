//! Lights all around: what they claim is a density over the sphere of directions.

use super::*;
use lucerna::core::image::{Image, pfm};
use lucerna::core::stats::chi2::{Chi2, SphereGrid};
use std::path::{Path, PathBuf};

const SAMPLES: usize = 500_000;
const GRID: SphereGrid = SphereGrid { rings: 20, spokes: 40 };

/// The table: configurations of every environment.
pub fn environments() -> Vec<String> {
    let light = |plugin: &str, inner: &str| format!("<emitter type='{plugin}'>{inner}</emitter>");
    let float = |name: &str, value: &str| format!("<float name='{name}' value='{value}'/>");
    let file = |name: &str| format!("<string name='filename' value='{name}'/>");
    let turn = "<transform name='to_world'><rotate x='1' angle='57'/><rotate y='1' angle='29'/></transform>";
    let sun = "<vector name='sun_direction' value='0.6, 0.2, 0.5'/>".to_owned();
    let mut all = vec![
        light("constant", "<rgb name='radiance' value='3 2 1'/>"),
        light("envmap", &file("textures/sky.exr")),
        light("envmap", &(file("textures/sky.exr") + turn + &float("scale", "2.5"))),
        light("envmap", &(file("textures/sky.exr") + "<boolean name='mis_compensation' value='true'/>")),
        // A sun wide enough for the cells.
        light("sunsky", &(sun.clone() + &float("sun_aperture", "34"))),
        light(
            "sunsky",
            &(sun.clone() + &float("sun_aperture", "20") + "<boolean name='complex_sun' value='true'/>" + turn),
        ),
        light("sunsky", &(sun.clone() + &float("sun_scale", "0"))),
        light("sunsky", &(sun.clone() + &float("sky_scale", "0") + &float("sun_aperture", "50"))),
        light("sunsky", &(float("hour", "18.5") + &float("sun_scale", "0") + &float("turbidity", "8"))),
    ];
    all.extend(pictures().iter().map(|path| light("envmap", &file(&path.to_string_lossy()))));
    all
}

/// hc_e01: one texel, one column, one row, and one bright texel in the dark.
fn pictures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("properties");
    std::fs::create_dir_all(&folder).expect("a folder");
    let bright = |i: u32| if i == 3 * 16 + 5 { 1e8 } else { 0.0 };
    let pattern = |i: u32| ((7 * i * i + 13 * i) % 11) as f32 / 4.0;
    let write = |width: u32, height: u32, value: &dyn Fn(u32) -> f32| {
        let path = folder.join(format!("{width}x{height}.pfm"));
        // Moved into place when it is whole: tests run side by side.
        let writer = (std::process::id(), std::thread::current().id());
        let fresh = folder.join(format!("{width}x{height}-{writer:?}.pfm"));
        let mut image = Image::new(width, height, &["R", "G", "B"]);
        image.data = (0..width * height).flat_map(|i| [value(i), 0.5 * value(i), 0.25 * value(i)]).collect();
        pfm::write(&fresh, &image).expect("a picture");
        std::fs::rename(&fresh, &path).expect("a picture");
        path
    };
    vec![
        write(1, 1, &|_| 2.0),
        write(1, 5, &pattern),
        write(2, 1, &pattern),
        write(3, 2, &pattern),
        write(16, 8, &bright),
    ]
}

pub fn chi_square(light: &dyn Emitter) -> Chi2 {
    let mut pcg = Pcg32::new(9, 1);
    let sample = || light.sample_direct(Vec3::ZERO, uniform(&mut pcg)).map(|s| s.point.d);
    GRID.test(SAMPLES, sample, |d| light.pdf_direct(Vec3::ZERO, &LightPoint::of_environment(d)))
}

#[test]
fn directions_follow_their_density() {
    assert_none(&failures(&environments(), Clone::clone, |xml| chi_square(&*emitter(xml))));
}

#[test]
fn samples_agree_with_what_is_asked() {
    // A sun of its true size is too narrow for cells.
    let sun = "<emitter type='sunsky'><vector name='sun_direction' value='0.6, 0.2, 0.5'/></emitter>";
    for xml in environments().into_iter().chain([sun.to_owned()]) {
        let light = emitter(&xml);
        assert!(light.flags().has(EmitterFlags::ENVIRONMENT), "{xml}");
        for from in [Vec3::ZERO, Vec3::new(1e5, -3.0, 2.0)] {
            assert_eq!(disagreement(&*light, from, |point| light.background(point.d)), None, "{xml}");
        }
    }
}
