//! What is known of the pixels before the next samples of them are taken: the aim of roulette.
//!
//! The samples so far are summed over blocks of pixels, each level of blocks twice as wide as the one below. A pixel is
//! estimated by the smallest block around it whose mean is known well enough: so the estimate is there from the first
//! samples on and is refined up to single pixels (as in the course "Path Guiding in Production", 2019, section 7.7). It
//! stays the same during a pass.

use super::combine::Moments;
use crate::interfaces::Goal;
use crate::io::limits::Cursor;
use crate::io::sealed::Packer;
use crate::io::{IoError, Result};
use crate::math::UVec2;
use glam::IVec2;

/// Samples that a block needs.
const ENOUGH: f64 = 32.0;

/// Its mean may be off by this part of itself (one sigma).
const ERROR: f64 = 0.2;

/// No pixel is taken for darker than this part of the picture's mean.
const DARKEST: f64 = 0.02;

/// Samples per pixel from which the variance of the picture is believed.
const ENOUGH_FOR_VARIANCE: f64 = 4.0;

/// The relative variance of a pixel counts up to this: one firefly does not decide.
const MOST_VARIANCE: f64 = 400.0;

/// Number of samples, sum of their luminance, and of its square.
type Sums = [f64; 3];

/// The estimates of all pixels.
pub struct Estimates {
    size: UVec2,
    pixels: Vec<Sums>,
    goals: Vec<Goal>,
}

impl Estimates {
    /// Nothing is known.
    pub fn new(size: UVec2) -> Self {
        let pixels = size.x as usize * size.y as usize;
        Estimates { size, pixels: vec![[0.0; 3]; pixels], goals: Vec::new() }
    }

    /// Takes in the moments of `spp` further samples per pixel.
    pub fn extend(&mut self, spp: u32, moments: &[Moments]) {
        for (pixel, sum, squares) in moments.iter().flat_map(Moments::iter) {
            if let Some(index) = self.index(pixel) {
                let [n, a, b] = &mut self.pixels[index];
                (*n, *a, *b) = (*n + f64::from(spp), *a + sum, *b + squares);
            }
        }
    }

    /// What is known of a pixel, as of the last [`update`](Self::update).
    #[inline]
    pub fn goal(&self, pixel: IVec2) -> Goal {
        self.index(pixel).and_then(|index| self.goals.get(index)).copied().unwrap_or_default()
    }

    /// Writes what was taken in; one word if that is nothing.
    pub fn pack(&self, to: &mut Packer) {
        let any = self.pixels.iter().any(|sums| *sums != [0.0; 3]);
        to.u32(any.into());
        if any {
            self.pixels.iter().flatten().for_each(|sum| to.f64(*sum));
        }
    }

    /// Reads what was taken in by one of the same size.
    ///
    /// # Errors
    /// If it is cut short or no sums.
    pub fn unpack(&mut self, from: &mut Cursor<'_>) -> Result<()> {
        const WHAT: &str = "the estimates of the pixels";
        if from.u32(WHAT)? == 0 {
            return Ok(());
        }
        for sum in self.pixels.iter_mut().flatten() {
            *sum = from.f64(WHAT)?;
            if sum.is_nan() {
                return Err(IoError::new("has estimates of pixels that are no numbers"));
            }
        }
        Ok(())
    }

    fn index(&self, pixel: IVec2) -> Option<usize> {
        let (x, y) = (u32::try_from(pixel.x).ok()?, u32::try_from(pixel.y).ok()?);
        (x < self.size.x && y < self.size.y).then(|| y as usize * self.size.x as usize + x as usize)
    }

    /// Makes the estimates of what has been taken in; a sample has cost so many rays in the mean.
    pub fn update(&mut self, cost: f64) {
        let mut levels = vec![(self.size, self.pixels.clone())];
        while let Some((size, below)) = levels.last()
            && size.max_element() > 1
        {
            let level = halved(*size, below);
            levels.push(level);
        }
        let [n, sum, _] = levels.last().map_or([0.0; 3], |(_, top)| top[0]);
        let mean = sum / n;
        if !(mean > 0.0 && mean.is_finite()) {
            return;
        }
        let known = |[n, sum, squares]: Sums| {
            let m = sum / n;
            let variance = (squares / n - m * m).max(0.0) / (n - 1.0);
            n >= ENOUGH && variance <= (ERROR * m) * (ERROR * m)
        };
        let estimate = |x: u32, y: u32| {
            let mut blocks = levels
                .iter()
                .enumerate()
                .map(|(level, (size, sums))| sums[(y >> level) as usize * size.x as usize + (x >> level) as usize]);
            let found = blocks.clone().find(|sums| known(*sums)).or_else(|| blocks.next_back());
            found.map_or(mean, |[n, sum, _]| (sum / n).max(DARKEST * mean))
        };
        let image: Vec<f64> =
            (0..self.size.y).flat_map(|y| (0..self.size.x).map(move |x| (x, y))).map(|(x, y)| estimate(x, y)).collect();
        let effort = (cost / self.relative_variance(&image)).sqrt() as f32;
        let effort = if effort.is_finite() { effort } else { 0.0 };
        self.goals = image.iter().map(|image| Goal { image: *image as f32, effort }).collect();
    }

    /// Mean over the pixels of the variance of a sample over the square of the estimate; NaN while unknown.
    fn relative_variance(&self, image: &[f64]) -> f64 {
        let mut sum = 0.0;
        for ([n, a, squares], image) in self.pixels.iter().zip(image) {
            if *n < ENOUGH_FOR_VARIANCE {
                return f64::NAN;
            }
            let variance = (squares - a * a / n) / (n - 1.0);
            sum += (variance / (image * image)).clamp(0.0, MOST_VARIANCE);
        }
        sum / image.len() as f64
    }
}

/// Sums over blocks of two by two.
fn halved(size: UVec2, below: &[Sums]) -> (UVec2, Vec<Sums>) {
    let half = (size + 1) / 2;
    let mut sums = vec![[0.0; 3]; half.x as usize * half.y as usize];
    for (i, more) in below.iter().enumerate() {
        let (x, y) = (i as u32 % size.x / 2, i as u32 / size.x / 2);
        let to = &mut sums[y as usize * half.x as usize + x as usize];
        to.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
    }
    (half, sums)
}
