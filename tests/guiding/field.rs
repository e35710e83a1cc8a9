//! Fields that were trained on light made up here: densities are those of the samples and integrate to one.

use super::cone;
use lucerna::core::interfaces::{
    Arena, FactValue, Guide, GuideField, GuideLearner, GuideRecord, GuidedDirections, GuidedVertex, RecordKind,
    SurfaceHit,
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

/// What a field knows at a hit.
pub fn known_at<'g>(
    field: &'g dyn GuideField,
    hit: &SurfaceHit,
    vertex: GuidedVertex,
    arena: &'g Arena,
) -> Option<&'g dyn GuidedDirections> {
    field.at(field.cell(hit.p), hit, vertex, arena)
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

/// Light from everywhere, found with this many times the density of the BSDF: what the mixture gains is the logarithm.
fn teach(guide: &dyn Guide, times: f32, rounds: u32, records: usize) -> Box<dyn GuideLearner> {
    let (mut learner, mut pcg) = (guide.start(UNIT), Pcg32::new(6, 6));
    let uniform = 0.25 / PI;
    for _ in 0..rounds {
        let found = |_| {
            let p = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32());
            let found = record(p, square_to_sphere(random(&mut pcg)), 1.0, times * uniform);
            GuideRecord { pdf_bsdf: uniform, ..found }
        };
        learner.learn(&[(0..records).map(found).collect()]);
        learner.refine(1);
    }
    learner
}

/// A guide that gains little is not asked any more after the first iteration that follows the start, with enough records to
/// tell, and one that gains nothing when the start is over; also when it goes on from a file. Never where that was not wanted,
/// or cannot be judged.
#[test]
fn a_guide_that_gains_little_leaves_paths_to_the_bsdf() {
    let (nothing, little, much) = (1.0, 1.05, 1.3);
    let guides = |parameters: &str, times: f32, rounds: u32, records: usize| {
        teach(&*guide(parameters), times, rounds, records).field().guides()
    };
    assert!(!guides("", nothing, 8, 20_000) && guides("", nothing, 7, 20_000));
    assert!(!guides("", little, 9, 20_000) && guides("", much, 9, 20_000));
    assert!(guides("", little, 8, 20_000) && guides("", little, 9, 5_000), "too early to tell");
    assert!(!guides("<integer name='startup' value='0'/>", little, 5, 20_000));
    assert!(!guides("<float name='least_gain' value='0.4'/>", much, 9, 20_000));
    for never in [
        "<float name='least_gain' value='0'/>",
        "<float name='p_guide' value='0.5'/>",
        "<string name='sets' value='direct_indirect'/>",
    ] {
        assert!(guides(never, little, 9, 20_000), "{never}");
    }
    let saved = teach(&*guide(""), little, 9, 20_000).save();
    let recalled = |parameters: &str| guide(parameters).recall(UNIT, &saved).expect("sound").field().guides();
    assert!(!recalled("") && recalled("<float name='least_gain' value='0'/>"));
}

/// A tree that has filled its memory keeps to it, and is as good as that allows: all of space is divided, and what was found
/// goes on to count.
#[test]
fn hc_p11_a_full_tree_is_evenly_coarse() {
    let mut shown = Vec::new();
    for more in ["", "<string name='sets' value='direct_indirect'/>", "<string name='sets' value='primary_product'/>"] {
        let guide = guide(&format!(
            "<float name='spatial_threshold' value='10'/><float name='max_memory' value='0.5'/>
             <float name='directional_threshold' value='0.001'/>{more}"
        ));
        let (mut learner, mut pcg) = (guide.start(UNIT), Pcg32::new(5, 5));
        for round in 0..6 {
            let found = |_| {
                let p = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32());
                light(p, &mut pcg)
            };
            learner.learn(&[(0..20_000).map(found).collect()]);
            learner.refine(1);
            let facts = learner.facts();
            let fact = |name: &str| facts.iter().find(|fact| fact.name == name).map(|fact| &fact.value);
            let Some(FactValue::Number(mib)) = fact("memory in MiB") else { panic!("no memory is told") };
            let Some(FactValue::PerDepth(cells)) = fact("cells of space by depth") else { panic!("no cells are told") };
            let depths: Vec<usize> = (0..cells.len()).filter(|depth| cells[*depth] > 0).collect();
            assert!(*mib <= 0.5, "{more}, round {round}: {mib} MiB");
            assert!(cells.iter().sum::<u64>() >= 16 && depths.len() <= 2, "{more}, round {round}: {cells:?}");
            shown.push(*mib);
        }
        assert!(learner.summary().iter().any(|line| line.contains("limit of memory")), "{more}");
        let saved = learner.save();
        learner.refine(1);
        assert!(
            known_at(&*learner.field(), &hit(Vec3::splat(0.5), Vec3::Y), REFLECTS, &Arena::new()).is_some(),
            "{more}"
        );
        assert!(guide.recall(UNIT, &saved).is_ok(), "{more}");
    }
    let most = shown.into_iter().fold(0.0, f64::max);
    measured("hc_p11_a_full_tree_is_evenly_coarse", format!("at most {most:.2} MiB of 0.5"));
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
        let mut cells = 0;
        for number in 0..CELLS {
            let arena = Arena::new();
            let p = Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32());
            let normal = square_to_sphere(random(&mut pcg));
            let vertex = GuidedVertex { primary: number % 2 == 0, ..REFLECTS };
            let Some(directions) = known_at(&*field, &hit(p, normal), vertex, &arena) else { continue };
            cells += 1;
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
        assert_eq!(cells, CELLS, "{product}, {sets}: some cells know nothing");
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

/// A direction of the distribution of von Mises and Fisher about `axis`, and its density. In f64, by what the cosine lacks
/// to 1: then no κ is too large or too small.
fn vmf(axis: Vec3, kappa: f64, u: Vec2) -> (Vec3, f32) {
    let decay = -(-2.0 * kappa).exp_m1();
    let lacks = if kappa < 1e-3 { 2.0 * f64::from(u.x) } else { -(-f64::from(u.x) * decay).ln_1p() / kappa };
    let lacks = lacks.clamp(0.0, 2.0);
    let sin = (lacks * (2.0 - lacks)).sqrt() as f32;
    let (y, x) = (2.0 * PI * u.y).sin_cos();
    let d = Frame::from_normal(axis).to_world(Vec3::new(sin * x, sin * y, (1.0 - lacks) as f32));
    let norm = if kappa < 1e-3 { 1.0 / (4.0 * PI) } else { (kappa / (f64::from(2.0 * PI) * decay)) as f32 };
    (d, norm * (-kappa * lacks).exp() as f32)
}

/// What guides of lobes must stand, for a tree: light of lobes from all directions alike to nearly one, many equal lobes, and
/// none. The density is bounded by the depth: 4^depth/4π.
#[test]
fn hc_p03_lobes_of_any_width_are_learnt() {
    const RECORDS: usize = 20_000;
    let known_from = |lobes: &[Vec3], kappa: f64, radiance: f32, depth: u32| {
        let guide =
            guide(&format!("<string name='product' value='none'/><integer name='directional_depth' value='{depth}'/>"));
        let (mut learner, mut pcg) = (guide.start(UNIT), Pcg32::new(11, 11));
        for _ in 0..6 {
            let lobe = |i: usize| lobes[i % lobes.len()];
            let records = (0..RECORDS).map(|i| {
                let (d, pdf) = vmf(lobe(i), kappa, random(&mut pcg));
                record(Vec3::splat(0.5), d, radiance * pdf, pdf)
            });
            learner.learn(&[records.filter(|r| r.pdf > 0.0).collect()]);
            learner.refine(1);
        }
        learner.field().validate().expect("the field is sound");
        learner.field()
    };
    let vertex = hit(Vec3::splat(0.5), Vec3::Z);
    let axis = Vec3::new(0.36, 0.48, -0.8);
    let mut peaks = Vec::new();
    for kappa in [0.0, 1e-6, 1e4, 1e8] {
        let arena = Arena::new();
        let coarse = known_from(&[axis], kappa, 1.0, 5);
        let directions = known_at(&*coarse, &vertex, REFLECTS, &arena).expect("something was learnt");
        let integral: f64 = expected(directions).iter().sum();
        assert!((integral - 1.0).abs() < 1e-3, "{kappa}: {integral}");
        let fine = known_from(&[axis], kappa, 1.0, 20);
        let directions = known_at(&*fine, &vertex, REFLECTS, &arena).expect("something was learnt");
        let (mut pcg, mut cosine) = (Pcg32::new(12, 12), 0.0);
        for _ in 0..RECORDS {
            let (d, pdf) = directions.sample(random(&mut pcg));
            assert!(pdf > 0.0 && f64::from(pdf) <= 4f64.powi(20) / (4.0 * std::f64::consts::PI), "{kappa}: {pdf}");
            cosine += f64::from(d.dot(axis)) / RECORDS as f64;
        }
        // Of the distribution: coth κ − 1/κ. A part of the tree stays even, and cells have a size.
        let exact = if kappa < 1.0 { 0.0 } else { 1.0 - 1.0 / kappa };
        assert!((cosine - exact).abs() < 0.02, "{kappa}: {cosine}");
        peaks.push(directions.pdf(axis));
    }
    let even = 1.0 / (4.0 * PI);
    assert!(peaks[..2].iter().all(|peak| (0.5..2.0).contains(&(peak / even))), "{peaks:?}");
    assert!(peaks[2] > 300.0 && peaks[3] > 100.0 * peaks[2], "{peaks:?}");
    // Equal lobes, spread evenly: each gets from half to twice its part, as the tree does not divide what is below a
    // hundredth of the flux.
    let lobes: Vec<Vec3> = (0..64)
        .map(|i| {
            let z = 1.0 - (i as f32 + 0.5) / 32.0;
            let (y, x) = (2.4 * i as f32).sin_cos();
            Vec3::new((1.0 - z * z).sqrt() * x, (1.0 - z * z).sqrt() * y, z)
        })
        .collect();
    let (field, arena, mut pcg) = (known_from(&lobes, 1e4, 1.0, 20), Arena::new(), Pcg32::new(13, 13));
    let directions = known_at(&*field, &vertex, REFLECTS, &arena).expect("something was learnt");
    let mut counts = vec![0; lobes.len()];
    for _ in 0..64 * 500 {
        let (d, _) = directions.sample(random(&mut pcg));
        let nearest = (0..lobes.len()).max_by(|a, b| d.dot(lobes[*a]).total_cmp(&d.dot(lobes[*b])));
        counts[nearest.expect("there are lobes")] += 1;
    }
    assert!(counts.iter().all(|count| (250..1000).contains(count)), "{counts:?}");
    // No light from any of them.
    let arena = Arena::new();
    assert!(known_at(&*known_from(&lobes, 1e4, 0.0, 20), &vertex, REFLECTS, &arena).is_none());
    measured(
        "hc_p03_lobes_of_any_width_are_learnt",
        format!(
            "densities at the peak {} for κ = 0, 1e-6, 1e4, 1e8; 64 equal lobes get {} to {} of 32000 samples",
            peaks.iter().map(|peak| format!("{peak:.2e}")).collect::<Vec<_>>().join(", "),
            counts.iter().min().expect("lobes"),
            counts.iter().max().expect("lobes")
        ),
    );
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
                match known_at(&*field, &hit(p, Vec3::Z), GuidedVertex::default(), &arena) {
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
