//! Rays that leave a surface do not meet it again, at any size and place.

use super::{Traced, draft, placement, shape, uniform};
use lucerna_core::interfaces::AreaSample;
use lucerna_core::math::{DMat4, DVec3, Frame, error_bounds};
use lucerna_core::sampling::{Pcg32, warp};
use lucerna_core::stats::figures::measured;
use std::f64::consts::FRAC_PI_2;

const PLACEMENTS: usize = 1000;
const RAYS: usize = 1000;

/// Numbers of hits, of rays that left them, and of those that came back at once.
#[derive(Default)]
struct Tally {
    hits: usize,
    bad: usize,
}

fn leave(traced: &Traced, pcg: &mut Pcg32, both_sides: bool, tally: &mut Tally) {
    for _ in 0..RAYS {
        let Some(target) = traced.shape.sample_area(uniform(pcg)) else { continue };
        check_sample(traced, pcg, &target, both_sides, tally);
        // From outside, as far away as the shape is large or as the coordinates are, whichever makes a hit.
        let out = Frame::from_normal(target.n).to_world(warp::square_to_cosine_hemisphere(uniform(pcg)));
        let reach = traced.shape.bounds().extent().length() + 1e-3 * target.p.length();
        let Some(hit) = traced.hit(target.p + out * reach, -out) else { continue };
        if !both_sides && hit.n.dot(out) <= 0.0 {
            continue;
        }
        tally.hits += 1;
        let side = if both_sides && pcg.next_f32() < 0.5 { -hit.n } else { hit.n };
        let d = Frame::from_normal(side).to_world(warp::square_to_cosine_hemisphere(uniform(pcg)));
        let returned = traced.hit(hit.origin_towards(d), d);
        if d.dot(side) > 1e-6 && returned.is_some() {
            tally.bad += 1;
        }
    }
}

/// Points of a light leave it as well as hits do.
fn check_sample(traced: &Traced, pcg: &mut Pcg32, sample: &AreaSample, both_sides: bool, tally: &mut Tally) {
    let side = if both_sides && pcg.next_f32() < 0.5 { -sample.n } else { sample.n };
    let d = Frame::from_normal(side).to_world(warp::square_to_cosine_hemisphere(uniform(pcg)));
    let o = error_bounds::offset_origin(sample.p, sample.p_error, sample.n, d);
    if d.dot(side) > 1e-6 && traced.hit(o, d).is_some() {
        tally.bad += 1;
    }
}

fn hc_g03(test: &str, plugin: &str, both_sides: bool) {
    let mut pcg = Pcg32::new(3, 14);
    let mut tally = Tally::default();
    for _ in 0..PLACEMENTS {
        let mut power = || 10f64.powf(f64::from(pcg.next_f32()) * 16.0 - 8.0);
        let (scale, coordinates) = (power(), power());
        let place = warp::square_to_sphere(uniform(&mut pcg)).as_dvec3() * coordinates;
        let matrix = placement(&mut pcg, scale, place);
        leave(&Traced::new(shape(&draft(plugin).to_world(matrix))), &mut pcg, both_sides, &mut tally);
    }
    measured(test, format!("{} of {} rays came back", tally.bad, 2 * tally.hits));
    assert!(tally.hits > PLACEMENTS * RAYS / 2, "{plugin}: only {} hits", tally.hits);
    assert_eq!(tally.bad, 0, "{plugin}: of {} hits", tally.hits);
}

#[test]
fn hc_g03_sphere() {
    hc_g03("hc_g03_sphere", "sphere", false);
}

#[test]
fn hc_g03_cylinder() {
    hc_g03("hc_g03_cylinder", "cylinder", false);
}

#[test]
fn hc_g03_cube() {
    hc_g03("hc_g03_cube", "cube", false);
}

#[test]
fn hc_g03_rectangle() {
    hc_g03("hc_g03_rectangle", "rectangle", true);
}

#[test]
fn hc_g03_disk() {
    hc_g03("hc_g03_disk", "disk", true);
}

/// The share of rays into a slightly wider cone that hit a sphere is the share of solid angles, however far it is.
#[test]
fn hc_g15_far_spheres_are_round() {
    let mut pcg = Pcg32::new(5, 2);
    let mut worst = 0f32;
    for distance in [1e4, 1e6] {
        let center = warp::square_to_sphere(uniform(&mut pcg)) * distance;
        let sphere = draft("sphere").to_world(DMat4::from_translation(center.as_dvec3()));
        let traced = Traced::new(shape(&sphere));
        let frame = Frame::from_normal(center / distance);
        let (rays, mut hits) = (100_000, 0);
        for _ in 0..rays {
            // Uniform over a disk of twice the radius around the centre; directions keep their full length, since
            // unit vectors in single precision are too coarse.
            let aim = warp::square_to_disk_concentric(uniform(&mut pcg)) * 2.0;
            let o = frame.s * aim.x + frame.t * aim.y;
            if let Some(hit) = traced.hit(o, center) {
                hits += 1;
                assert!(hit.n.is_normalized() && hit.n.dot(center) <= 0.0);
                let off = (hit.p.as_dvec3() - center.as_dvec3()).length() - 1.0;
                assert!(off.abs() <= f64::from(hit.p_error.length()), "{off}");
            }
        }
        let share = hits as f32 / rays as f32;
        worst = worst.max((share / 0.25 - 1.0).abs());
        assert!((share / 0.25 - 1.0).abs() < 0.01 + 3.0 * (3.0 / rays as f32).sqrt(), "{distance}: {share}");
    }
    measured("hc_g15_far_spheres_are_round", format!("off by {:.2} % of the solid angle", 100.0 * worst));
}

/// A gap between two rectangles much thinner than any fixed offset would allow.
#[test]
fn hc_g04_thin_gaps_stay_open() {
    for size in [1e-3f64, 1.0, 1e6] {
        let scale = DMat4::from_scale(DVec3::splat(size));
        let up = DMat4::from_translation(DVec3::Z * 1e-4 * size.min(1.0)) * scale;
        let floor = Traced::new(shape(&draft("rectangle").to_world(scale)));
        let roof = Traced::new(shape(&draft("rectangle").to_world(up)));
        let mut pcg = Pcg32::new(1, 1);
        for _ in 0..1000 {
            let a = floor.shape.sample_area(uniform(&mut pcg)).expect("a point");
            let b = roof.shape.sample_area(uniform(&mut pcg)).expect("a point");
            let from = error_bounds::offset_origin(a.p, a.p_error, a.n, b.p - a.p);
            let to = error_bounds::offset_origin(b.p, b.p_error, b.n, from - b.p);
            let segment = lucerna_core::accel::Ray::between(from, to);
            for traced in [&floor, &roof] {
                assert!(!traced.accel.occluded(&segment), "size {size}: {from} to {to}");
            }
        }
    }
    measured("hc_g04_thin_gaps_stay_open", "0 of 3000 segments blocked, for gaps down to 1e-7");
}

/// In a plane through the origin one coordinate is exactly 0, and so is its relative rounding error.
#[test]
fn planes_through_the_origin_are_left_too() {
    let mut pcg = Pcg32::new(2, 1);
    let mut tally = Tally::default();
    for plugin in ["rectangle", "disk", "obj"] {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for scale in [1e-6, 1.0, 1e6] {
                let turn = if axis == DVec3::Z { DMat4::IDENTITY } else { DMat4::from_axis_angle(axis, FRAC_PI_2) };
                let matrix = turn * DMat4::from_scale(DVec3::splat(scale));
                // Exact zeros, not what the cosine of 90 degrees rounds to.
                let exact = matrix.to_cols_array().map(|v| if v.abs() < 1e-10 * scale { 0.0 } else { v });
                let mut draft = draft(plugin).to_world(DMat4::from_cols_array(&exact));
                if plugin == "obj" {
                    draft = draft.string("filename", "flat.obj");
                }
                leave(&Traced::new(shape(&draft)), &mut pcg, true, &mut tally);
            }
        }
    }
    assert!(tally.hits > 3 * 9 * RAYS * 9 / 10);
    assert_eq!(tally.bad, 0, "of {}", tally.hits);
}
