//! Lucerna's side of a comparison.

use super::reference::Reference;
use super::{Options, PASSES, Refusal, TARGET, compared};
use crate::pictures::{NOT_BUILT, Source, one_line, read, render};
use lucerna_core::image::Image;
use lucerna_core::render::RenderContext;
use lucerna_core::scene::{Description, ObjectKind, Registry, Scene, SceneErrors, instantiate};
use lucerna_core::stats::Measured;
use lucerna_core::stats::images::variance_ratio;
use std::cell::Cell;
use std::path::{Path, PathBuf};

/// Threads the reference counts where it renders sample for sample: two workers and the main one.
pub const REFERENCE_THREADS: u32 = 3;

/// Passes and samples per pixel of a trial that tells how noisy a scene is.
const TRIAL: (u32, u32) = (8, 16);

/// Fewest and most samples per pixel that a plan asks for, and most samples of the picture (which yields to the fewest).
const FEWEST_SPP: u32 = 256;
const MOST_SPP: u32 = 1 << 16;
const MOST_SAMPLES: u64 = 1 << 26;

/// A scene, ready to be rendered by both.
pub struct Ours {
    /// The file.
    pub path: PathBuf,
    /// As read, with files and versions, at the wanted size.
    pub description: Description,
    /// The files it depends on.
    pub files: Vec<PathBuf>,
    scene: Scene,
    warnings: Vec<String>,
    seconds: Cell<f64>,
    total_spp: Cell<u32>,
    bad: Cell<u64>,
}

impl Ours {
    /// Reads a scene, at the size that was asked for.
    pub fn load(registry: &Registry, path: &Path, options: &Options) -> Result<Self, Refusal> {
        let Source { description, files } = read(path, &options.reading).map_err(|e| refusal(&e))?;
        let sensors = || description.nodes.iter().filter(|node| node.kind == ObjectKind::Sensor);
        if sensors().next().is_none() {
            return Err(Refusal::NotForUs("the scene has no sensor".to_owned()));
        }
        let plain = Self::build(registry, path, description, files, options)?;
        match options.size {
            Some((width, height)) => {
                let film = plain.size();
                let by_aspect = || (f64::from(width) * f64::from(film[1]) / f64::from(film[0])).round().max(1.0) as u32;
                let size = [width, height.unwrap_or_else(by_aspect)];
                plain.resized(registry, size, options)
            }
            None => Ok(plain),
        }
    }

    fn build(
        registry: &Registry,
        path: &Path,
        description: Description,
        files: Vec<PathBuf>,
        options: &Options,
    ) -> Result<Self, Refusal> {
        let built = instantiate(registry, description.clone(), options.reading.lenient).map_err(|e| refusal(&e))?;
        if built.scene.integrator().is_none() {
            return Err(Refusal::NotForUs("the scene has no integrator".to_owned()));
        }
        Ok(Ours {
            path: path.to_owned(),
            description,
            files,
            scene: built.scene,
            warnings: built.warnings.iter().map(ToString::to_string).collect(),
            seconds: Cell::new(0.0),
            total_spp: Cell::new(0),
            bad: Cell::new(0),
        })
    }

    /// The scene at the size of a stored picture; a crop window in the scene has that size already.
    pub fn at_size(self, registry: &Registry, size: [u32; 2], options: &Options) -> Result<Self, Refusal> {
        if self.size() == size { Ok(self) } else { self.resized(registry, size, options) }
    }

    fn resized(mut self, registry: &Registry, size: [u32; 2], options: &Options) -> Result<Self, Refusal> {
        self.description.resize_films(size, "--size");
        let resized = Self::build(registry, &self.path, self.description, self.files, options)?;
        resized.seconds.set(self.seconds.get());
        resized.bad.set(self.bad.get());
        Ok(resized)
    }

    /// Width and height of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.scene.sensors()[0].film.settings().crop_size.to_array()
    }

    /// Whether no sample counts in two pixels.
    pub fn has_independent_pixels(&self) -> bool {
        self.scene.sensors()[0].film.settings().filter.is_box()
    }

    /// Lets rays start as far off surfaces as the reference's do.
    pub fn use_reference_offsets(&mut self) {
        self.scene.use_reference_offsets();
    }

    /// Seconds of all renders.
    pub fn seconds(&self) -> f64 {
        self.seconds.get()
    }

    /// Samples per pixel of all passes of the last [`measure_like`](Self::measure_like).
    pub fn total_spp(&self) -> u32 {
        self.total_spp.get()
    }

    /// What the user should know about our side.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.warnings.clone();
        if self.bad.get() > 0 {
            notes.push(format!("{} of our samples were NaN, infinite or negative and left out", self.bad.get()));
        }
        notes
    }

    fn render(&self, spp: u32, seed: u32, change: impl FnOnce(&mut RenderContext<'_>)) -> Result<Image, Refusal> {
        let spp = self.scene.sensors()[0].sampler.round_spp(spp);
        let rendered = render(&self.scene, spp, seed, change).map_err(Refusal::failed)?;
        self.seconds.set(self.seconds.get() + rendered.seconds);
        self.bad.set(self.bad.get() + rendered.bad);
        Ok(rendered.image)
    }

    /// One render with the reference's random numbers in its order.
    pub fn render_exact(&self, spp: u32, seed: u32) -> Result<Image, Refusal> {
        self.render(spp, seed, |cx| cx.follow_reference(REFERENCE_THREADS))
    }

    /// Independent passes with seeds from `seed` on.
    pub fn passes(&self, passes: u32, spp: u32, seed: u32, tabulated: bool) -> Result<Vec<Image>, Refusal> {
        let tabulate = |cx: &mut RenderContext<'_>| {
            if tabulated {
                cx.tabulate_filter();
            }
        };
        (0..passes).map(|pass| self.render(spp, seed.wrapping_add(pass), tabulate)).collect()
    }

    /// The samples per pixel the reference is to take, after a trial: see [`plan_spp`].
    pub fn plan(&self, seed: u32) -> Result<u32, Refusal> {
        let (passes, spp) = TRIAL;
        let images = self.passes(passes, spp, seed.wrapping_add(500), false)?;
        let trial = Measured::of(&images, &compared(&images[0].channels)).map_err(Refusal::Failed)?;
        Ok(plan_spp(&trial, self.has_independent_pixels()))
    }

    /// Passes of so many samples per pixel in all, or to about the reference's standard error.
    pub fn measure_like(&self, reference: &Reference, fixed: Option<u32>, seed: u32) -> Result<Measured, Refusal> {
        let theirs = &reference.measured;
        if self.size() != theirs.size {
            let ([a, b], [c, d]) = (self.size(), theirs.size);
            return Err(Refusal::Failed(format!("ours has {a} x {b} pixels, the reference {c} x {d}")));
        }
        let spp = match fixed {
            Some(total) => (total / PASSES).max(1),
            None => self.equal_spp(reference, seed)?,
        };
        let images = self.passes(PASSES, spp, seed, reference.tabulated)?;
        self.total_spp.set(spp * PASSES);
        Measured::of(&images, &theirs.channels).map_err(Refusal::Failed)
    }

    /// The samples per pixel of a pass that give the reference's standard error, as a power of two.
    fn equal_spp(&self, reference: &Reference, seed: u32) -> Result<u32, Refusal> {
        let (passes, spp) = TRIAL;
        let trial = self.passes(passes, spp, seed.wrapping_add(500), reference.tabulated)?;
        let trial = Measured::of(&trial, &reference.measured.channels).map_err(Refusal::Failed)?;
        // What the trial's variance is above the reference's, that many times more samples are needed.
        let above = variance_ratio(&trial, &reference.measured);
        let equal = above * f64::from(passes * spp) / f64::from(PASSES);
        // A wide filter divides by the sum of its weights, with an error that falls with the samples of a pass: that
        // is to be the reference's.
        let spp = f64::from(reference.spp);
        let least = if self.has_independent_pixels() { (spp / 4.0).max(1.0) } else { spp };
        Ok((equal.clamp(least, 4.0 * spp).round() as u32).next_power_of_two())
    }
}

/// The samples per pixel, of all passes together, that bring the standard error of the image mean to [`TARGET`]; from a
/// trial of 8 passes with 16 samples per pixel each. A power of two: changes of the renderer that leave its noise alone
/// leave the number alone.
pub fn plan_spp(trial: &Measured, independent_pixels: bool) -> u32 {
    let error = trial.relative_error_of_mean(independent_pixels);
    let needed = f64::from(TRIAL.0 * TRIAL.1) * (error / TARGET).powi(2);
    let pixels = u64::from(trial.size[0]) * u64::from(trial.size[1]);
    let most = ((MOST_SAMPLES / pixels.max(1)).min(u64::from(MOST_SPP)) as u32).max(FEWEST_SPP);
    let whole = needed.clamp(f64::from(FEWEST_SPP), f64::from(most)) as u32;
    whole.next_power_of_two().min(1 << most.ilog2())
}

/// Errors of a scene as one line, and whether it is only that something is not built.
fn refusal(errors: &SceneErrors) -> Refusal {
    match errors.0.iter().any(|e| e.message.contains(NOT_BUILT)) {
        true => Refusal::NotForUs(one_line(errors)),
        false => Refusal::Failed(one_line(errors)),
    }
}
