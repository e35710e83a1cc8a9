//! Photons: light followed from lamps through glass and off mirrors to where paths are guided, before a path has found it.
//!
//! Light of a small lamp that arrives through glass, or by a mirror, is what paths from the camera meet last: no sampling of
//! lights finds it, and a guide learns of it from those few paths that run into the lamp by chance, in each cell of space
//! anew. Light on its way from the lamp cannot miss it. So a guide is told of both: paths that have found something, and photons
//! (reverse and forward training: Jensen 1995, "Importance driven path tracing using the photon map"; Vorba, Karlík, Šik,
//! Ritschel, Křivánek 2014, "On-line learning of parametric mixture models for light transport simulation"). They are a
//! guess of directions, nothing more: nothing of their power gets into the picture.
//!
//! Most of what a lamp sends out meets no glass. Instead of following that, a photon begins where it would first be turned: at
//! a point of such a surface, uniform in area, with a light that is sampled from there (projection maps, Jensen 2001, *Realistic
//! Image Synthesis Using Photon Mapping*, section 5.1, whose aim is the same). Any emitter will do, for it has to answer no
//! more than emitter sampling asks, but for those without extent: no path runs into them, so nothing is to be guided there.

use crate::accel::{NO_INSTANCE, NO_TRIANGLE, Ray};
use crate::color::Rgb;
use crate::interfaces::{AreaSample, Arena, EmitterFlags, Photon, SurfaceHit, Transport, is_guided};
use crate::math::Vec2;
use crate::sampling::{Discrete, Pcg32};
use crate::scene::{BuiltShape, Scene};
use rayon::prelude::*;

/// Photons that one stream of random numbers sends out.
const CHUNK: u64 = 4096;

/// Surfaces that one passes at most.
const LONGEST: u32 = 16;

/// Photons sent out at most, and
const MOST_EMITTED: u64 = 1 << 22;

/// kept, but for the rest of a chunk: 14 MiB. Then no more are sent out.
const MOST_KEPT: usize = 1 << 19;

/// Sent out in vain before it is given up: a mirror may send all light away.
const MOST_IN_VAIN: u64 = 16 * CHUNK;

/// Chunks that are followed at the same time; whether to stop is asked in between.
const BATCH: u64 = 16;

/// Sent out in any case: so few that it takes little time.
const LEAST_EMITTED: f64 = 16384.0;

/// Those sent out for each camera path. Each has few rays, and no light to sample on its way: a tenth of the time.
const PER_PATH: f64 = 0.2;

/// Sends photons out and keeps those that have arrived.
pub struct Photons<'s> {
    scene: &'s Scene,
    /// Narrower lobes than this are not guided.
    least_roughness: f32,
    /// Shapes that turn light without scattering it, in parts by area.
    shapes: Vec<u32>,
    by_area: Discrete,
    emitted: u64,
    arrived: Vec<Photon>,
}

impl<'s> Photons<'s> {
    /// None yet; `None` where there is nothing to turn them, or no light to be turned. None begin at what is placed by
    /// instances, which have no area of their own.
    pub fn new(scene: &'s Scene, least_roughness: f32) -> Option<Self> {
        if scene.emitters().iter().all(|emitter| emitter.flags().has(EmitterFlags::DELTA)) {
            return None;
        }
        let area = |shape: &BuiltShape| f64::from(shape.shape.area());
        let (shapes, areas): (Vec<u32>, Vec<f64>) = (0..)
            .zip(scene.shapes())
            .filter(|(_, shape)| shape.bsdf.lobes().has_delta() && area(shape) > 0.0 && area(shape).is_finite())
            .map(|(index, shape)| (index, area(shape)))
            .unzip();
        let by_area = Discrete::new(areas)?;
        Some(Photons { scene, least_roughness, shapes, by_area, emitted: 0, arrived: Vec::new() })
    }

    /// Sends out as many as are due after so many camera paths, and says whether that was done before it was to stop. Which
    /// have arrived is the same whether this was asked for often or only once, and after it was stopped.
    pub fn send(&mut self, paths: u64, seed: u32, stop: impl Fn() -> bool) -> bool {
        let due = (PER_PATH * paths as f64).max(LEAST_EMITTED).min(MOST_EMITTED as f64) as u64;
        while self.emitted < due && !self.is_over() {
            if stop() {
                return false;
            }
            let first = self.emitted / CHUNK;
            let chunks = first..due.div_ceil(CHUNK).min(first + BATCH);
            let arrived: Vec<Vec<Photon>> = chunks.into_par_iter().map(|chunk| self.chunk(seed, chunk)).collect();
            for of_chunk in arrived {
                if self.is_over() {
                    break;
                }
                self.arrived.extend(of_chunk);
                self.emitted += CHUNK;
            }
        }
        true
    }

    /// Whether enough have arrived, or so few that no more are worth sending.
    fn is_over(&self) -> bool {
        self.arrived.len() >= MOST_KEPT || (self.arrived.is_empty() && self.emitted >= MOST_IN_VAIN)
    }

    /// Those that have arrived so far.
    pub fn arrived(&self) -> &[Photon] {
        &self.arrived
    }

    /// Those sent out so far.
    pub fn emitted(&self) -> u64 {
        self.emitted
    }

    /// Those of a chunk that arrive.
    fn chunk(&self, seed: u32, chunk: u64) -> Vec<Photon> {
        let mut pcg = Pcg32::new(u64::from(seed), chunk);
        let mut arrived = Vec::new();
        let mut arena = Arena::new();
        for _ in 0..CHUNK {
            arena.reset();
            if let Some((hit, power)) = self.begin(&mut pcg) {
                self.follow(hit, power, &mut pcg, &arena, &mut arrived);
            }
        }
        arrived
    }

    /// Where one begins, as light of some power hits it. All sent out together have the power that arrives at these surfaces.
    fn begin(&self, pcg: &mut Pcg32) -> Option<(SurfaceHit, Rgb)> {
        let mut pair = || Vec2::new(pcg.next_f32(), pcg.next_f32());
        let (mut at, to) = (pair(), pair());
        let (choice, rest) = self.by_area.sample_reuse(at.x);
        at.x = rest;
        let index = self.shapes[choice as usize];
        let point = self.scene.shapes()[index as usize].shape.sample_area(at)?;
        let (_, light) = self.scene.sample_emitter(point.p, to)?;
        if light.delta {
            return None;
        }
        let radius = self.scene.bounding_sphere().1;
        // Just before the light, or outside of everything: it is seen from there if it can be.
        let distance = (0.999 * light.point.distance).min(2.1 * radius);
        let ray = Ray::new(point.p + distance * light.point.d, -light.point.d);
        let hit = self.scene.intersect_surface(&ray)?;
        if hit.instance != NO_INSTANCE || hit.shape != index || !is_at(&hit, &point, radius) {
            return None;
        }
        let power = light.weight * (light.point.d.dot(point.n).abs() * self.by_area.sum() as f32);
        (!power.is_black() && power.is_finite()).then_some((hit, power))
    }

    /// Follows one as long as it is not scattered.
    fn follow(&self, mut hit: SurfaceHit, mut power: Rgb, pcg: &mut Pcg32, arena: &Arena, arrived: &mut Vec<Photon>) {
        for turns in 0..LONGEST {
            let bxdf = self.scene.bsdf(&hit).resolve(&hit, arena);
            if turns > 0 && is_guided(bxdf, bxdf.lobes(), self.least_roughness) {
                arrived.push(Photon { p: hit.p, d: hit.to_world(hit.wi), power: power.mean() });
            }
            if turns + 1 == LONGEST {
                return;
            }
            let (u1, u2) = (pcg.next_f32(), Vec2::new(pcg.next_f32(), pcg.next_f32()));
            let Some(sample) = bxdf.sample(hit.wi, u1, u2, Transport::Importance) else { return };
            power *= sample.weight;
            // As paths are followed.
            let goes_on = sample.lobe.has_delta() && self.scene.keeps_sides(&hit, sample.wo);
            if !goes_on || power.is_black() || !power.is_finite() {
                return;
            }
            let ray = hit.leave(hit.to_world(sample.wo));
            if !self.scene.find_surface(&ray, &mut hit) {
                return;
            }
        }
    }
}

/// Whether this point of a shape is the one that was hit.
fn is_at(hit: &SurfaceHit, point: &AreaSample, radius: f32) -> bool {
    match point.triangle {
        NO_TRIANGLE => (hit.p - point.p).length() < 1e-3 * radius,
        triangle => hit.prim == triangle,
    }
}
