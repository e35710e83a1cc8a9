//! Do two renderers make the same picture? Both render it several times with different random numbers; the spread of
//! these passes tells how far apart their means may be.
//!
//! Three tests, since each alone is blind to something: single **pixels** (a wrong texel), means of 8 × 8 **tiles** (a
//! wrong region, too faint to see in one pixel) and the **mean** of the picture (a wrong factor). Each channel is
//! tested for itself, so that energy that moved from one to another is found. The level of a test is shared among its
//! values, and that of the whole among the three tests, after Šidák (1967): a picture that is right fails with at most
//! the chance that was asked for.
//!
//! **Few passes.** The standard error comes from the passes themselves, so that differences follow Student's t and not
//! the normal distribution. Welch's (1947) degrees of freedom are used for the mean. For pixels and tiles, one of the two
//! renderers may happen to have met no light at all in all its passes and to believe that it knows the value
//! exactly. So there the larger of both variances counts, after they have been brought to the same scale by the
//! median of their ratio over the picture. It keeps the degrees of freedom of both together if the scales are within a
//! factor of two (the larger variance is then above the pooled one, which has them), else those of the one it came from.
//!
//! **Heavy tails and fireflies.** Nothing is clipped, dropped or ranked: every sample counts in every mean. A rare
//! bright sample lifts mean and standard error of its pixel alike, to |t| ≈ 1, and raises no alarm. More generally, where
//! both renderers draw from the same distribution in passes of equal length, their difference is symmetric, and for
//! symmetric heavy tails Student's t is conservative (Efron 1969). It cannot hide a bias either: what it
//! costs is sensitivity, and only of the pixel, the tile and the mean it falls into; and [`Comparison::detectable`] tells
//! how large an error of the mean would still have been found. The limit of the method: energy that one
//! renderer carries by paths so rare that none was met in the whole run is not in its variance either, and shows as a
//! difference.

use super::chi2::sidak;
use super::measured::{Measured, TILE, tile_counts, tile_grid};
use super::student::{critical_t, two_sided_p};
use std::fmt;

/// A relative difference this small is no finding, whatever the noise says: it is that of single precision, of a
/// Gaussian filter made of a polynomial (4e-4), of a reference stored with 16 bits.
pub const ROUNDING: f64 = 5e-4;

/// What a test averages over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scale {
    /// Single pixels.
    Pixel,
    /// Tiles of [`TILE`] × [`TILE`] pixels.
    Tile,
    /// The whole picture.
    Mean,
}

impl fmt::Display for Scale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Scale::Pixel => "pixel",
            Scale::Tile => "tile",
            Scale::Mean => "mean",
        })
    }
}

/// One value of a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// Mean of our passes.
    pub ours: f64,
    /// Mean of the reference's.
    pub theirs: f64,
    /// Standard error of their difference.
    pub error: f64,
    /// Degrees of freedom of that.
    pub freedom: f64,
    /// The difference, less what rounding may make of it, in standard errors; positive where ours is brighter.
    pub t: f64,
}

impl Value {
    /// The largest |t| that is told: no number of standard errors, for what has no noise.
    const MOST: f64 = 1e9;

    /// Not compared, because the reference's value is not a finite number.
    const NONE: Value = Value { ours: f64::NAN, theirs: f64::NAN, error: f64::NAN, freedom: 1.0, t: 0.0 };

    fn new(ours: f64, theirs: f64, (variance, freedom): (f64, f64), scale: f64) -> Self {
        if !theirs.is_finite() {
            return Value::NONE;
        }
        if !(ours.is_finite() && variance.is_finite()) {
            return Value { ours, theirs, error: 0.0, freedom, t: Self::MOST };
        }
        let error = variance.sqrt();
        let allowed = ROUNDING * (theirs.abs() + 0.01 * scale);
        let excess = ((ours - theirs).abs() - allowed).max(0.0).copysign(ours - theirs);
        // Without any noise, any difference beyond rounding is one.
        let t = if excess == 0.0 { 0.0 } else { (excess / error.max(1e-30)).clamp(-Self::MOST, Self::MOST) };
        Value { ours, theirs, error, freedom, t }
    }

    /// Chance of a difference at least as large if there is none.
    pub fn p_value(&self) -> f64 {
        two_sided_p(self.t, self.freedom)
    }
}

/// One of the three tests.
#[derive(Clone, Debug)]
pub struct Test {
    /// What it averages over.
    pub scale: Scale,
    /// All values; row-major, channels interleaved.
    pub values: Vec<Value>,
    /// The chance of a false alarm that each single value has.
    pub level: f64,
    /// Values beyond that level, by number.
    pub failed: Vec<usize>,
    /// The least likely value.
    pub worst: usize,
}

impl Test {
    fn new(scale: Scale, values: Vec<Value>, level: f64) -> Self {
        let level = sidak(level, values.len().max(1));
        // Degrees of freedom repeat: the critical value is looked up once for each. They are few for pixels; where
        // they all differ, there are few values.
        let mut known: Vec<(f64, f64)> = Vec::new();
        let mut failed = Vec::new();
        for (i, value) in values.iter().enumerate().filter(|(_, v)| v.t.abs() > 2.0) {
            let critical = match known.iter().rev().take(4).find(|(freedom, _)| *freedom == value.freedom) {
                Some((_, critical)) => *critical,
                None => {
                    known.push((value.freedom, critical_t(level, value.freedom)));
                    known[known.len() - 1].1
                }
            };
            if value.t.abs() >= critical {
                failed.push(i);
            }
        }
        let strength = |i: &usize| (values[*i].t.abs(), std::cmp::Reverse(*i));
        let among = |list: &mut dyn Iterator<Item = usize>| {
            list.max_by(|a, b| strength(a).0.total_cmp(&strength(b).0).then(strength(a).1.cmp(&strength(b).1)))
        };
        let worst = among(&mut failed.iter().copied()).or_else(|| among(&mut (0..values.len()))).unwrap_or(0);
        Test { scale, values, level, failed, worst }
    }

    /// Whether every value agrees.
    pub fn passes(&self) -> bool {
        self.failed.is_empty()
    }

    /// Share of values that agree.
    pub fn share(&self) -> f64 {
        1.0 - self.failed.len() as f64 / self.values.len().max(1) as f64
    }

    /// The least likely value, and the |t| it may have.
    pub fn worst(&self) -> (Value, f64) {
        let value = self.values.get(self.worst).copied().unwrap_or(Value::NONE);
        (value, critical_t(self.level, value.freedom))
    }
}

/// What a comparison found.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Names of the channels.
    pub channels: Vec<String>,
    /// The tests of pixels, tiles and the mean.
    pub tests: [Test; 3],
    /// Variance of our mean over that of the reference's: the median over pixels that have both.
    pub variance_ratio: f64,
    /// Values where the reference is not a finite number, which are left out.
    pub left_out: usize,
}

impl Comparison {
    /// Whether all tests pass.
    pub fn agrees(&self) -> bool {
        self.tests.iter().all(Test::passes)
    }

    /// One of the tests.
    pub fn test(&self, scale: Scale) -> &Test {
        &self.tests[scale as usize]
    }

    /// Difference of the image means relative to the reference's, channels together, and its standard error (channels
    /// taken as if they had the same noise, which they nearly have).
    pub fn mean_difference(&self) -> (f64, f64) {
        let mean = &self.test(Scale::Mean).values;
        let sum = |f: fn(&Value) -> f64| mean.iter().map(f).filter(|v| v.is_finite()).sum::<f64>();
        let theirs = sum(|v| v.theirs);
        let relative = |v: f64| if theirs == 0.0 { 0.0 } else { v / theirs.abs() };
        (relative(sum(|v| v.ours) - theirs), relative(sum(|v| v.error)))
    }

    /// The relative error of the image mean that would have been found with a chance of nine in ten, in the channel
    /// where that is hardest (channels with less than a hundredth of the brightest one's energy aside).
    pub fn detectable(&self) -> f64 {
        const NINE_IN_TEN: f64 = 1.2816;
        let test = self.test(Scale::Mean);
        let brightest = test.values.iter().map(|v| v.theirs.abs()).fold(0.0, f64::max);
        (test.values.iter())
            .filter(|v| v.theirs.abs() > 0.01 * brightest)
            .map(|v| (critical_t(test.level, v.freedom) + NINE_IN_TEN) * v.error / v.theirs.abs() + ROUNDING)
            .fold(0.0, f64::max)
    }

    /// First pixel of a value of a test, and the channel.
    pub fn place(&self, scale: Scale, index: usize) -> ([u32; 2], &str) {
        let (place, channel) = (index / self.channels.len(), index % self.channels.len());
        let cell = |columns: u32| [place as u32 % columns, place as u32 / columns];
        let at = match scale {
            Scale::Pixel => cell(self.size[0]),
            Scale::Tile => cell(tile_grid(self.size)[0]).map(|v| v * TILE),
            Scale::Mean => [0, 0],
        };
        (at, &self.channels[channel])
    }

    /// Whether a second comparison, made with fresh random numbers on both sides, finds any of this one's findings
    /// again: at the same place, with the same sign, at a level shared among these places only. A difference that is
    /// there comes again; one that was chance does not.
    pub fn is_confirmed_by(&self, second: &Comparison, level: f64) -> bool {
        let places = self.tests.iter().map(|test| test.failed.len()).sum::<usize>();
        let level = sidak(level, places.max(1));
        self.tests.iter().any(|test| {
            let again = second.test(test.scale);
            test.failed
                .iter()
                .any(|&i| again.values.get(i).is_some_and(|v| v.t * test.values[i].t > 0.0 && v.p_value() < level))
        })
    }
}

/// Compares two measured pictures; a right one fails with the chance `level`. `independent_pixels`: no sample counts in
/// two pixels, which is so under a box filter.
///
/// # Errors
/// If sizes or channels differ.
pub fn compare(ours: &Measured, theirs: &Measured, independent_pixels: bool, level: f64) -> Result<Comparison, String> {
    if ours.size != theirs.size {
        let ([a, b], [c, d]) = (ours.size, theirs.size);
        return Err(format!("ours has {a} x {b} pixels, the reference {c} x {d}"));
    }
    if ours.channels != theirs.channels || ours.channels.is_empty() {
        return Err(format!("ours has channels {:?}, the reference {:?}", ours.channels, theirs.channels));
    }
    let finite: Vec<f64> = theirs.mean.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    let scale = finite.iter().sum::<f64>() / finite.len().max(1) as f64;
    let ratio = variance_ratio(ours, theirs);
    let level = sidak(level, 3);

    let pixels = (0..ours.mean.len())
        .map(|i| {
            let (a, b) = ((ours.variance[i], ours.freedom()), (theirs.variance[i], theirs.freedom()));
            Value::new(ours.mean[i], theirs.mean[i], larger(a, b, ratio), scale)
        })
        .collect();

    let own = ours.tile_variances(independent_pixels).ok_or("the passes of our picture were not kept")?;
    // Of a stored reference, only the variances of pixels are known. What neighbours that share samples add to the
    // variance of a tile is then taken from ours. (For the mean, it is the same but for a few percent at the edges of tiles.)
    let passes_kept = independent_pixels || theirs.tiles.len() >= 2;
    let other = match theirs.tile_variances(independent_pixels || !passes_kept) {
        Some(other) if passes_kept => other,
        other => {
            let apart = ours.tile_variances(true);
            let (apart, other) = apart.zip(other).ok_or("the passes of the reference were not kept")?;
            let shared = median(own.iter().zip(&apart).map(|(own, apart)| own.0 / apart.0));
            other.into_iter().map(|(variance, freedom)| (variance * shared, freedom)).collect()
        }
    };
    let (a, b) = (ours.tile_means(), theirs.tile_means());
    let tiles: Vec<Value> =
        (0..a.len()).map(|i| Value::new(a[i], b[i], larger(own[i], other[i], ratio), scale)).collect();

    let channels = ours.channels.len();
    let means = (0..channels)
        .map(|channel| {
            let used: Vec<(usize, f64)> = (tile_counts(ours.size).into_iter().enumerate())
                .map(|(tile, count)| (tile * channels + channel, count))
                .filter(|(i, _)| tiles[*i].error.is_finite())
                .collect();
            let average = |means: &[f64]| weighted(&used, |i| means[i]);
            let (va, fa) = mean_variance(ours, &used, &own, independent_pixels);
            let (vb, fb) = mean_variance(theirs, &used, &other, independent_pixels || !passes_kept);
            // Welch (1947).
            let freedom = if va + vb > 0.0 { (va + vb).powi(2) / (va * va / fa + vb * vb / fb) } else { fa + fb };
            Value::new(average(&a), average(&b), (va + vb, freedom), scale)
        })
        .collect();

    let left_out = theirs.mean.iter().filter(|m| !m.is_finite()).count();
    let tests = [(Scale::Pixel, pixels), (Scale::Tile, tiles), (Scale::Mean, means)];
    let tests = tests.map(|(scale, values)| Test::new(scale, values, level));
    Ok(Comparison { size: ours.size, channels: ours.channels.clone(), tests, variance_ratio: ratio, left_out })
}

/// Mean over tiles, each weighted with the pixels it has.
fn weighted(used: &[(usize, f64)], value: impl Fn(usize) -> f64) -> f64 {
    let total: f64 = used.iter().map(|(_, count)| count).sum();
    used.iter().map(|(i, count)| value(*i) * count).sum::<f64>() / total
}

/// Variance of the mean over these tiles, and its degrees of freedom: from the variances of the tiles if pixels are
/// independent, else from the spread over the passes.
fn mean_variance(measured: &Measured, used: &[(usize, f64)], tiles: &[(f64, f64)], independent: bool) -> (f64, f64) {
    if independent {
        let total: f64 = used.iter().map(|(_, count)| count).sum();
        let part = |&(i, count): &(usize, f64)| tiles[i].0 * (count / total).powi(2);
        let variance: f64 = used.iter().map(part).sum();
        let squares: f64 = used.iter().map(|u| part(u).powi(2) / tiles[u.0].1).sum();
        return (variance, if squares > 0.0 { variance * variance / squares } else { measured.freedom() });
    }
    let passes: Vec<f64> = measured.tiles.iter().map(|pass| weighted(used, |i| pass[i])).collect();
    let n = passes.len() as f64;
    let mean = passes.iter().sum::<f64>() / n;
    (passes.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)), n - 1.0)
}

/// Variance of the difference of two means and its degrees of freedom, with the larger of the two variances after
/// scaling: see the head of this file.
fn larger((va, fa): (f64, f64), (vb, fb): (f64, f64), ratio: f64) -> (f64, f64) {
    let (variance, freedom) = if va >= ratio * vb { (va * (1.0 + 1.0 / ratio), fa) } else { (vb * (1.0 + ratio), fb) };
    (variance, if (0.5..=2.0).contains(&ratio) { fa + fb } else { freedom })
}

/// The median of our variances over the reference's; 1 where no value has both.
pub fn variance_ratio(ours: &Measured, theirs: &Measured) -> f64 {
    median(ours.variance.iter().zip(&theirs.variance).map(|(a, b)| a / b))
}

/// The median of those ratios that are neither zero nor infinite; 1 if there are none.
fn median(ratios: impl Iterator<Item = f64>) -> f64 {
    let mut ratios: Vec<f64> = ratios.filter(|r| r.is_finite() && *r > 0.0).collect();
    if ratios.is_empty() {
        return 1.0;
    }
    let middle = ratios.len() / 2;
    *ratios.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::sampling::Pcg32;

    const SIZE: [u32; 2] = [33, 24];
    const PASSES: usize = 16;
    const FEW: u32 = 4;
    const MANY: u32 = 64;

    fn channels() -> Vec<String> {
        ["B", "G", "R"].map(str::to_owned).to_vec()
    }

    /// The picture the noisy ones have as their mean: bright, dark and black parts.
    fn truth(x: u32, y: u32, channel: usize) -> f64 {
        if y == 5 { 0.0 } else { (0.02 + f64::from(x * x) / 500.0) * [0.3, 1.0, 0.7][channel] }
    }

    /// No error planted.
    fn honest(_: u32, _: u32, _: usize) -> f64 {
        1.0
    }

    /// Passes of so many samples with a heavy tail: nine in ten are black or nearly so, one in a thousand is a firefly.
    fn noisy(seed: u64, spp: u32, factor: impl Fn(u32, u32, usize) -> f64) -> Measured {
        let mut random = Pcg32::new(seed, 3);
        let images: Vec<Image> = (0..PASSES)
            .map(|_| {
                let mut image = Image::new(SIZE[0], SIZE[1], &["B", "G", "R"]);
                for i in 0..image.data.len() {
                    let (pixel, channel) = (i as u32 / 3, i % 3);
                    let (x, y) = (pixel % SIZE[0], pixel / SIZE[0]);
                    let sample = |u: f32| match u {
                        u if u < 0.001 => 300.0,
                        u if u < 0.1 => 6.5,
                        _ => 0.06,
                    };
                    let sum: f64 = (0..spp).map(|_| sample(random.next_f32())).sum();
                    image.data[i] = (sum / f64::from(spp) * truth(x, y, channel) * factor(x, y, channel)) as f32;
                }
                image
            })
            .collect();
        Measured::of(&images, &channels()).unwrap()
    }

    /// Two hundred comparisons of a picture with itself, under noise whose standard deviation is ten times the mean.
    #[test]
    fn honest_runs_seldom_fail() {
        for independent in [true, false] {
            let alarms: Vec<Comparison> = (0..200)
                .map(|run| (noisy(2 * run, FEW, honest), noisy(2 * run + 1, FEW, honest)))
                .map(|(a, b)| compare(&a, &b, independent, 0.01).unwrap())
                .filter(|c| !c.agrees())
                .collect();
            // Two are expected; more than six are a chance of 1 in 230.
            assert!(alarms.len() <= 6, "{} alarms", alarms.len());
        }
    }

    #[test]
    fn what_is_planted_is_found() {
        let reference = noisy(1, MANY, honest);
        let found = |scale: Scale, factor: &dyn Fn(u32, u32, usize) -> f64| {
            [true, false].map(|independent| {
                let ours = |seed| noisy(seed, MANY, factor);
                let first = compare(&ours(7), &reference, independent, 0.01).unwrap();
                let second = compare(&ours(9), &noisy(8, MANY, honest), independent, 0.01).unwrap();
                !first.test(scale).passes() && first.is_confirmed_by(&second, 0.01)
            })
        };
        assert_eq!(found(Scale::Mean, &|_, _, c| if c == 1 { 1.1 } else { 1.0 }), [true; 2]);
        assert_eq!(found(Scale::Tile, &|x, y, _| if x / 8 == 3 && y / 8 == 1 { 2.0 } else { 1.0 }), [true; 2]);
        // A row where the reference has no light at all.
        let mut lit = noisy(2, MANY, honest);
        lit.mean[5 * 33 * 3 + 40] = 0.1;
        let comparison = compare(&lit, &reference, true, 0.01).unwrap();
        assert_eq!(comparison.test(Scale::Pixel).failed, [5 * 33 * 3 + 40]);
        assert_eq!(comparison.place(Scale::Pixel, 5 * 33 * 3 + 40), ([13, 5], "G"));
    }

    #[test]
    fn chance_is_not_confirmed() {
        let a = noisy(1, FEW, honest);
        let mut b = noisy(2, FEW, honest);
        b.mean[40] += 100.0 * b.variance[40].max(a.variance[40]).sqrt();
        let first = compare(&a, &b, true, 0.01).unwrap();
        let second = compare(&noisy(3, FEW, honest), &noisy(4, FEW, honest), true, 0.01).unwrap();
        assert!(!first.agrees() && first.is_confirmed_by(&first, 0.01) && !first.is_confirmed_by(&second, 0.01));
    }

    #[test]
    fn values_that_are_not_finite() {
        let good = noisy(1, FEW, honest);
        let mut bad = noisy(2, FEW, honest);
        bad.mean[77] = f64::NAN;
        let comparison = compare(&good, &bad, true, 0.01).unwrap();
        assert!(comparison.agrees() && comparison.left_out == 1 && comparison.mean_difference().0.is_finite());
        assert_eq!(compare(&bad, &good, true, 0.01).unwrap().test(Scale::Pixel).failed, [77]);
    }

    #[test]
    fn a_stored_reference_without_passes_will_do() {
        let ours = noisy(1, FEW, honest);
        let theirs = Measured { tiles: Vec::new(), ..noisy(2, FEW, honest) };
        for independent in [true, false] {
            let comparison = compare(&ours, &theirs, independent, 0.01).unwrap();
            assert!(comparison.agrees() && comparison.detectable() > 0.01, "{}", comparison.detectable());
        }
        assert!(compare(&theirs, &ours, false, 0.01).is_err());
    }
}
