//! Photons: as much arrives as is let through, of light that paths can meet, the same however they are asked for.

use super::scene;
use lucerna::core::interfaces::Photon;
use lucerna::core::render::Photons;
use std::cell::Cell;

/// Narrower lobes are not guided.
const LEAST_ROUGHNESS: f32 = 0.05;

/// A pane, or a thing in its place, of this material one unit above a floor; light from straight above.
fn below(pane: &str, light: &str) -> String {
    format!(
        "<scene version='3.0.0'>{light}
         <shape type='rectangle'><transform name='to_world'><scale value='50'/><rotate x='1' angle='-90'/></transform>
             <bsdf type='diffuse'/></shape>
         {pane}</scene>"
    )
}

/// No path can meet it.
const POINT: &str = "<emitter type='point'><point name='position' value='0, 3, 0'/></emitter>";
/// Far above: its light is nearly parallel, and gives 2 W/m² to a pane, of red, green and blue by 1, 2 and 3.
const SUN: &str = "<shape type='sphere'><point name='center' value='0, 100, 0'/><float name='radius' value='0.1'/>
    <emitter type='area'><rgb name='radiance' value='311979.8, 623959.6, 935939.4'/></emitter></shape>";
/// Nothing arrives at it.
const SKY: &str = "<emitter type='constant'/>";
const LAMP: &str = "<shape type='sphere'><point name='center' value='0, 3, 0'/><float name='radius' value='0.05'/>
    <emitter type='area'><rgb name='radiance' value='100, 100, 100'/></emitter></shape>";

fn pane(material: &str) -> String {
    format!(
        "<shape type='rectangle'><transform name='to_world'><scale x='0.5' y='2'/><rotate x='1' angle='-90'/><translate y='1'/>
         </transform><bsdf type='{material}'/></shape>"
    )
}

/// Those that arrive below the sun, and how many were sent out for each.
fn arrived(text: &str, paths: u64) -> Vec<(Photon, u64)> {
    let scene = scene(text, "");
    let mut photons = Photons::new(&scene, LEAST_ROUGHNESS).expect("turns light");
    assert!(photons.send(paths, 3, || false));
    let emitted = photons.emitted();
    photons.arrived().iter().filter(|photon| photon.p.y < 50.0).map(|photon| (*photon, emitted)).collect()
}

/// Power that arrives on the floor, by the photons, in W.
fn power(photons: &[(Photon, u64)]) -> f64 {
    photons.iter().map(|(photon, emitted)| f64::from(photon.power) / *emitted as f64).sum()
}

#[test]
fn what_a_pane_lets_through_arrives() {
    // A pane of 4 square units and an index of 1.504 lets through (1 - R)/(1 + R), with R = ((n - 1)/(n + 1))^2: 0.922 of what
    // hits it; what is reflected goes back to the sky, or to the sun. Light is still spread a little.
    let photons = arrived(&below(&pane("thindielectric"), SUN), 1_000_000);
    let r = ((1.5046 - 1.0) / (1.5046 + 1.000277_f64)).powi(2);
    let expected = 2.0 * 4.0 * (1.0 - r) / (1.0 + r);
    assert!((power(&photons) / expected - 1.0).abs() < 0.01, "{} {expected}", power(&photons));
    for (photon, _) in &photons {
        assert!(photon.p.y.abs() < 1e-4 && photon.d.y > 0.9997 && photon.p.x.abs() <= 0.507, "{photon:?}");
    }
}

/// A small lamp above a pane: seen from the floor its light comes from where the lamp is.
#[test]
fn light_of_a_lamp_comes_from_where_it_is() {
    let photons = arrived(&below(&pane("thindielectric"), LAMP), 1_000_000);
    assert!(photons.len() > 10_000);
    // What the pane reflects arrives at the lamp itself.
    for (photon, _) in photons.iter().filter(|(photon, _)| photon.p.y < 1.0) {
        let to_lamp = lucerna::core::math::Vec3::new(0.0, 3.0, 0.0) - photon.p;
        let sine = photon.d.cross(to_lamp).length() / to_lamp.length();
        assert!(sine < 0.06 / 3.0, "{photon:?} {sine}");
    }
}

/// What is hidden from the light behind something else does not begin there.
#[test]
fn no_light_comes_through_what_is_opaque() {
    let lid = "<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' angle='90'/>
        <translate y='1.5'/></transform><bsdf type='diffuse'/></shape>";
    assert!(arrived(&below(&(pane("thindielectric") + lid), SUN), 0).is_empty());
    // And a mirror sends all of it back.
    assert!(arrived(&below(&pane("conductor"), SUN), 0).is_empty());
}

#[test]
fn they_are_the_same_however_they_are_asked_for() {
    let scene = scene(&below(&pane("dielectric"), LAMP), "");
    let all = |steps: &[u64], threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let mut photons = Photons::new(&scene, LEAST_ROUGHNESS).expect("turns light");
        pool.install(|| {
            for paths in steps {
                // Stopped at times, and asked again.
                let asked = Cell::new(0);
                photons.send(*paths, 7, || asked.replace(asked.get() + 1) > 0);
                assert!(photons.send(*paths, 7, || false));
            }
        });
        photons.arrived().to_vec()
    };
    let once = all(&[400_000], 1);
    assert!(once.len() > 1000 && once == all(&[0, 50, 100_000, 399_000, 400_000], 3));
}

/// However many are due, not many more are kept than fit, and none are sent out after that.
#[test]
fn no_more_are_sent_than_can_be_kept() {
    let scene = scene(&below(&pane("thindielectric"), SUN), "");
    let mut photons = Photons::new(&scene, LEAST_ROUGHNESS).expect("turns light");
    assert!(photons.send(u64::MAX, 3, || false));
    let (kept, emitted) = (photons.arrived().len(), photons.emitted());
    assert!((1 << 19..(1 << 19) + 4096 * 2).contains(&kept) && emitted < 1 << 20, "{kept} {emitted}");
    assert!(photons.send(u64::MAX, 3, || true), "nothing is left to be stopped");
    assert_eq!((photons.arrived().len(), photons.emitted()), (kept, emitted));
}

/// Where all is sent away, it is given up.
#[test]
fn what_arrives_nowhere_is_given_up() {
    let scene = scene(&below(&pane("conductor"), SKY), "");
    let mut photons = Photons::new(&scene, LEAST_ROUGHNESS).expect("turns light");
    assert!(photons.send(u64::MAX, 3, || false));
    assert!(photons.arrived().is_empty() && photons.emitted() == 65536, "{}", photons.emitted());
}

/// Nothing turns light here: no photons at all.
#[test]
fn where_nothing_turns_light_there_are_none() {
    assert!(Photons::new(&scene(&below(&pane("diffuse"), SUN), ""), LEAST_ROUGHNESS).is_none());
    // Nor is there any light to be turned, or any that a path could meet.
    for light in ["", POINT] {
        assert!(Photons::new(&scene(&below(&pane("dielectric"), light), ""), LEAST_ROUGHNESS).is_none());
    }
    // Beside others it sends out nothing: what arrives is the light of the lamp.
    let both = POINT.replace("value='0, 3, 0'/>", "value='9, 3, 0'/><rgb name='intensity' value='1e6'/>") + LAMP;
    let (alone, both) = (
        power(&arrived(&below(&pane("thindielectric"), LAMP), 1_000_000)),
        power(&arrived(&below(&pane("thindielectric"), &both), 1_000_000)),
    );
    assert!((both / alone - 1.0).abs() < 0.03, "{both} {alone}");
}
