//! Directions from the BSDF, where what scattering brings is learnt for roulette alone; and notes of it.

use super::directions::{Directions, Step, Unguided};
use lucerna_core::interfaces::{Bxdf, Outlook, SurfaceHit};
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

    #[inline(always)]
    fn guidance(&self) -> Option<&Guidance<'_>> {
        Some(&self.guidance)
    }

    #[inline(always)]
    fn notes(&mut self) -> Option<&mut Notebook> {
        self.guidance.learning.then_some(&mut *self.notes)
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
    fn outlook(&self, (): (), place: &Place) -> Option<Outlook> {
        let field = self.guidance.field;
        field.outlook(field.cell(place.p), place.n)
    }

    #[inline]
    fn note_step(&mut self, (): (), hit: &SurfaceHit, _bxdf: &dyn Bxdf, step: &Step) {
        if let Some(notes) = self.notes() {
            notes.scattered(Scattering {
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
}
