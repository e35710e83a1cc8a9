//! The render driver: passes over tiles, budget, progress, and what is kept of the samples.
//!
//! A pass is a pure function of (scene, seed, sample range). Passes follow a fixed schedule ([`Schedule`]), tiles are
//! fixed, and tile results are added to the film in tile order: the picture has the same bits for any number of
//! threads, and a run that stops early has the bits of a run that was asked for that many samples.

mod bad_samples;
mod checkpoint;
mod combine;
mod control;
mod estimates;
mod film_store;
mod learnt;
mod notebook;
mod photons;
mod reference_order;
mod standing;
mod tabulated_filter;
mod tiles;
mod training;

pub use crate::interfaces::GuideFile;
pub use bad_samples::{BadSample, BadSamples};
pub use checkpoint::Checkpoint;
pub use control::{Budget, Clock, Control, OnPass, PassEnd, Progress, Schedule};
pub use film_store::FilmStore;
pub use learnt::Learnt;
pub use notebook::{Notebook, Place, Scattering};
pub use photons::Photons;
pub use reference_order::ReferenceOrder;
pub use tiles::{render_estimator, replay};
pub use training::{Guidance, GuidedEstimator, films_of, render_guided};

use crate::image::Image;
use crate::interfaces::{FilmSettings, Sampler, Sensor};
use crate::math::{UVec2, Vec2};
use crate::scene::{BuiltSensor, Scene};
use std::fmt;
use std::sync::Arc;
use tabulated_filter::TabulatedFilter;

/// In which order random numbers are spent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SampleOrder {
    /// Each pixel sample has its own numbers.
    #[default]
    PerSample,
    /// As the reference renderer's `scalar_rgb` with the sampler `independent`, for comparisons without noise.
    Reference {
        /// Threads the reference counts: its workers plus one.
        threads: u32,
    },
}

/// Everything an integrator needs to render.
pub struct RenderContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The camera.
    pub sensor: &'a dyn Sensor,
    /// Size, window, filter.
    pub film: FilmSettings,
    /// Where random numbers come from.
    pub sampler: &'a dyn Sampler,
    /// How long to render.
    pub budget: Budget,
    /// Chooses the random numbers.
    pub seed: u32,
    /// In which order they are spent.
    pub order: SampleOrder,
    /// Stop button, deadline and progress.
    pub control: &'a Control<'a>,
    /// Where the samples go.
    pub store: FilmStore,
    /// Where the state of the run is kept, if it is.
    pub checkpoint: Option<Checkpoint>,
    /// Where a guide keeps what it learns, if it does. It stands before a file that the scene names.
    pub guide_file: Option<GuideFile>,
    /// Whether what was learnt is left in a file that the scene names. A run that is one of several only begins with it, or
    /// each would depend on those before.
    pub leaves_learnt: bool,
}

impl<'a> RenderContext<'a> {
    /// A context with an empty film. `aovs` are the names of the channels after colour and alpha.
    pub fn new(
        scene: &'a Scene,
        camera: &'a BuiltSensor,
        budget: Budget,
        seed: u32,
        control: &'a Control<'a>,
        aovs: Vec<String>,
    ) -> Self {
        let film = camera.film.settings();
        Self::of_window(scene, camera, (film.crop_offset, film.crop_size), budget, seed, control, aovs)
    }

    /// As [`new`](Self::new), for the part of the film that has this offset and size.
    pub fn of_window(
        scene: &'a Scene,
        camera: &'a BuiltSensor,
        (crop_offset, crop_size): (UVec2, UVec2),
        budget: Budget,
        seed: u32,
        control: &'a Control<'a>,
        aovs: Vec<String>,
    ) -> Self {
        let film = FilmSettings { crop_offset, crop_size, ..camera.film.settings().clone() };
        let store = FilmStore::new(crop_size, aovs);
        let seed = seed.wrapping_add(camera.sampler.seed());
        let (sensor, sampler) = (&*camera.sensor, &*camera.sampler);
        let order = SampleOrder::PerSample;
        let (checkpoint, guide_file, leaves_learnt) = (None, None, false);
        RenderContext {
            scene,
            sensor,
            film,
            sampler,
            budget,
            seed,
            order,
            control,
            store,
            checkpoint,
            guide_file,
            leaves_learnt,
        }
    }

    /// The picture as it is now.
    pub fn picture(&self) -> Image {
        self.store.picture(&self.film)
    }

    /// The reference's order of random numbers, if it is asked for.
    pub(crate) fn reference_order(&self) -> Option<ReferenceOrder> {
        let SampleOrder::Reference { threads } = self.order else { return None };
        let offset = self.sampler.seed();
        let size = self.film.crop_size + 2 * self.border();
        Some(ReferenceOrder::new(size, self.seed.wrapping_sub(offset), offset, threads))
    }

    /// Spends random numbers and looks filters up as the reference's `scalar_rgb` does with so many threads (its workers
    /// and one more), so that its noise comes out.
    pub fn follow_reference(&mut self, threads: u32) {
        self.order = SampleOrder::Reference { threads };
        self.tabulate_filter();
    }

    /// Looks a filter that is wider than a pixel up in a table, as the reference's scalar variants do.
    pub fn tabulate_filter(&mut self) {
        if !self.film.filter.is_box() {
            self.film.filter = Arc::new(TabulatedFilter::new(&*self.film.filter));
        }
    }

    /// How far beside a camera ray its offset rays pass, in units of the film: one pixel over the square root of the
    /// samples per pixel, as in the reference. A run by the clock counts as one sample.
    pub(crate) fn differential_step(&self) -> Vec2 {
        let spp = match self.budget {
            Budget::Samples(spp) => self.sampler.round_spp(spp),
            Budget::Seconds(_) => 1,
        };
        Vec2::splat((spp as f32).sqrt().recip()) / self.film.size.as_vec2()
    }

    /// The window that is sampled: the crop window, and a border if the film asks for one.
    pub(crate) fn border(&self) -> u32 {
        if self.film.sample_border { (self.film.filter.radius() - 0.5).ceil().max(0.0) as u32 } else { 0 }
    }
}

/// How a render ended.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Samples per pixel of the passes that are complete.
    pub spp: u32,
    /// Pixel samples taken, those of a pass that was cut short and lost included.
    pub samples: u64,
    /// Rays traced.
    pub rays: u64,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Samples that were dropped.
    pub bad: BadSamples,
    /// What the integrator has to tell, a line each.
    pub notes: Vec<String>,
    /// The user or the clock stopped it before the asked number of samples.
    pub stopped: bool,
}

impl Report {
    /// Adds a note, if there is one that is new.
    fn tell_once(&mut self, note: Option<String>) {
        self.notes.extend(note.filter(|note| !self.notes.contains(note)));
    }
}

/// Why nothing could be rendered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RenderError(pub String);

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for RenderError {}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    /// First pixel.
    pub min: glam::IVec2,
    /// Size in pixels.
    pub size: UVec2,
}
