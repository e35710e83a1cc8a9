//! What the properties of all kinds share: objects from XML, random numbers, statistics.

use lucerna::core::interfaces::{Bsdf, Emitter, LightSampler, Rfilter, Sampler, Texture};
use lucerna::core::math::Vec2;
use lucerna::core::sampling::Pcg32;
use lucerna::core::scene::xml::{LoadOptions, load_str};
use lucerna::core::scene::{BuiltShape, NodeId, Object, ObjectKind, Value, build_one, resolve, upgrade};
use lucerna::core::stats::chi2::{Chi2, pearson, sidak};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::path::Path;
use std::sync::Arc;

/// Chance that all tests of one property together are wrong about a renderer that is right.
pub const SIGNIFICANCE: f64 = 0.01;

/// Fails unless the configurations are of all registered plugins of a kind and of no others.
pub fn assert_every_plugin_is_configured<'a>(kind: ObjectKind, configured: impl IntoIterator<Item = &'a str>) {
    let registry = lucerna::builtin();
    let registered: BTreeSet<&str> = registry.of_kind(kind).map(|plugin| plugin.name).collect();
    let configured: BTreeSet<&str> = configured.into_iter().collect();
    let missing: Vec<_> = registered.difference(&configured).collect();
    let unknown: Vec<_> = configured.difference(&registered).collect();
    assert!(missing.is_empty(), "without a configuration in tests/properties: {} {missing:?}", kind.tag());
    assert!(unknown.is_empty(), "configured in tests/properties, but not registered: {} {unknown:?}", kind.tag());
}

/// The name of the plugin that a piece of XML is of: its first `type`.
pub fn plugin_of(xml: &str) -> &str {
    xml.split_once("type='").and_then(|(_, rest)| rest.split_once('\'')).expect("an object").0
}

/// Builds the last object of a piece of XML; those before it may be referred to.
pub fn build(xml: &str) -> Object {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let search_path = ["scenes/tests/assets", "plugins/shapes/golden"].map(|folder| repository.join(folder)).into();
    let options = LoadOptions { search_path, ..LoadOptions::default() };
    let text = format!("<scene version='3.9.1'>{xml}</scene>");
    let described = || {
        let mut description = load_str(&text, "properties", &options)?;
        resolve::resolve(&mut description)?;
        upgrade::upgrade(&mut description);
        let last = description.node(description.root).parameters.iter().rev().find_map(|p| match p.value {
            Value::Object(id) => Some(id),
            _ => None,
        });
        description.root = last.unwrap_or(NodeId(0));
        build_one(&lucerna::builtin(), &description)
    };
    described().unwrap_or_else(|errors| panic!("{xml}: {errors}"))
}

/// An object of one kind from XML.
macro_rules! typed {
    ($name:ident, $variant:ident, $type:ty) => {
        pub fn $name(xml: &str) -> $type {
            match build(xml) {
                Object::$variant(object) => object,
                _ => panic!("{xml}: another kind was asked for"),
            }
        }
    };
}

typed!(bsdf, Bsdf, Arc<dyn Bsdf>);
typed!(texture, Texture, Arc<dyn Texture>);
typed!(built_shape, Shape, BuiltShape);
typed!(rfilter, Rfilter, Arc<dyn Rfilter>);
typed!(sampler, Sampler, Arc<dyn Sampler>);
typed!(light_sampler, LightSampler, Arc<dyn LightSampler>);
typed!(emitter, Emitter, Arc<dyn Emitter>);

/// Two random numbers.
pub fn uniform(pcg: &mut Pcg32) -> Vec2 {
    let x = pcg.next_f32();
    Vec2::new(x, pcg.next_f32())
}

/// Whether all of `f`'s results stand at a family-wise level; the cases run in parallel, and each is deterministic.
pub fn failures<C: Sync>(
    cases: &[C],
    describe: impl Fn(&C) -> String + Sync,
    test: impl Fn(&C) -> Chi2 + Sync,
) -> Vec<String> {
    assert!(!cases.is_empty());
    let level = sidak(SIGNIFICANCE, cases.len());
    cases
        .par_iter()
        .filter_map(|case| {
            let result = test(case);
            (!result.accepts(level)).then(|| format!("{}: {result:?}", describe(case)))
        })
        .collect()
}

/// Whether tests have teeth: `found` tells which of them fail with an error that is planted into something right. With
/// `none` there, none must; of each planted error all must that are listed with it.
pub fn assert_found<E: Copy + Debug, const N: usize>(
    found: impl Fn(E) -> [bool; N],
    none: E,
    planted: &[(E, &[usize])],
) {
    assert_eq!(found(none), [false; N]);
    for (error, by) in planted {
        let found = found(*error);
        assert!(by.iter().all(|test| found[*test]), "{error:?} went unnoticed: {found:?}, not all of {by:?}");
    }
}

/// Fails with what failed.
pub fn assert_none(failures: &[String]) {
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

/// Pearson's test that `count` draws of a cell index are uniform over the cells.
pub fn uniform_over(cells: usize, draws: impl Iterator<Item = usize>) -> Chi2 {
    let mut observed = vec![0u64; cells];
    let mut count = 0.0;
    for cell in draws {
        observed[cell] += 1;
        count += 1.0;
    }
    pearson(&observed, &vec![count / cells as f64; cells])
}

/// The index of the part of [0, 1) that `u` falls in.
pub fn part(u: f32, parts: usize) -> usize {
    ((u * parts as f32) as usize).min(parts - 1)
}

/// Whether two numbers agree relatively.
pub fn close(a: f32, b: f32, relative: f32) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs()) + 1e-9
}

/// χ² of two sets of independent draws over the same cells: are they of one distribution?
pub fn same_distribution(a: &[u64], b: &[u64]) -> Chi2 {
    assert_eq!(a.len(), b.len());
    let [total_a, total_b] = [a, b].map(|counts| counts.iter().sum::<u64>() as f64);
    // Cells pooled by size, the two rows tested as one table: the row totals are given, so one degree of freedom per
    // cell is lost beside the one that `pearson` takes off.
    let mut cells: Vec<(u64, u64)> = a.iter().copied().zip(b.iter().copied()).filter(|(a, b)| a + b > 0).collect();
    cells.sort_unstable_by_key(|(a, b)| a + b);
    let mut pooled: Vec<(u64, u64)> = Vec::new();
    let mut pool = (0, 0);
    for (a, b) in cells {
        pool = (pool.0 + a, pool.1 + b);
        if pool.0 + pool.1 >= 40 {
            pooled.push(std::mem::take(&mut pool));
        }
    }
    let total = total_a + total_b;
    let statistic = pooled
        .iter()
        .map(|(a, b)| {
            let (a, b) = (*a as f64, *b as f64);
            let (ea, eb) = ((a + b) * total_a / total, (a + b) * total_b / total);
            (a - ea).powi(2) / ea + (b - eb).powi(2) / eb
        })
        .sum();
    Chi2::of_statistic(statistic, pooled.len().saturating_sub(1))
}
