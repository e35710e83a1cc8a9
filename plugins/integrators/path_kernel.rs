//! The path that `path` follows, whatever decides about its directions.
//!
//! The kernel is compiled once for each way to decide ([`Directions`]); where nothing is learnt it is what it would be
//! without any of this.

use super::common::{Met, PathLimits, Scattered, find_surface, mis_weight, scattered, weighted_emission};
use super::decides::Decides;
use super::lights::PickLights;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Arena, Bxdf, BxdfSample, CameraRay, Goal, GuidedDirections, LightSample, Lobes, MOST_GUIDED, Outlook, PathState,
    Radiance, RecordKind, SurfaceHit, Transport, continuations,
};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::render::{Guidance, Notebook, Place, Scattering};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::Scene;
use std::cell::Cell;

/// Who decides in which direction a path goes on, and keeps notes.
pub(super) trait Directions {
    /// What is known at a vertex: read once, then used for all that happens there.
    type Here: Copy;

    /// Reads it. `smooth` says whether the BSDF has a lobe with a density here.
    fn here(&self, hit: &SurfaceHit, bxdf: &dyn Bxdf) -> Self::Here;

    /// Whether lights are sampled that a ray can also run into.
    fn samples_emitters(&self) -> bool;

    /// Density of world direction `d` in which the BSDF alone has density `pdf_bsdf`.
    fn mixed_pdf(here: Self::Here, d: Vec3, pdf_bsdf: f32) -> f32;

    /// Where the path goes on, in world space, and how.
    fn sample(here: Self::Here, hit: &SurfaceHit, bxdf: &dyn Bxdf, u1: f32, u2: Vec2) -> Option<Step>;

    /// Candidates for that at a vertex, if there are several: one is [resampled](Self::resample).
    fn candidates(&self) -> Option<u32>;

    /// Where the path goes on, chosen among so many candidates by `choice`.
    fn resample(
        here: Self::Here,
        hit: &SurfaceHit,
        bxdf: &dyn Bxdf,
        candidates: u32,
        numbers: (f32, Vec2),
        choice: f32,
    ) -> Option<Step>;

    /// What the throughput, which is this, would be about if directions came from the BSDF; not less than it is.
    fn prospects(&self, throughput: Rgb) -> Rgb;

    /// What has to be known to go back to this vertex.
    fn mark(&self) -> Rgb;

    /// Goes back to a vertex where [`mark`](Self::mark) said this.
    fn resume(&mut self, prospects: Rgb);

    /// What is known of the pixel.
    fn goal(&self) -> Goal;

    /// Whether what scattering brings is learnt, so that paths may split or end before they are scattered.
    fn looks_ahead(&self) -> bool;

    /// Whether notes are kept.
    fn learns(&self) -> bool;

    /// What scattering at a vertex brings, as far as is known.
    fn outlook(&self, place: &Place) -> Option<Outlook>;

    /// Notes that so many branches go on from a vertex, each with this share, after so many rays.
    fn note_fork(&mut self, place: Place, count: u32, share: f32, rays: u32);

    /// Notes light of a sampled emitter.
    fn note_direct(&mut self, light: Rgb);

    /// Notes where the path goes on.
    fn note_step(&mut self, here: Self::Here, hit: &SurfaceHit, bxdf: &dyn Bxdf, step: &Step);

    /// Notes that roulette was survived.
    fn note_survival(&mut self, q: f32);

    /// Notes light that was found by chance.
    fn note_met(&mut self, light: Rgb, alone: bool);

    /// Notes the end of the path, or of a branch, after so many rays.
    fn note_end(&mut self, rays: u32);
}

/// A direction that was chosen.
pub(super) struct Step {
    /// It and its weight; the density is that of the mixture.
    pub sample: BxdfSample,
    /// By what the weight is more than value over density, because this was chosen among several.
    pub choice: f32,
    /// In world space.
    pub d: Vec3,
    /// Its density in the BSDF alone, or the probability of the delta lobe.
    pub pdf_bsdf: f32,
    /// Its density in the guide alone.
    pub pdf_guide: f32,
}

/// Directions come from the BSDF, and nothing is noted.
pub(super) struct Unguided;

impl Directions for Unguided {
    type Here = ();

    #[inline(always)]
    fn here(&self, _hit: &SurfaceHit, _bxdf: &dyn Bxdf) {}

    #[inline(always)]
    fn samples_emitters(&self) -> bool {
        true
    }

    #[inline(always)]
    fn mixed_pdf((): (), _d: Vec3, pdf_bsdf: f32) -> f32 {
        pdf_bsdf
    }

    #[inline(always)]
    fn sample((): (), hit: &SurfaceHit, bxdf: &dyn Bxdf, u1: f32, u2: Vec2) -> Option<Step> {
        let sample = bxdf.sample(hit.wi, u1, u2, Transport::Radiance)?;
        Some(Step { d: hit.to_world(sample.wo), pdf_bsdf: sample.pdf, pdf_guide: 0.0, choice: 1.0, sample })
    }

    #[inline(always)]
    fn candidates(&self) -> Option<u32> {
        None
    }

    #[inline(always)]
    fn resample(
        (): (),
        hit: &SurfaceHit,
        bxdf: &dyn Bxdf,
        _candidates: u32,
        (u1, u2): (f32, Vec2),
        _choice: f32,
    ) -> Option<Step> {
        Self::sample((), hit, bxdf, u1, u2)
    }

    #[inline(always)]
    fn prospects(&self, throughput: Rgb) -> Rgb {
        throughput
    }

    #[inline(always)]
    fn mark(&self) -> Rgb {
        Rgb::WHITE
    }

    #[inline(always)]
    fn resume(&mut self, _prospects: Rgb) {}

    #[inline(always)]
    fn goal(&self) -> Goal {
        Goal::default()
    }

    #[inline(always)]
    fn looks_ahead(&self) -> bool {
        false
    }

    #[inline(always)]
    fn learns(&self) -> bool {
        false
    }

    #[inline(always)]
    fn outlook(&self, _place: &Place) -> Option<Outlook> {
        None
    }

    #[inline(always)]
    fn note_fork(&mut self, _place: Place, _count: u32, _share: f32, _rays: u32) {}

    #[inline(always)]
    fn note_direct(&mut self, _light: Rgb) {}

    #[inline(always)]
    fn note_step(&mut self, (): (), _hit: &SurfaceHit, _bxdf: &dyn Bxdf, _step: &Step) {}

    #[inline(always)]
    fn note_survival(&mut self, _q: f32) {}

    #[inline(always)]
    fn note_met(&mut self, _light: Rgb, _alone: bool) {}

    #[inline(always)]
    fn note_end(&mut self, _rays: u32) {}
}

/// Directions come from the mixture of a guide and the BSDF.
pub(super) struct Guided<'a> {
    /// What holds during the pass.
    pub guidance: Guidance<'a>,
    /// Where what is found is noted.
    pub notes: &'a mut Notebook,
    /// Where closed forms of what was learnt are made.
    pub arena: &'a Arena,
    /// What the throughput would be about if directions had been chosen by the BSDF.
    pub prospects: Rgb,
}

/// The two-dimensional Kronecker sequence of lowest discrepancy known: powers of one over the plastic number (Roberts
/// 2018, "The unreasonable effectiveness of quasirandom sequences").
const PLASTIC: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);

/// The least that is left of a path's prospects at a vertex: whatever an albedo says, roulette gives it a chance.
const LEAST_PROSPECTS: f32 = 0.05;

/// What a guide knows at a vertex.
#[derive(Clone, Copy)]
pub(super) struct Learnt<'v> {
    /// With its probability; none where the BSDF stands alone.
    guide: Option<(&'v dyn GuidedDirections, f32)>,
    /// Something can be learnt here.
    teaches: bool,
    /// The BSDF also has delta lobes.
    hybrid: bool,
}

impl<'a> Directions for Guided<'a> {
    type Here = Learnt<'a>;

    #[inline]
    fn here(&self, hit: &SurfaceHit, bxdf: &dyn Bxdf) -> Learnt<'a> {
        let lobes = bxdf.lobes();
        let hybrid = lobes.has_delta();
        let directs = self.guidance.subjects.directions;
        if !directs || !lobes.is_smooth() || bxdf.roughness() < self.guidance.least_roughness {
            return Learnt { guide: None, teaches: false, hybrid };
        }
        let one_sided = !lobes.and(Lobes::SMOOTH).intersects(Lobes::TRANSMISSION);
        let guide = self.guidance.field.at(hit, one_sided, self.arena).and_then(|guide| {
            let p = guide.p_guide().clamp(0.0, MOST_GUIDED);
            (p > 0.0).then_some((guide, p))
        });
        Learnt { guide, teaches: true, hybrid }
    }

    #[inline]
    fn samples_emitters(&self) -> bool {
        self.guidance.sample_emitters
    }

    #[inline]
    fn mixed_pdf(here: Learnt<'a>, d: Vec3, pdf_bsdf: f32) -> f32 {
        match here.guide {
            Some((guide, p_guide)) => p_guide * guide.pdf(d) + (1.0 - p_guide) * pdf_bsdf,
            None => pdf_bsdf,
        }
    }

    /// One-sample mixture (Veach 1997, section 9.2.4, with the balance heuristic): whichever chose the direction, it is
    /// weighted by the density of the mixture. Delta lobes belong to the BSDF alone.
    #[inline]
    fn sample(here: Learnt<'a>, hit: &SurfaceHit, bxdf: &dyn Bxdf, u1: f32, u2: Vec2) -> Option<Step> {
        let Some((guide, p_guide)) = here.guide else { return Unguided::sample((), hit, bxdf, u1, u2) };
        if u1 < p_guide {
            let (d, pdf_guide) = guide.sample(u2);
            let wo = hit.to_local(d);
            let (value, pdf_bsdf) = bxdf.eval_pdf(hit.wi, wo, Transport::Radiance);
            let pdf = p_guide * pdf_guide + (1.0 - p_guide) * pdf_bsdf;
            let weight = value * (1.0 / pdf);
            if value.is_black() || !weight.is_finite() {
                return None;
            }
            // The index of refraction only serves roulette, which may be told anything.
            let lobe = bxdf.lobes().and(Lobes::SMOOTH);
            let sample = BxdfSample { wo, weight, pdf, eta: 1.0, lobe };
            return Some(Step { sample, choice: 1.0, d, pdf_bsdf, pdf_guide });
        }
        let p_bsdf = 1.0 - p_guide;
        let rest = ((u1 - p_guide) / p_bsdf).min(ONE_MINUS_EPSILON);
        let mut step = Unguided::sample((), hit, bxdf, rest, u2)?;
        if step.sample.lobe.has_delta() {
            step.sample.weight *= 1.0 / p_bsdf;
            step.sample.pdf *= p_bsdf;
            return Some(step);
        }
        step.pdf_guide = guide.pdf(step.d);
        let pdf = p_guide * step.pdf_guide + p_bsdf * step.pdf_bsdf;
        step.sample.weight *= step.pdf_bsdf / pdf;
        step.sample.pdf = pdf;
        Some(step)
    }

    #[inline]
    fn candidates(&self) -> Option<u32> {
        Some(self.guidance.candidates).filter(|candidates| *candidates > 1)
    }

    /// Resampled importance sampling (Talbot, Cline, Egbert 2005) of the product of the BSDF and the light that was learnt.
    ///
    /// Each of M candidates i is drawn as [`sample`](Directions::sample) does, and has the contribution c(i), of which the
    /// expectation is what is sought. Candidate j is chosen with probability w(j)/Σw(i) and counts c(j) Σw(i)/(M w(j)).
    /// The expectation of that, given the candidates, is Σc(j)/M, if w(j) > 0 wherever c(j) ≠ 0; so it is what is sought,
    /// whatever w is, and also if candidates depend on each other: they are spread evenly over the random numbers.
    ///
    /// Here w(i) is c(i) without the light, times what is expected of it: with the probability of the guide, the light that
    /// was learnt over its mean, or else 1. For a diffuse BSDF that is what the mixture follows already, and the choice
    /// changes nothing; it helps the more, the less the BSDF is like a cosine.
    ///
    /// The density of the direction that comes out has no closed form, but none is asked for. In c(j) light met by chance
    /// is weighted against emitter sampling by the density of *one candidate*, the mixture's, and emitter sampling is
    /// weighted against the same. The two weights sum to one for each direction, which is all that the proof of multiple
    /// importance sampling needs (Veach 1997, section 9.2). It costs that emitter sampling counts for more than it would
    /// if the better density were known.
    #[inline]
    fn resample(
        here: Learnt<'a>,
        hit: &SurfaceHit,
        bxdf: &dyn Bxdf,
        candidates: u32,
        (u1, u2): (f32, Vec2),
        choice: f32,
    ) -> Option<Step> {
        let Some((guide, p_guide)) = here.guide else { return Unguided::sample((), hit, bxdf, u1, u2) };
        let (mut kept, mut kept_worth, mut total) = (None, 0.0, 0.0);
        let mut rest = choice;
        for i in 0..candidates {
            let shift = i as f32;
            let u1 = (u1 + shift / candidates as f32).fract().min(ONE_MINUS_EPSILON);
            let u2 = (u2 + shift * PLASTIC).fract().min(Vec2::splat(ONE_MINUS_EPSILON));
            let Some(step) = Self::sample(here, hit, bxdf, u1, u2) else { continue };
            let light = p_guide * guide.light(step.d).max(0.0) + (1.0 - p_guide);
            let worth = step.sample.weight.luminance() * light;
            if !(worth > 0.0 && worth.is_finite()) {
                // Nothing comes of it, or it is no number.
                continue;
            }
            total += worth;
            // A reservoir of one: with probability worth/total this one takes the place. What is left of the number is
            // a random number again.
            let p = worth / total;
            if rest < p || kept.is_none() {
                rest = (rest / p).min(ONE_MINUS_EPSILON);
                (kept, kept_worth) = (Some(step), worth);
            } else {
                rest = ((rest - p) / (1.0 - p)).clamp(0.0, ONE_MINUS_EPSILON);
            }
        }
        let mut step = kept?;
        step.choice = total / (candidates as f32 * kept_worth);
        step.sample.weight *= step.choice;
        Some(step)
    }

    /// A guide takes directions from which much light comes more often than the BSDF would, and the throughput falls by as
    /// much: judged by it, roulette would end the paths that matter (Müller 2019, section 10.6). What a path is worth, its
    /// throughput times the light ahead, falls by the albedo only. Where the guide was wrong the throughput is larger, and
    /// counts.
    #[inline]
    fn prospects(&self, throughput: Rgb) -> Rgb {
        let Rgb { r, g, b } = self.prospects;
        Rgb::new(throughput.r.max(r), throughput.g.max(g), throughput.b.max(b))
    }

    #[inline]
    fn mark(&self) -> Rgb {
        self.prospects
    }

    #[inline]
    fn resume(&mut self, prospects: Rgb) {
        self.prospects = prospects;
    }

    #[inline]
    fn goal(&self) -> Goal {
        self.guidance.goal
    }

    #[inline]
    fn looks_ahead(&self) -> bool {
        self.guidance.subjects.outlook
    }

    #[inline]
    fn learns(&self) -> bool {
        self.guidance.learning
    }

    #[inline]
    fn outlook(&self, place: &Place) -> Option<Outlook> {
        self.guidance.field.outlook(place.p, place.n)
    }

    #[inline]
    fn note_fork(&mut self, place: Place, count: u32, share: f32, rays: u32) {
        self.prospects *= share;
        if self.guidance.learning {
            self.notes.forked(place, count, share, rays);
        }
    }

    #[inline]
    fn note_direct(&mut self, light: Rgb) {
        if self.guidance.learning {
            self.notes.direct(light);
        }
    }

    #[inline]
    fn note_step(&mut self, here: Learnt<'a>, hit: &SurfaceHit, bxdf: &dyn Bxdf, step: &Step) {
        self.prospects *= match here.guide {
            Some(_) => at_least(bxdf.albedo(hit.wi), LEAST_PROSPECTS),
            None => step.sample.weight,
        };
        if !self.guidance.learning {
            return;
        }
        let kind = match (here.teaches, step.sample.lobe.has_delta(), here.guide) {
            (false, ..) => None,
            // A pure passage belongs to what lies behind; a mirror teaches how often it is taken.
            (true, true, Some(_)) if here.hybrid => Some(RecordKind::Delta),
            (true, true, _) => None,
            (true, false, Some(_)) => Some(RecordKind::Mixed),
            (true, false, None) => Some(RecordKind::Unguided),
        };
        let BxdfSample { weight, pdf, .. } = step.sample;
        let Step { d, choice, pdf_bsdf, pdf_guide, .. } = *step;
        // One over what the direction counts: a density in expectation, if there were several candidates.
        let pdf = pdf / choice;
        self.notes.scattered(Scattering { p: hit.p, d, weight, pdf, pdf_bsdf, pdf_guide, kind });
    }

    #[inline]
    fn note_survival(&mut self, q: f32) {
        self.prospects *= 1.0 / q;
        if self.guidance.learning {
            self.notes.survived(q);
        }
    }

    #[inline]
    fn note_met(&mut self, light: Rgb, alone: bool) {
        if self.guidance.learning {
            self.notes.met(light, alone);
        }
    }

    #[inline]
    fn note_end(&mut self, rays: u32) {
        if self.guidance.learning {
            self.notes.end(rays);
        }
    }
}

/// Each channel, or this if it is less; also if it is no number.
fn at_least(color: Rgb, least: f32) -> Rgb {
    Rgb::new(color.r.max(least), color.g.max(least), color.b.max(least))
}

/// Continuations of all splits of a camera sample together, at most.
const MOST_SPLITS: u32 = 1000;

/// A vertex from which further branches are to go on. Lies in the arena.
struct Branch<'v, H> {
    hit: SurfaceHit,
    here: H,
    throughput: Rgb,
    prospects: Rgb,
    eta: f32,
    depth: u32,
    /// How many are still to go on.
    left: Cell<u32>,
    /// What their random numbers depend on.
    key: u64,
    /// The one before, whose turn comes afterwards.
    below: Option<&'v Branch<'v, H>>,
}

/// Follows one path, and all its branches.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(super) fn trace<'v, D: Directions<Here: 'v>, R: Decides>(
    limits: PathLimits,
    scene: &Scene,
    lights: &impl PickLights,
    roulette: &R,
    camera: &CameraRay,
    stream: &mut Stream<'_>,
    arena: &'v Arena,
    directions: &mut D,
) -> Radiance {
    let PathLimits { max_depth, rr_depth, hide_emitters } = limits;
    let mut found = Radiance::default();
    if max_depth == 0 {
        return found;
    }
    let visible_environment = !hide_emitters && scene.environment().is_some();
    found.alpha = f32::from(visible_environment);
    let mut ray = camera.ray;
    let mut throughput = Rgb::WHITE;
    let mut eta = 1.0;
    // Of the vertex before; none at the camera and after a delta lobe, where light sampling has no part.
    let mut last: Option<Scattered> = None;
    let mut depth = 0;
    let mut hit = SurfaceHit::default();
    // What roulette has not used of the last random number drawn for it.
    let mut u_left = 0.0;
    let mut splits = 0;
    let mut branch: Option<&'v Branch<'v, D::Here>> = None;
    let mut resumed: Option<D::Here> = None;
    'paths: loop {
        'path: {
            let resumes = R::BRANCHES && resumed.is_some();
            if !resumes {
                let hidden = hide_emitters && depth == 0;
                let met = find_surface(scene, &ray, hidden, &mut hit, &mut found.rays);
                if !hidden
                    && let Some(Met { light, alone }) =
                        weighted_emission(scene, lights, &ray, met.then_some(&hit), last, mis_weight)
                {
                    directions.note_met(light, alone);
                    found.rgb += throughput * light;
                }
                if !met {
                    break 'path;
                }
                if depth + 1 >= max_depth {
                    if depth == 0 && !found.rgb.is_black() {
                        found.alpha = 1.0;
                    }
                    break 'path;
                }
            }
            let bsdf = scene.bsdf(&hit);
            let bxdf = bsdf.resolve(&hit, arena);
            let here = match resumed.take() {
                Some(here) if R::BRANCHES => here,
                _ => directions.here(&hit, bxdf),
            };
            let lobes = bsdf.lobes();
            // Whether the sample is transparent does not depend on what roulette decides.
            let asked = depth > 0 && (found.alpha > 0.0 || !lobes.intersects(Lobes::NULL));
            if R::BRANCHES
                && directions.looks_ahead()
                && !resumes
                && lobes.is_smooth()
                && (asked || directions.learns())
            {
                let place = Place { p: hit.p, n: hit.frame.n * 1f32.copysign(hit.wi.z), albedo: bxdf.albedo(hit.wi) };
                let (mut wanted, mut count) = (1.0, 1);
                if asked {
                    found.alpha = 1.0;
                    let (prospects, goal) = (directions.prospects(throughput), directions.goal());
                    let path = PathState { throughput, prospects, eta, due: depth >= rr_depth, depth, goal };
                    wanted = limited(roulette.branches(&path, place.albedo, directions.outlook(&place)), splits);
                    count = wanted as u32 + u32::from(u_left < wanted.fract());
                    if count == 0 {
                        break 'path;
                    }
                    splits += count - 1;
                    throughput *= 1.0 / wanted;
                }
                directions.note_fork(place, count, 1.0 / wanted, found.rays);
                if count > 1 {
                    let (left, key) = (Cell::new(count - 1), stream.key());
                    let prospects = directions.mark();
                    let below = branch;
                    branch =
                        Some(arena.alloc(Branch { hit, here, throughput, prospects, eta, depth, left, key, below }));
                }
            }
            let from = lights.vertex(&hit, lobes);
            let worth = |light: &LightSample| {
                let (contribution, pdf) = scattered(scene, &hit, bxdf, light);
                (contribution * weight_of::<D>(light, here, pdf)).luminance()
            };
            if lobes.is_smooth()
                && let Some(light) = lights.sample(scene, &from, stream, worth)
                // What no ray can run into must be sampled in any case.
                && (light.delta || directions.samples_emitters())
            {
                let direct = direct_light::<D>(scene, &hit, bxdf, &light, here, &mut found.rays);
                directions.note_direct(direct);
                found.rgb += throughput * direct;
            }
            let (u1, u2) = (stream.next_1d(), stream.next_2d());
            let step = match directions.candidates() {
                None => D::sample(here, &hit, bxdf, u1, u2),
                Some(n) => D::resample(here, &hit, bxdf, n, (u1, u2), stream.next_1d()),
            };
            // Drawn at every vertex, needed or not: the numbers of the next sample depend on it in the reference's order.
            let u_roulette = stream.next_1d();
            let Some(step) = step.filter(|step| scene.keeps_sides(&hit, step.sample.wo)) else {
                found.alpha = 1.0;
                break 'path;
            };
            let sample = &step.sample;
            throughput *= sample.weight;
            eta *= sample.eta;
            if sample.lobe != Lobes::NULL {
                found.alpha = 1.0;
            }
            ray = hit.leave(step.d);
            let delta = sample.lobe.has_delta();
            let weighs = !delta && directions.samples_emitters();
            last = weighs.then_some(Scattered { from, pdf: sample.pdf });
            depth += 1;
            directions.note_step(here, &hit, bxdf, &step);

            if throughput.is_black() {
                break 'path;
            }
            u_left = u_roulette;
            if depth >= rr_depth {
                let (prospects, goal) = (directions.prospects(throughput), directions.goal());
                let q = roulette.survival(&PathState { throughput, prospects, eta, due: true, depth, goal }, delta);
                if u_roulette >= q {
                    break 'path;
                }
                throughput *= 1.0 / q;
                directions.note_survival(q);
                u_left = u_roulette / q;
            }
            continue 'paths;
        }
        directions.note_end(found.rays);
        let Some(next) = branch.filter(|_| R::BRANCHES) else { break };
        (hit, throughput, eta, depth) = (next.hit, next.throughput, next.eta, next.depth);
        directions.resume(next.prospects);
        resumed = Some(next.here);
        let left = next.left.get();
        *stream = Stream::branch(next.key, left);
        next.left.set(left - 1);
        if left == 1 {
            branch = next.below;
        }
    }
    if found.alpha == 0.0 {
        found.rgb = Rgb::BLACK;
    }
    found
}

/// An answer of roulette as it is followed, after so many splits.
#[inline]
fn limited(answer: f32, splits: u32) -> f32 {
    let wanted = continuations(answer);
    if splits < MOST_SPLITS { wanted } else { wanted.min(1.0) }
}

/// Light of one emitter sample scattered at a hit, weighted against the sampling of directions.
#[inline(always)]
fn direct_light<D: Directions>(
    scene: &Scene,
    hit: &SurfaceHit,
    bxdf: &dyn Bxdf,
    light: &LightSample,
    here: D::Here,
    rays: &mut u32,
) -> Rgb {
    let (contribution, pdf) = scattered(scene, hit, bxdf, light);
    if contribution.is_black() {
        return Rgb::BLACK;
    }
    *rays += 1;
    if !scene.visible(hit, light) {
        return Rgb::BLACK;
    }
    contribution * weight_of::<D>(light, here, pdf)
}

/// Weight of emitter sampling against the sampling of directions, in which the BSDF has density `pdf`.
#[inline(always)]
fn weight_of<D: Directions>(light: &LightSample, here: D::Here, pdf: f32) -> f32 {
    if light.delta { 1.0 } else { mis_weight(light.pdf, D::mixed_pdf(here, light.point.d, pdf)) }
}
