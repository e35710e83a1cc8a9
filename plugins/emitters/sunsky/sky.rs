//! The light of the sky dome, and the sampling of it.

use hw_skymodel::rgb::{Error, SkyParams, SkyState};
use lucerna_core::color::Rgb;
use lucerna_core::math::{Vec2, Vec3, safe_sqrt};
use lucerna_core::sampling::Discrete;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Units of the model's RGB data set to those of the reference renderer: one over the integral of the CIE 1931 ȳ
/// function over wavelength in nm.
const UNITS: f32 = 1.0 / 106.750_26;

/// The dome for one position of the sun (Hosek and Wilkie 2012, "An analytic model for full spectral sky-dome
/// radiance"). Up is +z.
pub struct Sky {
    sun: Vec3,
    /// Parameters A to I of the model (in the order of its data set) for each channel.
    shape: [[f32; 9]; 3],
    /// Radiance scale of each channel.
    scale: [f32; 3],
}

impl Sky {
    /// The sky around a unit direction to the sun above the horizon. Fails if the turbidity is outside [1, 10] or an
    /// albedo outside [0, 1].
    pub fn new(turbidity: f32, albedo: Rgb, sun: Vec3, scale: f32) -> Result<Self, Error> {
        let elevation = (FRAC_PI_2 - 2.0 * (0.5 * (sun - Vec3::Z).length()).min(1.0).asin()).clamp(0.0, FRAC_PI_2);
        let state = SkyState::new(&SkyParams { elevation, turbidity, albedo: albedo.to_array() })?;
        let (shape, radiance) = state.raw();
        Ok(Sky {
            sun,
            shape: std::array::from_fn(|channel| std::array::from_fn(|i| shape[9 * channel + i])),
            scale: radiance.map(|r| r * UNITS * scale),
        })
    }

    /// Radiance from a unit direction above the horizon.
    pub fn radiance(&self, d: Vec3) -> Rgb {
        // From the chord: the arc cosine of a dot product knows nothing of angles near the sun.
        let chord2 = (d - self.sun).length_squared().min(4.0);
        let (gamma, cos_gamma) = (2.0 * (0.5 * chord2.sqrt()).asin(), 1.0 - 0.5 * chord2);
        let (horizon, zenith) = (1.0 / (d.z + 0.01), safe_sqrt(d.z));
        let [r, g, b] = std::array::from_fn(|channel| {
            let [a, b, c, d, e, f, g, i, h] = self.shape[channel];
            let gradation = 1.0 + a * (b * horizon).exp();
            let base = 1.0 + h * h - 2.0 * h * cos_gamma;
            let aureole = (1.0 + cos_gamma * cos_gamma) / (base * safe_sqrt(base));
            let indicatrix = c + d * (e * gamma).exp() + f * cos_gamma * cos_gamma + g * aureole + i * zenith;
            self.scale[channel] * gradation * indicatrix
        });
        Rgb::new(r, g, b)
    }
}

/// Rows of equal height in cos θ, and thus of equal solid angle.
const ROWS: usize = 64;
/// Columns of equal azimuth.
const COLUMNS: usize = 128;
/// Solid angle of a cell.
const CELL: f32 = TAU / (ROWS * COLUMNS) as f32;

/// Directions of the upper hemisphere with a density constant on each cell of a grid over (cos θ, φ), in proportion to
/// the sky's luminance there.
pub struct DomeSampler {
    rows: Discrete,
    columns: Vec<Discrete>,
    /// Per solid angle, by row and column.
    density: Vec<f32>,
    flux: f32,
}

impl DomeSampler {
    /// Tabulates a sky; `None` if it is black.
    pub fn new(sky: &Sky) -> Option<Self> {
        // Four points per cell tell its mean well enough.
        let cell = |row: usize, column: usize| -> f64 {
            let points = [(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)];
            let luminance = |(v, u)| sky.radiance(direction(row as f32 + v, column as f32 + u)).luminance().max(0.0);
            f64::from(points.into_iter().map(luminance).sum::<f32>() / 4.0)
        };
        let mut table: Vec<f64> = (0..ROWS * COLUMNS).map(|i| cell(i / COLUMNS, i % COLUMNS)).collect();
        let mean = table.iter().sum::<f64>() / table.len() as f64;
        // No cell is left out, however dark its four points.
        table.iter_mut().for_each(|w| *w = w.max(0.01 * mean));
        let sum: f64 = table.iter().sum();
        let columns =
            table.chunks(COLUMNS).map(|row| Discrete::new(row.iter().copied())).collect::<Option<Vec<_>>>()?;
        Some(DomeSampler {
            rows: Discrete::new(columns.iter().map(Discrete::sum))?,
            columns,
            density: table.iter().map(|w| (w / sum) as f32 / CELL).collect(),
            flux: mean as f32 * TAU,
        })
    }

    /// The integral of luminance over the hemisphere.
    pub fn flux(&self) -> f32 {
        self.flux
    }

    /// A unit direction above the horizon.
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let (row, v) = self.rows.sample_reuse(u.x);
        let (column, u) = self.columns[row as usize].sample_reuse(u.y);
        direction(row as f32 + v, column as f32 + u)
    }

    /// Density of [`sample`](Self::sample) per solid angle.
    pub fn pdf(&self, d: Vec3) -> f32 {
        if d.z < 0.0 {
            return 0.0;
        }
        let row = ((d.z * ROWS as f32) as usize).min(ROWS - 1);
        let turn = d.y.atan2(d.x) / TAU;
        let column = ((turn - turn.floor()) * COLUMNS as f32) as usize;
        self.density[row * COLUMNS + column.min(COLUMNS - 1)]
    }
}

/// The direction at fractional grid coordinates.
fn direction(row: f32, column: f32) -> Vec3 {
    let z = row / ROWS as f32;
    let r = safe_sqrt(1.0 - z * z);
    let (sin, cos) = (TAU * column / COLUMNS as f32).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::*;

    fn sun_at(elevation: f32) -> Vec3 {
        let (sin, cos) = elevation.to_radians().sin_cos();
        Vec3::new(cos, 0.0, sin)
    }

    #[test]
    fn agrees_with_the_reference() {
        let mut worst = 0f32;
        for (t, turbidity) in golden::TURBIDITIES.into_iter().enumerate() {
            for (a, [r, g, b]) in golden::ALBEDOS.into_iter().enumerate() {
                for (e, elevation) in golden::ELEVATIONS.into_iter().enumerate() {
                    let sky = Sky::new(turbidity, Rgb::new(r, g, b), sun_at(elevation), 1.0).unwrap();
                    for (i, expected) in golden::SKY[t][a][e].iter().enumerate() {
                        let z = (i as f32 + 0.5) / 20.0;
                        let (sin, cos) = (2.399963 * i as f32).sin_cos();
                        let r = safe_sqrt(1.0 - z * z);
                        let found = sky.radiance(Vec3::new(r * cos, r * sin, z)).to_array();
                        for (f, x) in found.into_iter().zip(expected) {
                            worst = worst.max((f / x - 1.0).abs());
                        }
                    }
                }
            }
        }
        assert!(worst < 2e-5, "{worst}");
    }

    #[test]
    fn turbidity_and_albedo_have_limits() {
        for (turbidity, albedo) in [(0.9, 0.5), (10.1, 0.5), (3.0, 1.1), (3.0, -0.1)] {
            assert!(Sky::new(turbidity, Rgb::splat(albedo), Vec3::Z, 1.0).is_err());
        }
    }

    #[test]
    fn density_of_the_dome_integrates_to_one_and_is_that_of_the_samples() {
        let sky = Sky::new(3.0, Rgb::splat(0.3), sun_at(30.0), 1.0).unwrap();
        let dome = DomeSampler::new(&sky).unwrap();
        assert!((dome.density.iter().sum::<f32>() * CELL - 1.0).abs() < 1e-4);
        // χ² over 16 × 16 blocks of cells against their probabilities.
        let n = 256;
        let (mut seen, mut expected) = (vec![0f64; 256], vec![0f64; 256]);
        for i in 0..n * n {
            let d = dome.sample(Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32));
            assert!((d.length() - 1.0).abs() < 1e-5 && dome.pdf(d) > 0.0);
            let turn = d.y.atan2(d.x) / TAU;
            let (row, column) = ((d.z * 16.0) as usize, ((turn - turn.floor()) * 16.0) as usize);
            seen[row.min(15) * 16 + column.min(15)] += 1.0;
        }
        for (i, density) in dome.density.iter().enumerate() {
            let (row, column) = (i / COLUMNS * 16 / ROWS, i % COLUMNS * 16 / COLUMNS);
            expected[row * 16 + column] += f64::from(density * CELL) * (n * n) as f64;
        }
        let chi: f64 = seen.iter().zip(&expected).map(|(s, e)| (s - e).powi(2) / e).sum();
        assert!(chi < 300.0, "χ² {chi} with 255 degrees of freedom");
    }

    #[test]
    fn flux_is_the_integral_of_luminance() {
        let sky = Sky::new(4.0, Rgb::splat(0.3), sun_at(50.0), 2.0).unwrap();
        let n = 400;
        let sum: f64 = (0..n * n)
            .map(|i| {
                let (row, column) = ((i / n) as f32 + 0.5, (i % n) as f32 + 0.5);
                f64::from(
                    sky.radiance(direction(row * ROWS as f32 / n as f32, column * COLUMNS as f32 / n as f32))
                        .luminance(),
                )
            })
            .sum();
        let exact = sum * f64::from(TAU) / f64::from(n * n);
        assert!((f64::from(DomeSampler::new(&sky).unwrap().flux()) / exact - 1.0).abs() < 2e-3);
    }
}
