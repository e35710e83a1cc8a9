//! Speed against error: which method gives a better picture of a scene in the same time?
//!
//! **Turns.** For each seed, each method renders the scene: A B C, A B C, …; what slows the machine for a while then
//! slows all, and ratios are taken between runs that stood next to each other. Each turn is a process of its own
//! ([`turn`]), and all use the same number of threads.
//!
//! **Points.** The curves have points at 1, 2, 4, … samples per pixel up to the budget. Where the sampler gives a
//! sequence, they are looked at on the way of one run, whose clock stands still meanwhile. Samplers that stratify a
//! number of points which they have to know at the start, and peers, render each point from the beginning; that costs
//! about as much again as the last one. A budget in seconds becomes a number of samples per pixel, once for each
//! method: from a short trial, or from a whole run by the clock where samples depend on those before. The time that was
//! in fact taken is what counts.
//!
//! **Reference.** Given, or rendered until its noise does not matter ([`truth`]).
//!
//! **Numbers.** [`lucerna_core::stats::metrics`]; intervals are Student's over the seeds ([`results`]). Every run is
//! kept ([`store`]).

pub mod facts;
pub mod method;
pub mod page;
pub mod plot;
pub mod results;
pub mod store;
pub mod subject;
pub mod tables;
pub mod truth;
pub mod turn;

use crate::check::maps::exposure;
use lucerna_core::image::Image;
use lucerna_core::render::Schedule;
use lucerna_core::scene::{Registry, xml};
use lucerna_core::stats::flip;
use lucerna_core::stats::metrics::{Seeds, bias_squared, bias_terms, errors};
use method::{Method, Methods};
use results::{MethodResult, Point, SceneResult};
use std::path::{Path, PathBuf};
use store::Store;
use subject::Subject;
use truth::Truth;
use turn::{Answer, Place, Turn, Work};

/// How long a run may take.
#[derive(Clone, Debug, PartialEq)]
pub enum Budgets {
    /// Samples per pixel.
    Samples(Vec<u32>),
    /// Seconds.
    Seconds(Vec<f64>),
}

impl Budgets {
    /// Each in words.
    pub fn names(&self) -> Vec<String> {
        match self {
            Budgets::Samples(list) => list.iter().map(|spp| format!("{spp} spp")).collect(),
            Budgets::Seconds(list) => list.iter().map(|seconds| format!("{seconds} s")).collect(),
        }
    }
}

/// How to compare.
#[derive(Clone, Debug)]
pub struct Options {
    /// How scenes are read.
    pub reading: xml::LoadOptions,
    /// Another picture size.
    pub size: Option<[u32; 2]>,
    /// Rising.
    pub budgets: Budgets,
    /// Runs of each method.
    pub seeds: u32,
    /// The first seed.
    pub seed: u32,
    /// Only render what the budgets name, not the points before.
    pub no_curves: bool,
    /// The relMSE whose time is told; that of the baseline's longest run if none.
    pub target: Option<f64>,
    /// Where turns are taken.
    pub place: Place,
    /// A given reference.
    pub reference: Option<PathBuf>,
    /// What renders it else, in short form.
    pub reference_method: String,
    /// Seconds it may take at most.
    pub reference_seconds: f64,
    /// Where rendered references are kept.
    pub cache: PathBuf,
    /// The folder of the report.
    pub output: PathBuf,
}

/// A picture and the time it took.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Samples per pixel.
    pub spp: u32,
    /// Those of the whole run, if the picture was taken on its way.
    pub of: u32,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Seconds of processor time, all threads together; not known of runs in this process.
    pub cpu: Option<f64>,
    /// The most memory of the turn's process in MiB; likewise.
    pub memory: Option<f64>,
    /// The picture.
    pub image: Image,
}

/// The channels that are compared: colour, else brightness, and their values.
///
/// # Errors
/// If there are neither.
pub fn colour(image: &Image) -> Result<(Vec<String>, Vec<f32>), String> {
    let pick = |names: &[&str]| -> Option<(Vec<String>, Vec<usize>)> {
        let order = names.iter().map(|name| image.channel(name)).collect::<Option<Vec<_>>>()?;
        Some((names.iter().map(|&name| name.to_owned()).collect(), order))
    };
    let found = pick(&["R", "G", "B"]).or_else(|| pick(&["Y"]));
    let (names, order) = found.ok_or("the picture has neither channels R, G, B nor Y")?;
    let pixels = image.data.chunks_exact(image.channels.len());
    Ok((names, pixels.flat_map(|pixel| order.iter().map(|&c| pixel[c])).collect()))
}

/// Samples per pixel a second, from a trial of about this many seconds: what runs of more and more samples come to. It
/// has settled when more samples make it no faster; until then, what every run has to do once is much of its time.
fn rate(subject: &Subject, seconds: f64) -> Result<f64, String> {
    const MOST: f64 = (1 << 22) as f64;
    const SETTLED: f64 = 1.3;
    let (mut spp, mut before) = (1.0, 0.0);
    loop {
        let shot = subject.render(&[subject.counts_up_to(spp as u32)], u32::MAX)?.pop().ok_or("no picture")?;
        let took = shot.seconds.max(1e-6);
        let found = f64::from(shot.spp) / took;
        // Four times as many, at least, are another number for samplers that round to powers of four, too.
        let next = (f64::from(shot.spp) * (seconds / took).clamp(4.0, 32.0)).min(MOST);
        let is_last = took >= 0.5 * seconds && found < SETTLED * before || took >= 2.0 * seconds;
        if is_last || subject.counts_up_to(next as u32) <= shot.spp {
            return Ok(found.max(before));
        }
        (spp, before) = (next, found);
    }
}

/// Samples per pixel that fit into each time, from a run that the clock ends: what a run learns makes its samples
/// slower or faster, and how much depends on how long it is.
fn fit(subject: &Subject, seconds: &[f64]) -> Result<Vec<u32>, String> {
    seconds.iter().map(|seconds| Ok(subject.counts_up_to(subject.samples_in(*seconds, u32::MAX)?))).collect()
}

/// One method in a scene, while runs are made.
struct Contestant {
    method: Method,
    state: Result<(Subject, Plan), String>,
}

/// Numbers of samples per pixel, rising, and the ones among them that the budgets ask for.
struct Plan {
    counts: Vec<u32>,
    stops: Vec<u32>,
}

fn plan(subject: &Subject, method: &Method, scene: &Path, options: &Options, store: &Store) -> Result<Plan, String> {
    let stops: Vec<u32> = match &options.budgets {
        Budgets::Samples(list) => list.iter().map(|spp| subject.counts_up_to(*spp)).collect(),
        Budgets::Seconds(list) => {
            let names = options.budgets.names().join(" ");
            match store.load_plan(&subject.key, &names).filter(|plan| plan.len() == list.len()) {
                Some(known) => known,
                None => {
                    let shortest = list.iter().copied().fold(f64::INFINITY, f64::min);
                    let work = match subject.learns() {
                        true => Work::Fit(list.clone()),
                        false => Work::Rate(shortest.min(2.0) / 2.0),
                    };
                    let counts = match turn::take(subject, &turn_of(subject, method, scene, work), options)? {
                        Answer::Rate(rate) => counts_of_seconds(subject, list, rate),
                        Answer::Fit(counts) if counts.len() == list.len() => counts,
                        _ => return Err("its process gave no rate".to_owned()),
                    };
                    store.keep_plan(&subject.key, &names, &counts)?;
                    counts
                }
            }
        }
    };
    let most = stops.iter().copied().max().unwrap_or(1);
    let mut counts = stops.clone();
    if !options.no_curves {
        let powers = (0..32).map(|i| 1_u32 << i).take_while(|spp| *spp < most);
        counts.extend(powers.map(|spp| subject.counts_up_to(spp)));
    }
    counts.sort_unstable();
    counts.dedup();
    Ok(Plan { counts, stops })
}

/// How many samples per pixel fit into times that rise. All but the last are rounded to the end of a pass where that
/// lets them be seen on the way.
fn counts_of_seconds(subject: &Subject, seconds: &[f64], rate: f64) -> Vec<u32> {
    let last = seconds.len().saturating_sub(1);
    let counts = seconds.iter().enumerate().map(|(i, seconds)| {
        let spp = (rate * seconds).clamp(1.0, f64::from(1 << 24)) as u32;
        let spp = match subject.is_sequence() && i < last {
            true => pass_ends().take_while(|end| *end <= spp).last().unwrap_or(1),
            false => spp,
        };
        subject.counts_up_to(spp)
    });
    counts.collect()
}

/// Samples per pixel at which a run can be looked at.
fn pass_ends() -> impl Iterator<Item = u32> {
    (0..1 << 21).map(|pass| Schedule::pass(pass).1)
}

fn turn_of(subject: &Subject, method: &Method, scene: &Path, work: Work) -> Turn {
    Turn { scene: scene.to_owned(), method: method.name.clone(), key: subject.key.clone(), work }
}

/// Compares methods in one scene. `tell` hears of every run.
///
/// # Errors
/// If nothing can be written, or there is no reference; one line. A method that fails is in the result.
pub fn compare(
    registry: &Registry,
    scene: &Path,
    methods: &Methods,
    options: &Options,
    tell: &mut dyn FnMut(String),
) -> Result<SceneResult, String> {
    let store = Store::open(options.output.join("runs"))?;
    let mut contestants: Vec<Contestant> = Vec::new();
    let mut size = None;
    for method in &methods.list {
        let state = Subject::load(registry, scene, method, options).and_then(|subject| {
            let plan = plan(&subject, method, scene, options, &store)?;
            match *size.get_or_insert(subject.size()) == subject.size() {
                true => Ok((subject, plan)),
                false => Err("its picture has another size than those before".to_owned()),
            }
        });
        if let Err(why) = &state {
            tell(format!("{}: failed: {why}", method.name));
        }
        contestants.push(Contestant { method: method.clone(), state });
    }
    let none_works = |contestants: &[Contestant]| contestants.iter().all(|c| c.state.is_err());
    let first_failure = |contestants: &[Contestant]| {
        contestants.iter().find_map(|c| c.state.as_ref().err().cloned()).unwrap_or_default()
    };
    for run in 0..options.seeds {
        take_turns(scene, &mut contestants, &store, run, options, tell)?;
    }
    let (Some(size), false) = (size, none_works(&contestants)) else {
        return Err(format!("no method works: {}", first_failure(&contestants)));
    };

    let longest = |(subject, plan): &(Subject, Plan)| {
        let spp = *plan.counts.last()?;
        let shot = store.load(&subject.key, spp, options.seed)?;
        Some((spp, colour(&shot.image).ok()?.1))
    };
    let pictures: Vec<(u32, Vec<f32>)> =
        contestants.iter().filter_map(|c| c.state.as_ref().ok()).filter_map(longest).collect();
    let truth = match &options.reference {
        Some(path) => Truth::read(path, size)?,
        None => {
            let most = pictures.iter().map(|(spp, _)| *spp).max().unwrap_or(1);
            let pictures: Vec<Vec<f32>> = pictures.into_iter().map(|(_, picture)| picture).collect();
            truth::make(registry, scene, options, &pictures, most, tell).map_err(|e| format!("the reference: {e}"))?
        }
    };
    let measured = contestants.into_iter().map(|contestant| {
        let blank = MethodResult::new(contestant.method);
        match contestant.state.and_then(|state| measure(&state, blank.clone(), &truth, &store, options)) {
            Ok(found) => found,
            Err(why) => MethodResult { failed: Some(why), ..blank },
        }
    });
    let methods_found: Vec<MethodResult> = measured.collect();
    let named = methods.baseline.as_ref().and_then(|name| methods.list.iter().position(|m| m.name == *name));
    let baseline = named.unwrap_or_else(|| methods_found.iter().position(|m| m.failed.is_none()).unwrap_or(0));
    Ok(SceneResult { scene: scene.to_owned(), truth, methods: methods_found, baseline })
}

/// One run of each method, with the same seed. What is kept is not rendered again.
fn take_turns(
    scene: &Path,
    contestants: &mut [Contestant],
    store: &Store,
    run: u32,
    options: &Options,
    tell: &mut dyn FnMut(String),
) -> Result<(), String> {
    let seed = options.seed.wrapping_add(run);
    for Contestant { method, state } in contestants {
        let Ok((subject, plan)) = &state else { continue };
        let is_missing = |spp: &u32| !store.has(&subject.key, *spp, seed);
        let counts: Vec<u32> = plan.counts.iter().copied().filter(is_missing).collect();
        if counts.is_empty() {
            continue;
        }
        let work = Work::Render { counts, seed };
        match turn::take(subject, &turn_of(subject, method, scene, work), options) {
            Ok(Answer::Shots(shots)) => {
                for shot in &shots {
                    store.keep(&subject.key, seed, shot)?;
                }
                let last = shots.last().map_or_else(String::new, |s| format!("{} spp, {:.2} s", s.spp, s.seconds));
                tell(format!("run {} of {}, {}: {last}", run + 1, options.seeds, method.name));
            }
            Ok(_) => *state = Err("its process gave no pictures".to_owned()),
            Err(why) => {
                tell(format!("{}: failed: {why}", method.name));
                *state = Err(why);
            }
        }
    }
    Ok(())
}

/// Compares the kept runs of a method with the reference.
fn measure(
    (subject, plan): &(Subject, Plan),
    mut result: MethodResult,
    truth: &Truth,
    store: &Store,
    options: &Options,
) -> Result<MethodResult, String> {
    let noise = truth.noise.map_or(0.0, |[mse, ..]| mse);
    let [width, height] = truth.size;
    let channels = truth.channels.len();
    let reference = Image { width, height, channels: truth.channels.clone(), data: truth.values.clone() };
    let brightness = exposure(&reference);
    let load = |spp: u32, run: u32| {
        let shot = store.load(&subject.key, spp, options.seed.wrapping_add(run));
        let shot = shot.ok_or("a run that was kept cannot be read")?;
        let (names, values) = colour(&shot.image)?;
        match names == truth.channels {
            true => Ok((shot, values)),
            false => Err(format!("channels {} instead of {}", names.join(" "), truth.channels.join(" "))),
        }
    };
    for &spp in &plan.counts {
        let (mut seeds, mut point) = (Seeds::default(), Point { spp, ..Point::default() });
        let is_last = plan.counts.last() == Some(&spp);
        for run in 0..options.seeds {
            let (shot, values) = load(spp, run)?;
            point.of = shot.of;
            point.errors.push(errors(&values, &truth.values, channels)?);
            point.seconds.push(shot.seconds);
            point.cpu.extend(shot.cpu);
            point.memory.extend(shot.memory);
            seeds.add(&values)?;
            if plan.stops.contains(&spp) {
                let ldr = flip::ldr(&values, &truth.values, channels, width as usize, brightness)?;
                let hdr = flip::hdr(&values, &truth.values, channels, width as usize)?;
                point.flip.push([flip::mean(&ldr), flip::mean(&hdr)]);
                if run == 0 && is_last {
                    result.flip_map = hdr;
                }
            }
            if run == 0 {
                result.picture = values;
            }
        }
        point.variance = seeds.variance();
        let mean = seeds.mean();
        let terms = (0..options.seeds).map(|run| Ok(bias_terms(&load(spp, run)?.1, &mean, &truth.values)));
        point.bias_squared = bias_squared(&terms.collect::<Result<Vec<_>, String>>()?, noise);
        result.points.push(point);
    }
    let at = |spp: &u32| plan.counts.iter().position(|count| count == spp).unwrap_or(0);
    result.stops = plan.stops.iter().map(at).collect();
    result.is_sequence = subject.is_sequence();
    Ok(result)
}
