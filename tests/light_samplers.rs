//! Whichever light a path samples, the picture is the same: pixels, tiles and means of `path`, `direct` and `volpath` with
//! every light sampler against those without one.

mod support;

use lucerna::core::image::Image;
use lucerna::core::render::SampleOrder;
use lucerna::core::stats::Measured;
use lucerna::core::stats::images::{Scale, compare};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;
use support::{load_text, render, repository};

/// Chance that one of all comparisons fails without a reason.
const LEVEL: f64 = 0.01;

const SAMPLERS: [&str; 6] = [
    "<light_sampler type='uniform'/>",
    "<light_sampler type='power'/>",
    "<light_sampler type='light_tree'/>",
    "<light_sampler type='ris'/>",
    "<light_sampler type='ris'><integer name='candidates' value='3'/><light_sampler type='power'/></light_sampler>",
    "<light_sampler type='ris'><integer name='candidates' value='1'/><light_sampler type='uniform'/></light_sampler>",
];

/// A camera that looks at the origin from (0, 1.5, 5), and what is common to the scenes.
fn around(integrator: &str, inner: &str) -> String {
    format!(
        "<scene version='3.0.0'>{integrator}<sensor type='perspective'><float name='fov' value='45'/>\
         <transform name='to_world'><lookat origin='0, 1.5, 5' target='0, 0.5, 0' up='0, 1, 0'/></transform>\
         <film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/><rfilter type='box'/>\
         </film><sampler type='independent'/></sensor>{inner}</scene>"
    )
}

fn shape(kind: &str, transform: &str, inner: &str) -> String {
    format!("<shape type='{kind}'><transform name='to_world'>{transform}</transform>{inner}</shape>")
}

fn floor(bsdf: &str) -> String {
    shape("rectangle", "<scale value='4'/><rotate x='1' angle='-90'/>", bsdf)
}

/// A hundred lamps in rows behind screens, of strengths from 1 to 30, over a glossy floor.
fn many_lamps() -> String {
    let mut text = floor("<bsdf type='roughplastic'><float name='alpha' value='0.3'/></bsdf>");
    for i in 0..100u32 {
        let (x, z) = ((i % 10) as f32 * 0.6 - 2.7, (i / 10) as f32 * 0.5 - 3.0);
        let (size, radiance) = (0.03 + 0.01 * (i % 5) as f32, [1.0, 3.0, 10.0, 30.0][(i * 7 % 4) as usize]);
        let place = format!(
            "<scale value='{size}'/><rotate x='1' angle='{}'/><translate x='{x}' y='{}' z='{z}'/>",
            60 + i % 7 * 10,
            0.6 + 0.2 * (i % 6) as f32
        );
        let light = format!("<emitter type='area'><rgb name='radiance' value='{radiance}, {radiance}, 2'/></emitter>");
        text += &shape("rectangle", &place, &light);
    }
    for i in 0..3 {
        let place =
            format!("<scale x='0.05' y='0.8' z='1.5'/><translate x='{}' y='0.8' z='-1'/>", i as f32 * 1.5 - 1.6);
        text += &shape("cube", &place, "<bsdf type='diffuse'/>");
    }
    text
}

/// Sky, sun, spot, a mesh of hundreds of triangles, a textured lamp, on materials that reflect, transmit and are bumpy.
fn all_kinds() -> String {
    let mut text = floor(
        "<bsdf type='bumpmap'><texture type='bitmap'><string name='filename' value='textures/height.png'/></texture>\
         <float name='scale' value='0.4'/><bsdf type='roughplastic'/></bsdf>",
    );
    let _ = write!(
        text,
        "<emitter type='constant'><rgb name='radiance' value='0.2'/></emitter>\
         <emitter type='directional'><vector name='direction' value='1, -2, -0.5'/><rgb name='irradiance' value='0.5'/></emitter>\
         <emitter type='spot'><transform name='to_world'><lookat origin='2, 3, 1' target='0, 0, 0' up='1, 0, 0'/></transform>\
         <rgb name='intensity' value='5'/></emitter>\
         <shape type='obj'><string name='filename' value='meshes/vase.obj'/><transform name='to_world'><scale value='0.4'/>\
         <translate x='-1.2' y='0.6'/></transform><emitter type='area'><rgb name='radiance' value='2, 3, 1'/></emitter></shape>"
    );
    text += &shape(
        "rectangle",
        "<scale value='0.5'/><translate x='0.3' y='1' z='-1.5'/>",
        "<emitter type='area'><texture type='bitmap' name='radiance'><string name='filename' value='textures/picture.png'/>\
         <boolean name='raw' value='true'/></texture></emitter>",
    );
    text += &shape(
        "sphere",
        "<scale value='0.5'/><translate x='1.2' y='0.6' z='0.5'/>",
        "<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>",
    );
    text
}

/// Round lamps of all sizes over rough and smooth metal: half of their light is found by the BSDF.
fn mirrors() -> String {
    let mut text = floor("<bsdf type='roughconductor'><float name='alpha' value='0.1'/></bsdf>");
    for (i, radius) in [0.02, 0.08, 0.3, 0.7].into_iter().enumerate() {
        let place = format!("<scale value='{radius}'/><translate x='{}' y='1.2' z='-1.5'/>", i as f32 * 1.3 - 2.0);
        let light = format!("<emitter type='area'><rgb name='radiance' value='{}, 1, 1'/></emitter>", 1.0 / radius);
        text += &shape(["sphere", "disk", "cylinder", "sphere"][i], &place, &light);
    }
    text += &shape("sphere", "<scale value='0.4'/><translate y='0.4' z='1'/>", "<bsdf type='plastic'/>");
    text
}

/// Passes with different random numbers.
fn measured(text: &str, first_seed: u32) -> Measured {
    let scene = load_text(text, &repository("scenes/tests/assets"));
    let passes: Vec<Image> = (0..16).map(|i| render(&scene, 32, first_seed + i, SampleOrder::PerSample).0).collect();
    let channels = ["R", "G", "B"].map(str::to_owned);
    Measured::of(&passes, &channels).expect("passes")
}

fn scenes() -> [(&'static str, String); 3] {
    [("many lamps", many_lamps()), ("all kinds", all_kinds()), ("mirrors", mirrors())]
}

#[test]
fn pictures_do_not_depend_on_the_light_sampler() {
    let integrators = ["path", "direct", "volpath", "volpathmis"];
    let scenes = scenes();
    let nested = |integrator: &str, inner: &str| {
        let more = if integrator == "direct" { "shading_samples" } else { "max_depth" };
        // Small lamps that the camera sees give noise that no light sampler has a part in.
        let hidden = "<boolean name='hide_emitters' value='true'/>";
        format!("<integrator type='{integrator}'><integer name='{more}' value='3'/>{hidden}{inner}</integrator>")
    };
    let cases: Vec<(usize, usize, usize)> = (0..scenes.len())
        .flat_map(|scene| (0..SAMPLERS.len()).map(move |sampler| (scene, 0, sampler)))
        .chain((1..integrators.len()).flat_map(|i| [2, 3].map(|sampler| (i - 1, i, sampler))))
        .collect();
    let level = LEVEL / cases.len() as f64;
    // Samples without a plugin, for all light samplers of a scene and an integrator.
    let pairs: BTreeSet<(usize, usize)> = cases.iter().map(|(scene, integrator, _)| (*scene, *integrator)).collect();
    let picture = |scene: usize, integrator: usize, sampler: &str, seed: u32| {
        measured(&around(&nested(integrators[integrator], sampler), &scenes[scene].1), seed)
    };
    let theirs: BTreeMap<_, _> = pairs.into_par_iter().map(|pair| (pair, picture(pair.0, pair.1, "", 1))).collect();
    let failed: Vec<String> = (cases.par_iter().enumerate())
        .filter_map(|(i, &(scene, integrator, sampler))| {
            let theirs = &theirs[&(scene, integrator)];
            let again = |seed| {
                let ours = picture(scene, integrator, SAMPLERS[sampler], seed);
                compare(&ours, theirs, true, level).expect("the same size")
            };
            let found = again(1000 * (i as u32 + 1));
            // A test that cannot find an error of some per cent says nothing.
            let blind = found.detectable() > 0.1;
            // Light that few samples find looks like none: what is wrong must be so with other numbers on both sides.
            let wrong = || {
                let (ours, theirs) = (
                    picture(scene, integrator, SAMPLERS[sampler], 1000 * (i as u32 + 1) + 500),
                    picture(scene, integrator, "", 500),
                );
                let second = compare(&ours, &theirs, true, level).expect("the same size");
                found.is_confirmed_by(&second, level)
            };
            (blind || (!found.agrees() && wrong())).then(|| {
                let (name, kind) = (scenes[scene].0, integrators[integrator]);
                let worst = [Scale::Pixel, Scale::Tile, Scale::Mean].map(|scale| found.test(scale).worst().0.t);
                format!("{name}, {kind}, {}: {worst:?}, detectable {}", SAMPLERS[sampler], found.detectable())
            })
        })
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// Without a plugin and with `uniform`, the same numbers are spent in the same way.
#[test]
fn uniform_is_what_is_done_without_a_plugin() {
    for (name, scene) in scenes() {
        let [plain, with] =
            ["<integrator type='path'/>", "<integrator type='path'><light_sampler type='uniform'/></integrator>"].map(
                |integrator| {
                    let scene = load_text(&around(integrator, &scene), &repository("scenes/tests/assets"));
                    render(&scene, 4, 0, SampleOrder::PerSample).0.data
                },
            );
        assert_eq!(plain, with, "{name}");
    }
}

/// Nested in `moment` and `aov`, a light sampler is made ready as well.
#[test]
fn integrators_inside_others_choose_their_lights() {
    let path = "<integrator type='path' name='p'><light_sampler type='power'/></integrator>";
    let picture = |integrator: &str| {
        let scene = load_text(&around(integrator, &many_lamps()), Path::new("."));
        let image = render(&scene, 4, 0, SampleOrder::PerSample).0;
        let channels = image.channels.len();
        let colour: Vec<f32> = image.data.chunks(channels).flat_map(|pixel| pixel[..3].to_vec()).collect();
        colour
    };
    let alone = picture(path);
    assert!(alone != picture("<integrator type='path'/>"));
    for outer in ["moment", "aov"] {
        let aovs = if outer == "aov" { "<string name='aovs' value='d:depth'/>" } else { "" };
        assert!(alone == picture(&format!("<integrator type='{outer}'>{aovs}{path}</integrator>")), "{outer}");
    }
}
