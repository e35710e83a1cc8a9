//! Every BSDF of the registry with its defaults: its closed form, samples of it, values and densities.

use crate::support::objects::build;
use crate::{INPUTS, group, uniform_pairs};
use criterion::{Criterion, Throughput};
use lucerna::core::interfaces::{Arena, SurfaceHit, Transport};
use lucerna::core::math::Vec3;
use lucerna::core::sampling::warp;
use lucerna::core::scene::{Object, ObjectKind};
use std::hint::black_box;

pub fn all(criterion: &mut Criterion) {
    let mut group = group(criterion, "bsdfs");
    group.throughput(Throughput::Elements(INPUTS as u64));
    let numbers = uniform_pairs();
    let directions: Vec<Vec3> = numbers.iter().map(|u| warp::square_to_cosine_hemisphere(*u)).collect();
    let hit = SurfaceHit::default();
    for plugin in lucerna::builtin().of_kind(ObjectKind::Bsdf) {
        let Object::Bsdf(bsdf) = build(&xml(plugin.name)) else { unreachable!("a BSDF") };
        group.bench_function(format!("{}/resolve", plugin.name), |b| {
            let mut arena = Arena::new();
            b.iter(|| {
                for _ in 0..INPUTS {
                    black_box(bsdf.resolve(black_box(&hit), &arena).lobes());
                    arena.reset();
                }
            });
        });
        let arena = Arena::new();
        let bxdf = bsdf.resolve(&hit, &arena);
        // Each direction and pair of numbers meets one that is far from it in the list, and unrelated.
        let others = || directions.iter().zip(numbers.iter().cycle().skip(INPUTS / 2));
        group.bench_function(format!("{}/sample", plugin.name), |b| {
            b.iter(|| {
                for (wi, u2) in others() {
                    black_box(bxdf.sample(*wi, u2.y, *u2, Transport::Radiance));
                }
            });
        });
        group.bench_function(format!("{}/eval_pdf", plugin.name), |b| {
            b.iter(|| {
                for (wi, wo) in directions.iter().zip(directions.iter().cycle().skip(INPUTS / 2)) {
                    black_box(bxdf.eval_pdf(*wi, *wo, Transport::Radiance));
                }
            });
        });
    }
}

/// The plugin with all defaults, and with what it cannot do without.
fn xml(plugin: &str) -> String {
    let needs = match plugin {
        "twosided" | "mask" => "<bsdf type='roughplastic'/>",
        "blendbsdf" => "<float name='weight' value='0.5'/><bsdf type='diffuse'/><bsdf type='roughconductor'/>",
        "bumpmap" => "<texture type='checkerboard'/><bsdf type='roughplastic'/>",
        "normalmap" => "<rgb name='normalmap' value='0.6 0.5 0.9'/><bsdf type='roughplastic'/>",
        _ => "",
    };
    format!("<bsdf type='{plugin}'>{needs}</bsdf>")
}
