//! ꟻLIP: how different two pictures look to one who flips between them, 0 (not at all) to 1, for every pixel.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "ꟻLIP: A Difference Evaluator for Alternating
//! Images", for pictures that a screen can show; Andersson, Nilsson, Shirley and Akenine-Möller 2021, "Visualizing Errors in
//! Rendered High Dynamic Range Images", for radiance: the largest difference over a range of exposures.
//!
//! | parameter | the papers' value and ours |
//! |---|---|
//! | pixels per degree | 67.02: a screen of 0.7 m and 3840 pixels, seen from 0.7 m |
//! | exponents, and where colour differences are bent | q_c = 0.7, p_c = 0.4, p_t = 0.95 |
//! | width and exponent of features | w = 0.082°, q_f = 0.5 |
//! | tone mapping of radiance | that of ACES (Narkowicz 2016), made 0.6 times as bright |
//! | exposures | from where the brightest pixel maps to 0.85 to where the median does, at most a stop apart |
//!
//! Ours alone: a pixel where either picture is not finite is black in both, and has no value (NaN); of a reference
//! whose median is black, the median of what is not black is taken.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Of the screen that pictures are thought to be seen on: 0.7 m · 3840 / 0.7 m · π / 180°.
const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;
const Q_C: f32 = 0.7;
const P_C: f32 = 0.4;
const P_T: f32 = 0.95;
/// Width of the features that the eye sees, in degrees.
const W: f64 = 0.082;
/// Tone mapping: (c₀x² + c₁x + c₂) / (c₃x² + c₄x + c₅) of a channel, with the factor 0.6 multiplied in.
const ACES: [f64; 6] = [0.36 * 2.51, 0.6 * 0.03, 0.0, 0.36 * 2.43, 0.6 * 0.59, 0.14];
/// What the ends of the range of exposures map to.
const T: f64 = 0.85;
/// Stops from which on a range is cut short: a single lamp in the dark.
const MOST_EXPOSURES: usize = 64;

/// Values of all pixels, row by row, of one channel.
type Plane = Vec<f32>;

/// Two pictures of the same size, each as three planes of radiance.
struct Pair {
    width: usize,
    pictures: [[Plane; 3]; 2],
    /// Pixels where either is not finite.
    broken: Vec<usize>,
}

/// LDR-ꟻLIP of each pixel. `image` and `reference` are linear, channels interleaved (one or three), `width` pixels a row;
/// both are multiplied with `brightness` and cut to [0, 1], as a screen does.
///
/// # Errors
/// If sizes or channels do not fit.
pub fn ldr(
    image: &[f32],
    reference: &[f32],
    channels: usize,
    width: usize,
    brightness: f32,
) -> Result<Vec<f32>, String> {
    let pair = Pair::new(image, reference, channels, width)?;
    let shown = pair.map(|v| (v * brightness).clamp(0.0, 1.0));
    Ok(pair.without_broken(difference(&shown, width)))
}

/// HDR-ꟻLIP of each pixel; arguments as of [`ldr`].
///
/// # Errors
/// If sizes or channels do not fit.
pub fn hdr(image: &[f32], reference: &[f32], channels: usize, width: usize) -> Result<Vec<f32>, String> {
    let pair = Pair::new(image, reference, channels, width)?;
    let mut worst = vec![0.0_f32; pair.pictures[0][0].len()];
    for exposure in exposures(&pair.pictures[1]) {
        let factor = exposure.exp2();
        let c = ACES.map(|c| c as f32);
        let shown = pair.map(|v| {
            let x = v.max(0.0) * factor as f32;
            // Beyond this the square overflows, and the curve is at its end.
            let x = x.min(1e15);
            (((c[0] * x + c[1]) * x + c[2]) / ((c[3] * x + c[4]) * x + c[5])).clamp(0.0, 1.0)
        });
        let found = difference(&shown, width);
        worst.iter_mut().zip(found).for_each(|(worst, found)| *worst = worst.max(found));
    }
    Ok(pair.without_broken(worst))
}

/// Mean over the pixels that have a value.
pub fn mean(map: &[f32]) -> f64 {
    let (sum, count) =
        map.iter().filter(|v| v.is_finite()).fold((0.0, 0_usize), |(s, n), v| (s + f64::from(*v), n + 1));
    if count > 0 { sum / count as f64 } else { f64::NAN }
}

impl Pair {
    fn new(image: &[f32], reference: &[f32], channels: usize, width: usize) -> Result<Self, String> {
        if image.len() != reference.len() || !matches!(channels, 1 | 3) || width == 0 {
            return Err(format!("the picture has {} values, the reference {}", image.len(), reference.len()));
        }
        let pixels = image.len() / channels;
        if pixels == 0 || !pixels.is_multiple_of(width) || pixels * channels != image.len() {
            return Err(format!("{} values are no picture {width} pixels wide", image.len()));
        }
        let finite = |i: &usize| {
            let at = i * channels..(i + 1) * channels;
            image[at.clone()].iter().chain(&reference[at]).all(|v| v.is_finite())
        };
        let broken: Vec<usize> = (0..pixels).filter(|i| !finite(i)).collect();
        let planes = |values: &[f32]| {
            [0, 1, 2].map(|c| {
                let mut plane: Plane = values.iter().skip(c.min(channels - 1)).step_by(channels).copied().collect();
                broken.iter().for_each(|&i| plane[i] = 0.0);
                plane
            })
        };
        let pictures = [planes(image), planes(reference)];
        Ok(Pair { width, pictures, broken })
    }

    /// Both pictures with each value changed.
    fn map(&self, change: impl Fn(f32) -> f32 + Sync) -> [[Plane; 3]; 2] {
        debug_assert!(self.pictures[0][0].len().is_multiple_of(self.width));
        let changed = |plane: &Plane| plane.par_iter().map(|v| change(*v)).collect();
        [0, 1].map(|i| [0, 1, 2].map(|c| changed(&self.pictures[i][c])))
    }

    fn without_broken(&self, mut map: Vec<f32>) -> Vec<f32> {
        self.broken.iter().for_each(|&i| map[i] = f32::NAN);
        map
    }
}

/// Logarithms to the base of two of the exposures at which a picture of radiance is looked at (2021, section 3).
fn exposures([r, g, b]: &[Plane; 3]) -> Vec<f64> {
    let pixels = r.iter().zip(g).zip(b);
    let light = pixels.map(|((r, g), b)| [*r, *g, *b].map(|v| f64::from(v.max(0.0))));
    let mut luminance: Vec<f64> = light.map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b).collect();
    luminance.sort_by(f64::total_cmp);
    let brightest = luminance[luminance.len() - 1];
    let middle = median(&luminance);
    let middle = if middle > 0.0 { middle } else { median(&luminance[luminance.partition_point(|v| *v <= 0.0)..]) };
    if middle <= 0.0 || !brightest.is_finite() {
        return vec![0.0];
    }
    // Where the curve reaches T: the larger root.
    let [a, b, c] = [0, 1, 2].map(|i| ACES[i] - T * ACES[i + 3]);
    let roots = [1.0, -1.0].map(|sign| (-b + sign * (b * b - 4.0 * a * c).sqrt()) / (2.0 * a));
    let reached = roots[0].max(roots[1]);
    let (start, stop) = ((reached / brightest).log2(), (reached / middle).log2());
    let count = ((stop - start).ceil() as usize).clamp(2, MOST_EXPOSURES);
    (0..count).map(|i| start + (stop - start) * i as f64 / (count - 1) as f64).collect()
}

/// Of values that rise; 0 of none.
fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// The difference of two pictures on a screen, linear RGB in [0, 1] (2020, section 4).
fn difference(pictures: &[[Plane; 3]; 2], width: usize) -> Vec<f32> {
    let seen = [0, 1].map(|i| Seen::new(&pictures[i], width));
    let most = most_colour_difference();
    (0..seen[0].edges.len())
        .into_par_iter()
        .map(|i| {
            let colour = bent(hyab(seen[0].lab(i), seen[1].lab(i)).powf(Q_C), most);
            let edges = (seen[0].edges[i] - seen[1].edges[i]).abs();
            let points = (seen[0].points[i] - seen[1].points[i]).abs();
            let features = (edges.max(points) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
            colour.powf(1.0 - features)
        })
        .collect()
}

/// A picture as the eye takes it up.
struct Seen {
    /// Perceived colour after the eye's blur, L\*a\*b\* after Hunt.
    lab: [Plane; 3],
    /// How much of an edge, and of a point, each pixel is.
    edges: Plane,
    points: Plane,
}

impl Seen {
    fn new(rgb: &[Plane; 3], width: usize) -> Self {
        let opponent = recolour(rgb, |rgb| {
            let [x, y, z] = to_xyz(rgb);
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        });
        let blurred = blur_as_the_eye(&opponent, width);
        let to_rgb = from_xyz();
        let lab = recolour(&blurred, |[y, cx, cz]| {
            let y = (y + 16.0) / 116.0;
            hunt_lab(to_rgb([y + cx / 500.0, y, y - cz / 200.0]).map(|v| v.clamp(0.0, 1.0)))
        });
        let brightness: Plane = opponent[0].iter().map(|y| (y + 16.0) / 116.0).collect();
        let [bell, slope, bend] = feature_kernels();
        let strength = |kernel: &[f32]| -> Plane {
            let (across, down) =
                (convolve(&brightness, width, kernel, &bell), convolve(&brightness, width, &bell, kernel));
            across.iter().zip(&down).map(|(a, b)| a.hypot(*b)).collect()
        };
        Seen { lab, edges: strength(&slope), points: strength(&bend) }
    }

    fn lab(&self, i: usize) -> [f32; 3] {
        [0, 1, 2].map(|c| self.lab[c][i])
    }
}

fn recolour([a, b, c]: &[Plane; 3], change: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> [Plane; 3] {
    let changed: Vec<[f32; 3]> = (0..a.len()).into_par_iter().map(|i| change([a[i], b[i], c[i]])).collect();
    [0, 1, 2].map(|channel| changed.iter().map(|v| v[channel]).collect())
}

/// Linear sRGB to XYZ, and XYZ of its white (D65). The fractions are those of the primaries in IEC 61966-2-1.
const XYZ: [[f64; 3]; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_746_782.0, 8_788_810.0 / 73_746_782.0, 70_074_185.0 / 73_746_782.0],
];

/// XYZ over that of white, of linear RGB.
fn to_xyz(rgb: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|row| {
        let white: f64 = XYZ[row].iter().sum();
        let sum: f64 = XYZ[row].iter().zip(rgb).map(|(m, v)| m * f64::from(v)).sum();
        (sum / white) as f32
    })
}

/// Back again.
fn from_xyz() -> impl Fn([f32; 3]) -> [f32; 3] + Sync {
    let rows = XYZ.map(|row| {
        let white: f64 = row.iter().sum();
        row.map(|m| m / white)
    });
    let inverse = DMat3::from_cols_array_2d(&rows).transpose().inverse();
    move |xyz| (inverse * DVec3::from_array(xyz.map(f64::from))).to_array().map(|v| v as f32)
}

/// L\*a\*b\* whose colourfulness falls with the brightness, after Hunt.
fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let bend = |t: f32| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = to_xyz(rgb).map(bend);
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// The distance of Abasi, Amani Tehran and Fairchild 2020: good for large ones.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// The largest colour difference of sRGB, that of green and blue, to the power of [`Q_C`].
fn most_colour_difference() -> f32 {
    hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(Q_C)
}

/// Brings colour differences to [0, 1], small ones stretched: they matter, and large ones are all the same.
fn bent(difference: f32, most: f32) -> f32 {
    let knee = P_C * most;
    let bent = if difference < knee {
        P_T * difference / knee
    } else {
        P_T + (1.0 - P_T) * (difference - knee) / (most - knee)
    };
    bent.clamp(0.0, 1.0)
}

/// Blurs the opponent colours with the eye's contrast sensitivity (2020, section 4.1.1): for each, one or two bells
/// a·√(π/b)·exp(−π²r²/b), r in degrees, all cut at the same distance.
fn blur_as_the_eye([y, cx, cz]: &[Plane; 3], width: usize) -> [Plane; 3] {
    const WIDEST: f64 = 0.04;
    let pi = std::f64::consts::PI;
    let radius = (3.0 * (WIDEST / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let bell = |b: f64| -> Vec<f64> {
        let height = |i: i32| (-(pi * f64::from(i) / PIXELS_PER_DEGREE).powi(2) / b).exp();
        (-radius..=radius).map(height).collect()
    };
    let blur = |plane: &Plane, b: f64| {
        let kernel = normalised(&bell(b));
        convolve(plane, width, &kernel, &kernel)
    };
    // A sum of two: each counts as much as it holds.
    let share = |a: f64, b: f64| a * (pi / b).sqrt() * bell(b).iter().sum::<f64>().powi(2);
    let (narrow, wide) = (share(13.5, 0.025), share(34.1, WIDEST));
    let part = (narrow / (narrow + wide)) as f32;
    let (a, b) = (blur(cz, 0.025), blur(cz, WIDEST));
    let cz = a.iter().zip(&b).map(|(a, b)| part * a + (1.0 - part) * b).collect();
    [blur(y, 0.0047), blur(cx, 0.0053), cz]
}

/// A bell as wide as the features the eye sees, its first derivative, and its second (2020, section 4.2). Of the
/// derivatives, what is positive sums to 1, and what is negative to −1.
fn feature_kernels() -> [Vec<f32>; 3] {
    let sigma = 0.5 * W * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let places = || (-radius..=radius).map(f64::from);
    let bell: Vec<f64> = places().map(|x| (-0.5 * (x / sigma).powi(2)).exp()).collect();
    let balanced = |kernel: Vec<f64>| -> Vec<f32> {
        let sum = |positive: bool| kernel.iter().filter(|v| (**v > 0.0) == positive).sum::<f64>().abs();
        let (above, below) = (sum(true), sum(false));
        kernel.iter().map(|v| (v / if *v > 0.0 { above } else { below }) as f32).collect()
    };
    let slope = balanced(places().zip(&bell).map(|(x, g)| -x * g).collect());
    let bend = balanced(places().zip(&bell).map(|(x, g)| ((x / sigma).powi(2) - 1.0) * g).collect());
    [normalised(&bell), slope, bend]
}

fn normalised(kernel: &[f64]) -> Vec<f32> {
    let sum: f64 = kernel.iter().sum();
    kernel.iter().map(|v| (v / sum) as f32).collect()
}

/// Convolves with a kernel of odd length across and one down. At the border, the outermost pixels go on.
fn convolve(plane: &[f32], width: usize, across: &[f32], down: &[f32]) -> Plane {
    let height = plane.len() / width;
    let mut wide = vec![0.0; plane.len()];
    wide.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        let radius = across.len() / 2;
        let padded: Vec<f32> = (0..width + 2 * radius).map(|i| row[i.saturating_sub(radius).min(width - 1)]).collect();
        for (tap, weight) in across.iter().enumerate() {
            out.iter_mut().zip(&padded[tap..]).for_each(|(sum, v)| *sum += weight * v);
        }
    });
    let mut result = vec![0.0; plane.len()];
    result.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let radius = down.len() / 2;
        for (tap, weight) in down.iter().enumerate() {
            let from = (y + tap).saturating_sub(radius).min(height - 1) * width;
            out.iter_mut().zip(&wide[from..from + width]).for_each(|(sum, v)| *sum += weight * v);
        }
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        (0..40 * 50).map(|i| value(i % 40, i / 40)).collect()
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture = grey(|x, y| (x * y) as f32 * 0.01);
        for map in [ldr(&picture, &picture, 1, 40, 0.3), hdr(&picture, &picture, 1, 40)] {
            assert!(map.unwrap().iter().all(|v| *v == 0.0));
        }
        let black = vec![0.0; 300];
        assert_eq!(mean(&hdr(&black, &black, 3, 10).unwrap()), 0.0);
    }

    /// Black on white is nearly as different as can be; a faint step is not.
    #[test]
    fn differences_are_ordered() {
        let white = grey(|_, _| 1.0);
        let found = [0.9, 0.5, 0.0].map(|v| mean(&ldr(&grey(|_, _| v), &white, 1, 40, 1.0).unwrap()));
        assert!(found[0] > 0.03 && found[0] < found[1] && found[1] < found[2] && found[2] > 0.9, "{found:?}");
        // Lines that are not seen from the distance differ less from grey than those that are.
        let lines =
            |wide: usize| mean(&ldr(&grey(|x, _| ((x / wide) % 2) as f32), &grey(|_, _| 0.5), 1, 40, 1.0).unwrap());
        assert!(lines(1) < lines(5), "{} {}", lines(1), lines(5));
    }

    #[test]
    fn what_is_not_finite_has_no_value() {
        let (mut image, reference) = (grey(|_, _| 0.4), grey(|_, _| 0.4));
        image[3] = f32::NAN;
        image[7] = f32::INFINITY;
        let map = hdr(&image, &reference, 1, 40).unwrap();
        assert!(map[3].is_nan() && map[7].is_nan() && mean(&map) == 0.0);
        for wrong in
            [ldr(&[0.0], &[0.0, 1.0], 1, 1, 1.0), hdr(&[0.0; 6], &[0.0; 6], 2, 1), hdr(&[0.0; 6], &[0.0; 6], 3, 4)]
        {
            assert!(wrong.is_err());
        }
    }

    /// A lamp in the dark: the exposures reach from the one to the other, and one whose median is black has some, too.
    #[test]
    fn exposures_cover_the_range() {
        let planes = |value: &dyn Fn(usize) -> f32| [0, 1, 2].map(|_| (0..101).map(value).collect::<Plane>());
        let found = exposures(&planes(&|i| if i == 0 { 1024.0 } else { 1.0 }));
        assert_eq!(found.len(), 10);
        assert!((found[9] - found[0] - 10.0).abs() < 1e-6, "{found:?}");
        assert_eq!(exposures(&planes(&|i| if i < 3 { 2.0 } else { 0.0 })).len(), 2);
        assert_eq!(exposures(&planes(&|_| 0.0)), [0.0]);
    }
}
