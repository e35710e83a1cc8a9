//! Two sets of directions in each cell: what goes to which, what is drawn from which, and what is kept.

use super::field::{self, REFLECTS, hit, known_at, record};
use super::kept::{SETS, UNIT, checkpoint, file, folder, render, trained};
use super::{guided, scene};
use crate::support::render_with;
use lucerna::core::interfaces::{Arena, GuideField, GuideRecord, GuidedVertex};
use lucerna::core::math::{Vec2, Vec3};
use lucerna::core::render::{Control, GuideFile, Learnt};
use lucerna::core::sampling::Pcg32;
use std::f32::consts::PI;
use std::fs;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Density of a uniform direction.
const UNIFORM: f32 = 0.25 / PI;

const FIRST: GuidedVertex = GuidedVertex { primary: true, ..REFLECTS };

fn of_sets(sets: &str, threshold: u32, more: &str) -> String {
    guided(threshold, &format!("<string name='sets' value='{sets}'/>{more}"))
}

/// What is learnt on a floor below a lamp, half of which is hidden, beside a wall that it lights.
fn half_hidden(name: &str, more: &str) -> Arc<dyn GuideField> {
    let integrator = format!(
        "<integrator type='path'><integer name='max_depth' value='4'/>{}</integrator>",
        of_sets("direct_indirect", 4000, more)
    );
    let scene = scene(include_str!("half_hidden.xml"), &integrator);
    let path = folder(name).join("learnt");
    render_with(&scene, 256, 1, |cx| cx.guide_file = Some(GuideFile { path: path.clone(), frozen: false }));
    let learnt = Learnt::read(&path).expect("a file was written");
    learnt.recall(&*field::guide(""), learnt.bounds).expect("sound").field()
}

/// Light of the lamp is in the set for it, that of the wall in the other; what is hidden is in none.
#[test]
fn light_of_a_half_hidden_lamp_is_learnt_in_the_set_for_it() {
    let field = half_hidden("half_hidden", "");
    for p in [Vec3::ZERO, Vec3::new(0.15, -0.1, 0.0), Vec3::new(-0.1, 0.15, 0.0)] {
        let arena = Arena::new();
        let directions = known_at(&*field, &hit(p, Vec3::Z), REFLECTS, &arena).expect("something was learnt");
        let towards = |x: f32, y: f32, z: f32| directions.pdf_sets((Vec3::new(x, y, z) - p).normalize());
        let (lamp, hidden, wall) = (towards(0.5, 0.0, 2.0), towards(-0.6, 0.0, 2.0), towards(-2.0, 0.0, 0.7));
        assert!(lamp[0] > 20.0 * UNIFORM && lamp[1] < 0.1 * lamp[0], "lamp {lamp:?} at {p}");
        assert!(hidden[0] < 0.1 * lamp[0], "hidden {hidden:?}, lamp {lamp:?} at {p}");
        assert!(wall[1] > 3.0 * UNIFORM && wall[0] < 0.01 * wall[1], "wall {wall:?} at {p}");
        // Both are drawn from.
        let d = (Vec3::new(0.5, 0.0, 2.0) - p).normalize();
        let part = (directions.pdf(d) - lamp[1]) / (lamp[0] - lamp[1]);
        assert!((0.049..0.951).contains(&part), "{part} at {p}");
    }
}

/// Light that emitter sampling finds is in neither, if it is not to be learnt: the rest stands alone.
#[test]
fn light_that_is_not_learnt_is_in_no_set() {
    let field = half_hidden("not_learnt", "<boolean name='direct' value='false'/>");
    let arena = Arena::new();
    let directions = known_at(&*field, &hit(Vec3::ZERO, Vec3::Z), REFLECTS, &arena).expect("something was learnt");
    let [direct, rest] = directions.pdf_sets(Vec3::new(0.5, 0.0, 2.0).normalize());
    assert!(direct == rest && rest < UNIFORM, "{direct} {rest}");
    let wall = Vec3::new(-2.0, 0.0, 0.7).normalize();
    assert!(directions.pdf(wall) > 3.0 * UNIFORM && directions.pdf(wall) == directions.pdf_sets(wall)[1]);
}

/// At first hits what they scattered counts, and no cosine once more; at later vertices the light, times the cosine.
#[test]
fn first_hits_follow_what_they_scatter_and_others_the_light() {
    let guide = field::guide("<string name='sets' value='primary_product'/>");
    let (mut learner, mut pcg) = (guide.start(UNIT), Pcg32::new(1, 1));
    let p = Vec3::splat(0.5);
    // Light comes from two sides alike; first hits scatter only that of one, and see nothing else. The normal lies in the
    // middle of those that cosines are taken together for.
    let (sin, cos) = (PI / 16.0).sin_cos();
    let n = Vec3::new(cos, sin, 0.0625).normalize();
    let sides = [0.8, -0.8].map(|side| 0.6 * n + side * Vec3::new(-sin, cos, 0.0));
    let about = |d: Vec3, pcg: &mut Pcg32| {
        let jitter = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) - 0.5;
        (d + 0.2 * jitter).normalize()
    };
    for _ in 0..4 {
        let records = (0..20_000).map(|i| {
            let (d, primary) = (sides[i % 2], i % 4 < 2);
            let scattered = if i % 2 == 0 { 0.5 } else { 0.0 };
            GuideRecord { scattered, primary, ..record(p, about(d, &mut pcg), 1.0, 0.5) }
        });
        learner.learn(&[records.collect()]);
        learner.refine(1);
    }
    let field = learner.field();
    field.validate().expect("the field is sound");
    let densities = |vertex: GuidedVertex, n: Vec3| {
        let arena = Arena::new();
        let directions = known_at(&*field, &hit(p, n), vertex, &arena).expect("something was learnt");
        let (d, pdf) = directions.sample(Vec2::new(0.4, 0.6));
        assert!((pdf / directions.pdf(d) - 1.0).abs() < 1e-4);
        let mut pcg = Pcg32::new(2, 2);
        sides.map(|side| (0..1000).map(|_| directions.pdf(about(side, &mut pcg)) / 1000.0).sum::<f32>())
    };
    let first = densities(FIRST, n);
    assert!(first[0] > 20.0 * UNIFORM && first[1] < 0.1 * UNIFORM, "{first:?}");
    // A normal from which the light comes makes no difference, for what was scattered has the cosine in it.
    assert_eq!(densities(FIRST, sides[1]), first);
    let later = densities(REFLECTS, n);
    assert!(later.iter().all(|pdf| *pdf > 10.0 * UNIFORM) && (0.5..2.0).contains(&(later[0] / later[1])), "{later:?}");
    let tilted = densities(REFLECTS, sides[1]);
    assert!(tilted[1] / tilted[0] > 2.0 * later[1] / later[0], "{tilted:?}, not {later:?}");
}

/// A file goes on with the sets it has, unless others are asked for.
#[test]
fn a_file_of_other_sets_is_refused_if_some_are_asked_for() {
    for sets in SETS {
        let saved = trained(&format!("<string name='sets' value='{sets}'/>")).save();
        let learner = field::guide("").recall(UNIT, &saved).expect("none are asked for");
        assert!(learner.save() == saved && learner.field().validate().is_ok());
        for asked in SETS {
            let found = field::guide(&format!("<string name='sets' value='{asked}'/>")).recall(UNIT, &saved);
            let message = found.err().map(|e| e.to_string());
            let expected = format!("was learnt with sets \"{sets}\", not \"{asked}\"");
            assert_eq!(message, (asked != sets).then_some(expected));
        }
    }
}

/// What a run with two sets keeps brings it on to the bit.
#[test]
fn hc_x02_an_interrupted_run_with_two_sets_has_the_same_bits() {
    const SPP: u32 = 48;
    let folder = folder("interrupted sets");
    for sets in &SETS[1..] {
        let guide = of_sets(sets, 100, "");
        let run = |name: &str, threads: usize, control: &Control<'_>| {
            let mut kept = file(&folder.join(format!("{sets} {name}.guide")), false);
            kept.checkpoint = Some(checkpoint(&folder.join(format!("{sets} {name}.state")), 1e9));
            render(&guide, 1, SPP, threads, kept, control).expect("it renders")
        };
        let learnt = |name: &str| fs::read(folder.join(format!("{sets} {name}.guide"))).expect("a file");
        let (expected, bits) = run("whole", 2, &Control::new());
        for stop in [3, 11, 30] {
            let look = |end: lucerna::core::render::PassEnd<'_>| match end.spp >= stop {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            };
            let name = format!("{stop}");
            let (begun, _) = run(&name, 1, &Control::new().with_pass_end(&look));
            assert!(begun.stopped && begun.spp < SPP);
            fs::remove_file(folder.join(format!("{sets} {name}.guide"))).expect("a file was written at the end");
            let (report, found) = run(&name, 3, &Control::new());
            assert!(found == bits && report.notes == expected.notes, "{sets}, {stop}: another picture");
            assert!(learnt(&name) == learnt("whole"), "{sets}, {stop}: learnt otherwise");
        }
    }
}
