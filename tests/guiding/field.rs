//! Fields that were trained on light made up here: densities are those of the samples and integrate to one.

use super::cone;
use lucerna::core::interfaces::{
    Arena, Guide, GuideLearner, GuideRecord, GuidedDirections, GuidedVertex, RecordKind, SurfaceHit,
};
use lucerna::core::math::{Aabb, Frame, Vec2, Vec3};
use lucerna::core::sampling::Pcg32;
use lucerna::core::sampling::warp::square_to_sphere;
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{Object, build_one};
use lucerna::core::stats::chi2::{pearson, sidak};
use lucerna::core::stats::figures::measured;
use std::f32::consts::PI;
use std::sync::Arc;

const UNIT: Aabb = Aabb { min: Vec3::ZERO, max: Vec3::ONE };

pub fn guide(parameters: &str) -> Arc<dyn Guide> {
    let text = format!("<guide version='3.0.0' type='sd_tree'>{parameters}</guide>");
    let description = load_str(&text, "guide.xml", &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    match build_one(&lucerna::builtin(), &description) {
        Ok(Object::Guide(guide)) => guide,
        Ok(_) => panic!("no guide"),
        Err(e) => panic!("{e}"),
    }
}

fn random(pcg: &mut Pcg32) -> Vec2 {
    Vec2::new(pcg.next_f32(), pcg.next_f32())
}

pub fn record(p: Vec3, d: Vec3, radiance: f32, pdf: f32) -> GuideRecord {
    let kind = RecordKind::Mixed;
    GuideRecord {
        p,
        d,
        radiance,
        direct: 0.0,
        scattered: radiance,
        pdf,
        pdf_bsdf: pdf,
        pdf_guide: pdf,
        pdf_sets: [pdf; 2],
        kind,
        primary: false,
    }
}

/// A lamp that is seen from everywhere, narrower from further away, and a sky.
fn light(p: Vec3, pcg: &mut Pcg32) -> GuideRecord {
    let towards = (Vec3::new(0.5, 0.5, 2.0) - p).normalize();
    let cutoff = 0.999 - 0.1 * p.x;
    if pcg.next_f32() < 0.5 {
        let frame = Frame::from_normal(towards);
        let lamp = record(p, frame.to_world(cone::sample(random(pcg), cutoff)), 5.0, 0.5 * cone::pdf(cutoff));
        return GuideRecord { direct: 5.0, ..lamp };
    }
    let d = square_to_sphere(random(pcg));
    record(p, d, if d.y > 0.0 { 0.3 } else { 0.0 }, 0.5 / (4.0 * PI))
}

pub fn train(learner: &mut dyn GuideLearner, rounds: u32, records: usize) {
    let mut pcg = Pcg32::new(5, 5);
    for _ in 0..rounds {
        let mut tiles = vec![Vec::new(); 4];
        for i in 0..records {
            let p = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32() * pcg.next_f32());
            tiles[i % 4].push(GuideRecord { primary: i % 3 == 0, ..light(p, &mut pcg) });
        }
        learner.learn(&tiles);
        learner.refine(1);
        learner.field().validate().expect("the field is sound");
    }
}

pub fn hit(p: Vec3, n: Vec3) -> SurfaceHit {
    SurfaceHit { p, n, frame: Frame::from_normal(n), wi: Vec3::Z, ..SurfaceHit::default() }
}

/// A later vertex, on a surface that reflects only.
pub const REFLECTS: GuidedVertex = GuidedVertex { one_sided: true, primary: false };

/// Cells along an edge of the square of directions; the trees are no finer.
const EDGE: usize = 32;

fn cell(d: Vec3) -> usize {
    let turn = f64::from(d.y).atan2(f64::from(d.x)) / f64::from(2.0 * PI);
    let v = if turn < 0.0 { turn + 1.0 } else { turn };
    let index = |x: f64| ((x * EDGE as f64) as usize).min(EDGE - 1);
    index(v) * EDGE + index(0.5 * (f64::from(d.z) + 1.0))
}

/// The probability of each cell: the density is the same all over it.
fn expected(directions: &dyn GuidedDirections) -> Vec<f64> {
    let middle = |i: usize| (i as f32 + 0.5) / EDGE as f32;
    let direction = |cell: usize| {
        let z = 2.0 * middle(cell % EDGE) - 1.0;
        let (sin, cos) = (2.0 * PI * middle(cell / EDGE)).sin_cos();
        Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    };
    let size = 4.0 * std::f64::consts::PI / (EDGE * EDGE) as f64;
    (0..EDGE * EDGE).map(|cell| f64::from(directions.pdf(direction(cell))) * size).collect()
}

#[test]
fn hc_p01_trained_fields_have_the_density_of_their_samples() {
    const CELLS: usize = 100;
    const SAMPLES: usize = 20_000;
    let mut worst: f64 = 0.0;
    let ways = [
        ("none", "one"),
        ("cosine", "one"),
        ("none", "direct_indirect"),
        ("cosine", "direct_indirect"),
        ("cosine", "primary_product"),
    ];
    for (product, sets) in ways {
        let settings = "<float name='spatial_threshold' value='500'/><integer name='directional_depth' value='5'/>";
        let guide =
            guide(&format!("{settings}<string name='product' value='{product}'/><string name='sets' value='{sets}'/>"));
        let mut learner = guide.start(UNIT);
        train(&mut *learner, 5, 50_000);
        let (field, mut pcg) = (learner.field(), Pcg32::new(9, 9));
        for number in 0..CELLS {
            let arena = Arena::new();
            let p = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32());
            let normal = square_to_sphere(random(&mut pcg));
            let vertex = GuidedVertex { primary: number % 2 == 0, ..REFLECTS };
            let Some(directions) = field.at(&hit(p, normal), vertex, &arena).known() else { continue };
            let expected = expected(directions);
            let integral: f64 = expected.iter().sum();
            worst = worst.max((integral - 1.0).abs());
            assert!((integral - 1.0).abs() < 1e-3, "{product}, {sets}: {integral}");
            let mut observed = vec![0; expected.len()];
            for _ in 0..SAMPLES {
                let (d, pdf) = directions.sample(random(&mut pcg));
                assert!((d.length() - 1.0).abs() < 1e-4 && pdf > 0.0);
                observed[cell(d)] += 1;
            }
            let expected: Vec<f64> = expected.iter().map(|e| e * SAMPLES as f64 / integral).collect();
            let found = pearson(&observed, &expected);
            assert!(found.accepts(sidak(0.01, ways.len() * CELLS)), "{product}, {sets} at {p}: {found:?}");
        }
    }
    measured(
        "hc_p01_trained_fields_have_the_density_of_their_samples",
        format!(
            "{CELLS} cells {} times, with and without the cosine and a second set: all pass; integrals within {worst:.0e} of 1",
            ways.len()
        ),
    );
}

/// The lamp is where the field looks, and what it says arrives from there is about right.
#[test]
fn a_trained_field_knows_where_the_light_is() {
    let guide = guide("<float name='spatial_threshold' value='2000'/>");
    let mut learner = guide.start(UNIT);
    train(&mut *learner, 5, 100_000);
    let field = learner.field();
    let p = Vec3::splat(0.25);
    let towards = (Vec3::new(0.5, 0.5, 2.0) - p).normalize();
    let lamp = field.incident(p, towards).expect("something was learnt");
    let sky = field.incident(p, Vec3::Y).expect("something was learnt");
    assert!(lamp > 2.0 && lamp < 8.0, "{lamp}");
    assert!(sky > 0.2 && sky < 0.45, "{sky}");
}

#[test]
fn hc_p02_records_of_nothing_and_of_extremes_leave_a_sound_field() {
    let at = |p: Vec3, radiance: f32| record(p, Vec3::Z, radiance, 1.0);
    let cases: [Vec<GuideRecord>; 6] = [
        Vec::new(),
        vec![at(Vec3::splat(0.5), 1.0)],
        vec![at(Vec3::splat(0.5), 0.0); 1000],
        vec![at(Vec3::splat(0.5), 1.0); 100_000],
        vec![at(Vec3::splat(0.1), 1e30), at(Vec3::splat(0.9), 1.0)],
        vec![at(Vec3::splat(1e18), f32::MAX), at(Vec3::NAN, 1.0), record(Vec3::ONE, Vec3::NAN, 1.0, 1e-38)],
    ];
    for (number, records) in cases.into_iter().enumerate() {
        let guide = guide("<float name='spatial_threshold' value='50'/>");
        let mut learner = guide.start(UNIT);
        let lit = records.iter().any(|r| r.radiance > 0.0);
        for _ in 0..3 {
            learner.learn(std::slice::from_ref(&records));
            learner.refine(1);
            let field = learner.field();
            field.validate().unwrap_or_else(|e| panic!("{number}: {e}"));
            for p in [Vec3::splat(0.5), Vec3::splat(0.1), Vec3::splat(-1e20)] {
                let arena = Arena::new();
                match field.at(&hit(p, Vec3::Z), GuidedVertex::default(), &arena).known() {
                    None => assert!(!lit || number == 5 || number == 4, "{number}: nothing at {p}"),
                    Some(directions) => {
                        let (d, pdf) = directions.sample(Vec2::splat(0.5));
                        assert!(lit && d.is_finite() && pdf.is_finite() && directions.p_guide() <= 0.95);
                    }
                }
            }
        }
    }
}
