//! Directions from the mixture of a guide and the BSDF, or chosen among several by their product; and notes of what
//! they find.

use super::directions::{Directions, Step, Unguided};
use super::with_environment::WithEnvironment;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Arena, Bxdf, BxdfSample, GuideSets, GuidedDirections, GuidedVertex, Lobes, MOST_GUIDED, Outlook, RecordKind,
    SurfaceHit, Transport, is_guided,
};
use lucerna_core::math::{ONE_MINUS_EPSILON, Vec2, Vec3};
use lucerna_core::render::{Guidance, Notebook, Place, Scattering};
use lucerna_core::sampling::{Reservoir, r2};

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

/// The least that is left of a path's prospects at a vertex: whatever an albedo says, roulette gives it a chance.
const LEAST_PROSPECTS: f32 = 0.05;

/// What a guide knows at a vertex.
#[derive(Clone, Copy)]
pub(super) struct Learnt<'v> {
    /// With its probability; none where the BSDF stands alone.
    guide: Option<(&'v dyn GuidedDirections, f32)>,
    /// Something can be learnt here.
    teaches: bool,
    /// The first vertex of a path from the camera.
    primary: bool,
    /// What the guide knows here follows the product with the BSDF already.
    follows_product: bool,
    /// The cell of space, if the guide was asked.
    cell: Option<usize>,
}

impl<'a> Guided<'a> {
    /// What is known at a vertex at `p`, with the part that goes to the environment.
    #[inline]
    fn with_environment(&self, learnt: &'a dyn GuidedDirections, p: Vec3) -> &'a dyn GuidedDirections {
        match self.guidance.environment {
            Some((environment, part)) => self.arena.alloc(WithEnvironment { learnt, environment, part, p }),
            None => learnt,
        }
    }
}

impl<'a> Directions for Guided<'a> {
    type Here = Learnt<'a>;

    #[inline]
    fn here(&self, hit: &SurfaceHit, bxdf: &dyn Bxdf, primary: bool, undecided: bool) -> Learnt<'a> {
        let lobes = bxdf.lobes();
        if !is_guided(bxdf, lobes, self.guidance.least_roughness) {
            return Learnt { guide: None, teaches: false, primary, follows_product: false, cell: None };
        }
        let vertex = GuidedVertex { one_sided: lobes.is_one_sided(), primary };
        let cell = (!undecided).then(|| self.guidance.field.cell(hit.p));
        let guide = cell.and_then(|cell| self.guidance.field.at(cell, hit, vertex, self.arena)).and_then(|guide| {
            let p = guide.p_guide().clamp(0.0, MOST_GUIDED);
            (p > 0.0).then_some((self.with_environment(guide, hit.p), p))
        });
        let follows_product = primary && self.guidance.sets == GuideSets::PrimaryProduct;
        Learnt { guide, teaches: true, primary, follows_product, cell }
    }

    #[inline(always)]
    fn guidance(&self) -> Option<&Guidance<'_>> {
        Some(&self.guidance)
    }

    #[inline(always)]
    fn notes(&mut self) -> Option<&mut Notebook> {
        self.guidance.learning.then_some(&mut *self.notes)
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

    /// Resampled importance sampling (Talbot, Cline, Egbert 2005) of the product of the BSDF and the light that was
    /// learnt.
    ///
    /// Each of M candidates i is drawn as [`sample`](Directions::sample) does, and has the contribution c(i), of which
    /// the expectation is what is sought. Candidate j is chosen with probability w(j)/Σw(i) and counts c(j) Σw(i)/(M
    /// w(j)). The expectation of that, given the candidates, is Σc(j)/M, if w(j) > 0 wherever c(j) ≠ 0; so it is what
    /// is sought, whatever w is, and also if candidates depend on each other: they are spread evenly over the random
    /// numbers.
    ///
    /// Here w(i) is c(i) without the light, times what is expected of it: with the probability of the guide, the light
    /// that was learnt over its mean, or else 1. For a diffuse BSDF that is what the mixture follows already, and the
    /// choice changes nothing; it helps the more, the less the BSDF is like a cosine.
    ///
    /// The density of the direction that comes out has no closed form, but none is asked for. In c(j) light met by
    /// chance is weighted against emitter sampling by the density of *one candidate*, the mixture's, and emitter
    /// sampling is weighted against the same. The two weights sum to one for each direction, which is all that the
    /// proof of multiple importance sampling needs (Veach 1997, section 9.2). It costs that emitter sampling counts for
    /// more than it would if the better density were known.
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
        if here.follows_product {
            return Self::sample(here, hit, bxdf, u1, u2);
        }
        let mut tried = Reservoir::new(choice);
        for i in 0..candidates {
            let u1 = (u1 + i as f32 / candidates as f32).fract().min(ONE_MINUS_EPSILON);
            let Some(step) = Self::sample(here, hit, bxdf, u1, r2(u2, i)) else { continue };
            let light = p_guide * guide.light(step.d).max(0.0) + (1.0 - p_guide);
            let worth = step.sample.weight.luminance() * light;
            tried.offer(step, worth);
        }
        let (mut step, factor) = tried.take(candidates)?;
        step.choice = factor;
        step.sample.weight *= factor;
        Some(step)
    }

    /// A guide takes directions from which much light comes more often than the BSDF would, and the throughput falls by
    /// as much: judged by it, roulette would end the paths that matter (Müller 2019, section 10.6). What a path is
    /// worth, its throughput times the light ahead, falls by the albedo only. Where the guide was wrong the throughput
    /// is larger, and counts.
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
    fn outlook(&self, here: Learnt<'a>, place: &Place) -> Option<Outlook> {
        let field = self.guidance.field;
        field.outlook(here.cell.unwrap_or_else(|| field.cell(place.p)), place.n)
    }

    #[inline]
    fn note_fork(&mut self, place: Place, count: u32, share: f32, rays: u32) {
        self.prospects *= share;
        if let Some(notes) = self.notes() {
            notes.forked(place, count, share, rays);
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
            (true, true, Some(_)) => Some(RecordKind::Delta),
            (true, true, _) => None,
            (true, false, Some(_)) => Some(RecordKind::Mixed),
            (true, false, None) => Some(RecordKind::Unguided),
        };
        let BxdfSample { weight, pdf, .. } = step.sample;
        let Step { d, choice, pdf_bsdf, pdf_guide, .. } = *step;
        // One over what the direction counts: a density in expectation, if there were several candidates.
        let pdf = pdf / choice;
        let pdf_sets = match here.guide {
            Some((guide, _)) if self.guidance.sets == GuideSets::DirectIndirect => guide.pdf_sets(d),
            _ => [0.0; 2],
        };
        let primary = here.primary;
        self.notes.scattered(Scattering { p: hit.p, d, weight, pdf, pdf_bsdf, pdf_guide, pdf_sets, primary, kind });
    }

    #[inline]
    fn note_survival(&mut self, q: f32) {
        self.prospects *= 1.0 / q;
        if let Some(notes) = self.notes() {
            notes.survived(q);
        }
    }
}

/// Each channel, or this if it is less; also if it is no number.
fn at_least(color: Rgb, least: f32) -> Rgb {
    Rgb::new(color.r.max(least), color.g.max(least), color.b.max(least))
}

#[cfg(test)]
mod tests {
    use super::super::with_environment::tests::Above;
    use super::*;
    use crate::testing::Draft;
    use lucerna_core::math::Frame;
    use lucerna_core::sampling::Pcg32;
    use lucerna_core::scene::{Object, ObjectKind};
    use lucerna_core::stats::chi2::{SphereGrid, sidak};

    /// Mixtures of a guide that looks upwards with BSDFs of smooth lobes, narrow ones, transmission, and delta lobes, on a
    /// slope: half of what the guide gives lies below.
    #[test]
    fn hc_p01_mixtures_have_the_density_of_their_samples() {
        let names = ["diffuse", "roughconductor", "roughdielectric", "roughplastic", "plastic"];
        let (mut pcg, grid) = (Pcg32::new(7, 7), SphereGrid { rings: 16, spokes: 32 });
        let frame = Frame::from_normal(Vec3::new(0.8, 0.0, 0.6));
        let hit = SurfaceHit { n: frame.n, frame, wi: Vec3::new(0.6, 0.0, 0.8), ..SurfaceHit::default() };
        for name in names {
            let draft = Draft::new(ObjectKind::Bsdf, name);
            let draft = if name.starts_with("rough") { draft.float("alpha", 0.3) } else { draft };
            let Ok(Object::Bsdf(bsdf)) = draft.build() else { panic!("{name} is no BSDF") };
            let arena = Arena::new();
            let bxdf = bsdf.resolve(&hit, &arena);
            for p_guide in [0.1, 0.5, 0.9] {
                let guide = Some((&Above as &dyn GuidedDirections, p_guide));
                let here = Learnt { guide, teaches: true, primary: true, follows_product: false, cell: None };
                // Where the BSDF is black, a direction of the guide ends the path.
                let density = |d: Vec3| {
                    let (value, pdf_bsdf) = bxdf.eval_pdf(hit.wi, hit.to_local(d), Transport::Radiance);
                    if value.is_black() { 0.0 } else { Guided::mixed_pdf(here, d, pdf_bsdf) }
                };
                let sample = || {
                    let u2 = Vec2::new(pcg.next_f32(), pcg.next_f32());
                    let step = Guided::sample(here, &hit, bxdf, pcg.next_f32(), u2)?;
                    (!step.sample.lobe.has_delta()).then(|| {
                        let told = density(step.d);
                        assert!((step.sample.pdf / told - 1.0).abs() < 1e-2, "{name}: {} {told}", step.sample.pdf);
                        step.d
                    })
                };
                let found = grid.test(100_000, sample, density);
                assert!(found.accepts(sidak(0.01, 3 * names.len())), "{name} {p_guide}: {found:?}");
            }
        }
    }
}
