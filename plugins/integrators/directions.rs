//! How a path chooses its directions: questions to whoever decides, with the answers where nothing is learnt.

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bxdf, BxdfSample, Goal, Outlook, SurfaceHit, Transport};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::render::{Guidance, Notebook, Place};

/// Who decides in which direction a path goes on, and keeps notes. What has an answer here has that where nothing is
/// learnt.
pub(super) trait Directions {
    /// What is known at a vertex: read once, then used for all that happens there.
    type Here: Copy;

    /// Reads it. `primary` says whether this is the first vertex of a path from the camera; `undecided`, that the lobe which is
    /// drawn here decides whether the sample is transparent, so that the BSDF has to choose.
    fn here(&self, hit: &SurfaceHit, bxdf: &dyn Bxdf, primary: bool, undecided: bool) -> Self::Here;

    /// What holds during the pass, if something is learnt: the answers below follow from it.
    #[inline(always)]
    fn guidance(&self) -> Option<&Guidance<'_>> {
        None
    }

    /// Where what is found is noted, while something is learnt.
    #[inline(always)]
    fn notes(&mut self) -> Option<&mut Notebook> {
        None
    }

    /// Whether lights are sampled that a ray can also run into.
    #[inline(always)]
    fn samples_emitters(&self) -> bool {
        self.guidance().is_none_or(|guidance| guidance.sample_emitters)
    }

    /// Density of world direction `d` in which the BSDF alone has density `pdf_bsdf`.
    fn mixed_pdf(here: Self::Here, d: Vec3, pdf_bsdf: f32) -> f32;

    /// Where the path goes on, in world space, and how.
    fn sample(here: Self::Here, hit: &SurfaceHit, bxdf: &dyn Bxdf, u1: f32, u2: Vec2) -> Option<Step>;

    /// Candidates for that at a vertex, if there are several: one is [resampled](Self::resample).
    #[inline(always)]
    fn candidates(&self) -> Option<u32> {
        None
    }

    /// Where the path goes on, chosen among so many candidates by `choice`; the first of them, if nothing is known to
    /// choose by.
    #[inline(always)]
    fn resample(
        here: Self::Here,
        hit: &SurfaceHit,
        bxdf: &dyn Bxdf,
        _candidates: u32,
        (u1, u2): (f32, Vec2),
        _choice: f32,
    ) -> Option<Step> {
        Self::sample(here, hit, bxdf, u1, u2)
    }

    /// What the throughput, which is this, would be about if directions came from the BSDF; not less than it is.
    #[inline(always)]
    fn prospects(&self, throughput: Rgb) -> Rgb {
        throughput
    }

    /// What has to be known to go back to this vertex.
    #[inline(always)]
    fn mark(&self) -> Rgb {
        Rgb::WHITE
    }

    /// Goes back to a vertex where [`mark`](Self::mark) said this.
    #[inline(always)]
    fn resume(&mut self, _prospects: Rgb) {}

    /// What is known of the pixel.
    #[inline(always)]
    fn goal(&self) -> Goal {
        self.guidance().map_or_else(Goal::default, |guidance| guidance.goal)
    }

    /// Whether what scattering brings is learnt, so that paths may split or end before they are scattered.
    #[inline(always)]
    fn looks_ahead(&self) -> bool {
        self.guidance().is_some_and(|guidance| guidance.subjects.outlook)
    }

    /// Whether notes are kept.
    #[inline(always)]
    fn learns(&self) -> bool {
        self.guidance().is_some_and(|guidance| guidance.learning)
    }

    /// What scattering at a vertex brings, as far as is known.
    #[inline(always)]
    fn outlook(&self, _here: Self::Here, _place: &Place) -> Option<Outlook> {
        None
    }

    /// Notes that so many branches go on from a vertex, each with this share, after so many rays.
    #[inline(always)]
    fn note_fork(&mut self, place: Place, count: u32, share: f32, rays: u32) {
        if let Some(notes) = self.notes() {
            notes.forked(place, count, share, rays);
        }
    }

    /// Notes light of a sampled emitter.
    #[inline(always)]
    fn note_direct(&mut self, light: Rgb) {
        if let Some(notes) = self.notes() {
            notes.direct(light);
        }
    }

    /// Notes where the path goes on.
    #[inline(always)]
    fn note_step(&mut self, _here: Self::Here, _hit: &SurfaceHit, _bxdf: &dyn Bxdf, _step: &Step) {}

    /// Notes that roulette was survived.
    #[inline(always)]
    fn note_survival(&mut self, q: f32) {
        if let Some(notes) = self.notes() {
            notes.survived(q);
        }
    }

    /// Notes light that was found by chance.
    #[inline(always)]
    fn note_met(&mut self, light: Rgb, alone: bool) {
        if let Some(notes) = self.notes() {
            notes.met(light, alone);
        }
    }

    /// Notes the end of the path, or of a branch, after so many rays.
    #[inline(always)]
    fn note_end(&mut self, rays: u32) {
        if let Some(notes) = self.notes() {
            notes.end(rays);
        }
    }
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
    fn here(&self, _hit: &SurfaceHit, _bxdf: &dyn Bxdf, _primary: bool, _undecided: bool) {}

    #[inline(always)]
    fn mixed_pdf((): (), _d: Vec3, pdf_bsdf: f32) -> f32 {
        pdf_bsdf
    }

    #[inline(always)]
    fn sample((): (), hit: &SurfaceHit, bxdf: &dyn Bxdf, u1: f32, u2: Vec2) -> Option<Step> {
        let sample = bxdf.sample(hit.wi, u1, u2, Transport::Radiance)?;
        Some(Step { d: hit.to_world(sample.wo), pdf_bsdf: sample.pdf, pdf_guide: 0.0, choice: 1.0, sample })
    }
}
