//! Light samplers: chances add up, are those of the choices made, and are never zero where light could arrive.

use crate::support::{assert_every_plugin_is_configured, assert_none, failures, light_sampler, plugin_of, uniform};
use lucerna::core::interfaces::{Light, LightPoint, LightSample, LightSelection, LightVertex};
use lucerna::core::math::{Vec2, Vec3};
use lucerna::core::sampling::{Pcg32, Stream};
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{EmitterId, ObjectKind, Scene, instantiate, resolve, upgrade};
use lucerna::core::stats::chi2::pearson;
use std::fmt::Write;
use std::path::Path;

/// The table: light samplers to test.
const CONFIGURATIONS: &[&str] = &[
    "<light_sampler type='uniform'/>",
    "<light_sampler type='power'/>",
    "<light_sampler type='light_tree'/>",
    "<light_sampler type='ris'/>",
    "<light_sampler type='ris'><integer name='candidates' value='3'/><light_sampler type='power'/></light_sampler>",
];

#[test]
fn every_light_sampler_is_configured() {
    assert_every_plugin_is_configured(ObjectKind::LightSampler, CONFIGURATIONS.iter().map(|xml| plugin_of(xml)));
}

/// A scene from what is in it.
fn scene(inner: &str) -> Scene {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/assets");
    let options = LoadOptions { search_path: vec![assets], ..LoadOptions::default() };
    let text = format!("<scene version='3.9.1'>{inner}</scene>");
    let described = || {
        let mut description = load_str(&text, "lights", &options)?;
        resolve::resolve(&mut description)?;
        upgrade::upgrade(&mut description);
        instantiate(&lucerna::builtin(), description, false)
    };
    described().unwrap_or_else(|errors| panic!("{errors}")).scene
}

fn placed(shape: &str, transform: &str, radiance: f32) -> String {
    format!(
        "<shape type='{shape}'><transform name='to_world'>{transform}</transform>\
         <emitter type='area'><rgb name='radiance' value='{radiance}'/></emitter></shape>"
    )
}

fn point(p: Vec3, intensity: f32) -> String {
    let Vec3 { x, y, z } = p;
    format!(
        "<emitter type='point'><point name='position' x='{x}' y='{y}' z='{z}'/>\
         <rgb name='intensity' value='{intensity}'/></emitter>"
    )
}

fn in_box(pcg: &mut Pcg32, reach: f32) -> Vec3 {
    Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) * (2.0 * reach) - reach
}

/// Points and small squares anywhere, facing anywhere, of strengths that differ by up to four orders of magnitude.
fn crowd(count: usize) -> String {
    let mut pcg = Pcg32::new(3, 3);
    let mut text = String::new();
    for i in 0..count {
        let at = in_box(&mut pcg, 4.0);
        let strength = 10f32.powf(4.0 * pcg.next_f32() - 2.0);
        if i % 3 == 0 {
            text += &point(at, strength);
            continue;
        }
        let towards = at + in_box(&mut pcg, 1.0);
        let size = 0.05 + 0.4 * pcg.next_f32();
        let transform = format!(
            "<scale value='{size}'/><lookat origin='{}, {}, {}' target='{}, {}, {}' up='0.3, 1, 0.2'/>",
            at.x, at.y, at.z, towards.x, towards.y, towards.z
        );
        text += &placed("rectangle", &transform, strength);
    }
    text
}

/// Scenes whose lights are of all kinds, many, alone, coincident, black, without area.
fn scenes() -> Vec<(&'static str, Scene)> {
    let spot = "<emitter type='spot'><transform name='to_world'><lookat origin='0, 2, 0' target='0.3, 0, 0.1' up='1, 0, 0'/>\
                </transform><float name='cutoff_angle' value='30'/></emitter>";
    let sky = "<emitter type='constant'><rgb name='radiance' value='0.3'/></emitter>";
    let sun = "<emitter type='directional'><vector name='direction' value='1, -2, 0.5'/></emitter>";
    let mesh = "<shape type='obj'><string name='filename' value='meshes/vase.obj'/><emitter type='area'/></shape>";
    let cube = placed("cube", "<scale value='0.3'/><rotate y='1' angle='30'/><translate x='2'/>", 2.0);
    let ball = placed("sphere", "<scale value='0.4'/><translate x='-2' y='1'/>", 1.0);
    let pipe = placed("cylinder", "<scale value='0.4'/><translate z='-2' y='1'/>", 1.0);
    let disk = placed("disk", "<scale value='0.4'/><rotate x='1' angle='70'/><translate z='2' y='1'/>", 1.0);
    let black = placed("rectangle", "<scale value='0.4'/>", 0.0);
    let mut pile = String::new();
    for _ in 0..40 {
        pile += &point(Vec3::new(0.5, 0.5, 0.5), 1.0);
        pile += &placed("rectangle", "<scale value='0.2'/>", 1.0);
    }
    let mut far = crowd(20);
    far += &point(Vec3::new(1e12, 0.0, 0.0), 1e6);
    far += &point(Vec3::new(0.1, 0.0, 0.0), 1e-6);
    let of_all_kinds = [spot, sky, sun, mesh, &cube, &ball, &pipe, &disk, &black].concat();
    // hc_e03: triangles without area, and one that is there twice, beside good ones.
    let file =
        std::env::temp_dir().join(format!("lucerna-flat-{}-{:?}.obj", std::process::id(), std::thread::current().id()));
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 0 0 1\nf 1 2 4\nf 1 2 3\nf 1 1 2\nf 1 2 3\nf 1 2 5\nf 3 3 3\n";
    std::fs::write(&file, obj).expect("a temporary file");
    let name = file.display();
    let flat = format!("<shape type='obj'><string name='filename' value='{name}'/><emitter type='area'/></shape>");
    let flat = scene(&flat);
    std::fs::remove_file(&file).expect("the temporary file");
    vec![
        ("flat triangles", flat),
        ("crowd", scene(&crowd(60))),
        ("all kinds", scene(&of_all_kinds)),
        ("one light", scene(&disk)),
        ("only a sky", scene(sky)),
        ("sky and sun", scene(&[sky, sun].concat())),
        ("only black lights", scene(&black)),
        ("no light", scene("<shape type='sphere'/>")),
        ("a pile", scene(&pile)),
        ("far and faint", scene(&far)),
        ("mesh", scene(mesh)),
    ]
}

/// All lights there are, as the selection counts them.
fn lights(scene: &Scene, selection: &dyn LightSelection) -> Vec<Light> {
    let mut all = Vec::new();
    for id in (0..scene.emitters().len() as u32).map(EmitterId) {
        if selection.in_parts() {
            all.extend((0..scene.emitter(id).part_count()).map(|part| Light { emitter: id, part: Some(part) }));
        } else {
            all.push(Light::whole(id));
        }
    }
    all
}

/// Vertices near and far, on lights and inside their boxes, looking everywhere and towards lights; some that scatter
/// from all sides.
fn vertices(scene: &Scene, count: usize) -> Vec<LightVertex> {
    let mut pcg = Pcg32::new(7, 1);
    let on_lights: Vec<Vec3> = (scene.emitters().iter())
        .filter_map(|light| light.sample_direct(Vec3::new(0.3, 0.2, 0.1), Vec2::new(0.3, 0.6)))
        .filter(|sample| sample.point.distance.is_finite())
        .map(|sample| sample.point.p)
        .collect();
    (0..count)
        .map(|i| {
            let mut p = in_box(&mut pcg, [1.0, 5.0, 50.0][i % 3]);
            if i % 4 == 0 && !on_lights.is_empty() {
                let near = [0.0, 1e-6, 1e-3, 0.1][i / 4 % 4];
                p = on_lights[i % on_lights.len()] + in_box(&mut pcg, 1.0) * near;
            }
            let n = if i % 7 == 0 { Vec3::ZERO } else { in_box(&mut pcg, 1.0).normalize_or(Vec3::X) };
            LightVertex { p, n }
        })
        .collect()
}

fn prepared(scene: &Scene) -> Vec<(&'static str, Box<dyn LightSelection>)> {
    CONFIGURATIONS.iter().map(|xml| (*xml, light_sampler(xml).prepare(scene))).collect()
}

#[test]
fn what_is_built_is_in_order() {
    for (name, scene) in scenes() {
        for (xml, selection) in prepared(&scene) {
            assert_eq!(selection.validate(), Ok(()), "{xml} {name}");
        }
    }
}

#[test]
fn chances_add_up_and_are_those_of_the_choices() {
    let scenes = scenes();
    let mut cases = Vec::new();
    for (name, scene) in &scenes {
        for (xml, selection) in prepared(scene) {
            for from in vertices(scene, 24) {
                cases.push((*name, xml, scene, from));
            }
            drop(selection);
        }
    }
    let failed = failures(
        &cases,
        |(name, xml, _, from)| format!("{name}, {xml}, {from:?}"),
        |(name, xml, scene, from)| {
            let selection = light_sampler(xml).prepare(scene);
            let all = lights(scene, &*selection);
            let pmf: Vec<f32> = all.iter().map(|light| selection.pmf(from, *light)).collect();
            let sum: f64 = pmf.iter().map(|p| f64::from(*p)).sum();
            assert!(pmf.iter().all(|p| *p >= 0.0) && sum < 1.0 + 1e-5, "{name}, {xml}, {from:?}: sum {sum}");
            let draws = 4000;
            let mut observed = vec![0; all.len() + 1];
            let mut pcg = Pcg32::new(11, 5);
            for _ in 0..draws {
                let u = (f64::from(pcg.next_u32()) + 0.5) / 4_294_967_296.0;
                let cell = match selection.choose(from, u) {
                    None => all.len(),
                    Some((light, p)) => {
                        let at = all.iter().position(|other| *other == light).expect("a light of the scene");
                        assert!(p > 0.0 && p == pmf[at], "{name}, {xml}, {from:?}: {light:?} {p} {}", pmf[at]);
                        at
                    }
                };
                observed[cell] += 1;
            }
            let mut expected: Vec<f64> = pmf.iter().map(|p| f64::from(*p) * f64::from(draws)).collect();
            expected.push((1.0 - sum).max(0.0) * f64::from(draws));
            // Rounding of the sum is no chance.
            if expected[all.len()] < 1e-2 {
                assert_eq!(observed[all.len()], 0, "{name}, {xml}, {from:?}: chose nothing");
                expected.pop();
                observed.pop();
            }
            if all.is_empty() || pmf.iter().filter(|p| **p > 0.0).count() + usize::from(sum < 0.999) < 2 {
                return lucerna::core::stats::chi2::Chi2::of_statistic(0.0, 1);
            }
            pearson(&observed, &expected)
        },
    );
    assert_none(&failed);
}

/// Light that a sample of a light brings to a vertex that scatters like a diffuse surface.
fn arrives(from: &LightVertex, d: Vec3, weight: f32) -> bool {
    let cos = if from.n == Vec3::ZERO { 1.0 } else { from.n.dot(d) };
    weight > 0.0 && cos > 0.0
}

#[test]
fn no_light_that_could_arrive_is_left_out() {
    let mut lit = 0;
    for (name, scene) in scenes() {
        for (xml, selection) in prepared(&scene) {
            let mut pcg = Pcg32::new(2, 9);
            for from in vertices(&scene, 1500) {
                for light in lights(&scene, &*selection) {
                    let Some(sample) = scene.sample_light(light, 1.0, from.p, uniform(&mut pcg)) else { continue };
                    if arrives(&from, sample.point.d, sample.weight.luminance()) {
                        lit += 1;
                        assert!(
                            selection.pmf(&from, light) > 0.0,
                            "{name}, {xml}: {light:?} from {from:?}, {sample:?}"
                        );
                    }
                }
            }
        }
    }
    assert!(lit > 100_000, "{lit}");
}

/// The density that a chance hit is weighted by is that of the samples.
#[test]
fn densities_are_those_of_the_samples() {
    for (name, scene) in scenes() {
        for (xml, selection) in prepared(&scene) {
            let mut stream = Stream::independent(Pcg32::new(4, 4));
            for from in vertices(&scene, 300) {
                let worth = |sample: &LightSample| sample.weight.luminance();
                let Some(sample) = selection.sample(&scene, &from, &mut stream, &worth) else { continue };
                if sample.delta {
                    continue;
                }
                let Some(emitter) = emitter_of(&scene, &sample.point, &from) else { continue };
                let pdf = selection.pdf(&scene, emitter, &from, &sample.point);
                let close = (pdf - sample.pdf).abs() <= 2e-3 * sample.pdf;
                assert!(close, "{name}, {xml}, {from:?}: {pdf}, not {}, at {sample:?}", sample.pdf);
            }
        }
    }
}

/// The one emitter on which a sampled point is, if that is beyond doubt.
fn emitter_of(scene: &Scene, point: &LightPoint, from: &LightVertex) -> Option<EmitterId> {
    let all = (0..scene.emitters().len() as u32).map(EmitterId);
    if point.distance.is_infinite() {
        return scene.environment();
    }
    use lucerna::core::accel::Ray;
    if point.distance < 1e-2 {
        return None;
    }
    let ray = Ray::new(from.p + point.d * (point.distance - 1e-3), point.d);
    let hit = scene.intersect_surface(&ray).filter(|hit| (hit.p - point.p).length() < 2e-3)?;
    let emitter = scene.emitter_at(&hit)?;
    (hit.triangle == point.triangle && all.into_iter().any(|id| id == emitter)).then_some(emitter)
}

/// A light that is hit by chance has the part that a sample of it has.
#[test]
fn parts_of_hits_are_those_of_samples() {
    let mut text = String::new();
    let _ = write!(text, "{}", crowd(5));
    text += "<shape type='obj'><string name='filename' value='meshes/vase.obj'/><emitter type='area'/></shape>";
    let scene = scene(&text);
    let id = (0..scene.emitters().len() as u32).map(EmitterId).find(|id| scene.emitter(*id).part_count() > 1);
    let id = id.expect("a mesh");
    let mut found = 0;
    let mut pcg = Pcg32::new(2, 2);
    for part in 0..scene.emitter(id).part_count() {
        let from = in_box(&mut pcg, 5.0);
        let light = Light { emitter: id, part: Some(part) };
        let Some(sample) = scene.sample_light(light, 0.5, from, uniform(&mut pcg)) else { continue };
        assert_eq!(scene.light_part(id, &sample.point), Some(part));
        let pdf = 0.5 * scene.pdf_light(light, from, &sample.point);
        assert!((pdf - sample.pdf).abs() < 1e-3 * pdf, "{pdf} {sample:?}");
        let whole = scene.emitter(id).sample_part(part, from, Vec2::splat(0.3)).map(|s| s.weight * s.pdf);
        let radiance = scene.emitter(id).sample_direct(from, Vec2::splat(0.3)).map(|s| s.weight * s.pdf);
        if let (Some(a), Some(b)) = (whole, radiance) {
            assert!((a.luminance() - b.luminance()).abs() < 1e-4 * b.luminance());
        }
        found += 1;
    }
    assert!(found > 20, "{found}");
}

/// Mean irradiance at a vertex, nothing in between, and its standard error.
fn mean_light(scene: &Scene, selection: &dyn LightSelection, from: &LightVertex) -> [f64; 2] {
    let mut stream = Stream::independent(Pcg32::new(8, 2));
    let (count, mut sum, mut squares) = (20_000, 0.0, 0.0);
    for _ in 0..count {
        let arriving = |sample: &LightSample| {
            let cos = if from.n == Vec3::ZERO { 1.0 } else { from.n.dot(sample.point.d).max(0.0) };
            sample.weight.luminance() * cos
        };
        let sample = selection.sample(scene, from, &mut stream, &arriving);
        let found = sample.map_or(0.0, |sample| f64::from(arriving(&sample)));
        (sum, squares) = (sum + found, squares + found * found);
    }
    let mean = sum / f64::from(count);
    [mean, ((squares / f64::from(count) - mean * mean).max(0.0) / f64::from(count)).sqrt()]
}

/// All light samplers find the same light: what one of them gets wrong, by chance, weight or density, would show.
#[test]
fn all_find_the_same_light() {
    let (mut wrong, mut compared, mut lit) = (Vec::new(), 0, 0);
    for (name, scene) in scenes() {
        if name == "far and faint" {
            // Of a light with nearly all the power, and a chance that is all but zero, nobody tells a mean by sampling.
            continue;
        }
        let selections = prepared(&scene);
        for from in vertices(&scene, 12).into_iter().skip(1).step_by(2) {
            let means: Vec<_> = selections.iter().map(|(_, s)| mean_light(&scene, &**s, &from)).collect();
            lit += u32::from(means[0][0] > 0.0);
            for (i, [mean, error]) in means.iter().enumerate().skip(1) {
                let [expected, other] = means[0];
                let sigma = error.hypot(other) + 1e-4 * expected;
                compared += 1;
                if (mean - expected).abs() > 4.5 * sigma {
                    wrong.push(format!("{name}, {}, {from:?}: {mean}, not {expected} ± {sigma}", selections[i].0));
                }
            }
        }
    }
    assert_none(&wrong);
    assert!(compared > 150 && lit > 30, "{compared} {lit}");
}
