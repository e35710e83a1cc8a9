//! Shapes that are not triangles, and instances.

use super::*;

/// A sphere, solved in `f64`.
pub struct Ball {
    pub center: Vec3,
    pub radius: f32,
}

impl Primitive for Ball {
    fn bounds(&self) -> Aabb {
        let reach = Vec3::splat(self.radius * (1.0 + 4.0 * f32::EPSILON));
        Aabb { min: self.center - reach, max: self.center + reach }
    }

    fn intersect(&self, ray: &Ray) -> Option<PrimHit> {
        let [o, d] = [(ray.o.as_dvec3() - self.center.as_dvec3()), ray.d.as_dvec3()];
        let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - f64::from(self.radius).powi(2));
        let root = (b * b - a * c).sqrt();
        let roots = [(-b - root) / a, (-b + root) / a].map(|t| t as f32);
        let t = roots.into_iter().find(|t| *t > ray.t_min && *t < ray.t_max)?;
        Some(PrimHit { t, u: 0.0, v: 0.0, shape: None, prim: 0 })
    }
}

#[test]
fn hc_g15_analytic_shapes_mix_with_triangles_and_stay_visible_from_afar() {
    let mut random = Random(15);
    let mesh = Mesh::soup(200, 0.2, &mut random);
    let balls: Vec<_> =
        (0..50).map(|_| Arc::new(Ball { center: random.vector(), radius: random.signed().abs() * 0.1 })).collect();
    for options in ALL {
        let mut items: Vec<_> =
            balls.iter().enumerate().map(|(i, b)| (i as u32, Geometry::Analytic(Arc::clone(b) as _))).collect();
        items.insert(20, (100, mesh.geometry()));
        let accel = Accel::build(&items, &options).unwrap();
        assert_eq!(accel.validate(), Ok(()));
        for i in 0..1000 {
            let ray = test_ray(i, &mut random);
            let from_balls = balls.iter().enumerate().filter_map(|(i, b)| b.intersect(&ray).map(|h| (h.t, i as u32)));
            let from_mesh = brute_force(&[&mesh], &ray).map(|h| (h.t, 100));
            let expected = from_balls.chain(from_mesh).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            assert_eq!(accel.intersect(&ray).map(|h| (h.t, h.shape)), expected);
            assert_eq!(accel.occluded(&ray), expected.is_some());
        }
    }
    let one = [(0, Geometry::Analytic(Arc::new(Ball { center: Vec3::ZERO, radius: 1.0 })))];
    let accel = Accel::build(&one, &BuildOptions::default()).unwrap();
    for distance in [1e4, 1e6] {
        let o = Vec3::new(0.0, 0.0, distance);
        let count = 20_000;
        let hits = (0..count)
            .filter(|_| accel.intersect(&Ray::new(o, random.vector() * Vec3::new(1.5, 1.5, 0.0) - o)).is_some())
            .count();
        let share = hits as f64 / f64::from(count);
        let expected = std::f64::consts::PI / 9.0;
        assert!((share - expected).abs() < 4.0 * (expected / f64::from(count)).sqrt(), "{share} at {distance}");
    }
}

#[test]
fn hc_g17_instances_equal_moved_copies() {
    let mut random = Random(17);
    let mesh = Mesh::soup(100, 0.3, &mut random);
    let group = Arc::new(build(&[&Mesh::grid(2, 0.0), &mesh], &ALL[0]));
    // Powers of two and whole numbers: the copies are exact, so distances must be the same bits. Some are mirrored.
    let placements: Vec<_> = (0..40)
        .map(|i| {
            let scale = if i % 2 == 0 { Vec3::splat(0.5) } else { Vec3::new(-0.25, 0.5, 1.0) };
            (scale, Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32) * 2.0)
        })
        .collect();
    let items: Vec<_> = placements
        .iter()
        .enumerate()
        .map(|(i, (scale, offset))| {
            let to_world = glam::Mat4::from_translation(*offset) * glam::Mat4::from_scale(*scale);
            let instance = Instance::new(Arc::clone(&group), to_world).unwrap();
            (i as u32, Geometry::Analytic(Arc::new(instance) as _))
        })
        .collect();
    let accel = Accel::build(&items, &BuildOptions::default()).unwrap();
    assert_eq!(accel.validate(), Ok(()));
    for _ in 0..2000 {
        let o = (random.vector() * 1024.0).round() / 64.0;
        let ray = Ray::new(o, (Vec3::splat(3.0) + random.vector() * 4.0 - o).normalize());
        let expected = placements
            .iter()
            .enumerate()
            .filter_map(|(i, (scale, offset))| {
                let local = Ray::new((ray.o - *offset) / *scale, ray.d / *scale);
                group.intersect(&local).map(|hit| Hit { instance: i as u32, triangle: NO_TRIANGLE, ..hit })
            })
            .min_by(|a, b| a.t.total_cmp(&b.t).then(a.instance.cmp(&b.instance)));
        assert_eq!(accel.intersect(&ray), expected);
        assert_eq!(accel.occluded(&ray), expected.is_some());
    }

    let nested = Instance::new(Arc::new(accel), glam::Mat4::IDENTITY).err();
    assert_eq!(nested.as_deref(), Some("an instance of a group that contains instances is not supported"));
    let flat = Instance::new(group, glam::Mat4::from_scale(Vec3::new(1.0, 1.0, 0.0))).err();
    assert_eq!(flat.as_deref(), Some("the transform of an instance must be invertible"));
}

#[test]
fn equal_distances_go_to_the_smaller_analytic_shape() {
    let ball = Arc::new(Ball { center: Vec3::ZERO, radius: 1.0 });
    let mut random = Random(18);
    for options in ALL {
        for count in [2, 9, 40] {
            let items: Vec<_> = (0..count).rev().map(|i| (i, Geometry::Analytic(Arc::clone(&ball) as _))).collect();
            let accel = Accel::build(&items, &options).unwrap();
            for _ in 0..100 {
                let o = random.vector() * 10.0;
                let hit = accel.intersect(&Ray::new(o, random.vector() * 0.5 - o));
                assert!(hit.is_none_or(|hit| hit.shape == 0), "{hit:?}");
            }
        }
    }
}
