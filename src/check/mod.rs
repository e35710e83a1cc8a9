//! The reference-matching suite: does a scene look the same as with the reference renderer, the `mitsuba` package?
//!
//! For each scene there is a reference, stored in the repository ([`stored`]), kept in a cache ([`cache`]) or rendered
//! anew ([`mod@reference`]). Lucerna renders the scene to the same standard error ([`ours`]); both pictures come in
//! independent passes, and [`lucerna_core::stats::images`] says whether they differ by more than noise.
//!
//! **Levels.** A run over many scenes is to raise a false alarm with a chance of [`SIGNIFICANCE`] in all: the level is
//! shared among the scenes (Šidák 1967). A scene that fails is looked at again, with fresh random numbers on both
//! sides (of a stored reference, on ours), and only what is found again at the same place counts.
//!
//! **Budget.** [`PASSES`] passes of so many samples that the standard error of the image mean is [`TARGET`] on either
//! side, within limits (`ours::plan`): an error of 0.3 % in the mean is then found, in one scene or in a hundred.
//! [`Comparison::detectable`] tells what was reached.
//!
//! **Ray offsets.** The reference starts rays a fixed fraction off surfaces and so leaks light through thin gaps;
//! Lucerna does not. A scene that differs is rendered once more with the reference's offsets. If all tests pass then,
//! the offsets are the whole difference, and the verdict says so.

pub mod cache;
pub mod key;
pub mod maps;
pub mod ours;
pub mod page;
pub mod reference;
pub mod scenes;
pub mod stored;

use lucerna_core::image::Image;
use lucerna_core::scene::Registry;
use lucerna_core::stats::Measured;
use lucerna_core::stats::agreement::{Agreement, SHARE, TOLERANCE, agreement};
use lucerna_core::stats::chi2::sidak;
use lucerna_core::stats::images::{Comparison, compare};
use ours::Ours;
use reference::{Reference, Source};
use std::path::PathBuf;

/// Chance that a run without any error tells of one, over all its scenes.
pub const SIGNIFICANCE: f64 = 0.01;

/// Independent passes of each renderer.
pub const PASSES: u32 = 16;

/// Wanted standard error of the image mean, relative, on either side.
pub const TARGET: f64 = 3e-4;

/// The reference numbers shapes in an order that changes from run to run.
const SHAPE_NUMBER: &str = "shape.I";

/// Distance between the seeds of two looks.
const FRESH: u32 = 100_000;

/// How to check.
#[derive(Clone, Debug)]
pub struct Options {
    /// How scenes are read.
    pub reading: lucerna_core::scene::xml::LoadOptions,
    /// Width, and height if not the scene's aspect, instead of the scene's size.
    pub size: Option<(u32, Option<u32>)>,
    /// Samples per pixel of all passes together, instead of as many as [`TARGET`] needs: of the reference, or of
    /// Lucerna where the reference is stored. Sample for sample, of either.
    pub spp: Option<u32>,
    /// First seed, 0 if unset; sample for sample, the only one.
    pub seed: Option<u32>,
    /// The reference's variant; empty for the fastest one that works.
    pub variant: String,
    /// Sample for sample instead of statistically.
    pub exact: bool,
    /// Rays start as far off surfaces as the reference's do.
    pub reference_offsets: bool,
    /// Render references even if they are stored.
    pub fresh: bool,
    /// The cache.
    pub cache: PathBuf,
}

/// How a scene fared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No difference beyond noise.
    Agrees,
    /// Differs, but agrees with the reference's ray offsets.
    Offset,
    /// Differs in a way that `reference/apart.toml` explains.
    Known,
    /// Differs.
    Differs,
    /// Needs what is not built, or is no scene to render.
    Skipped,
    /// Could not be compared.
    Failed,
}

impl Verdict {
    /// One word or two.
    pub fn text(self) -> &'static str {
        match self {
            Verdict::Agrees => "agrees",
            Verdict::Offset => "ray offset",
            Verdict::Known => "known",
            Verdict::Differs => "DIFFERS",
            Verdict::Skipped => "skipped",
            Verdict::Failed => "not run",
        }
    }
}

/// Why a scene was not compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It needs what is not built, or is no scene to render.
    NotForUs(String),
    /// Anything else.
    Failed(String),
}

impl Refusal {
    /// A failure.
    pub fn failed(message: impl std::fmt::Display) -> Self {
        Refusal::Failed(message.to_string())
    }

    /// The reason.
    pub fn text(&self) -> String {
        match self {
            Refusal::NotForUs(text) | Refusal::Failed(text) => text.clone(),
        }
    }
}

/// What was found in a scene.
pub struct Findings {
    /// Our picture, the channels that are compared.
    pub ours: Image,
    /// The reference's.
    pub theirs: Image,
    /// Statistical comparison.
    pub comparison: Option<Comparison>,
    /// Comparison sample for sample.
    pub agreement: Option<Agreement>,
}

/// A compared scene.
pub struct Outcome {
    /// The scene, as it was named.
    pub scene: PathBuf,
    /// How it fared.
    pub verdict: Verdict,
    /// What else is to be said, one line each; for scenes that were not compared, why.
    pub notes: Vec<String>,
    /// What was compared with, and how: one line.
    pub reference: String,
    /// Samples per pixel of all passes, ours and the reference's.
    pub spp: [u32; 2],
    /// Seconds of rendering, ours and the reference's (0 where it was stored).
    pub seconds: [f64; 2],
    /// What was found.
    pub findings: Option<Findings>,
}

impl Outcome {
    /// Of a scene that was not compared.
    fn refused(scene: PathBuf, refusal: Refusal) -> Self {
        let (verdict, why) = match refusal {
            Refusal::NotForUs(why) => (Verdict::Skipped, why),
            Refusal::Failed(why) => (Verdict::Failed, why),
        };
        let reference = String::new();
        Outcome { scene, verdict, notes: vec![why], reference, spp: [0; 2], seconds: [0.0; 2], findings: None }
    }
}

/// Checks one of `scenes` scenes that share a level.
pub fn check(registry: &Registry, scene: PathBuf, options: &Options, scenes: usize) -> Outcome {
    let done = match options.exact {
        true => check_exact(registry, &scene, options),
        false => check_statistically(registry, &scene, options, sidak(SIGNIFICANCE, scenes.max(1))),
    };
    done.unwrap_or_else(|refusal| Outcome::refused(scene, refusal))
}

/// Channels of a reference that are compared.
pub fn compared(channels: &[String]) -> Vec<String> {
    channels.iter().filter(|c| *c != SHAPE_NUMBER).cloned().collect()
}

fn check_statistically(
    registry: &Registry,
    path: &std::path::Path,
    options: &Options,
    level: f64,
) -> Result<Outcome, Refusal> {
    let mut ours = Ours::load(registry, path, options)?;
    let stored = if options.fresh { None } else { stored::find(path, &ours, options)? };
    if let Some(entry) = &stored {
        ours = ours.at_size(registry, entry.size, options)?;
    }
    let (independent, seed) = (ours.has_independent_pixels(), options.seed.unwrap_or(0));
    let fixed = options.spp.filter(|_| stored.is_some());
    let look = |ours: &Ours, number: u32| -> Result<(Measured, Reference), Refusal> {
        let reference = match &stored {
            Some(entry) => entry.load()?,
            None => {
                let total = options.spp.map_or_else(|| ours.plan(seed), Ok)?;
                let spp = (total / PASSES).max(1);
                reference::measure(ours, options, spp, seed.wrapping_add(number * FRESH))?
            }
        };
        let own = ours.measure_like(&reference, fixed, seed.wrapping_add(1000 + number * FRESH))?;
        Ok((own, reference))
    };
    let with = |own: &Measured, reference: &Reference| {
        compare(own, &reference.measured, independent, level).map_err(Refusal::Failed)
    };
    if options.reference_offsets {
        ours.use_reference_offsets();
    }

    let (own, reference) = look(&ours, 0)?;
    let comparison = with(&own, &reference)?;
    let mut notes = reference.notes.clone();
    notes.extend(ours.notes());
    let mut verdict = Verdict::Agrees;
    if !comparison.agrees() {
        let (second, again) = look(&ours, 1)?;
        let confirmation = with(&second, &again)?;
        if !comparison.is_confirmed_by(&confirmation, SIGNIFICANCE) {
            notes.push("failed once, but not again with fresh random numbers at the same places".to_owned());
        } else {
            verdict = Verdict::Differs;
            notes.push("found again with fresh random numbers".to_owned());
            if !options.reference_offsets {
                ours.use_reference_offsets();
                let offset = ours.measure_like(&again, fixed, seed.wrapping_add(1000 + 2 * FRESH))?;
                if with(&offset, &again)?.agrees() {
                    verdict = Verdict::Offset;
                    notes.push("agrees if rays start as far off surfaces as the reference's do".to_owned());
                } else {
                    notes.push("the reference's ray offsets do not explain it".to_owned());
                }
            }
        }
    }
    if verdict == Verdict::Differs
        && let Some(reason) = stored::known(path, false)
    {
        verdict = Verdict::Known;
        notes.push(reason);
    }
    Ok(Outcome {
        scene: path.to_owned(),
        verdict,
        notes,
        reference: reference.describe(),
        spp: [ours.total_spp(), reference.spp * reference.measured.passes],
        seconds: [ours.seconds(), reference.seconds],
        findings: Some(Findings {
            ours: own.picture(&own.mean),
            theirs: reference.measured.picture(&reference.measured.mean),
            comparison: Some(comparison),
            agreement: None,
        }),
    })
}

/// Sample for sample, against stored images of `scalar_rgb` or one rendered now.
fn check_exact(registry: &Registry, path: &std::path::Path, options: &Options) -> Result<Outcome, Refusal> {
    let mut ours = Ours::load(registry, path, options)?;
    let entries = if options.fresh { Vec::new() } else { stored::find_exact(path, &ours, options)? };
    let mut shots: Vec<(Image, u32, u32, [u32; 2])> = Vec::new();
    let (mut description, mut seconds) = (String::new(), [0.0; 2]);
    for entry in &entries {
        description = format!("{} stored images of scalar_rgb", entries.len());
        shots.push((entry.load_exact()?, entry.seed, entry.spp, entry.size));
    }
    if shots.is_empty() {
        let (spp, seed) = (options.spp.unwrap_or(4), options.seed.unwrap_or(0));
        let (image, took) = reference::exact(&ours, options, spp, seed)?;
        description = format!("scalar_rgb, {spp} spp, seed {seed}");
        seconds[1] = took;
        shots.push((image, seed, spp, ours.size()));
    }
    let mut worst: Option<(Agreement, Findings)> = None;
    let mut spp = 0;
    for (theirs, seed, shot_spp, size) in shots {
        ours = ours.at_size(registry, size, options)?;
        ours.use_reference_offsets();
        let image = ours.render_exact(shot_spp, seed)?;
        seconds[0] = ours.seconds();
        spp = spp.max(shot_spp);
        let channels = compared(&theirs.channels);
        let found = agreement(&image, &theirs, &channels, TOLERANCE).map_err(Refusal::Failed)?;
        if worst.as_ref().is_none_or(|(known, _)| found.share < known.share) {
            let picked = |image: &Image| image.pick(&channels).map_err(Refusal::Failed);
            let (ours, theirs) = (picked(&image)?, picked(&theirs)?);
            worst = Some((found, Findings { ours, theirs, comparison: None, agreement: Some(found) }));
        }
    }
    let (found, findings) = worst.ok_or_else(|| Refusal::failed("nothing was compared"))?;
    let mut notes = ours.notes();
    let mut verdict = if found.share >= SHARE { Verdict::Agrees } else { Verdict::Differs };
    if verdict == Verdict::Differs
        && let Some(reason) = stored::known(path, true)
    {
        verdict = Verdict::Known;
        notes.push(reason);
    }
    let scene = path.to_owned();
    Ok(Outcome { scene, verdict, notes, reference: description, spp: [spp; 2], seconds, findings: Some(findings) })
}

impl Reference {
    /// One line on where it comes from.
    fn describe(&self) -> String {
        let source = match self.source {
            Source::Stored => "stored",
            Source::Cached => "cached",
            Source::Rendered => "rendered",
        };
        let (passes, spp) = (self.measured.passes, self.spp);
        format!("{source}, mitsuba {}, {}, {passes} passes of {spp} spp", self.mitsuba, self.variant)
    }
}
