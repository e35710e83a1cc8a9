//! Student's t: how unlikely a difference is whose standard error was itself measured from few passes.

/// Chance of a |t| at least as large with `freedom` degrees of freedom (which need not be whole) if there is no
/// difference: the regularised incomplete beta function I(ν / (ν + t²); ν/2, 1/2). 0 for infinite and NaN `t`.
pub fn two_sided_p(t: f64, freedom: f64) -> f64 {
    let square = t * t;
    if !square.is_finite() {
        return 0.0;
    }
    let x = freedom / (freedom + square);
    let (a, b) = (0.5 * freedom, 0.5);
    // 1 − x as a quotient of its own: it may be far below the rounding of x.
    let rest = square / (freedom + square);
    if rest == 0.0 {
        return 1.0;
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * rest.ln()).exp();
    // The continued fraction converges fast on this side of the mean of the beta distribution.
    let p = if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(x, a, b) / a
    } else {
        1.0 - front * beta_fraction(rest, b, a) / b
    };
    p.clamp(0.0, 1.0)
}

/// The |t| that is reached or exceeded with the chance `p` in (0, 1): the inverse of [`two_sided_p`], to 1e-9 relative.
pub fn critical_t(p: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while two_sided_p(high, freedom) > p && high < 1e12 {
        (low, high) = (high, 2.0 * high);
    }
    while high - low > 1e-9 * high {
        let middle = 0.5 * (low + high);
        if two_sided_p(middle, freedom) > p {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The continued fraction of the incomplete beta function (DLMF 8.17.22), by Lentz's algorithm. It needs about
/// √max(a, b) steps.
fn beta_fraction(x: f64, a: f64, b: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let away_from_zero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut h = d;
    for m in 1..100_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / away_from_zero(1.0 + even * d);
        c = away_from_zero(1.0 + even / c);
        h *= c * d;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away_from_zero(1.0 + odd * d);
        c = away_from_zero(1.0 + odd / c);
        h *= c * d;
        if (c * d - 1.0).abs() < 1e-14 {
            break;
        }
    }
    h
}

/// ln Γ(x) for x > 0 by Stirling's series (DLMF 5.11.1), after the recurrence has made x large: to about 1e-14.
fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 12.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    let series = (1.0 / 12.0 + y * (-1.0 / 360.0 + y * (1.0 / 1260.0 + y * (-1.0 / 1680.0 + y / 1188.0)))) / x;
    shift + (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of published tables, two-sided.
    #[test]
    fn tabulated_quantiles() {
        for (freedom, p, t) in [
            (1.0, 0.05, 12.706),
            (1.0, 0.5, 1.0),
            (7.0, 0.01, 3.499),
            (15.0, 0.001, 4.073),
            (30.0, 0.05, 2.042),
            (30.0, 0.001, 3.646),
            (120.0, 0.01, 2.617),
            (1e6, 0.05, 1.960),
        ] {
            assert!((critical_t(p, freedom) - t).abs() < 6e-4, "{freedom} {p}: {}", critical_t(p, freedom));
        }
    }

    /// With 1 and 2 degrees of freedom there are closed forms, also far out in the tails.
    #[test]
    fn closed_forms() {
        for t in [1e-6_f64, 0.1, 1.0, 7.0, 1e3, 1e6] {
            let one = 1.0 - t.atan() * std::f64::consts::FRAC_2_PI;
            let two = 1.0 - t / (2.0 + t * t).sqrt();
            assert!((two_sided_p(t, 1.0) - one).abs() < 1e-12, "{t}");
            assert!((two_sided_p(t, 2.0) - two).abs() < 1e-12, "{t}");
        }
        // 1 − t/√(2 + t²) ≈ 1/t² far out.
        assert!((two_sided_p(1e8, 2.0) / 1e-16 - 1.0).abs() < 1e-6);
        assert_eq!((two_sided_p(0.0, 5.0), two_sided_p(f64::INFINITY, 5.0)), (1.0, 0.0));
        assert_eq!((two_sided_p(1e200, 5.0), two_sided_p(f64::NAN, 5.0)), (0.0, 0.0));
    }
}
