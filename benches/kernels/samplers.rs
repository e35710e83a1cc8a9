//! Every sampler of the registry: the numbers of all samples of a pixel, as a path of some bounces draws them.

use crate::group;
use crate::support::objects::build;
use criterion::{Criterion, Throughput};
use lucerna::core::interfaces::stream;
use lucerna::core::math::UVec2;
use lucerna::core::scene::{Object, ObjectKind};
use std::hint::black_box;

/// Vertices of the path; at each, two pairs and two singles are drawn.
const VERTICES: u64 = 5;

pub fn all(criterion: &mut Criterion) {
    let mut group = group(criterion, "samplers");
    for plugin in lucerna::builtin().of_kind(ObjectKind::Sampler) {
        let xml = format!("<sampler type='{}'><integer name='sample_count' value='64'/></sampler>", plugin.name);
        let Object::Sampler(sampler) = build(&xml) else { unreachable!("a sampler") };
        let spp = sampler.sample_count();
        let points = sampler.point_set(0, spp, UVec2::splat(1024));
        group.throughput(Throughput::Elements(u64::from(spp) * 6 * VERTICES));
        group.bench_function(plugin.name, |b| {
            b.iter(|| {
                for sample in 0..spp {
                    let mut stream = stream(points.as_deref(), 0, black_box(UVec2::new(123, 456)), sample);
                    for _ in 0..VERTICES {
                        black_box((stream.next_2d(), stream.next_1d()));
                        black_box((stream.next_2d(), stream.next_1d()));
                    }
                }
            });
        });
    }
}
