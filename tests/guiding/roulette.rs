//! Roulette that goes by what was learnt: unbiased whatever that is, and of effect.

use super::unbiased::{agree, path};
use super::{SCENES, guided, scene};
use crate::support::render;
use lucerna::core::color::Rgb;
use lucerna::core::interfaces::{Goal, Guide, Outlook, PathState, Roulette, continuations};
use lucerna::core::render::{Budget, Control, RenderContext, SampleOrder};
use lucerna::core::scene::{
    Built, Constructor, Description, Location, Node, Object, ObjectKind, Param, Parameter, Plugin, Properties, Value,
    build_one,
};
use lucerna::core::stats::figures::measured;
use std::sync::{Arc, Mutex};

/// Table entry of a roulette that counts what another one decides.
pub const PLUGIN: Plugin = Plugin {
    name: "counted",
    aliases: &[],
    summary: "counts what another one decides",
    params: &[&[Param::string("of", "adjoint", "the other one")]],
    build: Constructor::Roulette(|p: &Properties<'_>| -> Built<dyn Roulette> {
        Ok(Arc::new(Counted { inner: roulette(p.string("of"), &[]) }))
    }),
};

/// A roulette with these parameters.
fn roulette(name: &str, parameters: &[(&str, f64)]) -> Arc<dyn Roulette> {
    let at = Location::file("roulette".to_owned());
    let parameter = |(name, value): &(&str, f64)| Parameter {
        name: (*name).to_owned(),
        value: Value::Float(*value),
        at: at.clone(),
    };
    let parameters = parameters.iter().map(parameter).collect();
    let (kind, plugin) = (ObjectKind::Roulette, name.to_owned());
    let node = Node { kind, plugin, id: None, parameters, at: at.clone(), included_from: Vec::new() };
    match build_one(&lucerna::builtin(), &Description::of(node)) {
        Ok(Object::Roulette(roulette)) => roulette,
        Ok(_) => panic!("{name} is no roulette"),
        Err(e) => panic!("{e}"),
    }
}

/// How often a number of continuations was below one, one, or above, with the sums of those numbers.
#[derive(Clone, Copy, Default)]
struct Tally {
    fewer: (u64, f64),
    one: u64,
    more: (u64, f64),
}

/// The tally of all that were counted in this process, for a plugin has no other way to tell.
static COUNTED: Mutex<Tally> = Mutex::new(Tally { fewer: (0, 0.0), one: 0, more: (0, 0.0) });

struct Counted {
    inner: Arc<dyn Roulette>,
}

impl Roulette for Counted {
    fn teacher(&self) -> Option<Arc<dyn Guide>> {
        self.inner.teacher()
    }

    fn branches(&self, path: &PathState, albedo: Rgb, outlook: Option<Outlook>) -> f32 {
        let answer = self.inner.branches(path, albedo, outlook);
        let count = f64::from(continuations(answer));
        let mut tally = COUNTED.lock().expect("no panic");
        if count < 1.0 {
            tally.fewer = (tally.fewer.0 + 1, tally.fewer.1 + count);
        } else if count > 1.0 {
            tally.more = (tally.more.0 + 1, tally.more.1 + count);
        } else {
            tally.one += 1;
        }
        answer
    }

    fn survival(&self, path: &PathState) -> f32 {
        self.inner.survival(path)
    }
}

/// The decisions that go by what was learnt.
const LEARNT: [&str; 2] = ["adjoint", "efficiency"];

#[test]
fn roulette_by_what_was_learnt_is_unbiased() {
    let guide = guided(200, "");
    let mut ways: Vec<String> = LEARNT.iter().map(|name| format!("<roulette type='{name}'/>")).collect();
    ways.push("<roulette type='adjoint'><float name='window' value='1'/></roulette>".to_owned());
    ways.extend(["throughput", "adjoint", "efficiency"].map(|name| format!("{guide}<roulette type='{name}'/>")));
    let blind = agree(&SCENES, &ways, 9, 64);
    measured(
        "roulette_by_what_was_learnt_is_unbiased",
        format!(
            "{} ways in {} scenes agree; an error of {:.1} % of the mean would be found",
            ways.len(),
            SCENES.len(),
            100.0 * blind
        ),
    );
}

/// Whatever a field tells of what lies ahead, pictures are those of `path`. Paths are short: after many vertices at which
/// one in twenty goes on, a picture of few samples lacks what is rare; and where all split, their number is a power of
/// twenty.
#[test]
fn hc_p14_corrupted_outlooks_are_unbiased() {
    let scenes = [SCENES[0], SCENES[1]];
    let (mut blind, mut count): (f64, usize) = (0.0, 0);
    for (outlooks, depth) in [(&["zero", "nan", "random"][..], 4), (&["huge"], 3)] {
        let corrupted = |outlook: &&str| {
            LEARNT.map(|name| {
                format!(
                    "<guide type='corrupted'><string name='way' value='empty'/>
                     <string name='outlook' value='{outlook}'/></guide><roulette type='{name}'/>"
                )
            })
        };
        let ways: Vec<String> = outlooks.iter().flat_map(corrupted).collect();
        blind = blind.max(agree(&scenes, &ways, depth, 24));
        count += ways.len();
    }
    measured(
        "hc_p14_corrupted_outlooks_are_unbiased",
        format!(
            "{count} ways in {} scenes agree; an error of {:.1} % of the mean would be found",
            scenes.len(),
            100.0 * blind
        ),
    );
}

#[test]
fn hc_p14_extremes_never_kill_a_path_for_good() {
    let extremes = [0.0, 1e-30, 1e-3, 1.0, 1e30, f32::INFINITY, f32::NAN];
    let mut asked = 0;
    for name in LEARNT {
        let roulette = roulette(name, &[]);
        for throughput in extremes {
            for image in extremes {
                for light in extremes {
                    for (square, cost, due) in
                        [(0.0, 0.0, false), (1e30, 1e30, true), (1.0, 3.0, true), (light, 1.0, false)]
                    {
                        let throughput = Rgb::splat(throughput);
                        let goal = Goal { image, effort: 2.0 };
                        let (prospects, eta, passage) = (throughput, 1.0, 1.0);
                        let path = PathState { throughput, prospects, eta, passage, due, depth: 9, goal };
                        for outlook in [None, Some(Outlook { light, square, spread: square, cost })] {
                            let count = continuations(roulette.branches(&path, Rgb::splat(0.5), outlook));
                            assert!((0.05..=20.0).contains(&count), "{name}: {path:?}, {outlook:?}: {count}");
                            asked += 1;
                        }
                        if light == 0.0 && !due {
                            let outlook = Outlook { light, square: 0.0, spread: 0.0, cost };
                            let count = continuations(roulette.branches(&path, Rgb::splat(0.5), Some(outlook)));
                            assert_eq!(count, 1.0, "{name}: nothing was learnt, {path:?}");
                        }
                    }
                }
            }
        }
    }
    measured("hc_p14_extremes_never_kill_a_path_for_good", format!("{asked} answers in [0.05, 20]"));
}

/// A guide lowers the throughput where it sends paths to a lamp through glass: they must not end at the glass. Where
/// delta lobes swallow light paths end, and also where they never do.
#[test]
fn paths_that_are_guided_through_glass_go_on() {
    let dim = Rgb::splat(1e-4);
    let state = |passage, depth| {
        let goal = Goal { image: 1.0, effort: 2.0 };
        PathState { throughput: dim, prospects: dim, eta: 1.0, passage, due: true, depth, goal }
    };
    for name in LEARNT {
        let roulette = roulette(name, &[]);
        for (passage, depth, expected) in
            [(1.0, 9, 1.0), (2.0, 9, 1.0), (0.25, 9, 0.25), (1e-9, 9, 0.05), (1.0, 1000, 0.95), (0.25, 1000, 0.25)]
        {
            assert_eq!(roulette.survival(&state(passage, depth)), expected, "{name}: {passage} after {depth}");
        }
    }
}

/// A rule that in effect does nothing would be unbiased, too.
#[test]
fn paths_end_and_split() {
    let mut told = Vec::new();
    for name in LEARNT {
        *COUNTED.lock().expect("no panic") = Tally::default();
        let counted = format!("<roulette type='counted'><string name='of' value='{name}'/></roulette>");
        let scene = scene(SCENES[0].1, &path(40, &counted));
        render(&scene, 64, 1, SampleOrder::PerSample);
        let Tally { fewer, one, more } = *COUNTED.lock().expect("no panic");
        let (survival, split) = (fewer.1 / fewer.0 as f64, more.1 / more.0 as f64);
        let all = (fewer.0 + one + more.0) as f64;
        assert!(fewer.0 as f64 > 0.1 * all && survival < 0.8, "{name}: {} of {all} survive by {survival}", fewer.0);
        assert!(more.0 > 100 && split > 1.1, "{name}: {} of {all} split into {split}", more.0);
        told.push(format!(
            "{name}: {:.2} of all survive by {survival:.2}, {:.3} split into {split:.2}",
            fewer.0 as f64 / all,
            more.0 as f64 / all
        ));
    }
    measured("paths_end_and_split", told.join("; "));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let guide = guided(100, "");
    for name in LEARNT {
        for guide in ["", &guide] {
            let picture = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
                pool.install(|| {
                    let scene = scene(SCENES[1].1, &path(30, &format!("{guide}<roulette type='{name}'/>")));
                    let (integrator, control) = (scene.integrator().expect("there is one"), Control::new());
                    let (sensor, budget) = (&scene.sensors()[0], Budget::Samples(40));
                    let mut cx = RenderContext::new(&scene, sensor, budget, 1, &control, Vec::new());
                    integrator.render(&mut cx).expect("it renders");
                    cx.store.develop(&cx.film).1.iter().map(|v| v.to_bits()).collect::<Vec<u32>>()
                })
            };
            let one = picture(1);
            assert!(one.iter().any(|bits| f32::from_bits(*bits) > 0.0), "black");
            assert!(picture(2) == one && picture(7) == one, "{name} {guide}");
        }
    }
}

/// What is there without a roulette, under its name.
#[test]
fn throughput_and_adjoint_are_the_defaults() {
    let guide = guided(100, "");
    let data = |more: &str| render(&scene(SCENES[1].1, &path(30, more)), 24, 1, SampleOrder::PerSample).0.data;
    assert!(data("") == data("<roulette type='throughput'/>"));
    assert!(data("") == data("<roulette type='albedo'/>"));
    assert!(data(&guide) == data(&format!("{guide}<roulette type='adjoint'/>")));
    for other in ["throughput", "albedo"] {
        assert!(data(&guide) != data(&format!("{guide}<roulette type='{other}'/>")), "{other}");
    }
}
