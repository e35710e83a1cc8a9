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
