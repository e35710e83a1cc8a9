//! Sample for sample: two pictures made with the same random numbers in the same order have the same noise, and
//! what Monte Carlo noise hides shows in single pixels.

use crate::image::Image;

/// How two such pictures agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Share of pixels whose channels all agree.
    pub share: f64,
    /// The largest relative difference.
    pub worst: f32,
    /// The pixel that has it.
    pub worst_pixel: [u32; 2],
}

/// Relative difference that counts as the same: paths are the same, their arithmetic is not in the last bits.
pub const TOLERANCE: f32 = 1e-3;

/// Share of pixels that must agree: a few paths fork on the last bit.
pub const SHARE: f64 = 0.99;

/// The relative difference of a value, with a floor below a thousandth of the picture's mean.
pub fn relative_difference(ours: f32, theirs: f32, scale: f32) -> f32 {
    (ours - theirs).abs() / theirs.abs().max(1e-3 * scale).max(1e-12)
}

/// The mean of the absolute values of a picture.
pub fn scale(image: &Image) -> f32 {
    image.data.iter().map(|v| v.abs()).sum::<f32>() / image.data.len().max(1) as f32
}

/// Compares the given channels of two pictures.
///
/// # Errors
/// If sizes differ or a channel is missing.
pub fn agreement(ours: &Image, theirs: &Image, channels: &[String], tolerance: f32) -> Result<Agreement, String> {
    if [ours.width, ours.height] != [theirs.width, theirs.height] {
        return Err(format!(
            "ours has {} x {} pixels, the reference {} x {}",
            ours.width, ours.height, theirs.width, theirs.height
        ));
    }
    let pairs: Vec<(usize, usize)> = (channels.iter())
        .map(|name| {
            ours.channel(name).zip(theirs.channel(name)).ok_or_else(|| format!("channel \"{name}\" is missing"))
        })
        .collect::<Result<_, _>>()?;
    if pairs.is_empty() {
        return Err("there is no channel to compare".to_owned());
    }
    let scale = scale(theirs);
    let (mut good, mut worst, mut worst_pixel) = (0_u32, 0.0, [0, 0]);
    for y in 0..ours.height {
        for x in 0..ours.width {
            let (a, b) = (ours.pixel(x, y), theirs.pixel(x, y));
            // NaN, which `max` would drop, is a difference.
            let differences = pairs.iter().map(|&(i, j)| relative_difference(a[i], b[j], scale));
            let error = differences.fold(0.0, |e: f32, d| if d.is_nan() { f32::INFINITY } else { e.max(d) });
            good += u32::from(error <= tolerance);
            if error > worst {
                (worst, worst_pixel) = (error, [x, y]);
            }
        }
    }
    let share = f64::from(good) / (f64::from(ours.width) * f64::from(ours.height)).max(1.0);
    Ok(Agreement { share, worst, worst_pixel })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_counted() {
        let channels = ["Y".to_owned()];
        let mut a = Image::new(4, 5, &["Y"]);
        a.data.fill(1.0);
        let mut b = a.clone();
        assert_eq!(agreement(&a, &b, &channels, TOLERANCE).unwrap().share, 1.0);
        b.data[6] = 1.5;
        b.data[7] = 1.0005;
        let found = agreement(&a, &b, &channels, TOLERANCE).unwrap();
        assert_eq!((found.share, found.worst_pixel), (0.95, [2, 1]));
        a.data[0] = f32::NAN;
        assert_eq!(agreement(&a, &b, &channels, TOLERANCE).unwrap().worst_pixel, [0, 0]);
        assert!(agreement(&a, &b, &["Z".to_owned()], TOLERANCE).is_err());
    }
}
