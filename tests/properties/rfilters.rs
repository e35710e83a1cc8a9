//! Reconstruction filters: known integrals, symmetry, and nothing beyond the radius.

use crate::support::{assert_every_plugin_is_configured, plugin_of, rfilter};
use lucerna::core::interfaces::Rfilter;
use lucerna::core::scene::ObjectKind;
use std::f64::consts::PI;

/// What a filter claims.
struct Claim {
    xml: String,
    /// ∫ over the support.
    integral: f64,
    /// Σ over the pixels is the integral wherever the sample falls.
    partitions_unity: bool,
}

/// The table: configurations of every filter.
fn claims() -> Vec<Claim> {
    let filter = |plugin: &str, inner: &str, integral, partitions_unity| Claim {
        xml: format!("<rfilter type='{plugin}'>{inner}</rfilter>"),
        integral,
        partitions_unity,
    };
    let float = |name: &str, value: &str| format!("<float name='{name}' value='{value}'/>");
    // A Gauss curve up to four standard deviations, of which 6.334·10⁻⁵ is cut off, less its value there.
    let gaussian = |sigma: f64| sigma * ((2.0 * PI).sqrt() * (1.0 - 6.334_248e-5) - 8.0 * (-8.0f64).exp());
    vec![
        filter("box", "", 1.0, true),
        filter("tent", "", 1.0, true),
        filter("tent", &float("radius", "2.5"), 2.5, false),
        filter("gaussian", "", gaussian(0.5), false),
        filter("gaussian", &float("stddev", "1.25"), gaussian(1.25), false),
        filter("mitchell", "", 1.0, true),
        filter("mitchell", &(float("B", "0.7") + &float("C", "-0.2")), 1.0, true),
        filter("catmullrom", "", 1.0, true),
        // By quadrature in extended precision; for one lobe 2 Si(2π) / π.
        filter("lanczos", "", 0.997_055_3, false),
        filter("lanczos", "<integer name='lobes' value='1'/>", 0.902_823_36, false),
    ]
}

#[test]
fn every_filter_is_configured() {
    let claims = claims();
    assert_every_plugin_is_configured(ObjectKind::Rfilter, claims.iter().map(|c| plugin_of(&c.xml)));
}

/// What is wrong about a filter.
fn mistake(filter: &dyn Rfilter, claim: &Claim) -> Option<String> {
    let (radius, steps) = (filter.radius(), 20_000);
    let step = 2.0 * f64::from(radius) / f64::from(steps);
    let at = |i: i32| -f64::from(radius) + (f64::from(i) + 0.5) * step;
    let integral: f64 = (0..steps).map(|i| f64::from(filter.eval(at(i) as f32)) * step).sum();
    if (integral - claim.integral).abs() > 2e-5 * claim.integral {
        return Some(format!("integral {integral}, not {}", claim.integral));
    }
    for x in (0..200).map(|i| (i as f32 + 0.31) / 200.0 * radius) {
        if filter.eval(x) != filter.eval(-x) {
            return Some(format!("not even at {x}"));
        }
    }
    for x in [radius, radius * 1.01, radius + 1.0, 1e6] {
        // A box holds its left border, so that a sample counts for one pixel.
        if filter.eval(x).abs() > 1e-7 || (!filter.is_box() && filter.eval(-x).abs() > 1e-7) {
            return Some(format!("{} at {x}, beyond the radius", filter.eval(x)));
        }
    }
    for x in (0..100).filter(|_| claim.partitions_unity).map(|i| i as f32 / 100.0) {
        let sum: f32 = (-4..=4).map(|pixel| filter.eval(x + pixel as f32)).sum();
        if (sum - 1.0).abs() > 1e-6 {
            return Some(format!("the weights of a sample at {x} add up to {sum}"));
        }
    }
    (filter.eval(0.0) <= 0.5).then(|| format!("{} in the middle", filter.eval(0.0)))
}

#[test]
fn integral_support_and_symmetry() {
    for claim in claims() {
        let filter = rfilter(&claim.xml);
        assert_eq!(filter.is_box(), plugin_of(&claim.xml) == "box");
        assert_eq!(mistake(&*filter, &claim), None, "{}", claim.xml);
    }
}

/// A right filter that is changed.
struct Changed<'a> {
    right: &'a dyn Rfilter,
    shift: f32,
    factor: f32,
    radius_factor: f32,
}

impl Rfilter for Changed<'_> {
    fn radius(&self) -> f32 {
        self.right.radius() * self.radius_factor
    }

    fn eval(&self, x: f32) -> f32 {
        self.factor * self.right.eval(x - self.shift)
    }
}

#[test]
fn planted_errors_are_found() {
    for claim in claims() {
        let right = rfilter(&claim.xml);
        for (shift, factor, radius_factor) in [(0.01, 1.0, 1.0), (0.0, 1.0001, 1.0), (0.0, 1.0, 0.9)] {
            let wrong = Changed { right: &*right, shift, factor, radius_factor };
            assert!(mistake(&wrong, &claim).is_some(), "{}: {shift} {factor} {radius_factor}", claim.xml);
        }
    }
}
