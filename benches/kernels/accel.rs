//! Building the tree over a mesh, and rays through it.

use crate::support::mesh::landscape;
use crate::support::rays::{RaySet, above_landscape, diffuse, shadow};
use crate::{alone, group};
use criterion::{Criterion, Throughput};
use lucerna::core::accel::Accel;
use std::cell::LazyCell;
use std::hint::black_box;

pub fn build(criterion: &mut Criterion) {
    let mut group = group(criterion, "build");
    group.sample_size(10);
    for (name, triangles) in [("10k", 10_000), ("100k", 100_000), ("1M", 1_000_000)] {
        let mesh = LazyCell::new(|| landscape(triangles));
        group.throughput(Throughput::Elements(triangles as u64));
        group.bench_function(name, |b| {
            let mesh = &*mesh;
            alone(|| b.iter(|| mesh.build()));
        });
    }
}

pub fn traversal(criterion: &mut Criterion) {
    const TRIANGLES: usize = 1_000_000;
    const PIXELS: u32 = 1 << 16;
    let mut group = group(criterion, "traversal");
    // Made for the first bench that is not filtered out.
    let ready = LazyCell::new(|| {
        let mesh = landscape(TRIANGLES);
        let accel = mesh.build();
        let primary = above_landscape(PIXELS);
        let [diffuse, shadow] = [diffuse, shadow].map(|kind| kind(&mesh, &accel, &primary));
        (accel, [primary, diffuse, shadow])
    });
    for (number, name) in ["primary", "diffuse", "shadow"].into_iter().enumerate() {
        group.bench_function(name, |b| {
            let (accel, sets) = &*ready;
            b.iter(|| trace(accel, &sets[number]));
        });
    }
}

fn trace(accel: &Accel, set: &RaySet) {
    for ray in &set.rays {
        if set.any {
            black_box(accel.occluded(ray));
        } else {
            black_box(accel.intersect(ray));
        }
    }
}
