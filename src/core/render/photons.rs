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
//! Image Synthesis Using Photon Mapping*, section 5.1.2, whose aim is the same). Any emitter will do, for it has to answer no
//! more than emitter sampling asks.

use crate::accel::{NO_INSTANCE, NO_TRIANGLE, Ray};
use crate::interfaces::{AreaSample, Arena, Photon, SurfaceHit, Transport, is_guided};
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

/// kept at most: 14 MiB.
const MOST_KEPT: usize = 1 << 19;

/// Sent out in any case: so few that it takes no time.
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
    /// None yet; `None` where there is nothing to turn them. Shapes of groups that are placed by instances are not looked at.
    pub fn new(scene: &'s Scene, least_roughness: f32) -> Option<Self> {
        let area = |shape: &BuiltShape| f64::from(shape.shape.area());
        let (shapes, areas): (Vec<u32>, Vec<f64>) = (0..)
            .zip(scene.shapes())
            .filter(|(_, shape)| shape.shape.group().is_none() && shape.shape.instance().is_none())
            .filter(|(_, shape)| shape.bsdf.lobes().has_delta() && area(shape) > 0.0 && area(shape).is_finite())
            .map(|(index, shape)| (index, area(shape)))
            .unzip();
        let by_area = Discrete::new(areas)?;
        Some(Photons { scene, least_roughness, shapes, by_area, emitted: 0, arrived: Vec::new() })
    }

    /// All that have arrived once as many are sent out as are due after so many camera paths: the same whether they were
    /// asked for often or only once.
    pub fn after(&mut self, paths: u64, seed: u32) -> &[Photon] {
        let due = (PER_PATH * paths as f64).max(LEAST_EMITTED).min(MOST_EMITTED as f64) as u64;
        let chunks = self.emitted / CHUNK..due.div_ceil(CHUNK);
        let arrived: Vec<Vec<Photon>> = chunks.clone().into_par_iter().map(|chunk| self.chunk(seed, chunk)).collect();
        self.emitted = self.emitted.max(chunks.end * CHUNK);
        self.arrived.extend(arrived.into_iter().flatten());
        self.arrived.truncate(MOST_KEPT);
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
    fn begin(&self, pcg: &mut Pcg32) -> Option<(SurfaceHit, f32)> {
        let mut pair = || Vec2::new(pcg.next_f32(), pcg.next_f32());
        let (mut at, to) = (pair(), pair());
        let (choice, rest) = self.by_area.sample_reuse(at.x);
        at.x = rest;
        let index = self.shapes[choice as usize];
        let point = self.scene.shapes()[index as usize].shape.sample_area(at)?;
        let (_, light) = self.scene.sample_emitter(point.p, to)?;
        let radius = self.scene.bounding_sphere().1;
        // Just before the light, or outside of everything: it is seen from there if it can be.
        let distance = (0.999 * light.point.distance).min(2.1 * radius);
        let ray = Ray::new(point.p + distance * light.point.d, -light.point.d);
        let hit = self.scene.intersect_surface(&ray)?;
        if hit.instance != NO_INSTANCE || hit.shape != index || !is_at(&hit, &point, radius) {
            return None;
        }
        let power = light.weight.luminance() * light.point.d.dot(point.n).abs() * self.by_area.sum() as f32;
        (power > 0.0 && power.is_finite()).then_some((hit, power))
    }

    /// Follows one as long as it is not scattered.
    fn follow(&self, mut hit: SurfaceHit, mut power: f32, pcg: &mut Pcg32, arena: &Arena, arrived: &mut Vec<Photon>) {
        for turns in 0..LONGEST {
            let bxdf = self.scene.bsdf(&hit).resolve(&hit, arena);
            if turns > 0 && is_guided(bxdf, bxdf.lobes(), self.least_roughness) {
                arrived.push(Photon { p: hit.p, d: hit.to_world(hit.wi), power });
            }
            let (u1, u2) = (pcg.next_f32(), Vec2::new(pcg.next_f32(), pcg.next_f32()));
            let Some(sample) = bxdf.sample(hit.wi, u1, u2, Transport::Importance) else { return };
            power *= sample.weight.luminance();
            if !(sample.lobe.has_delta() && power > 0.0 && power.is_finite()) {
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
