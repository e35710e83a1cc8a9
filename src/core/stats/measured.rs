//! What independent passes over the same picture say about it.

use crate::image::Image;

/// Edge of a tile in pixels. Tiles start at the top left corner; the last ones of a row or column may be smaller.
pub const TILE: u32 = 8;

/// Mean and variance of a picture, measured from independent passes of equal length.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Number of passes, at least 2.
    pub passes: u32,
    /// Mean of every value; row-major, channels interleaved. NaN where any pass was not finite.
    pub mean: Vec<f64>,
    /// Variance *of that mean*, estimated from the spread of the passes.
    pub variance: Vec<f64>,
    /// The means of all tiles in each pass; row-major, channels interleaved. Empty if only mean and variance were kept.
    pub tiles: Vec<Vec<f64>>,
}

impl Measured {
    /// From passes with different random numbers. Channels of the first one that are not in `channels` are left out.
    ///
    /// # Errors
    /// If there are fewer than two passes, if they differ in size, or if one lacks a channel.
    pub fn of(passes: &[Image], channels: &[String]) -> Result<Self, String> {
        let [first, _, ..] = passes else { return Err("a variance needs two passes".to_owned()) };
        let size = [first.width, first.height];
        let picked: Vec<Vec<f64>> = passes.iter().map(|pass| pick(pass, size, channels)).collect::<Result<_, _>>()?;
        let n = picked.len() as f64;
        let (mut mean, mut variance) = (Vec::new(), Vec::new());
        for i in 0..picked[0].len() {
            let m = picked.iter().map(|pass| pass[i]).sum::<f64>() / n;
            mean.push(if m.is_finite() { m } else { f64::NAN });
            variance.push(picked.iter().map(|pass| (pass[i] - m).powi(2)).sum::<f64>() / (n * (n - 1.0)));
        }
        let tiles = picked.iter().map(|pass| tile_means(pass, size, channels.len())).collect();
        Ok(Measured { size, channels: channels.to_vec(), passes: passes.len() as u32, mean, variance, tiles })
    }

    /// From a stored mean and its variance.
    ///
    /// # Errors
    /// If the two differ in size, or lack a channel.
    pub fn stored(mean: &Image, variance: &Image, passes: u32, channels: &[String]) -> Result<Self, String> {
        let size = [mean.width, mean.height];
        let mean = pick(mean, size, channels)?.into_iter().map(|m| if m.is_finite() { m } else { f64::NAN }).collect();
        let variance = pick(variance, size, channels)?;
        Ok(Measured { size, channels: channels.to_vec(), passes: passes.max(2), mean, variance, tiles: Vec::new() })
    }

    /// The mean, or another list of as many values, as a picture.
    pub fn picture(&self, values: &[f64]) -> Image {
        let data = values.iter().map(|v| *v as f32).collect();
        Image { width: self.size[0], height: self.size[1], channels: self.channels.clone(), data }
    }

    /// Degrees of freedom of [`variance`](Self::variance).
    pub fn freedom(&self) -> f64 {
        f64::from(self.passes - 1)
    }

    /// Standard error of the mean of the picture over that mean, in the channel where it is largest (those with less than
    /// a hundredth of the brightest one's energy aside). Neighbouring tiles count as independent, which under a wide
    /// filter makes it a little too small.
    pub fn relative_error_of_mean(&self, independent: bool) -> f64 {
        let Some(variances) = self.tile_variances(independent) else { return 0.0 };
        let (channels, counts) = (self.channels.len(), tile_counts(self.size));
        let total: f64 = counts.iter().sum();
        let means = self.tile_means();
        let sums: Vec<(f64, f64)> = (0..channels)
            .map(|channel| {
                let tiles = counts.iter().enumerate().map(|(t, count)| (t * channels + channel, count / total));
                tiles.filter(|(i, _)| means[*i].is_finite()).fold((0.0, 0.0), |(mean, variance), (i, weight)| {
                    (mean + weight * means[i], variance + weight * weight * variances[i].0)
                })
            })
            .collect();
        let brightest = sums.iter().map(|(mean, _)| mean.abs()).fold(0.0, f64::max);
        let bright = sums.iter().filter(|(mean, _)| mean.abs() > 0.01 * brightest);
        bright.map(|(mean, variance)| variance.sqrt() / mean.abs()).fold(0.0, f64::max)
    }

    /// Means over the tiles, NaN for a tile with a value that is not finite.
    pub fn tile_means(&self) -> Vec<f64> {
        tile_means(&self.mean, self.size, self.channels.len())
    }

    /// Variances of the tile means and their degrees of freedom. If pixels are independent, the variances of the pixels
    /// add up, and the degrees of freedom are Satterthwaite's (1946). Else (under a filter wider than a pixel,
    /// neighbours share samples) the spread of the tile over the passes counts; `None` if that was not kept.
    pub fn tile_variances(&self, independent: bool) -> Option<Vec<(f64, f64)>> {
        if !independent {
            let n = self.tiles.len() as f64;
            return (self.tiles.len() >= 2).then(|| {
                (0..self.tiles[0].len())
                    .map(|i| {
                        let mean = self.tiles.iter().map(|pass| pass[i]).sum::<f64>() / n;
                        let squares = self.tiles.iter().map(|pass| (pass[i] - mean).powi(2)).sum::<f64>();
                        (squares / (n * (n - 1.0)), n - 1.0)
                    })
                    .collect()
            });
        }
        let channels = self.channels.len();
        let squares: Vec<f64> = self.variance.iter().map(|v| v * v).collect();
        let counts = tile_counts(self.size);
        let sums = tile_means(&self.variance, self.size, channels).into_iter();
        let variances = sums.zip(tile_means(&squares, self.size, channels)).enumerate().map(|(i, (v, v2))| {
            let n = counts[i / channels];
            (v / n, if v2 > 0.0 { n * v * v / v2 * self.freedom() } else { n * self.freedom() })
        });
        Some(variances.collect())
    }
}

/// The values of some channels.
fn pick(image: &Image, size: [u32; 2], channels: &[String]) -> Result<Vec<f64>, String> {
    if [image.width, image.height] != size {
        let [width, height] = size;
        return Err(format!("{} x {} pixels instead of {width} x {height}", image.width, image.height));
    }
    Ok(image.pick(channels)?.data.into_iter().map(f64::from).collect())
}

/// Number of tiles in a row and in a column.
pub(super) fn tile_grid([width, height]: [u32; 2]) -> [u32; 2] {
    [width.div_ceil(TILE), height.div_ceil(TILE)]
}

/// Pixels of each tile.
pub(super) fn tile_counts([width, height]: [u32; 2]) -> Vec<f64> {
    let [columns, rows] = tile_grid([width, height]);
    let extent = |tile: u32, size: u32| f64::from((size - tile * TILE).min(TILE));
    (0..rows).flat_map(|ty| (0..columns).map(move |tx| extent(tx, width) * extent(ty, height))).collect()
}

/// Means of all tiles, channels interleaved.
fn tile_means(values: &[f64], [width, height]: [u32; 2], channels: usize) -> Vec<f64> {
    let [columns, rows] = tile_grid([width, height]);
    let mut sums = vec![0.0; (columns * rows) as usize * channels];
    for (i, value) in values.iter().enumerate() {
        let (pixel, channel) = (i / channels, i % channels);
        let (x, y) = (pixel as u32 % width, pixel as u32 / width);
        sums[(y / TILE * columns + x / TILE) as usize * channels + channel] += value;
    }
    let counts = tile_counts([width, height]);
    sums.iter().enumerate().map(|(i, sum)| sum / counts[i / channels]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Image {
        let mut image = Image::new(width, height, &["Y"]);
        for i in 0..width * height {
            image.data[i as usize] = value(i % width, i / width);
        }
        image
    }

    #[test]
    fn tiles_cover_the_picture() {
        let passes = [image(11, 9, |x, y| (x * y) as f32), image(11, 9, |x, y| (x + y) as f32)];
        let measured = Measured::of(&passes, &["Y".to_owned()]).unwrap();
        let counts = tile_counts([11, 9]);
        assert_eq!(counts, [64.0, 24.0, 8.0, 3.0]);
        let total: f64 = measured.tile_means().iter().zip(&counts).map(|(m, n)| m * n).sum();
        assert!((total - measured.mean.iter().sum::<f64>()).abs() < 1e-9);
        // The variance of a mean of two passes is the square of half their difference.
        assert_eq!(measured.variance[13], (0.5 * (2.0 - 3.0_f64)).powi(2));
        let [a, b] = [&measured.tiles[0], &measured.tiles[1]];
        let (variance, freedom) = measured.tile_variances(false).unwrap()[1];
        assert!((variance - (0.5 * (a[1] - b[1])).powi(2)).abs() < 1e-12 && freedom == 1.0);
    }

    #[test]
    fn one_noisy_pixel_leaves_a_tile_few_degrees_of_freedom() {
        let flat = image(8, 8, |_, _| 1.0);
        let even = image(8, 8, |x, y| if (x + y) % 2 == 0 { 1.5 } else { 0.5 });
        let spike = image(8, 8, |x, y| if (x, y) == (3, 3) { 99.0 } else { 1.0 });
        let freedom = |other: &Image| {
            let measured = Measured::of(&[flat.clone(), other.clone()], &["Y".to_owned()]).unwrap();
            measured.tile_variances(true).unwrap()[0].1
        };
        assert!((freedom(&even) - 64.0).abs() < 1e-9 && (freedom(&spike) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn values_that_are_not_finite_are_marked() {
        let passes = [image(9, 8, |_, _| 1.0), image(9, 8, |x, _| if x == 8 { f32::INFINITY } else { 1.0 })];
        let measured = Measured::of(&passes, &["Y".to_owned()]).unwrap();
        assert!(measured.mean[8].is_nan() && measured.mean[7] == 1.0);
        assert!(measured.tile_means()[1].is_nan() && measured.tile_means()[0] == 1.0);
        assert!(Measured::of(&passes[..1], &["Y".to_owned()]).is_err());
        assert!(Measured::of(&passes, &["R".to_owned()]).is_err());
    }
}
