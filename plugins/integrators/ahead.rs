//! Directions from the BSDF, where what scattering brings is learnt for roulette alone; and notes of it.

use super::directions::{Directions, Step, Unguided};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Bxdf, Goal, Outlook, SurfaceHit};
use lucerna_core::math::{Vec2, Vec3};
use lucerna_core::render::{Guidance, Notebook, Place, Scattering};

/// Directions come from the BSDF; paths end and split by what lies ahead. Apart from [`super::guided`], so that the kernel has
/// nothing of a guide in it.
pub(super) struct Ahead<'a> {
    /// What holds during the pass.
    pub guidance: Guidance<'a>,
    /// Where what is found is noted.
    pub notes: &'a mut Notebook,
}

impl Directions for Ahead<'_> {
    type Here = ();

    #[inline(always)]
    fn here(&self, _hit: &SurfaceHit, _bxdf: &dyn Bxdf, _primary: bool, _undecided: bool) {}

    #[inline]
    fn samples_emitters(&self) -> bool {
        self.guidance.sample_emitters
    }

    #[inline(always)]
    fn mixed_pdf((): (), _d: Vec3, pdf_bsdf: f32) -> f32 {
        pdf_bsdf
    }

    #[inline(always)]
    fn sample((): (), hit: &SurfaceHit, bxdf: &dyn Bxdf, u1: f32, u2: Vec2) -> Option<Step> {
        Unguided::sample((), hit, bxdf, u1, u2)
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
    fn outlook(&self, (): (), place: &Place) -> Option<Outlook> {
        let field = self.guidance.field;
        field.outlook(field.cell(place.p), place.n)
    }

    #[inline]
    fn note_fork(&mut self, place: Place, count: u32, share: f32, rays: u32) {
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
    fn note_step(&mut self, (): (), hit: &SurfaceHit, _bxdf: &dyn Bxdf, step: &Step) {
        if self.guidance.learning {
            self.notes.scattered(Scattering {
                p: hit.p,
                d: step.d,
                weight: step.sample.weight,
                pdf: step.sample.pdf,
                pdf_bsdf: step.pdf_bsdf,
                pdf_guide: step.pdf_guide,
                pdf_sets: [0.0; 2],
                primary: false,
                // Nothing is learnt of directions.
                kind: None,
            });
        }
    }

    #[inline]
    fn note_survival(&mut self, q: f32) {
        if self.guidance.learning {
            self.notes.survived(q);
        }
    }

    #[inline]
    fn note_met(&mut self, light: lucerna_core::color::Rgb, alone: bool) {
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
