//! What a guide has learnt, as a file: for other runs in the same scene, and to be looked at.

use super::RenderError;
use crate::interfaces::{Guide, GuideFile, GuideLearner, mix};
use crate::io::limits::Cursor;
use crate::io::sealed::{self, Kind, Packer};
use crate::io::{IoError, Result};
use crate::math::{Aabb, Vec3};
use std::path::Path;

/// Files of what was learnt.
const KIND: Kind = Kind { magic: *b"LUCGUIDE", version: 3, what: "a file of what a guide has learnt" };

/// What such a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Learnt {
    /// Name of the guide's plugin.
    pub guide: String,
    /// Bounds of the scene in which it was learnt.
    pub bounds: Aabb,
    /// Samples per pixel of the longest iteration that it comes from; 0 if there was none.
    pub spp: u32,
    /// As [`GuideLearner::save`] gave it.
    pub state: Vec<u8>,
}

impl Learnt {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read or is damaged; with the name of the file.
    pub fn read(path: &Path) -> std::result::Result<Self, RenderError> {
        let content = sealed::read(path, KIND);
        content.and_then(|content| Learnt::of_content(&content)).map_err(|e| at(path, &e))
    }

    /// The content of a file in memory.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn of_bytes(file: &[u8]) -> Result<Self> {
        Learnt::of_content(sealed::unseal(KIND, file)?)
    }

    /// As a file in memory.
    pub fn to_bytes(&self) -> Vec<u8> {
        sealed::seal(KIND, &self.pack())
    }

    /// Writes a file, complete or not at all.
    ///
    /// # Errors
    /// If it cannot be written; with the name of the file.
    pub fn write(&self, path: &Path) -> std::result::Result<(), RenderError> {
        sealed::write(path, KIND, &self.pack()).map_err(|e| at(path, &e))
    }

    fn pack(&self) -> Vec<u8> {
        let mut to = Packer::default();
        to.text(&self.guide);
        let corners = [self.bounds.min, self.bounds.max];
        corners.iter().flat_map(|corner| corner.to_array()).for_each(|x| to.f32(x));
        to.u32(self.spp);
        to.block(&self.state);
        to.0
    }

    /// What stands between head and checksum of a file.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn of_content(content: &[u8]) -> Result<Self> {
        let mut from = Cursor::new(content);
        let guide = from.text("the name of the guide")?;
        let mut corner = || Ok(Vec3::new(from.f32("bounds")?, from.f32("bounds")?, from.f32("bounds")?));
        let bounds = Aabb { min: corner()?, max: corner()? };
        let spp = from.u32("the samples")?;
        let state = from.block("what was learnt")?.to_vec();
        from.end()?;
        Ok(Learnt { guide, bounds, spp, state })
    }

    /// Somebody who knows it, for a scene inside `bounds`.
    ///
    /// # Errors
    /// If it is of another guide or scene, or damaged; one line.
    pub fn recall(&self, guide: &dyn Guide, bounds: Aabb) -> Result<Box<dyn GuideLearner>> {
        match guide.kept_as() {
            Some(name) if name == self.guide => {}
            Some(name) => {
                let theirs: String = self.guide.chars().filter(|c| !c.is_control()).take(40).collect();
                return Err(IoError::new(format!("is of the guide \"{theirs}\", not of \"{name}\"")));
            }
            None => return Err(IoError::new("what this guide learns cannot be kept")),
        }
        let numbers = |b: Aabb| [b.min.to_array(), b.max.to_array()];
        if numbers(self.bounds).map(|c| c.map(f32::to_bits)) != numbers(bounds).map(|c| c.map(f32::to_bits)) {
            let [[a, b], [c, d]] = [numbers(self.bounds), numbers(bounds)];
            return Err(IoError::new(format!(
                "is of another scene: its bounds are {a:?} to {b:?}, and here they are {c:?} to {d:?}"
            )));
        }
        let learner = guide.recall(bounds, &self.state)?;
        learner.field().validate().map_err(IoError::new)?;
        Ok(learner)
    }

    /// A seed for a run that begins with this. With the numbers from which it was learnt the picture would be biased: what
    /// they happened to find would count twice.
    pub(super) fn other_seed(&self, seed: u32) -> u32 {
        mix(u64::from(seed) << 32 | u64::from(sealed::checksum(&self.state))) as u32
    }
}

/// With the name of the file.
fn at(path: &Path, error: &IoError) -> RenderError {
    RenderError(format!("{}: {error}", path.display()))
}

/// What a file holds, and somebody who knows that.
type Opened = (Learnt, Box<dyn GuideLearner>);

impl GuideFile {
    /// What it holds; `None` if it is not there.
    pub(super) fn open(&self, guide: &dyn Guide, bounds: Aabb) -> std::result::Result<Option<Opened>, RenderError> {
        if guide.kept_as().is_none() {
            return Err(RenderError("what this guide learns cannot be kept in a file".to_owned()));
        }
        if !self.path.exists() {
            let missing = RenderError(format!("{}: no such file, and nothing may be learnt", self.path.display()));
            return if self.frozen { Err(missing) } else { Ok(None) };
        }
        let learnt = Learnt::read(&self.path)?;
        let learner = learnt.recall(guide, bounds).map_err(|e| at(&self.path, &e))?;
        Ok(Some((learnt, learner)))
    }
}
