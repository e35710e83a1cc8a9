//! Tests of all shapes together.

mod golden;
mod groups;
mod leaving;
mod sampling;
mod special;

use crate::testing::Draft;
use lucerna_core::accel::{Accel, BuildOptions, Ray};
use lucerna_core::interfaces::{Shape, SurfaceHit};
use lucerna_core::math::{DMat4, DVec3, Vec2, Vec3};
use lucerna_core::sampling::Pcg32;
use lucerna_core::scene::{Object, ObjectKind, Value};
use std::sync::Arc;

fn draft(plugin: &str) -> Draft {
    Draft::new(ObjectKind::Shape, plugin)
}

fn shape(draft: &Draft) -> Arc<dyn Shape> {
    match draft.build() {
        Ok(Object::Shape(built)) => built.shape,
        Ok(_) => panic!("not a shape"),
        Err(errors) => panic!("{errors}"),
    }
}

/// One shape, ready for rays.
struct Traced {
    shape: Arc<dyn Shape>,
    accel: Accel,
}

impl Traced {
    fn new(shape: Arc<dyn Shape>) -> Self {
        let accel = Accel::build(&[(0, shape.geometry())], &BuildOptions::default()).expect("builds");
        Traced { shape, accel }
    }

    fn hit(&self, o: Vec3, d: Vec3) -> Option<SurfaceHit> {
        let ray = Ray::new(o, d);
        let hit = self.accel.intersect(&ray)?;
        let mut surface = SurfaceHit::default();
        self.shape.surface(&ray, &hit, &mut surface);
        Some(surface)
    }
}

fn uniform(pcg: &mut Pcg32) -> Vec2 {
    Vec2::new(pcg.next_f32(), pcg.next_f32())
}

/// A similarity with a random axis of rotation.
fn placement(pcg: &mut Pcg32, scale: f64, translation: DVec3) -> DMat4 {
    let axis = lucerna_core::sampling::warp::square_to_sphere(uniform(pcg)).as_dvec3().normalize();
    let turn = DMat4::from_axis_angle(axis, f64::from(pcg.next_f32()) * 6.0);
    DMat4::from_translation(translation) * turn * DMat4::from_scale(DVec3::splat(scale))
}

fn vector(v: Vec3) -> Value {
    Value::Vector(v.as_dvec3().to_array())
}
