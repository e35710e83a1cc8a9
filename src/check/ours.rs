//! Lucerna's side of a comparison.

use super::reference::Reference;
use super::{Options, PASSES, Refusal, TARGET, compared};
use lucerna_core::image::Image;
use lucerna_core::render::{Budget, Control, RenderContext};
use lucerna_core::scene::{Description, ObjectKind, Registry, Scene, SceneErrors, instantiate, resolve, upgrade, xml};
use lucerna_core::stats::Measured;
use std::cell::Cell;
use std::path::{Path, PathBuf};

/// Threads the reference counts where it renders sample for sample: two workers and the main one.
pub const REFERENCE_THREADS: u32 = 3;

/// Passes and samples per pixel of a trial that tells how noisy a scene is.
const TRIAL: (u32, u32) = (8, 16);

/// Fewest and most samples per pixel that a plan asks for, and most samples of the picture (which yields to the fewest).
const FEWEST_SPP: u32 = 256;
const MOST_SPP: u32 = 1 << 14;
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
        let errors = |errors: SceneErrors| refusal(&errors);
        let mut description = xml::load(path, &options.reading).map_err(errors)?;
        let files = description.files();
        resolve::resolve(&mut description).map_err(errors)?;
        upgrade::upgrade(&mut description);
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
        Self::build(registry, &self.path, self.description, self.files, options)
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
        let control = Control::new();
        let camera = &self.scene.sensors()[0];
        let integrator = self.scene.integrator().ok_or_else(|| Refusal::failed("the scene has no integrator"))?;
        let budget = Budget::Samples(camera.sampler.round_spp(spp));
        let mut cx = RenderContext::new(&self.scene, camera, budget, seed, &control, integrator.aov_names());
        change(&mut cx);
        let report = integrator.render(&mut cx).map_err(Refusal::failed)?;
        self.seconds.set(self.seconds.get() + report.seconds);
        self.bad.set(self.bad.get() + report.bad.count);
        let (channels, data) = cx.store.develop(&cx.film);
        let size = cx.store.size();
        Ok(Image { width: size.x, height: size.y, channels, data })
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

    /// The samples per pixel that bring the standard error of the image mean to [`TARGET`], as a power of two: changes
    /// of the renderer that leave its noise alone leave the number alone.
    pub fn plan(&self, seed: u32) -> Result<u32, Refusal> {
        let (passes, spp) = TRIAL;
        let images = self.passes(passes, spp, seed.wrapping_add(500), false)?;
        let trial = Measured::of(&images, &compared(&images[0].channels)).map_err(Refusal::Failed)?;
        let error = trial.relative_error_of_mean(self.has_independent_pixels());
        let needed = f64::from(passes * spp) * (error / TARGET).powi(2);
        let [width, height] = self.size().map(u64::from);
        let most = ((MOST_SAMPLES / (width * height).max(1)) as u32).clamp(FEWEST_SPP, MOST_SPP);
        let whole = needed.clamp(f64::from(FEWEST_SPP), f64::from(most)) as u32;
        Ok(whole.next_power_of_two().min(1 << most.ilog2()))
    }

    /// Passes to about the reference's standard error.
    pub fn measure_like(&self, reference: &Reference, independent: bool, seed: u32) -> Result<Measured, Refusal> {
        let theirs = &reference.measured;
        let (passes, spp) = TRIAL;
        let channels = &theirs.channels;
        let trial = self.passes(passes, spp, seed.wrapping_add(500), reference.tabulated)?;
        let trial = Measured::of(&trial, channels).map_err(Refusal::Failed)?;
        if trial.size != theirs.size {
            let ([a, b], [c, d]) = (trial.size, theirs.size);
            return Err(Refusal::Failed(format!("ours has {a} x {b} pixels, the reference {c} x {d}")));
        }
        // What the trial's variance is above the reference's, that many times more samples are needed.
        let ratio = lucerna_core::stats::images::variance_ratio(&trial, theirs) * f64::from(passes * spp);
        let equal = ratio / f64::from(PASSES);
        // Never so few that a wide filter's division by its weights shows.
        let least = f64::from(reference.spp) / if independent { 4.0 } else { 1.0 };
        let chosen = equal.clamp(least.max(1.0), 4.0 * f64::from(reference.spp)).round() as u32;
        let chosen = if chosen.is_power_of_two() { chosen } else { chosen.next_power_of_two() };
        let images = self.passes(PASSES, chosen, seed, reference.tabulated)?;
        self.total_spp.set(chosen * PASSES);
        Measured::of(&images, channels).map_err(Refusal::Failed)
    }
}

/// Errors of a scene as one line, and whether it is only that something is not built.
fn refusal(errors: &SceneErrors) -> Refusal {
    let not_built = |message: &str| message.contains("not built");
    let first = errors.0.iter().find(|e| not_built(&e.message)).or(errors.0.first());
    let text = first.map_or_else(|| "the scene cannot be read".to_owned(), ToString::to_string);
    let text = text.strip_prefix("error: ").unwrap_or(&text).to_owned();
    let more = errors.0.len().saturating_sub(1);
    let text = if more > 0 { format!("{text} (and {more} more)") } else { text };
    match !errors.0.is_empty() && errors.0.iter().any(|e| not_built(&e.message)) {
        true => Refusal::NotForUs(text),
        false => Refusal::Failed(text),
    }
}
