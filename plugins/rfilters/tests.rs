use crate::testing::Draft;
use lucerna_core::interfaces::Rfilter;
use lucerna_core::scene::{Object, ObjectKind};
use std::sync::Arc;

fn filter(plugin: &str) -> Arc<dyn Rfilter> {
    match Draft::new(ObjectKind::Rfilter, plugin).build() {
        Ok(Object::Rfilter(filter)) => filter,
        _ => panic!("{plugin} does not build"),
    }
}

fn integral(filter: &dyn Rfilter) -> f64 {
    let (radius, steps) = (f64::from(filter.radius()), 20_000);
    let step = 2.0 * radius / f64::from(steps);
    (0..steps).map(|i| f64::from(filter.eval((-radius + (f64::from(i) + 0.5) * step) as f32)) * step).sum()
}

#[test]
fn integrals_are_known() {
    // ∫ exp(−2x²) over [−2, 2] is √(π/2) erf(2√2), less the offset times the width.
    let gaussian = (std::f64::consts::PI / 2.0).sqrt() * 0.999_936_657_5 - 4.0 * (-8.0f64).exp();
    // ∫ sinc(x) sinc(x/3) over [−3, 3], by quadrature in extended precision.
    let expected = [
        ("box", 1.0),
        ("tent", 1.0),
        ("gaussian", gaussian),
        ("mitchell", 1.0),
        ("catmullrom", 1.0),
        ("lanczos", 0.997_055_3),
    ];
    for (plugin, value) in expected {
        let found = integral(&*filter(plugin));
        assert!((found - value).abs() < 2e-5, "{plugin}: {found} instead of {value}");
    }
}

#[test]
fn even_and_zero_outside() {
    for plugin in ["tent", "gaussian", "mitchell", "catmullrom", "lanczos"] {
        let filter = filter(plugin);
        for x in [0.0, 0.3, 0.9, 1.4, 1.99] {
            assert_eq!(filter.eval(x), filter.eval(-x), "{plugin}({x})");
        }
        for x in [filter.radius(), filter.radius() * 1.01, 100.0] {
            assert!(filter.eval(x).abs() < 1e-7, "{plugin}({x})");
        }
        assert!(filter.eval(0.0) > 0.8, "{plugin}");
    }
}

#[test]
fn interpolating_filters_vanish_at_other_pixels() {
    for plugin in ["catmullrom", "lanczos", "tent"] {
        let filter = filter(plugin);
        assert_eq!(filter.eval(0.0), 1.0);
        assert!((1..=3).all(|x| filter.eval(x as f32).abs() < 1e-6), "{plugin}");
    }
}

/// Filter, distance, value of the reference renderer; its `gaussian` is a polynomial good to 4e-4 only.
const GOLDEN: [(&str, f32, f32); 7] = [
    ("mitchell", 0.0, 0.888_888_95),
    ("mitchell", 0.25, 0.782_118_1),
    ("mitchell", 1.5, -0.034_722_1),
    ("catmullrom", 0.75, 0.226_562_5),
    ("catmullrom", 1.5, -0.0625),
    ("lanczos", 0.25, 0.890_067_04),
    ("lanczos", 1.5, -0.135_094_91),
];

#[test]
fn as_the_reference() {
    for (plugin, x, value) in GOLDEN {
        let found = filter(plugin).eval(x);
        assert!((found - value).abs() < 1e-6, "{plugin}({x}) = {found}, not {value}");
    }
}

#[test]
fn senseless_parameters_are_refused() {
    assert!(Draft::new(ObjectKind::Rfilter, "gaussian").float("stddev", 0.0).errors().contains("stddev"));
    assert!(Draft::new(ObjectKind::Rfilter, "tent").float("radius", -1.0).errors().contains("radius"));
    assert!(Draft::new(ObjectKind::Rfilter, "lanczos").int("lobes", 0).errors().contains("lobes"));
}
