//! Pictures of several iterations as one.
//!
//! Early iterations are guided badly and noisy, late ones are better. Each picture is weighted by the inverse of its mean
//! pixel variance, and only the last four count (Müller 2019, "Practical Path Guiding in Production", section 10.3). The
//! weights of that text's equation 6 are sums of inverse variances; what its words ask for, and what is done here, is the
//! inverse of the mean variance. Weights that come from the samples they weigh favour dark pictures, for what raises the
//! mean raises the variance: therefore the pixels are divided like a chessboard, and each half has the weights that come
//! from the other. And no sample counts for more than one of a later iteration: where the noise is in rare bright samples,
//! a short early iteration has met none and seems to have the least.

use super::FilmStore;
use crate::interfaces::{Combination, Radiance};
use crate::io::Result;
use crate::io::limits::Cursor;
use crate::io::sealed::Packer;
use crate::math::UVec2;
use glam::IVec2;
use std::collections::VecDeque;

/// Iterations that count (Müller 2019, section 10.3).
const KEPT: usize = 4;

/// Edge of the fields of the chessboard in pixels: far more than a filter reaches.
const FIELD: u32 = 8;

/// The variance of a pixel counts up to the square of so many mean values of the picture: one firefly does not decide.
/// (In the public code of the method it is 10⁴, for pictures of mean 1.)
const MOST_DEVIATION: f64 = 100.0;

/// Samples from which the variance of a picture is believed.
const ENOUGH: u32 = 4;

/// The first and second moments of the samples of a tile's pixels.
#[derive(Default)]
pub struct Moments(Vec<(IVec2, f64, f64)>);

impl Moments {
    /// Pixels with the sum of their samples' luminance and of its square.
    pub fn iter(&self) -> impl Iterator<Item = (IVec2, f64, f64)> {
        self.0.iter().copied()
    }

    /// Adds a sample; those of a pixel follow each other.
    #[inline]
    pub fn add(&mut self, pixel: IVec2, value: Radiance) {
        let x = f64::from(value.rgb.luminance());
        match self.0.last_mut() {
            Some((last, sum, squares)) if *last == pixel => {
                *sum += x;
                *squares += x * x;
            }
            _ => self.0.push((pixel, x, x * x)),
        }
    }
}

/// The samples of one iteration.
#[derive(Clone)]
struct Iteration {
    store: FilmStore,
    spp: u32,
    /// Of each pixel, the sum of its samples' luminance and of the squares.
    moments: Vec<[f64; 2]>,
}

impl Iteration {
    /// Mean variance of one sample in each half of the chessboard, if there are enough samples.
    fn variances(&self) -> Option<[f64; 2]> {
        let n = f64::from(self.spp);
        let pixels = self.moments.len() as f64;
        let mean = self.moments.iter().map(|[sum, _]| sum / n).sum::<f64>() / pixels;
        let most = (MOST_DEVIATION * mean).powi(2);
        let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
        for (i, [sum, squares]) in self.moments.iter().enumerate() {
            let half = half(i, self.store.size());
            sums[half] += ((squares - sum * sum / n) / (n - 1.0)).clamp(0.0, most);
            counts[half] += 1.0;
        }
        let variances = [0, 1].map(|half: usize| sums[half] / counts[half]);
        let known = self.spp >= ENOUGH && variances.iter().all(|v| v.is_finite() && *v > 0.0);
        known.then_some(variances)
    }
}

/// The half of the chessboard in which a pixel lies.
fn half(index: usize, size: UVec2) -> usize {
    let (x, y) = (index as u32 % size.x, index as u32 / size.x);
    ((x / FIELD + y / FIELD) % 2) as usize
}

/// The pictures that count, the one under way last.
pub struct Iterations {
    kept: VecDeque<Iteration>,
    empty: Iteration,
    policy: Combination,
}

impl Iterations {
    /// None yet; `store` is an empty film.
    pub fn new(store: &FilmStore, policy: Combination) -> Self {
        let pixels = store.size().x as usize * store.size().y as usize;
        let empty = Iteration { store: store.clone(), spp: 0, moments: vec![[0.0; 2]; pixels] };
        Iterations { kept: VecDeque::new(), empty, policy }
    }

    /// The samples that follow belong to another iteration.
    pub fn begin(&mut self) {
        if self.policy == Combination::All && !self.kept.is_empty() {
            return;
        }
        let kept = self.most_kept();
        // While the new one is incomplete, the last complete ones all count.
        while self.kept.len() > kept {
            self.kept.pop_front();
        }
        self.kept.push_back(self.empty.clone());
    }

    /// The film of the iteration under way.
    pub fn film(&self) -> FilmStore {
        self.kept.back().map_or_else(|| self.empty.store.clone(), |last| last.store.clone())
    }

    /// Takes over the film of the iteration under way after `spp` further samples per pixel, and their moments.
    pub fn extend(&mut self, film: FilmStore, spp: u32, moments: &[Moments]) {
        let Some(last) = self.kept.back_mut() else { return };
        let size = film.size();
        last.store = film;
        last.spp += spp;
        for (pixel, sum, squares) in moments.iter().flat_map(|tile| &tile.0) {
            let (x, y) = (pixel.x as u32, pixel.y as u32);
            if x < size.x && y < size.y {
                let [a, b] = &mut last.moments[(y * size.x + x) as usize];
                (*a, *b) = (*a + sum, *b + squares);
            }
        }
    }

    /// Ends the iteration under way: from now on the oldest no longer counts.
    pub fn complete(&mut self) {
        let kept = self.most_kept();
        while self.kept.len() > kept {
            self.kept.pop_front();
        }
    }

    /// Mean variance of one sample of the latest iteration, if it is known.
    pub fn variance(&self) -> Option<f64> {
        let [even, odd] = self.kept.back()?.variances()?;
        Some(0.5 * (even + odd))
    }

    fn most_kept(&self) -> usize {
        match self.policy {
            Combination::InverseVariance => KEPT,
            Combination::All | Combination::Last => 1,
        }
    }

    /// Weights of the iterations' means in both halves; they sum to 1.
    fn weights(&self) -> Vec<[f64; 2]> {
        let sampled: Vec<&Iteration> = self.kept.iter().collect();
        let by_count = || sampled.iter().map(|i| [f64::from(i.spp); 2]).collect::<Vec<_>>();
        let mut weights = match self.policy {
            Combination::All | Combination::Last => {
                // The last that is complete, until the one under way has as many samples.
                let best = (0..sampled.len()).max_by_key(|i| sampled[*i].spp);
                (0..sampled.len()).map(|i| [f64::from(u8::from(Some(i) == best)); 2]).collect()
            }
            Combination::InverseVariance => {
                let mut variances: Vec<Option<[f64; 2]>> = sampled.iter().map(|i| i.variances()).collect();
                // One that has just begun is taken to be as good as the one before.
                if let [.., before, last] = &mut variances[..]
                    && last.is_none()
                    && sampled.last().is_some_and(|i| i.spp < ENOUGH)
                {
                    *last = *before;
                }
                for i in (1..variances.len()).rev() {
                    if let [Some(earlier), Some(later)] = &mut variances[i - 1..=i] {
                        *earlier = [0, 1].map(|half: usize| earlier[half].max(later[half]));
                    }
                }
                let weigh = |(i, v): (&&Iteration, Option<[f64; 2]>)| {
                    v.map(|[even, odd]| [f64::from(i.spp) / odd, f64::from(i.spp) / even])
                };
                // Where one tells nothing, as a black one, all samples are alike.
                sampled.iter().zip(variances).map(weigh).collect::<Option<Vec<_>>>().unwrap_or_else(by_count)
            }
        };
        let sums = [0, 1].map(|half: usize| weights.iter().map(|w| w[half]).sum::<f64>());
        for weight in &mut weights {
            *weight = [0, 1].map(|half: usize| if sums[half] > 0.0 { weight[half] / sums[half] } else { 0.0 });
        }
        weights
    }

    /// Writes all that counts.
    pub fn pack(&self, to: &mut Packer) {
        to.u32(self.kept.len() as u32);
        for Iteration { store, spp, moments } in &self.kept {
            to.u32(*spp);
            store.pack(to);
            moments.iter().flatten().for_each(|moment| to.f64(*moment));
        }
    }

    /// Reads what was written of pictures like these.
    ///
    /// # Errors
    /// If they are of another size.
    pub fn unpack(&mut self, from: &mut Cursor<'_>) -> Result<()> {
        self.kept.clear();
        for _ in 0..from.count(12, "iterations")? {
            let spp = from.u32("an iteration")?;
            let mut iteration = Iteration { spp, store: self.empty.store.unpack(from)?, ..self.empty.clone() };
            for moment in iteration.moments.iter_mut().flatten() {
                *moment = from.f64("moments of an iteration")?;
            }
            self.kept.push_back(iteration);
        }
        Ok(())
    }

    /// All that counts as one film.
    pub fn combined(&self) -> FilmStore {
        let mut film = self.empty.store.clone();
        let size = film.size();
        for (iteration, weights) in self.kept.iter().zip(self.weights()) {
            let spp = f64::from(iteration.spp.max(1));
            film.add_weighted(&iteration.store, |pixel| weights[half(pixel, size)] / spp);
        }
        film
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;
    use crate::sampling::Pcg32;
    use crate::stats::figures::measured;

    const SIZE: UVec2 = UVec2::new(64, 64);

    /// Log-normal samples of mean 1 with this deviation of the logarithm.
    fn sample(pcg: &mut Pcg32, deviation: f64) -> f64 {
        let u = 1.0 - f64::from(pcg.next_f32());
        let normal = (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * f64::from(pcg.next_f32())).cos();
        (deviation * normal - 0.5 * deviation * deviation).exp()
    }

    /// Pictures of the given samples per pixel and deviation; `black` is one without light.
    fn iterations(policy: Combination, parts: &[(u32, f64)], seed: u64, black: Option<usize>) -> Iterations {
        let mut pcg = Pcg32::new(seed, 1);
        let mut all = Iterations::new(&FilmStore::new(SIZE, Vec::new()), policy);
        for (index, (spp, deviation)) in parts.iter().enumerate() {
            all.begin();
            let (mut film, mut moments) = (all.film(), Moments::default());
            for y in 0..SIZE.y {
                for x in 0..SIZE.x {
                    for _ in 0..*spp {
                        let v = if black == Some(index) { 0.0 } else { sample(&mut pcg, *deviation) as f32 };
                        let value = Radiance { rgb: Rgb::splat(v), alpha: 1.0, rays: 0 };
                        film.add_sample(UVec2::new(x, y), value);
                        moments.add(UVec2::new(x, y).as_ivec2(), value);
                    }
                }
            }
            all.extend(film, *spp, &[moments]);
            all.complete();
        }
        all
    }

    /// Mean of a picture and its mean squared error; all pixels are 1.
    fn errors(film: &FilmStore) -> (f64, f64) {
        let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y)));
        let values: Vec<f64> = pixels.map(|(x, y)| f64::from(film.pixel(x, y).rgb.luminance())).collect();
        let n = values.len() as f64;
        (values.iter().sum::<f64>() / n, values.iter().map(|v| (v - 1.0).powi(2)).sum::<f64>() / n)
    }

    /// Iterations that get better: the combination is better than the last one alone, and not darker.
    #[test]
    fn hc_p09_the_combination_is_better_than_the_last_and_not_darker() {
        let parts = [(8, 1.2), (16, 1.1), (32, 1.0), (64, 1.0)];
        let (mut bias, mut gain, runs) = (0.0, 0.0, 12);
        for seed in 0..runs {
            let (mean, error) = errors(&iterations(Combination::InverseVariance, &parts, seed, None).combined());
            let (_, alone) = errors(&iterations(Combination::Last, &parts, seed, None).combined());
            bias += (mean - 1.0) / runs as f64;
            gain += alone / error / runs as f64;
        }
        // Deviation of the mean over all pixels and runs.
        let sigma = (1f64.exp_m1() / (120.0 * f64::from(SIZE.x * SIZE.y) * runs as f64)).sqrt();
        measured(
            "hc_p09_the_combination_is_better_than_the_last_and_not_darker",
            format!(
                "bias {:.3} % (one sigma is {:.3} %), error of the last alone {gain:.2} times",
                100.0 * bias,
                100.0 * sigma
            ),
        );
        assert!(bias.abs() < 4.0 * sigma, "{bias} against {sigma}");
        assert!(gain > 1.3, "{gain}");
    }

    /// A run that ends early, in an iteration that has hardly begun, shows the last that is complete.
    #[test]
    fn the_last_complete_iteration_counts_until_there_is_a_better_one() {
        for (spp, shown) in [(4, 64.0), (100, 100.0)] {
            let mut all = iterations(Combination::Last, &[(16, 1.0), (64, 1.0)], 1, None);
            all.begin();
            let film = all.film();
            all.extend(film, spp, &[]);
            let weights = all.weights();
            let counts: Vec<f64> = all.kept.iter().zip(weights).map(|(i, [w, _])| w * f64::from(i.spp)).collect();
            assert_eq!(counts.iter().sum::<f64>(), shown, "{counts:?}");
        }
    }

    #[test]
    fn hc_p09_a_black_or_constant_iteration_leaves_a_finite_picture() {
        for parts in [[(8, 0.0), (16, 1.0)], [(8, 1.0), (16, 0.0)], [(8, 0.0), (16, 0.0)], [(1, 1.0), (1, 1.0)]] {
            for black in [None, Some(0), Some(1)] {
                let (mean, _) = errors(&iterations(Combination::InverseVariance, &parts, 3, black).combined());
                assert!(mean.is_finite() && mean > 0.2 && mean < 1.2, "{parts:?} {black:?}: {mean}");
            }
        }
    }
}
