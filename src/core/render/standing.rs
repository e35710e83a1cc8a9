//! Where a guided run stands between two passes: enough to go on from, also in another process.

use super::combine::Iterations;
use super::estimates::Estimates;
use super::{FilmStore, GuideFile, RenderContext, RenderError, Report};
use crate::interfaces::{Guide, GuideLearner};
use crate::io::limits::Cursor;
use crate::io::sealed::Packer;
use crate::io::{IoError, Result};

/// An iteration.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// It is one of those at the start.
    pub startup: bool,
    /// Samples per pixel of the run when it begins and when it is complete.
    pub spp: (u32, u32),
    /// Samples per pixel that it needs to teach something.
    pub wanted: u32,
    /// Whether paths note what they find.
    pub learning: bool,
}

/// The course of the iterations.
#[derive(Clone, Copy)]
pub(super) struct Course {
    /// Chooses the random numbers.
    pub seed: u32,
    /// Iterations of one sample per pixel at the start.
    pub startup: u32,
    /// Samples per pixel of the first iteration after those.
    pub first: u32,
    /// Samples per pixel of the longest iteration that has taught something, also in runs before.
    pub reach: u32,
    /// Something was learnt in this run.
    pub taught: bool,
    /// Number of the iteration.
    pub index: u32,
    /// It, once it has begun.
    pub part: Option<Part>,
    /// Seconds that a sample per pixel took in the iteration before; 0 if there is none.
    pub pace: f64,
    /// Variance that the picture would have if the rest of the budget were spent as the iteration before was; infinite if
    /// that is not known.
    pub expected: f64,
    /// It has risen: more is not worth learning.
    pub enough: bool,
}

/// Where a run stands.
pub(super) struct Standing {
    pub course: Course,
    pub report: Report,
    pub pictures: Iterations,
    pub learner: Box<dyn GuideLearner>,
    pub estimates: Estimates,
}

impl Standing {
    /// At the start: with what a file has, or nothing.
    pub fn begin(
        cx: &RenderContext<'_>,
        guide: &dyn Guide,
        file: Option<&GuideFile>,
    ) -> std::result::Result<Self, RenderError> {
        let bounds = cx.scene.accel().bounds();
        let startup = guide.training().startup;
        let mut course = Course {
            seed: cx.seed,
            startup,
            first: 1,
            reach: 0,
            taught: false,
            index: 0,
            part: None,
            pace: 0.0,
            expected: f64::INFINITY,
            enough: false,
        };
        let open = |file: &GuideFile| file.open(guide, bounds);
        let learner = match file.map(open).transpose()?.flatten() {
            Some((learnt, learner)) => {
                course.seed = learnt.other_seed(cx.seed);
                if learnt.spp > 0 {
                    // Less than it comes from would only spoil it.
                    let first = learnt.spp.saturating_mul(2);
                    course = Course { startup: 0, first, reach: learnt.spp, ..course };
                }
                learner
            }
            None => guide.start(bounds),
        };
        let empty = FilmStore::new(cx.store.size(), cx.store.aovs().to_vec());
        let pictures = Iterations::new(&empty, guide.training().combination);
        let estimates = Estimates::new(cx.store.size());
        Ok(Standing { course, report: Report::default(), pictures, learner, estimates })
    }

    /// Writes it. `learner` is what was known at the end of the latest pass, `report` what was told then.
    pub fn pack(&self, learner: &[u8], report: &Report, seconds: f64, to: &mut Packer) {
        let Course { seed, startup, first, reach, taught, index, part, pace, expected, enough } = self.course;
        let numbers = [seed, startup, first, reach, u32::from(taught), index, u32::from(enough)];
        numbers.into_iter().for_each(|number| to.u32(number));
        to.f64(pace);
        to.f64(expected);
        if let Some(Part { startup, spp, wanted, learning }) = part {
            [u32::from(startup), spp.0, spp.1, wanted, u32::from(learning)].into_iter().for_each(|v| to.u32(v));
        }
        report.pack(seconds, to);
        self.pictures.pack(to);
        self.estimates.pack(to);
        to.block(learner);
    }

    /// Reads what was written of a run of so many samples per pixel in this context.
    ///
    /// # Errors
    /// If it cannot be gone on from; one line.
    pub fn unpack(from: &mut Cursor<'_>, cx: &RenderContext<'_>, guide: &dyn Guide, asked: u32) -> Result<Self> {
        let mut next = || from.u32("the course of the run");
        let (seed, startup, first) = (next()?, next()?, next()?);
        let (reach, taught, index, enough) = (next()?, next()? != 0, next()?, next()? != 0);
        let (pace, expected) = (from.f64("the course of the run")?, from.f64("the course of the run")?);
        let mut next = || from.u32("an iteration");
        let begun = next()? != 0;
        let (spp, wanted, learning) = ((next()?, next()?), next()?, next()? != 0);
        let part = Part { startup: begun, spp, wanted, learning };
        let report = Report::unpack(from, asked)?;
        if !(spp.0 <= report.spp && report.spp <= spp.1 && spp.1 <= asked && pace >= 0.0 && index < u32::MAX) {
            return Err(IoError::new("has an iteration that cannot be gone on with"));
        }
        let empty = FilmStore::new(cx.store.size(), cx.store.aovs().to_vec());
        let mut pictures = Iterations::new(&empty, guide.training().combination);
        pictures.unpack(from)?;
        let mut estimates = Estimates::new(cx.store.size());
        estimates.unpack(from)?;
        let learner = guide.recall(cx.scene.accel().bounds(), from.block("what was learnt")?)?;
        let course = Course { seed, startup, first, reach, taught, index, part: Some(part), pace, expected, enough };
        Ok(Standing { course, report, pictures, learner, estimates })
    }
}
