//! A render that can be interrupted: where it stands, as a file.
//!
//! A pass is a pure function of what was there before it, so a run that goes on from the end of a pass gives the bits of
//! one that was never interrupted. A checkpoint is what is there at the end of a pass: the sums of the film, or of the
//! iterations that count, what the report has, and what was learnt. What a pass that was cut short has changed is not in
//! it.

use super::{BadSample, BadSamples, Control, FilmStore, RenderContext, RenderError, Report, SampleOrder};
use crate::io::limits::Cursor;
use crate::io::sealed::{self, Kind, Packer};
use crate::io::{IoError, Result};
use crate::math::UVec2;
use std::cell::Cell;
use std::path::PathBuf;

/// Files of where a render stands.
const KIND: Kind = Kind { magic: *b"LUCSTATE", version: 3, what: "a checkpoint" };

/// Where the state of a run is kept. The run goes on from the file if it is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// Seconds of rendering between two writes; it is also written when the run ends.
    pub every: f64,
    /// What the run depends on, each with its name: a file of another run is refused, and told by what it differs.
    pub of: Vec<(String, String)>,
}

/// A checkpoint in use.
pub(super) struct Keeper<'a> {
    of: Checkpoint,
    control: &'a Control<'a>,
    /// Seconds of this part of the run, and samples per pixel, at the latest write.
    written: Cell<(f64, u32)>,
}

impl<'a> Keeper<'a> {
    /// That of a context, if it asks for one.
    pub fn of(cx: &RenderContext<'a>) -> std::result::Result<Option<Self>, RenderError> {
        let Some(of) = cx.checkpoint.clone() else { return Ok(None) };
        if matches!(cx.order, SampleOrder::Reference { .. }) {
            let message = "random numbers in the reference's order and a checkpoint exclude each other";
            return Err(RenderError(message.to_owned()));
        }
        Ok(Some(Keeper { of, control: cx.control, written: Cell::new((0.0, 0)) }))
    }

    /// Reads the state of an interrupted run with `read`; `None` if there is none.
    pub fn resume<T>(
        &self,
        read: impl FnOnce(&mut Cursor<'_>) -> Result<T>,
    ) -> std::result::Result<Option<T>, RenderError> {
        let path = &self.of.path;
        if !path.exists() {
            return Ok(None);
        }
        let state = sealed::read(path, KIND).and_then(|content| {
            let mut from = Cursor::new(&content);
            self.compare(&mut from)?;
            let state = read(&mut from)?;
            from.end().map(|()| state)
        });
        state.map(Some).map_err(|e| RenderError(format!("{}: {e}", path.display())))
    }

    /// Whether the file is of this run.
    fn compare(&self, from: &mut Cursor<'_>) -> Result<()> {
        let count = from.count(16, "properties")?;
        let theirs = (0..count).map(|_| Ok((from.text("a property")?, from.text("a property")?)));
        let theirs = theirs.collect::<Result<Vec<_>>>()?;
        for (name, value) in &self.of.of {
            match theirs.iter().find(|(known, _)| known == name) {
                Some((_, known)) if known == value => {}
                // Hashes tell nobody anything.
                Some((_, known)) if known.len() < 40 && value.len() < 40 => {
                    let known: String = known.chars().filter(|c| !c.is_control()).collect();
                    return Err(IoError::new(format!("is of another run: its {name} is {known}, not {value}")));
                }
                _ => return Err(IoError::new(format!("is of another run: its {name} is another"))),
            }
        }
        Ok(())
    }

    /// Whether it is time to write.
    pub fn is_due(&self) -> bool {
        self.control.seconds() - self.written.get().0 >= self.of.every
    }

    /// Whether the file is older than a run that has so many samples per pixel, and some.
    pub fn is_behind(&self, spp: u32) -> bool {
        spp > self.written.get().1
    }

    /// Writes the state after so many samples per pixel with `pack`, which is told the seconds of this part of the run; the
    /// time it takes is no rendering. Gives a note if it cannot be written.
    pub fn write(&self, spp: u32, pack: impl FnOnce(f64, &mut Packer)) -> Option<String> {
        let seconds = self.control.seconds();
        self.written.set((seconds, spp));
        let written = self.control.aside(|| {
            let mut to = Packer::default();
            to.u32(self.of.of.len() as u32);
            for (name, value) in &self.of.of {
                to.text(name);
                to.text(value);
            }
            pack(seconds, &mut to);
            sealed::write(&self.of.path, KIND, &to.0)
        });
        written.err().map(|error| format!("warning: no checkpoint: {}: {error}", self.of.path.display()))
    }
}

impl Report {
    /// Writes the numbers; `seconds` are those of rendering so far.
    pub(super) fn pack(&self, seconds: f64, to: &mut Packer) {
        to.u32(self.spp);
        to.u64(self.samples);
        to.u64(self.rays);
        to.f64(seconds);
        to.u64(self.bad.count);
        to.u32(self.bad.first.len() as u32);
        for BadSample { pixel, sample, value } in &self.bad.first {
            [pixel.x, pixel.y, *sample].into_iter().for_each(|number| to.u32(number));
            value.iter().for_each(|v| to.f32(*v));
        }
    }

    /// Reads what was written of a run of at most `asked` samples per pixel.
    pub(super) fn unpack(from: &mut Cursor<'_>, asked: u32) -> Result<Self> {
        let spp = from.u32("the samples")?;
        let (samples, rays) = (from.u64("the samples")?, from.u64("the rays")?);
        let seconds = from.f64("the seconds")?;
        if spp == 0 || spp > asked || !(0.0..1e12).contains(&seconds) {
            return Err(IoError::new(format!("has {spp} samples per pixel of {asked}, or no usable time")));
        }
        let mut bad = BadSamples::default();
        let count = from.u64("bad samples")?;
        for _ in 0..from.count(24, "bad samples")? {
            let mut next = || from.u32("a bad sample");
            let (pixel, sample) = (UVec2::new(next()?, next()?), next()?);
            let mut next = || from.f32("a bad sample");
            bad.add(BadSample { pixel, sample, value: [next()?, next()?, next()?] });
        }
        bad.count = count;
        Ok(Report { spp, samples, rays, seconds, bad, ..Report::default() })
    }
}

impl FilmStore {
    /// Reads the sums that were written of a film like this one.
    pub(super) fn unpack(&self, from: &mut Cursor<'_>) -> Result<FilmStore> {
        let count = from.u64("sums of the film")?;
        let mut film = self.clone();
        if count != film.sums().len() as u64 {
            return Err(IoError::new(format!("has {count} sums of pixels instead of {}", film.sums().len())));
        }
        for sum in film.sums_mut() {
            *sum = from.f64("sums of the film")?;
        }
        Ok(film)
    }

    /// Writes the sums.
    pub(super) fn pack(&self, to: &mut Packer) {
        to.u64(self.sums().len() as u64);
        self.sums().iter().for_each(|sum| to.f64(*sum));
    }
}
