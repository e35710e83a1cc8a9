//! What a sample costs without light transport: its random numbers, its camera ray, and its splat on the film.

use crate::support::objects::scene_of;
use crate::{alone, group};
use criterion::{Criterion, Throughput};
use lucerna::core::color::Rgb;
use lucerna::core::interfaces::{Arena, CameraRay, Radiance, RadianceEstimator};
use lucerna::core::render::{Budget, Control, RenderContext, render_estimator};
use lucerna::core::sampling::Stream;
use lucerna::core::scene::Scene;

const SIZE: u32 = 256;
const SPP: u32 = 16;

/// Finds the same for every ray.
struct Fog;

impl RadianceEstimator for Fog {
    fn radiance(&self, _: &Scene, camera: &CameraRay, _: &mut Stream<'_>, _: &mut Arena, _: &mut [f32]) -> Radiance {
        Radiance { rgb: Rgb::new(1.0, 0.5, camera.ray.d.z.abs()), alpha: 1.0, rays: 0 }
    }
}

pub fn all(criterion: &mut Criterion) {
    let mut group = group(criterion, "film");
    group.throughput(Throughput::Elements(u64::from(SIZE * SIZE * SPP)));
    for filter in ["box", "gaussian"] {
        let scene = scene_of(&format!(
            "<scene version='3.9.1'><sensor type='perspective'><sampler type='independent'/><film type='hdrfilm'>\
             <integer name='width' value='{SIZE}'/><integer name='height' value='{SIZE}'/><rfilter type='{filter}'/>\
             </film></sensor></scene>"
        ));
        group.bench_function(filter, |b| {
            let once = || {
                let control = Control::new();
                let budget = Budget::Samples(SPP);
                let mut cx = RenderContext::new(&scene, &scene.sensors()[0], budget, 0, &control, Vec::new());
                render_estimator(&mut cx, &Fog).expect("a picture")
            };
            alone(|| b.iter(once));
        });
    }
}
