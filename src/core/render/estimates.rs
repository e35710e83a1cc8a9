//! What is known of the pixels before the next samples of them are taken: the aim of roulette.
//!
//! The samples so far are summed over blocks of pixels, each level of blocks twice as wide as the one below. A block is
//! estimated by its own samples and by the block around it, which counts as a few samples more: so the estimate is there
//! from the first samples on and is refined up to single pixels, as the course "Path Guiding in Production" (2019,
//! section 7.7) asks for. It stays the same during a pass. The goal lies between it and the mean of all.

use super::combine::Moments;
use crate::interfaces::Goal;
use crate::io::limits::Cursor;
use crate::io::sealed::Packer;
use crate::io::{IoError, Result};
use crate::math::UVec2;
use glam::IVec2;

/// Samples that the estimate of the block around a block counts for.
const PRIOR: f64 = 8.0;

/// No pixel is taken for darker than this part of the picture's mean.
const DARKEST: f64 = 0.02;

/// The part that the picture as a whole has in the goal of a pixel: 0 would spend work by the relative error of each pixel,
/// 1 by its error as such.
const WHOLE: f64 = 1.0 / 3.0;

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
        let (mut width, mut image) = (1, vec![mean]);
        for (size, sums) in levels.iter().rev() {
            let around = |i: usize| {
                let (x, y) = (i % size.x as usize, i / size.x as usize);
                // The uppermost block is its own.
                image[if image.len() == 1 { 0 } else { y / 2 * width + x / 2 }]
            };
            let refined = sums.iter().enumerate().map(|(i, [n, sum, _])| (sum + PRIOR * around(i)) / (n + PRIOR));
            image = refined.collect();
            width = size.x as usize;
        }
        image.iter_mut().for_each(|image| *image = image.max(DARKEST * mean));
        // Of logarithms, so that a lamp in view does not decide.
        let whole = image.iter().map(|image| image.ln()).sum::<f64>() / image.len() as f64;
        image.iter_mut().for_each(|image| *image = ((1.0 - WHOLE) * image.ln() + WHOLE * whole).exp());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::interfaces::Radiance;

    /// A bright half and a dark one, on a film whose edges are no powers of two.
    #[test]
    fn estimates_are_refined_up_to_pixels() {
        let size = UVec2::new(13, 6);
        let bright = |x: i32| if x < 5 { 4.0 } else { 0.25 };
        let mut estimates = Estimates::new(size);
        assert_eq!(estimates.goal(IVec2::ZERO), Goal::default());
        let mut errors: Vec<f32> = Vec::new();
        for n in [32.0, 64.0, 96.0] {
            let mut moments = Moments::default();
            for y in 0..6 {
                for x in 0..13 {
                    for sample in 0..32 {
                        // The mean is right, the relative variance 1.
                        let rgb = Rgb::splat(bright(x) * if sample % 2 == 0 { 2.0 } else { 0.0 });
                        moments.add(IVec2::new(x, y), Radiance { rgb, alpha: 1.0, rays: 0 });
                    }
                }
            }
            estimates.extend(32, &[moments]);
            estimates.update(3.0);
            // Of the picture as a whole: five columns of 4, eight of 1/4.
            let whole = 4f32.powf((5.0 - 8.0) / 13.0);
            let goal = |x: i32| bright(x).powf(2.0 / 3.0) * whole.powf(1.0 / 3.0);
            let off = |x: i32| (estimates.goal(IVec2::new(x, 2)).image / goal(x) - 1.0).abs();
            let worst = (0..13).map(off).fold(0.0, f32::max);
            // What lies around a pixel is at most sixteen times as bright.
            assert!(worst < 15.0 * PRIOR as f32 / (n + PRIOR as f32), "{n}: {worst}");
            assert!(errors.last().is_none_or(|before| worst < 0.75 * before), "{errors:?}, {worst}");
            errors.push(worst);
        }
        let effort = estimates.goal(IVec2::new(7, 3)).effort;
        // Variance over the square of the goal: in the mean of five bright columns and eight dark ones.
        let whole = 4f32.powf(-3.0 / 13.0);
        let variance = (5.0 * (4.0 / whole).powf(2.0 / 3.0) + 8.0 * (0.25 / whole).powf(2.0 / 3.0)) / 13.0;
        assert!((effort / (3.0 / variance).sqrt() - 1.0).abs() < 0.05, "{effort}");
        assert_eq!(estimates.goal(IVec2::new(13, 2)), Goal::default());
        assert_eq!(estimates.goal(IVec2::new(-1, 2)), Goal::default());
    }

    #[test]
    fn a_black_picture_tells_nothing() {
        let mut estimates = Estimates::new(UVec2::new(3, 1));
        let mut moments = Moments::default();
        moments.add(IVec2::ZERO, Radiance::default());
        estimates.extend(1, &[moments]);
        estimates.update(1.0);
        assert_eq!(estimates.goal(IVec2::ZERO), Goal::default());
    }
}
