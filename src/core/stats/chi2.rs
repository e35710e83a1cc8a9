//! Pearson's χ² test: do samples follow the density that is claimed for them?
//!
//! Directions are counted in a grid over the sphere, and the claimed density is integrated over the same cells, finer
//! where it is steep. One more cell holds the samples that gave no direction: it takes the rest of the probability,
//! so that a density that does not add up is found too.

use crate::math::Vec3;
use std::f64::consts::{PI, TAU};

/// What a test found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chi2 {
    /// Σ (observed − expected)² / expected.
    pub statistic: f64,
    /// Number of pooled cells less one.
    pub degrees_of_freedom: usize,
    /// Chance of a statistic at least as large if the claim is true.
    pub p_value: f64,
}

impl Chi2 {
    /// Of a statistic with so many degrees of freedom. With none, a single cell held all: it must hold what was expected.
    pub fn of_statistic(statistic: f64, degrees_of_freedom: usize) -> Self {
        let p_value = match degrees_of_freedom {
            0 => f64::from(u8::from(statistic < 1.0)),
            k => upper_tail(statistic, k),
        };
        Chi2 { statistic, degrees_of_freedom, p_value }
    }

    /// Whether the claim stands at a level of significance.
    pub fn accepts(&self, significance: f64) -> bool {
        self.p_value > significance
    }
}

/// The level each of `tests` independent tests must be made at for all together to err with the chance
/// `significance` (Šidák 1967).
pub fn sidak(significance: f64, tests: usize) -> f64 {
    1.0 - (1.0 - significance).powf(1.0 / tests as f64)
}

/// Pearson's test of counts against expected counts. Cells expected to hold fewer than five are pooled.
///
/// # Panics
/// If the slices differ in length.
pub fn pearson(observed: &[u64], expected: &[f64]) -> Chi2 {
    assert_eq!(observed.len(), expected.len());
    let mut cells: Vec<(f64, u64)> = expected.iter().copied().zip(observed.iter().copied()).collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));

    let (mut statistic, mut count) = (0.0, 0usize);
    let mut pool = (0.0, 0u64);
    let last = cells.len().saturating_sub(1);
    for (i, (expected, observed)) in cells.into_iter().enumerate() {
        pool = (pool.0 + expected, pool.1 + observed);
        if pool.0 >= 5.0 || i == last {
            // What nothing was expected of, and nothing was found in, says nothing.
            if pool.0 > 0.0 || pool.1 > 0 {
                statistic += (pool.1 as f64 - pool.0).powi(2) / pool.0.max(1e-12);
                count += 1;
            }
            pool = (0.0, 0);
        }
    }
    Chi2::of_statistic(statistic, count.saturating_sub(1))
}

/// [`pearson`] for `samples` draws that may give nothing: the last count is of those, and is expected to be the rest. Cells
/// that together hold more than all, by a thousandth that is granted to quadrature, are rejected.
///
/// # Panics
/// Unless there is one count more than expected ones.
pub fn pearson_with_rest(observed: &[u64], mut expected: Vec<f64>, samples: usize) -> Chi2 {
    let n = samples as f64;
    let rest = n - expected.iter().sum::<f64>();
    if rest.is_nan() || rest < -1e-3 * n {
        return Chi2 { statistic: f64::INFINITY, degrees_of_freedom: expected.len(), p_value: 0.0 };
    }
    expected.push(rest.max(0.0));
    pearson(observed, &expected)
}

/// A grid over the sphere with cells of equal solid angle: `rings` over cos θ, `spokes` over φ.
#[derive(Clone, Copy, Debug)]
pub struct SphereGrid {
    /// Cells over cos θ; an even number keeps the horizon on an edge.
    pub rings: usize,
    /// Cells over φ.
    pub spokes: usize,
}

impl SphereGrid {
    /// The cell of a unit direction.
    pub fn cell(&self, d: Vec3) -> usize {
        let ring = ((f64::from(d.z) + 1.0) * 0.5 * self.rings as f64) as usize;
        let turn = f64::from(d.y).atan2(f64::from(d.x)) / TAU;
        let spoke = ((if turn < 0.0 { turn + 1.0 } else { turn }) * self.spokes as f64) as usize;
        ring.min(self.rings - 1) * self.spokes + spoke.min(self.spokes - 1)
    }

    /// The integral of a density per solid angle over each cell, finer where
    /// halving a part of a cell changes its integral by more than `tolerance`.
    pub fn integrate(&self, pdf: impl Fn(Vec3) -> f32, tolerance: f64) -> Vec<f64> {
        // Integrated over (θ, φ): the poles, where many cells meet, are seen as finely as the rest.
        let density = |theta: f64, phi: f64| {
            let (sin_theta, cos_theta) = theta.sin_cos();
            let d = [sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta];
            f64::from(pdf(Vec3::from_array(d.map(|v| v as f32)))) * sin_theta
        };
        let edge = |ring: usize| (2.0 * ring as f64 / self.rings as f64 - 1.0).acos();
        let dphi = TAU / self.spokes as f64;
        let mut cells = Vec::with_capacity(self.rings * self.spokes);
        for ring in 0..self.rings {
            for spoke in 0..self.spokes {
                let (theta, phi) = (edge(ring + 1), spoke as f64 * dphi);
                let cell = Cell { theta, phi, dtheta: edge(ring) - theta, dphi };
                // Some splits in any case, so that nothing narrow is overlooked between the nodes; slabs at the
                // horizon, near which densities break off.
                let at_horizon = ring == self.rings / 2 || ring + 1 == self.rings / 2;
                let parts = cell.split(if at_horizon { 16 } else { 2 }, 2);
                cells.push(parts.map(|part| part.integrate(&density, part.gauss(&density), tolerance, 0)).sum());
            }
        }
        cells
    }

    /// Tests `samples` calls of `sample`, which gives a direction or nothing, against `pdf`.
    pub fn test(&self, samples: usize, mut sample: impl FnMut() -> Option<Vec3>, pdf: impl Fn(Vec3) -> f32) -> Chi2 {
        let n = samples as f64;
        let mut expected = self.integrate(pdf, 0.02 / n);
        expected.iter_mut().for_each(|e| *e *= n);
        let mut observed = vec![0u64; expected.len() + 1];
        let nothing = expected.len();
        for _ in 0..samples {
            observed[sample().map_or(nothing, |d| self.cell(d))] += 1;
        }
        pearson_with_rest(&observed, expected, samples)
    }
}

/// A rectangle in (θ, φ).
#[derive(Clone, Copy)]
struct Cell {
    theta: f64,
    phi: f64,
    dtheta: f64,
    dphi: f64,
}

impl Cell {
    const MAX_DEPTH: u32 = 6;

    /// Parts of equal size: so many over θ, so many over φ.
    fn split(self, thetas: usize, phis: usize) -> impl Iterator<Item = Cell> {
        let (dtheta, dphi) = (self.dtheta / thetas as f64, self.dphi / phis as f64);
        (0..thetas * phis).map(move |i| Cell {
            theta: self.theta + (i / phis) as f64 * dtheta,
            phi: self.phi + (i % phis) as f64 * dphi,
            dtheta,
            dphi,
        })
    }

    /// Gauss's rule with 4 × 4 nodes.
    fn gauss(&self, f: &impl Fn(f64, f64) -> f64) -> f64 {
        const NODES: [(f64, f64); 4] = [
            (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
            (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
            (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
            (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
        ];
        let mut sum = 0.0;
        for (x, wx) in NODES {
            for (y, wy) in NODES {
                sum += wx * wy * f(self.theta + x * self.dtheta, self.phi + y * self.dphi);
            }
        }
        sum * self.dtheta * self.dphi
    }

    /// Whether a density is zero in a corner but not at the node next to it, or the other way round.
    fn breaks_off(&self, f: &impl Fn(f64, f64) -> f64) -> bool {
        let is_zero = |x: f64, y: f64| f(self.theta + x * self.dtheta, self.phi + y * self.dphi) == 0.0;
        [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].into_iter().any(|(x, y)| {
            let inside = |corner: f64, by: f64| corner + by * (1.0 - 2.0 * corner);
            is_zero(inside(x, 0.002), inside(y, 0.002)) != is_zero(inside(x, 0.07), inside(y, 0.07))
        })
    }

    /// Splits until halving the cell changes no more than the tolerance, or the cell is as small as it gets.
    fn integrate(&self, f: &impl Fn(f64, f64) -> f64, coarse: f64, tolerance: f64, depth: u32) -> f64 {
        let mut parts = [(*self, 0.0); 4];
        for (part, quarter) in parts.iter_mut().zip(self.split(2, 2)) {
            *part = (quarter, quarter.gauss(f));
        }
        let fine: f64 = parts.iter().map(|(_, value)| value).sum();
        // Not for NaN. A density that breaks off between the outermost nodes and the corners changes nothing yet.
        let refine = (fine - coarse).abs() > tolerance || self.breaks_off(f);
        if !refine || depth >= Self::MAX_DEPTH {
            return fine;
        }
        parts.iter().map(|(part, value)| part.integrate(f, *value, tolerance, depth + 1)).sum()
    }
}

/// Chance that a χ² variable of `k` ≥ 1 degrees of freedom exceeds `x`: the regularised incomplete gamma function
/// Q(k/2, x/2), by its series or its continued fraction, whichever converges.
fn upper_tail(x: f64, k: usize) -> f64 {
    let (a, x) = (k as f64 / 2.0, x / 2.0);
    if x.is_nan() || x == f64::INFINITY {
        return 0.0;
    }
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma_half(k)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        (1.0 - front * sum).clamp(0.0, 1.0)
    } else {
        // Lentz's algorithm.
        let mut b = x + 1.0 - a;
        let (mut c, mut d) = (1e300, 1.0 / b);
        let mut h = d;
        for i in 1..10_000 {
            let i = f64::from(i);
            let numerator = -i * (i - a);
            b += 2.0;
            d = 1.0 / (numerator * d + b);
            c = b + numerator / c;
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-15 {
                break;
            }
        }
        (front * h).clamp(0.0, 1.0)
    }
}

/// `ln Γ(k/2)` by the recurrence from Γ(1/2) = √π or Γ(1) = 1.
fn ln_gamma_half(k: usize) -> f64 {
    let start = if k % 2 == 1 { 0.5 * PI.ln() } else { 0.0 };
    let first = if k % 2 == 1 { 1 } else { 2 };
    (first..k).step_by(2).map(|j| (j as f64 / 2.0).ln()).sum::<f64>() + start
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;
    use crate::sampling::{Pcg32, warp};

    /// Quantiles of published tables: 95 % and 99 %.
    #[test]
    fn tabulated_tails() {
        for (k, q95, q99) in [(1, 3.841, 6.635), (2, 5.991, 9.210), (10, 18.307, 23.209), (100, 124.342, 135.807)] {
            assert!((upper_tail(q95, k) - 0.05).abs() < 1e-4, "{k}");
            assert!((upper_tail(q99, k) - 0.01).abs() < 1e-4, "{k}");
        }
        assert_eq!(upper_tail(0.0, 3), 1.0);
        assert!(upper_tail(1e6, 3) < 1e-300);
    }

    #[test]
    fn accepts_the_truth_and_rejects_a_near_miss() {
        let mut pcg = Pcg32::new(7, 1);
        let mut u = || Vec2::new(pcg.next_f32(), pcg.next_f32());
        let grid = SphereGrid { rings: 20, spokes: 40 };
        let mut sample = || Some(warp::square_to_cosine_hemisphere(u()));
        let truth = grid.test(100_000, &mut sample, warp::cosine_hemisphere_pdf);
        assert!(truth.accepts(0.01), "{truth:?}");
        let tilted = grid.test(100_000, &mut sample, |d| warp::cosine_hemisphere_pdf(d) * (1.0 + 0.05 * d.x));
        assert!(!tilted.accepts(0.01), "{tilted:?}");
        let too_little = grid.test(100_000, &mut sample, |d| 0.97 * warp::cosine_hemisphere_pdf(d));
        assert!(!too_little.accepts(0.01), "{too_little:?}");
        let too_much = grid.test(100_000, &mut sample, |d| 1.002 * warp::cosine_hemisphere_pdf(d));
        assert!(!too_much.accepts(0.01), "{too_much:?}");
        let half = grid.test(
            100_000,
            || sample().filter(|d| d.x > 0.0),
            |d| {
                if d.x > 0.0 { warp::cosine_hemisphere_pdf(d) } else { 0.0 }
            },
        );
        assert!(half.accepts(0.01), "{half:?}");
    }

    #[test]
    fn integrates_narrow_peaks() {
        let grid = SphereGrid { rings: 20, spokes: 40 };
        let axis = Vec3::new(0.3, -0.5, 0.81).normalize();
        // A von Mises–Fisher lobe about 0.03 wide; its density adds up to 1.
        let kappa = 1000.0f32;
        let pdf = |d: Vec3| kappa / std::f32::consts::TAU * (kappa * (d.dot(axis) - 1.0)).exp();
        let sum: f64 = grid.integrate(pdf, 1e-7).iter().sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    }

    #[test]
    fn sidak_levels() {
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-12);
        assert!((1.0 - (1.0 - sidak(0.01, 300)).powi(300) - 0.01).abs() < 1e-9);
    }
}
