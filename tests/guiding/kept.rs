//! What is learnt as a file, and guided runs that are interrupted: the same bits from the same file, and nothing that
//! damaged files could do.

use super::field::{self, REFLECTS, hit, known_at, train};
use super::{SCENES, guided, left_to_the_bsdf, scene};
use crate::support::damage::{Random, damage_bytes};
use lucerna::core::interfaces::{Arena, GuideLearner, GuidedVertex};
use lucerna::core::math::{Aabb, Vec2, Vec3};
use lucerna::core::render::{Budget, Checkpoint, Control, GuideFile, Learnt, RenderContext, RenderError, Report};
use lucerna::core::stats::figures::measured;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Goes by estimates of pixels and by what scattering brings, and splits often.
const ADJOINT: &str = "<roulette type='adjoint'><float name='window' value='1'/></roulette>";

/// A folder of its own, empty.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("guiding").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// What a run keeps, and how it is controlled.
#[derive(Default)]
pub struct Kept {
    pub guide_file: Option<GuideFile>,
    pub checkpoint: Option<Checkpoint>,
}

pub fn file(path: &Path, frozen: bool) -> Kept {
    Kept { guide_file: Some(GuideFile { path: path.to_owned(), frozen }), checkpoint: None }
}

/// Renders a scene with `path` and what is nested in it, and gives the picture's bits.
pub fn render(
    nested: &str,
    number: usize,
    spp: u32,
    threads: usize,
    kept: Kept,
    control: &Control<'_>,
) -> Result<(Report, Vec<u32>), RenderError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| {
        let scene = scene(SCENES[number].1, &format!("<integrator type='path'>{nested}</integrator>"));
        let integrator = scene.integrator().expect("there is one");
        let budget = Budget::Samples(spp);
        let mut cx = RenderContext::new(&scene, &scene.sensors()[0], budget, 1, control, integrator.aov_names());
        (cx.guide_file, cx.checkpoint) = (kept.guide_file, kept.checkpoint);
        let report = integrator.render(&mut cx)?;
        let (_, data) = cx.store.develop(&cx.film);
        Ok((report, data.iter().map(|v| v.to_bits()).collect()))
    })
}

fn whole(spp: u32, threads: usize, kept: Kept) -> Vec<u32> {
    let (report, bits) = render(&guided(100, ""), 1, spp, threads, kept, &Control::new()).expect("it renders");
    assert!(report.spp == spp && bits.iter().any(|bits| f32::from_bits(*bits) > 0.0));
    bits
}

/// A file is a by-product; runs that begin with it have the same bits for any number of threads; it learns on when it
/// can learn from more, and never when it is frozen.
#[test]
fn hc_p08_runs_from_the_same_file_have_the_same_bits() {
    let folder = folder("bits");
    let (first, second) = (folder.join("first"), folder.join("second"));
    assert_eq!(whole(24, 2, file(&first, false)), whole(24, 2, Kept::default()), "the file changed the picture");
    let learnt = fs::read(&first).expect("a file was written");
    let begun = Learnt::of_bytes(&learnt).expect("it can be read");
    assert!(begun.guide == "sd_tree" && begun.spp >= 8, "{} spp", begun.spp);
    let frozen = whole(24, 1, file(&first, true));
    assert_eq!(whole(24, 3, file(&first, true)), frozen);
    assert_ne!(whole(24, 2, Kept::default()), frozen);
    // Too short to learn from: as if it were frozen.
    assert_eq!(whole(begun.spp, 2, file(&first, false)), whole(begun.spp, 2, file(&first, true)));
    assert_eq!(fs::read(&first).expect("it is still there"), learnt, "a frozen file was written");
    fs::copy(&first, &second).expect("a copy");
    assert_eq!(whole(100, 1, file(&first, false)), whole(100, 3, file(&second, false)));
    let on = fs::read(&first).expect("a file");
    assert!(on == fs::read(&second).expect("a file") && Learnt::of_bytes(&on).expect("sound").spp >= 2 * begun.spp);
    assert!(
        render(&guided(100, ""), 1, 8, 2, file(&folder.join("none"), true), &Control::new()).is_err(),
        "nothing to freeze"
    );
}

/// Guides that know where light is give less noise from the first sample on.
#[test]
fn a_run_that_begins_with_a_file_has_less_noise() {
    let learnt = folder("noise").join("file");
    let (_, reference) = render(&guided(100, ""), 0, 4096, 2, Kept::default(), &Control::new()).expect("it renders");
    render(&guided(100, ""), 0, 512, 2, file(&learnt, false), &Control::new()).expect("it renders");
    let error = |kept: Kept| {
        let (_, bits) = render(&guided(100, ""), 0, 32, 2, kept, &Control::new()).expect("it renders");
        let pairs = bits.iter().zip(&reference).map(|(a, b)| (f32::from_bits(*a), f32::from_bits(*b)));
        pairs.map(|(a, b)| f64::from((a - b).powi(2) / (b * b + 0.01))).sum::<f64>() / reference.len() as f64
    };
    let (fresh, taught) = (error(Kept::default()), error(file(&learnt, true)));
    measured(
        "a_run_that_begins_with_a_file_has_less_noise",
        format!("relMSE {taught:.4} from the first sample, {fresh:.4} when it has to learn"),
    );
    assert!(taught < 0.8 * fresh, "{taught} {fresh}");
}

#[test]
fn a_file_of_another_scene_or_guide_is_refused() {
    let path = folder("other").join("file");
    whole(16, 2, file(&path, false));
    let told = |number: usize| {
        let refused =
            render(&guided(100, ""), number, 16, 2, file(&path, false), &Control::new()).expect_err("refused");
        refused.to_string()
    };
    let other = told(0);
    assert!(other.contains("of another scene: its bounds are [") && other.lines().count() == 1, "{other}");
    let mut learnt = Learnt::of_bytes(&fs::read(&path).expect("a file")).expect("sound");
    learnt.guide = "other".to_owned();
    learnt.write(&path).expect("written");
    assert!(told(1).ends_with("is of the guide \"other\", not of \"sd_tree\""));
    fs::write(&path, "LUCGUIDEnonsense").expect("written");
    assert!(told(1).contains("of version"), "{}", told(1));
    fs::write(&path, "nonsense").expect("written");
    assert!(told(1).ends_with("is not a file of what a guide has learnt"), "{}", told(1));
}

/// What cells may keep apart.
pub const SETS: [&str; 3] = ["one", "direct_indirect", "primary_product"];

pub const UNIT: Aabb = Aabb { min: Vec3::ZERO, max: Vec3::ONE };

pub fn trained(parameters: &str) -> Box<dyn GuideLearner> {
    let mut learner = field::guide(parameters).start(UNIT);
    train(&mut *learner, 3, 20_000);
    learner
}

/// What comes back is to the bit what was saved, in the middle of an iteration too: it learns on alike.
#[test]
fn what_is_recalled_learns_on_alike() {
    for sets in SETS {
        let settings = &format!("<float name='spatial_threshold' value='500'/><string name='sets' value='{sets}'/>");
        let mut learner = trained(settings);
        learner.learn(&[vec![field::record(Vec3::splat(0.3), Vec3::Z, 2.0, 0.5); 50]]);
        let saved = learner.save();
        let mut recalled = field::guide(settings).recall(UNIT, &saved).expect("it can be recalled");
        assert!(recalled.save() == saved && recalled.facts() == learner.facts(), "{sets}");
        for learner in [&mut learner, &mut recalled] {
            train(&mut **learner, 2, 10_000);
        }
        assert!(recalled.save() == learner.save() && recalled.save() != saved, "{sets}");
    }
}

/// Any bytes are refused or give a field that is sound, may be sampled and learns on; and nothing as large as they say
/// is allocated.
#[test]
fn hc_i22_damaged_files_are_refused_or_harmless() {
    const VERSIONS: usize = 4000;
    let accepted: usize = SETS.iter().map(|sets| damaged(sets, VERSIONS)).sum();
    // A flipped bit of a number most often leaves a number that could have been.
    measured(
        "hc_i22_damaged_files_are_refused_or_harmless",
        format!("{} versions: {accepted} usable, the others refused; none panics", SETS.len() * VERSIONS),
    );
}

/// Damages a file of such sets as often as that, and tells how often it was usable.
fn damaged(sets: &str, versions: usize) -> usize {
    let settings = format!(
        "<float name='spatial_threshold' value='3000'/><integer name='directional_depth' value='5'/>
         <string name='sets' value='{sets}'/>"
    );
    let (learner, guide) = (trained(&settings), field::guide(&settings));
    let whole = Learnt { guide: "sd_tree".to_owned(), bounds: UNIT, spp: 8, state: learner.save() };
    let sealed = whole.to_bytes();
    let (mut random, mut accepted) = (Random(7), 0);
    for version in 0..versions {
        let mut damaged = sealed.clone();
        damage_bytes(&mut damaged, &mut random);
        assert!(damaged == sealed || Learnt::of_bytes(&damaged).is_err(), "{version}: damage was not noticed");
        // With a checksum that is right, what reads the content is on its own.
        let mut state = whole.state.clone();
        (0..=version % 3).for_each(|_| damage_bytes(&mut state, &mut random));
        let Ok(mut recalled) = (Learnt { state, ..whole.clone() }).recall(&*guide, UNIT) else { continue };
        accepted += 1;
        let (field, arena) = (recalled.field(), Arena::new());
        for p in [Vec3::splat(0.1), Vec3::new(0.9, 0.5, 0.2)] {
            if let Some(directions) =
                known_at(&*field, &hit(p, Vec3::Z), GuidedVertex { primary: version % 2 == 0, ..REFLECTS }, &arena)
            {
                let (d, pdf) = directions.sample(Vec2::new(0.3, 0.8));
                assert!(d.is_finite() && pdf >= 0.0, "{version}: {d} {pdf}");
            }
        }
        if version % 16 == 0 {
            train(&mut *recalled, 1, 500);
        }
    }
    assert!(accepted > 0 && accepted < versions / 2, "{sets}: {accepted}");
    accepted
}

pub fn checkpoint(path: &Path, every: f64) -> Checkpoint {
    Checkpoint { path: path.to_owned(), every, of: vec![("seed".to_owned(), "1".to_owned())] }
}

/// Each run is interrupted after these numbers of samples per pixel, at the end of a pass, or inside of the first pass that
/// begins with as many: the picture, the numbers and what was learnt are those of a run without interruption.
fn interruptions_leave_no_trace(test: &str, spp: u32, nested: &str, after: &[&[u32]], inside: &[u32]) {
    let folder = folder(test);
    let both = |name: &str, every: f64| Kept {
        guide_file: Some(GuideFile { path: folder.join(format!("{name}.guide")), frozen: false }),
        checkpoint: Some(checkpoint(&folder.join(format!("{name}.state")), every)),
    };
    let alone = Kept { checkpoint: None, ..both("alone", 0.0) };
    let (expected, bits) = render(nested, 1, spp, 2, alone, &Control::new()).expect("it renders");
    let learnt = fs::read(folder.join("alone.guide")).expect("a file");
    let compare = |name: &str, report: &Report, found: &[u32]| {
        assert!(found == bits, "{name}: another picture");
        assert_eq!((report.spp, report.samples, report.rays), (spp, expected.samples, expected.rays), "{name}");
        assert_eq!(report.notes, expected.notes, "{name}");
        assert!(fs::read(folder.join(format!("{name}.guide"))).expect("a file") == learnt, "{name}: learnt otherwise");
    };
    for stops in after {
        let name = format!("{stops:?}");
        for &stop in *stops {
            let look = |end: lucerna::core::render::PassEnd<'_>| match end.spp >= stop {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            };
            let control = Control::new().with_pass_end(&look);
            let (report, _) = render(nested, 1, spp, 1, both(&name, 1e9), &control).expect("it renders");
            assert!(report.stopped && report.spp >= stop && report.spp < spp, "{name}: {}", report.spp);
            fs::remove_file(folder.join(format!("{name}.guide"))).expect("a file was written at the end");
        }
        let (report, found) = render(nested, 1, spp, 3, both(&name, 1e9), &Control::new()).expect("it goes on");
        compare(&name, &report, &found);
        // Over already: the same picture again, without a sample.
        let (again, found) = render(nested, 1, spp, 3, both(&name, 1e9), &Control::new()).expect("it is over");
        assert!(found == bits && again.samples == report.samples, "{name}");
    }
    let pixels = expected.samples / u64::from(spp);
    for stop in inside {
        let name = format!("inside, after {stop}");
        let (taken, begun) = (AtomicU64::new(0), AtomicU64::new(u64::MAX));
        let look = |end: lucerna::core::render::PassEnd<'_>| {
            if end.spp >= *stop {
                begun.fetch_min(pixels * u64::from(end.spp), Ordering::Relaxed);
            }
            ControlFlow::Continue(())
        };
        let count = |progress: lucerna::core::render::Progress| {
            taken.fetch_max(progress.samples, Ordering::Relaxed);
        };
        let is_over = || taken.load(Ordering::Relaxed) > begun.load(Ordering::Relaxed);
        let clock = || Duration::from_secs(u64::from(is_over()));
        let control = Control::new().with_progress(&count).with_pass_end(&look).with_clock(&clock).with_deadline(0.5);
        let (report, _) = render(nested, 1, spp, 2, both(&name, 0.0), &control).expect("it renders");
        assert!(report.stopped && report.samples > pixels * u64::from(report.spp), "{name}: not inside a pass");
        let _ = fs::remove_file(folder.join(format!("{name}.guide")));
        let (report, found) = render(nested, 1, spp, 2, both(&name, 0.0), &Control::new()).expect("it goes on");
        compare(&name, &report, &found);
    }
}

/// In any kind of iteration, once or often.
#[test]
fn hc_x02_an_interrupted_guided_run_has_the_same_bits() {
    let inside = [4, 13, 20, 45];
    let after: [&[u32]; 7] = [&[3], &[8], &[11], &[19], &[30], &[45], &[2, 9, 10, 23, 40]];
    interruptions_leave_no_trace("interrupted", 64, &guided(100, ""), &after, &inside);
    interruptions_leave_no_trace(
        "interrupted_left",
        64,
        &left_to_the_bsdf(100),
        &[&[11], &[2, 9, 23, 40]],
        &inside[2..],
    );
}

/// Whether learning goes on is judged at the end of an iteration, also where a run goes on just there.
#[test]
fn hc_x02_a_run_interrupted_before_a_judgement_has_the_same_bits() {
    let nested = guided(100, "<string name='ending' value='variance'/>").replace("value='0.4'", "value='0.5'");
    assert!(nested.contains("'learning' value='0.5'"));
    interruptions_leave_no_trace("interrupted_judged", 600, &nested, &[&[256]], &[]);
}

/// Roulette that goes by what was found for the pixel and by what scattering has brought finds both again, with a guide
/// and without one.
#[test]
fn hc_x02_an_interrupted_run_with_learnt_roulette_has_the_same_bits() {
    let both = format!("{}{ADJOINT}", guided(100, ""));
    for (test, nested) in [("interrupted_adjoint", ADJOINT), ("interrupted_both", &both)] {
        interruptions_leave_no_trace(test, 64, nested, &[&[3], &[11], &[2, 9, 23, 40]], &[5, 36]);
    }
}

/// A checkpoint of another run is refused and told by what it differs; one that is damaged, too.
#[test]
fn hc_i22_other_checkpoints_are_refused() {
    let folder = folder("refused");
    let path = folder.join("state");
    let kept = |of: Checkpoint| Kept { guide_file: None, checkpoint: Some(of) };
    render(&guided(100, ""), 1, 20, 2, kept(checkpoint(&path, 0.0)), &Control::new()).expect("it renders");
    let told = |of: Checkpoint| {
        render(&guided(100, ""), 1, 20, 2, kept(of), &Control::new())
            .err()
            .map(|e| e.to_string())
            .expect("it is refused")
    };
    let mut other = checkpoint(&path, 0.0);
    other.of[0].1 = "2".to_owned();
    assert!(told(other).ends_with("is of another run: its seed is 1, not 2"));
    let whole = fs::read(&path).expect("a file");
    let mut random = Random(3);
    for version in 0..200 {
        let mut damaged = whole.clone();
        damage_bytes(&mut damaged, &mut random);
        if damaged != whole {
            fs::write(&path, damaged).expect("written");
            let message = told(checkpoint(&path, 0.0));
            assert!(message.lines().count() == 1, "{version}: {message}");
        }
    }
}
