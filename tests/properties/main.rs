//! What holds for every plugin of a kind, for every plugin there is.
//!
//! Each file walks the registry for its kind: a table has configurations of every plugin, and a registered plugin that
//! is not in the table is a failure. Statistical tests have fixed seeds and a level of 1 % for all tests of a property
//! together (Šidák). Each kind ends with a test of the tests: errors of one or a few per cent, planted into right
//! plugins, must be found.

mod bsdfs;
mod emitters;
mod light_samplers;
mod rfilters;
mod samplers;
mod shapes;
mod support;
mod textures;

use lucerna::core::scene::ObjectKind;

/// Sensors, films and integrators have no density of their own to test: they are under test in `plugins` beside their
/// code, and whole pictures in `tests/analytic.rs` and `tests/references.rs`. Guides and roulettes are in `tests/guiding`.
const ELSEWHERE: [ObjectKind; 5] =
    [ObjectKind::Sensor, ObjectKind::Film, ObjectKind::Integrator, ObjectKind::Guide, ObjectKind::Roulette];
const HERE: [ObjectKind; 7] = [
    ObjectKind::Bsdf,
    ObjectKind::Emitter,
    ObjectKind::Shape,
    ObjectKind::Texture,
    ObjectKind::Rfilter,
    ObjectKind::Sampler,
    ObjectKind::LightSampler,
];

#[test]
fn every_kind_is_under_test() {
    for plugin in lucerna::builtin().all() {
        let kind = plugin.build.kind();
        assert!(HERE.contains(&kind) || ELSEWHERE.contains(&kind), "nothing here is about {}", kind.tag());
    }
}
