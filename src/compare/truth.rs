//! The picture that methods are compared with: a given one, or one that is rendered until it is good enough.
//!
//! A rendered one is the mean of independent passes, with seeds of their own. It is good enough when its standard error,
//! estimated from the spread of the passes, is below a tenth of the best method's error; then it adds less than 1 % to
//! an MSE. It is kept in a cache after every pass, so that another comparison, or one that was killed, takes it up.

use super::method::Method;
use super::subject::Subject;
use super::{Options, colour, rate};
use crate::pictures::{write_exr, write_json};
use lucerna_core::image::{Image, ReadLimits, exr};
use lucerna_core::scene::Registry;
use lucerna_core::stats::metrics::{EPSILON, Seeds, errors};
use serde_json::{Value, json};
use std::path::Path;

/// The reference's standard error over the best method's, at most.
pub const SHARE: f64 = 0.1;

/// Passes from which the spread is believed.
const FEWEST_PASSES: usize = 8;

/// Samples per pixel of a pass, as a multiple of those of the longest run; with as much noise per sample as the best
/// method's it takes a hundred such runs, 13 passes.
const LONGER: u32 = 8;

/// First seed; those of the methods are far away.
const SEED: u32 = 1 << 30;

/// What methods are compared with.
#[derive(Clone)]
pub struct Truth {
    /// Colour, channels interleaved.
    pub values: Vec<f32>,
    /// Width and height.
    pub size: [u32; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// What its noise adds to an MSE and to a relMSE, and the relative variance of its mean; not known of a single file.
    pub noise: Option<[f64; 3]>,
    /// Where it comes from, in one line.
    pub source: String,
    /// Samples per pixel; 0 if not known.
    pub spp: u64,
    /// Whether its noise is small enough; `None` if its noise is not known.
    pub reached: Option<bool>,
}

impl Truth {
    /// Reads a file, and its variance, if there is one next to it that ends in `.var.exr`.
    ///
    /// # Errors
    /// If it cannot be read or is of another size.
    pub fn read(path: &Path, size: [u32; 2]) -> Result<Self, String> {
        let read = |path: &Path| {
            let file = exr::read(path, &ReadLimits::default()).map_err(|e| format!("{}: {e}", path.display()))?;
            let found = [file.image.width, file.image.height];
            if found != size {
                let ([a, b], [c, d]) = (found, size);
                return Err(format!("{}: {a} x {b} pixels instead of {c} x {d}", path.display()));
            }
            colour(&file.image)
        };
        let (channels, values) = read(path)?;
        let variance = path.with_extension("var.exr");
        let variance = if variance.is_file() { Some(read(&variance)?.1) } else { None };
        let noise = variance.map(|variance| noise(&values, &variance));
        let source = path.display().to_string();
        Ok(Truth { values, size, channels, noise, source, spp: 0, reached: None })
    }

    /// Whether the noise is small enough against an MSE that holds it.
    fn is_good_for(&self, best_mse: f64) -> bool {
        self.noise.is_some_and(|[mse, ..]| mse <= SHARE * SHARE * (best_mse - mse))
    }
}

/// What a reference of this variance adds to errors: see [`Truth::noise`].
fn noise(values: &[f32], variance: &[f32]) -> [f64; 3] {
    let (mut sums, mut total, mut count) = ([0.0; 3], 0.0, 0.0);
    for (r, v) in values.iter().zip(variance).filter(|(r, v)| r.is_finite() && v.is_finite()) {
        let (r, v) = (f64::from(*r), f64::from(*v));
        sums[0] += v;
        sums[1] += v / (r * r + EPSILON);
        total += r;
        count += 1.0;
    }
    let count = f64::max(count, 1.0);
    // Pixels count as independent.
    let of_mean = if total == 0.0 { 0.0 } else { sums[0] / (total * total) };
    [sums[0] / count, sums[1] / count, of_mean]
}

/// Renders the reference, or goes on with the one in the cache, until it is good enough for `pictures` (one of each
/// method, of its longest run) or the time is up.
///
/// # Errors
/// If the scene cannot be rendered, or the cache cannot be written to.
pub fn make(
    registry: &Registry,
    scene: &Path,
    options: &Options,
    pictures: &[Vec<f32>],
    longest: u32,
    tell: &mut dyn FnMut(String),
) -> Result<Truth, String> {
    let method = Method::of_text(&options.reference_method)?;
    let subject = Subject::load(registry, scene, &method, options)?;
    let folder = options.cache.join(format!("truth-{}", &subject.key[..32]));
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let (mut kept, mut spent) = (load(&folder), 0.0);
    loop {
        if let Some(kept) = &kept
            && kept.seeds.count() >= 2
        {
            let truth = kept.truth(&method);
            let mses = pictures.iter().filter_map(|p| errors(p, &truth.values, truth.channels.len()).ok());
            let best = mses.map(|e| e.mse).fold(f64::INFINITY, f64::min);
            // Where no picture can be measured there is nothing it has to be good for.
            let reached = best.is_finite().then(|| truth.is_good_for(best) && kept.seeds.count() >= FEWEST_PASSES);
            if reached.unwrap_or(kept.seeds.count() >= FEWEST_PASSES) || spent >= options.reference_seconds {
                return Ok(Truth { reached, ..truth });
            }
        }
        let mut running = match kept.take() {
            Some(kept) => kept,
            None => Kept::new(&subject, options, longest)?,
        };
        let seed = SEED.wrapping_add(running.seeds.count() as u32);
        let shot = subject.render(&[running.spp], seed)?.pop().ok_or("the reference gave no picture")?;
        spent += shot.seconds;
        let (channels, values) = colour(&shot.image)?;
        running.channels = channels;
        running.seeds.add(&values)?;
        running.store(&folder)?;
        tell(format!("reference, pass {} of {} spp", running.seeds.count(), running.spp));
        kept = Some(running);
    }
}

/// Passes so far.
struct Kept {
    seeds: Seeds,
    spp: u32,
    size: [u32; 2],
    channels: Vec<String>,
}

const MEAN: &str = "mean.exr";
const VARIANCE: &str = "variance.exr";
const ABOUT: &str = "passes.json";

impl Kept {
    fn new(subject: &Subject, options: &Options, longest: u32) -> Result<Self, String> {
        // No pass may take so long that the time is up before there are enough.
        let affordable = options.reference_seconds / f64::from(2 * FEWEST_PASSES as u32) * rate(subject, 0.5)?;
        let spp = f64::from(longest.saturating_mul(LONGER)).min(affordable).clamp(1.0, f64::from(1 << 22));
        let spp = subject.counts_up_to(spp as u32);
        Ok(Kept { seeds: Seeds::default(), spp, size: subject.size(), channels: Vec::new() })
    }

    fn truth(&self, method: &Method) -> Truth {
        let (values, count) = (self.seeds.mean(), self.seeds.count());
        let noise = self.seeds.variance_of_mean().map(|variance| noise(&values, &variance));
        let source = format!("{}, {count} passes of {} spp", method.describe(), self.spp);
        let spp = u64::from(self.spp) * count as u64;
        Truth { values, size: self.size, channels: self.channels.clone(), noise, source, spp, reached: None }
    }

    fn store(&self, folder: &Path) -> Result<(), String> {
        // A single pass has no spread that could be kept; it is lost with the program.
        let Some(variance) = self.seeds.variance_of_mean() else { return Ok(()) };
        let [width, height] = self.size;
        let picture = |data| Image { width, height, channels: self.channels.clone(), data };
        let count = self.seeds.count();
        // Pictures of another number of passes than the document tells are not taken.
        let _ = std::fs::remove_file(folder.join(ABOUT));
        write_exr(&folder.join(MEAN), &picture(self.seeds.mean()))?;
        write_exr(&folder.join(VARIANCE), &picture(variance))?;
        write_json(&folder.join(ABOUT), &json!({ "passes": count, "spp": self.spp, "size": self.size }))
    }
}

fn load(folder: &Path) -> Option<Kept> {
    let about: Value = serde_json::from_slice(&std::fs::read(folder.join(ABOUT)).ok()?).ok()?;
    let read = |name: &str| exr::read(&folder.join(name), &ReadLimits::default()).ok().map(|file| file.image);
    let (mean, variance) = (read(MEAN)?, read(VARIANCE)?);
    let size = [mean.width, mean.height];
    if size != [variance.width, variance.height] {
        return None;
    }
    let ((channels, mean), (_, variance)) = (colour(&mean).ok()?, colour(&variance).ok()?);
    let number = |name: &str| about[name].as_u64().and_then(|v| u32::try_from(v).ok()).filter(|v| *v > 0);
    let seeds = Seeds::stored(number("passes")? as usize, &mean, &variance);
    Some(Kept { seeds, spp: number("spp")?, size, channels })
}
