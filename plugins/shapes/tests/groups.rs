//! Groups and instances.

use super::{Traced, draft, placement, shape, uniform};
use crate::testing::Draft;
use lucerna_core::accel::Ray;
use lucerna_core::math::{DMat4, DVec3, Frame, Vec3};
use lucerna_core::sampling::{Pcg32, warp};
use lucerna_core::scene::{Object, Scene};

fn group(inner: Draft) -> Draft {
    draft("shapegroup").child(inner)
}

fn scene(draft: &Draft) -> Scene {
    match draft.build() {
        Ok(Object::Shape(built)) => Scene::new(vec![built], &[], Vec::new(), None).expect("a scene"),
        Ok(_) => panic!("not a shape"),
        Err(errors) => panic!("{errors}"),
    }
}

/// An instance looks like the shape itself with the same transform.
#[test]
fn an_instance_is_its_shape_in_place() {
    let stretch = DMat4::from_translation(DVec3::new(1.0, -2.0, 0.5))
        * DMat4::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1)
        * DMat4::from_scale(DVec3::new(2.0, 0.5, 1.5));
    let mirror = stretch * DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
    let mut pcg = Pcg32::new(9, 9);
    let even = placement(&mut pcg, 2.0, DVec3::X);
    let cases = [
        ("rectangle", stretch),
        ("rectangle", mirror),
        ("disk", mirror),
        ("cube", stretch),
        ("sphere", even),
        ("cylinder", even),
    ];
    for (plugin, matrix) in cases {
        let placed = Traced::new(shape(&draft(plugin).to_world(matrix)));
        let scene = scene(&draft("instance").child(group(draft(plugin))).to_world(matrix));
        assert_eq!(scene.shapes()[0].shape.primitive_count(), 1);
        for _ in 0..500 {
            let target = placed.shape.sample_area(uniform(&mut pcg)).expect("a point");
            let d = warp::square_to_sphere(uniform(&mut pcg));
            // At grazing incidence the rounding of the ray moves the hit along the surface.
            if d.dot(target.n).abs() < 0.3 {
                continue;
            }
            let o = target.p - d * 9.0;
            let expected = placed.hit(o, d).expect("a hit");
            let ray = Ray::new(o, d);
            let hit = scene.intersect_surface(&ray).expect("a hit");
            let near = |a: Vec3, b: Vec3, tolerance: f32, what: &str| {
                assert!((a - b).length() <= tolerance, "{plugin}, {what}: {a} and {b}");
            };
            near(hit.p, expected.p, 1e-5, "p");
            near(hit.n, expected.n, 1e-5, "n");
            near(hit.frame.n, expected.frame.n, 1e-5, "shading normal");
            near(hit.frame.s, expected.frame.s, 1e-4, "tangent");
            near(hit.dp_du, expected.dp_du, 1e-4, "dp_du");
            near(hit.dp_dv, expected.dp_dv, 1e-4, "dp_dv");
            assert!((hit.uv - expected.uv).length() < 1e-4, "{plugin}");
            assert!(scene.occluded(&ray) && hit.instance == 0);
        }
    }
}

#[test]
fn rays_leave_instances() {
    let mut pcg = Pcg32::new(4, 1);
    let (mut hits, mut bad) = (0, 0);
    for plugin in ["sphere", "cube", "rectangle", "disk"] {
        for _ in 0..200 {
            let mut power = || 10f64.powf(f64::from(pcg.next_f32()) * 8.0 - 4.0);
            let (outer, inner, coordinates) = (power(), power(), power());
            let place = warp::square_to_sphere(uniform(&mut pcg)).as_dvec3() * coordinates;
            let within = placement(&mut pcg, inner, DVec3::new(0.3, 2.0, -1.0));
            let matrix = placement(&mut pcg, outer, place);
            let scene = scene(&draft("instance").child(group(draft(plugin).to_world(within))).to_world(matrix));
            let bounds = scene.shapes()[0].shape.bounds();
            let reach = bounds.extent().length();
            for _ in 0..50 {
                let d = warp::square_to_sphere(uniform(&mut pcg));
                let Some(hit) = scene.intersect_surface(&Ray::new(bounds.center() - d * reach, d)) else { continue };
                let side = if hit.n.dot(d) < 0.0 { hit.n } else { -hit.n };
                let away = Frame::from_normal(side).to_world(warp::square_to_cosine_hemisphere(uniform(&mut pcg)));
                hits += 1;
                let convex = plugin != "sphere" && plugin != "cube" || side == hit.n;
                if convex && away.dot(side) > 1e-3 && scene.occluded(&Ray::new(hit.origin_towards(away), away)) {
                    bad += 1;
                }
            }
        }
    }
    assert!(hits > 10_000);
    assert_eq!(bad, 0, "of {hits}");
}

#[test]
fn hc_g17_groups_do_not_nest() {
    let nested = group(draft("instance").child(group(draft("sphere"))));
    assert!(nested.errors().contains("do not nest"));
    assert!(draft("instance").child(draft("sphere")).errors().contains("needs a shapegroup"));
    assert!(draft("instance").errors().contains("shape"));
    let lamp = Draft::new(lucerna_core::scene::ObjectKind::Emitter, "area");
    assert!(group(draft("sphere").child(lamp)).errors().contains("cannot contain a light"));
}
