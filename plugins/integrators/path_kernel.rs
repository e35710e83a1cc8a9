//! The path that `path` follows, whatever decides about its directions.
//!
//! The kernel is compiled once for each way to decide ([`Directions`]); where nothing is learnt it is what it would be
//! without any of this.

use super::common::{Met, PathLimits, Scattered, find_surface, mis_weight, scattered, weighted_emission};
use super::decides::Decides;
use super::directions::Directions;
use super::lights::PickLights;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Arena, Bxdf, CameraRay, LightSample, Lobes, PathState, Radiance, SurfaceHit, continuations,
};
use lucerna_core::render::Place;
use lucerna_core::sampling::Stream;
use lucerna_core::scene::Scene;
use std::cell::Cell;

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
    /// The splits of the camera sample before: what their random numbers depend on.
    before: u32,
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
    let mut passage = 1.0;
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
            let lobes = bsdf.lobes();
            // A sample is transparent if all lobes that were drawn let it through: how often must not depend on what decides.
            let undecided = found.alpha == 0.0 && lobes.intersects(Lobes::NULL);
            let here = match resumed.take() {
                Some(here) if R::BRANCHES => here,
                _ => directions.here(&hit, bxdf, depth == 0, undecided),
            };
            if R::BRANCHES && lobes.is_smooth() {
                passage = 1.0;
            }
            let asked = depth > 0 && !undecided;
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
                    let path = PathState { throughput, prospects, eta, passage, due: depth >= rr_depth, depth, goal };
                    wanted = limited(roulette.branches(&path, place.albedo, directions.outlook(here, &place)), splits);
                    count = wanted as u32 + u32::from(u_left < wanted.fract());
                    if count == 0 {
                        break 'path;
                    }
                    throughput *= 1.0 / wanted;
                }
                directions.note_fork(place, count, 1.0 / wanted, found.rays);
                if count > 1 {
                    let (left, before) = (Cell::new(count - 1), splits);
                    splits += count - 1;
                    let prospects = directions.mark();
                    let below = branch;
                    branch =
                        Some(arena.alloc(Branch { hit, here, throughput, prospects, eta, depth, left, before, below }));
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

            if R::BRANCHES && delta {
                passage *= sample.weight.max_component() * sample.eta * sample.eta;
            }

            if throughput.is_black() {
                break 'path;
            }
            u_left = u_roulette;
            if depth >= rr_depth {
                let (prospects, goal) = (directions.prospects(throughput), directions.goal());
                let q = roulette.survival(&PathState { throughput, prospects, eta, passage, due: true, depth, goal });
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
        stream.enter_branch(next.before + left);
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
