//! `sd_tree`: learns where light comes from in a tree over space whose leaves hold trees over directions.
//!
//! Practical path guiding (Müller, Gross, Novák 2017) with the extensions of Müller 2019 ("Practical Path Guiding in
//! Production"). Space is halved along x, y, z in turn; each cell holds a quadtree over the cylinder (z, azimuth) of
//! world directions. Paths note at each vertex the radiance that arrived; after an iteration cells with many records
//! are halved and quadtrees are refined where the flux is. A direction is drawn from the mixture of this and the BSDF;
//! the probability of either is learnt in each cell. Delta lobes are left to the BSDF. Incident radiance only: where
//! the BSDF is narrow and light comes from everywhere, it helps little. The picture is unbiased whatever was learnt.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `spatial_threshold` | float | 500 | a cell of space is halved with more records than this times √(samples per pixel of the iteration) |
//! | `directional_threshold` | float | 0.01 | a cell of directions is divided with more than this part of the flux |
//! | `directional_depth` | integer | 20 | levels of quadtrees at most, from 3 to 20 |
//! | `prior` | float | 1 | what larger cells of space have found counts as much as so many records, and so does, inside a cell of directions, light from everywhere; 0 as published |
//! | `memory` | float | 0.5 | part of what was found that still counts an iteration later; 0 as published |
//! | `spatial_filter` | string | stochastic | records go to the cell they lie in (`nearest`), to one in a box about it (`stochastic`), or to all of the `box` by volume (of small parts some are taken, for all) |
//! | `directional_filter` | string | box | records go to the directions they lie in (`nearest`), or to all in a `box` about them by area |
//! | `p_guide` | float | unset | probability of the guide, limited to 0.95; learnt if unset, up to 0.7 |
//! | `least_gain` | float | 0.12 | if the mixture is closer than the BSDF alone to the light that is scattered by less than so many nats (divergence of Kullback and Leibler, mean over all vertices), the rest of the picture is left to the BSDF, and to roulette; 0: never. Only where `p_guide` is learnt and `sets` is `one` |
//! | `environment` | float | 0.1 | part of the guide's directions that go where the environment is bright, learnt or not, in scenes with glass or masks, behind which emitter sampling does not see it; 0 as published |
//! | `photons` | float | 0.5 | part of the guide's directions, at most, that is given anew in each iteration to where light came from that was followed from lamps through glass and off mirrors; less where paths find little there; 0 as published |
//! | `product` | string | cosine | what the guide follows: `none`, the light alone; `cosine`, its product with the cosine, for BSDFs that reflect only; `resampling`, its product with any BSDF, by a choice among candidates |
//! | `candidates` | integer | 2 | for `resampling`: directions drawn at a vertex, of which one is followed |
//! | `sets` | string | one | sets of directions in each cell of space: `one`; `direct_indirect`, one for light of emitters that a scattered ray runs into and one for all other light, whose mixture is learnt; `primary_product`, one for what first hits scatter towards the camera (light times BSDF times cosine) and one for light that arrives at later vertices |
//! | `roughness_threshold` | float | 0.05 | narrower lobes than this are not guided |
//! | `nee` | string | always | when lights are sampled: `never`, `kickstart` (the first 128 samples per pixel), `always` |
//! | `direct` | boolean | true | light that emitter sampling also finds is learnt, times the weight of finding it by scattering |
//! | `startup` | integer | 8 | iterations of one sample per pixel before those that have as many samples as all before them |
//! | `learning` | float | 0.2 | the last iteration, from which nothing is learnt, begins once so much of the budget is spent, or half as much where paths are left to the BSDF; 1/3 is nearly as published |
//! | `ending` | string | doubling | when else it begins: never (`doubling`), or, from 256 samples per pixel on, as soon as the `variance` that the rest of the budget would leave rises from one iteration to the next |
//! | `combination` | string | inverse_variance | which iterations make the picture: the last four by `inverse_variance`, or the `last` |
//! | `max_memory` | float | 64 | MiB that the trees may take; then they stay coarser |
//! | `file` | string | unset | a file to begin with, if it is there, and to leave what was learnt in; a relative name is looked for beside the scene. Only `render` writes it, and its `--guide-file` takes the place of both this and `frozen` |
//! | `frozen` | boolean | false | nothing is learnt, and the file, which must be there, stays as it is |
//!
//! Light of lamps behind glass, or by way of mirrors, which paths meet by chance only, is followed from the lamps: `photons`
//! tell each cell from where it comes before a path has found it. Scenes without delta lobes have none and pay nothing;
//! smooth `plastic` and `mask` have such lobes too. What `memory` keeps of photons comes on top of their part, and a cell in
//! which paths have found nothing at all follows photons alone. Not followed is light off gloss, or that is first turned by
//! shapes placed as instances; nor do photons know how long the integrator lets paths be. With `primary_product` what first
//! hits scatter is learnt from paths alone. Where such light is rare in what paths find, `prior` may hide it, and a fifth of
//! the budget may be too little to learn from:
//! `lucerna compare scene.xml -m path path+guide=sd_tree path+guide=sd_tree:prior=0,learning=0.333` tells that, and what
//! each sample costs.
//!
//! Two `sets` have to share what is found and cost time; whether they pay in a scene tells
//! `lucerna compare scene.xml -m path+guide=sd_tree path+guide=sd_tree:sets=direct_indirect`.
//!
//! Whether to guide at all is decided when the start is over, by 0.4 of `least_gain`, and by all of it after each iteration
//! that learns from then on; once left to the BSDF, the picture stays so. The threshold knows nothing of what rays cost:
//! whether it is right for a scene tells
//! `lucerna compare scene.xml -m path+roulette=adjoint path+guide=sd_tree:least_gain=0`.
//!
//! Limits. A cell of space has one distribution for all its points: a bright spot near by is blurred by parallax until
//! the cells are small, which takes millions of samples. Small or short renders, and those whose noise comes from
//! sampled lights or from caustics that are rarely found, gain little, and each sample costs more: least where rays are
//! dear, as in large scenes, and most in a box of few triangles. Each candidate of `resampling` asks the guide and the
//! BSDF again; it pays where rays are dear and BSDFs are not diffuse. `prior` 0, `memory` 0, `spatial_threshold` 12000,
//! both filters `nearest`, `p_guide` 0.5, `product` `none`, `startup` 0, `environment` 0, `photons` 0 and `combination`
//! `last` are nearly the form of 2017.
//!
//! Samples are never clamped, guided or not. A limit to what a sample may count would take more light where the guide knows
//! little than where it knows much, and leave patches along the edges of its cells, most of all in shadows. More samples,
//! or `p_guide` at 0.5, are what there is against bright dots.
//!
//! Paths go by the roulette `adjoint` unless another is named: from what this tree has learnt they end early where little
//! light is ahead, and split where much is.
//!
//! What differs from the publications stands at the head of `learner.rs`.
//!
//! ```xml
//! <guide type="sd_tree">
//!     <float name="spatial_threshold" value="2000"/>
//! </guide>
//! ```

mod cylinder;
mod field;
mod gain;
mod kept;
mod learner;
mod mixing;
mod near;
mod outlook;
mod pair;
mod photons;
mod prior;
mod quadtree;
mod sets;
mod spatial;
mod sums;

use learner::Learner;
use lucerna_core::interfaces::{
    Combination, EmitterSampling, Ending, Guide, GuideFile, GuideLearner, GuideSets, MOST_GUIDED, Training,
};
use lucerna_core::io::Result;
use lucerna_core::math::Aabb;
use lucerna_core::render::Learnt;
use lucerna_core::scene::{Built, Constructor, Failed, Param, Plugin, Properties};
use std::sync::Arc;

/// The part of the budget in which something is learnt. Samples that are learnt from take longer, and what they teach has to
/// pay for that in what is left.
const LEARNING: f64 = 0.2;

/// Iterations after which the guide is judged, where the start has fewer.
const LEAST_TRIAL: u32 = 4;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "sd_tree",
    aliases: &[],
    summary: "learns incident light in a tree over space and directions",
    params: &[&[
        Param::float("spatial_threshold", 500.0, "records after which a cell of space is halved").at_least(1.0),
        Param::float("directional_threshold", 0.01, "part of the flux above which a cell of directions is divided")
            .range(1e-6, 1.0),
        Param::int("directional_depth", 20, "levels of quadtrees at most").range(3.0, quadtree::MOST_LEVELS as f64),
        Param::float("prior", 1.0, "records that count as much as what larger cells around have found").at_least(0.0),
        Param::float("memory", 0.5, "part of what was found that still counts an iteration later").range(0.0, 1.0),
        Param::choice("spatial_filter", &["nearest", "stochastic", "box"], "stochastic", "cells a record goes to"),
        Param::choice("directional_filter", &["nearest", "box"], "box", "directions a record goes to"),
        Param::float_opt("p_guide", "probability of the guide; learnt if unset").range(0.0, 1.0),
        Param::float("least_gain", 0.12, "nats that the guide must gain, or the picture is left to the BSDF")
            .range(0.0, 1e3),
        Param::float("environment", 0.1, "part of the guide that goes to a bright environment behind glass")
            .range(0.0, 0.5),
        Param::float(
            "photons",
            0.5,
            "part of the guide, at most, that goes to light followed from lamps through glass",
        )
        .range(0.0, 0.9),
        Param::choice(
            "product",
            &["none", "cosine", "resampling"],
            "cosine",
            "what the guide follows besides the light",
        ),
        Param::int("candidates", 2, "directions of which one is chosen, if the product is by resampling")
            .range(1.0, 64.0),
        Param::choice("sets", &sets::NAMES, sets::NAMES[0], "sets of directions in each cell"),
        Param::float("roughness_threshold", 0.05, "narrower lobes are not guided").range(0.0, 1.0),
        Param::choice("nee", &["never", "kickstart", "always"], "always", "when lights are sampled"),
        Param::bool("direct", true, "learns light that emitter sampling also finds, by its weight"),
        Param::int("startup", 8, "iterations of one sample per pixel at the start").range(0.0, 64.0),
        Param::float("learning", LEARNING, "part of the budget after which nothing more is learnt").range(0.0, 0.5),
        Param::choice("ending", &["doubling", "variance"], "doubling", "when the last iteration begins"),
        Param::choice(
            "combination",
            &["inverse_variance", "last"],
            "inverse_variance",
            "which iterations make the picture",
        ),
        Param::float("max_memory", 64.0, "MiB that the trees may take").at_least(0.0),
        Param::string_opt("file", "a file to begin with, and to leave what was learnt in"),
        Param::bool("frozen", false, "nothing is learnt, and the file stays as it is"),
    ]],
    build: Constructor::Guide(build),
};

/// Which cells a record goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SpatialFilter {
    Nearest,
    Stochastic,
    Box,
}

/// Which directions a record goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DirectionalFilter {
    Nearest,
    Box,
}

/// How the tree grows and what it gives.
#[derive(Clone, Copy, Debug)]
struct Settings {
    spatial_threshold: f64,
    directional_threshold: f64,
    depth: u32,
    /// Records that what larger cells have found is worth.
    prior: f64,
    /// Part of what was found that still counts an iteration later.
    memory: f64,
    /// Part of the directions that photons have, at most.
    photons: f64,
    spatial_filter: SpatialFilter,
    directional_filter: DirectionalFilter,
    p_guide: Option<f32>,
    /// What the guide must gain over the BSDF, in nats, or paths are left to that; 0 if they never are.
    least_gain: f64,
    /// Iterations after which it must.
    trial: u32,
    cosine: bool,
    max_bytes: usize,
    /// What each cell keeps apart.
    sets: GuideSets,
    /// Whether that was asked for; else what begins with a file goes on with what it has.
    sets_asked: bool,
    /// Whether directions are learnt; else only what scattering brings.
    directions: bool,
}

/// The part of the least gain that is asked for when the start is over. A guide learns fast then: one that was misled by a
/// single sample had 0.06 nats in the kitchen, and 0.15 after the next iteration (`lucerna guide info` after `lucerna render
/// kitchen.xml --lenient --integrator path --size 96x54 --sampler sobol --seed 7 --guide sd_tree --guide-file FILE` with `--spp 8`
/// and `--spp 16`).
const EARLY: f64 = 0.4;

impl Settings {
    /// The gain without which paths are left to the BSDF after so many iterations.
    fn asked_gain(&self, iterations: u32) -> f64 {
        if !self.may_leave() || iterations < self.trial {
            f64::NEG_INFINITY
        } else if iterations == self.trial {
            EARLY * self.least_gain
        } else {
            self.least_gain
        }
    }

    /// Whether paths are left to the BSDF where [little is gained](gain).
    fn may_leave(&self) -> bool {
        self.least_gain > 0.0 && self.p_guide.is_none() && self.sets == GuideSets::One
    }
}

fn build(p: &Properties<'_>) -> Built<dyn Guide> {
    let number = |name: &str| u32::try_from(p.int(name)).unwrap_or(0);
    let settings = Settings {
        spatial_threshold: p.double("spatial_threshold"),
        directional_threshold: p.double("directional_threshold"),
        depth: number("directional_depth"),
        prior: p.double("prior"),
        memory: p.double("memory"),
        photons: p.double("photons"),
        spatial_filter: match p.choice("spatial_filter") {
            "nearest" => SpatialFilter::Nearest,
            "box" => SpatialFilter::Box,
            _ => SpatialFilter::Stochastic,
        },
        directional_filter: match p.choice("directional_filter") {
            "nearest" => DirectionalFilter::Nearest,
            _ => DirectionalFilter::Box,
        },
        p_guide: p.float_opt("p_guide").map(|p| p.min(MOST_GUIDED)),
        least_gain: p.double("least_gain"),
        trial: number("startup").max(LEAST_TRIAL),
        cosine: p.choice("product") != "none",
        max_bytes: (p.double("max_memory") * f64::from(1 << 20)) as usize,
        sets: sets::of_name(p.choice("sets")),
        sets_asked: p.has("sets"),
        directions: true,
    };
    let training = Training {
        startup: number("startup"),
        ending: match p.choice("ending") {
            "variance" => Ending::Variance,
            _ => Ending::Doubling,
        },
        learning: p.double("learning"),
        combination: match p.choice("combination") {
            "last" => Combination::Last,
            _ => Combination::InverseVariance,
        },
        emitter_sampling: match p.choice("nee") {
            "never" => EmitterSampling::Never,
            "kickstart" => EmitterSampling::Kickstart,
            _ => EmitterSampling::Always,
        },
        learn_direct: p.bool("direct"),
        least_roughness: p.float("roughness_threshold"),
        to_environment: p.float("environment"),
        to_photons: p.float("photons"),
        candidates: if p.choice("product") == "resampling" { number("candidates") } else { 1 },
    };
    Ok(Arc::new(SdTree { settings, training, file: file(p)? }))
}

/// The file that the scene names, which can be read if it is there.
fn file(p: &Properties<'_>) -> std::result::Result<Option<GuideFile>, Failed> {
    let frozen = p.bool("frozen");
    if p.string_opt("file").is_none() {
        return if frozen { Err(p.error("frozen", "\"frozen\" needs a \"file\"")) } else { Ok(None) };
    }
    let path = if frozen { p.file("file")? } else { p.file_to_write("file")? };
    if path.exists() {
        Learnt::read(&path).map_err(|e| p.error("file", e.to_string()))?;
    }
    Ok(Some(GuideFile { path, frozen }))
}

struct SdTree {
    settings: Settings,
    training: Training,
    file: Option<GuideFile>,
}

/// Records after which a cell of space is halved where nothing but outlooks is learnt.
const OUTLOOK_THRESHOLD: f64 = 500.0;

/// What a tree over space alone goes by.
const OUTLOOK: Settings = Settings {
    spatial_threshold: OUTLOOK_THRESHOLD,
    directional_threshold: 1.0,
    depth: 0,
    spatial_filter: SpatialFilter::Nearest,
    directional_filter: DirectionalFilter::Nearest,
    p_guide: Some(0.0),
    least_gain: 0.0,
    trial: 0,
    prior: 0.0,
    memory: 0.0,
    photons: 0.0,
    cosine: false,
    max_bytes: 64 << 20,
    sets: GuideSets::One,
    sets_asked: false,
    directions: false,
};

/// The tree over space alone, for roulette of paths that are not guided. All samples count alike, since none is guided
/// worse than others.
pub(crate) fn outlook_alone() -> Arc<dyn Guide> {
    let training = Training {
        startup: 4,
        ending: Ending::Doubling,
        learning: LEARNING,
        combination: Combination::All,
        emitter_sampling: EmitterSampling::Always,
        learn_direct: true,
        least_roughness: 0.0,
        to_environment: 0.0,
        to_photons: 0.0,
        candidates: 1,
    };
    Arc::new(SdTree { settings: OUTLOOK, training, file: None })
}

impl Guide for SdTree {
    fn start(&self, bounds: Aabb) -> Box<dyn GuideLearner> {
        Box::new(Learner::new(self.settings, bounds))
    }

    fn training(&self) -> Training {
        self.training
    }

    fn kept_as(&self) -> Option<&'static str> {
        Some(if self.settings.directions { PLUGIN.name } else { "outlook" })
    }

    fn file(&self) -> Option<GuideFile> {
        self.file.clone()
    }

    fn recall(&self, bounds: Aabb, saved: &[u8]) -> Result<Box<dyn GuideLearner>> {
        Ok(Box::new(Learner::unpack(self.settings, bounds, saved)?))
    }
}
