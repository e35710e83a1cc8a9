//! Shapes: samples are uniform in area and lie on what rays hit, densities as lights are those that are asked for, and
//! hits fit the geometry around them.

use crate::support::{
    assert_every_plugin_is_configured, assert_none, build, failures, plugin_of, same_distribution, uniform,
};
use lucerna::core::accel::Ray;
use lucerna::core::interfaces::{Shape, SurfaceHit};
use lucerna::core::math::{Frame, Vec2, Vec3};
use lucerna::core::sampling::{Pcg32, warp};
use lucerna::core::scene::{BuiltShape, Object, ObjectKind, Scene};
use lucerna::core::stats::chi2::Chi2;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

mod teeth;

const LINES: u32 = 500_000;
const EVEN: &str = "<scale value='0.7'/><rotate x='0.6' z='0.8' angle='40'/><translate x='0.3' y='-0.2' z='0.1'/>";
const UNEVEN: &str = "<scale x='0.5' y='1.5'/><rotate x='0.6' z='0.8' angle='40'/>";
const MIRRORED: &str = "<scale x='-0.7' y='0.7' z='0.7'/><rotate y='1' angle='25'/>";

/// The table: configurations of every shape, with a place for a light or material inside.
pub fn shapes(inside: &str) -> Vec<String> {
    let shape = |plugin: &str, transform: &str, inner: &str| {
        format!("<shape type='{plugin}'><transform name='to_world'>{transform}</transform>{inner}{inside}</shape>")
    };
    let file = |name: &str| format!("<string name='filename' value='{name}'/>");
    let flag = |name: &str| format!("<boolean name='{name}' value='true'/>");
    let group = |inner: &str| {
        format!("<shape type='shapegroup' id='group'>{inner}</shape>")
            + "<shape type='instance'><transform name='to_world'>"
            + UNEVEN
            + "</transform><ref id='group'/></shape>"
    };
    let mut all = vec![
        shape("rectangle", UNEVEN, ""),
        shape("rectangle", MIRRORED, ""),
        shape("disk", UNEVEN, ""),
        shape("cylinder", EVEN, ""),
        shape("cylinder", MIRRORED, &flag("flip_normals")),
        shape("sphere", EVEN, ""),
        shape("sphere", MIRRORED, ""),
        shape("sphere", EVEN, &flag("flip_normals")),
        shape("cube", UNEVEN, ""),
        shape("obj", EVEN, &file("bumpy.obj")),
        shape("obj", UNEVEN, &(file("bumpy.obj") + &flag("face_normals"))),
        shape("ply", EVEN, &file("bumpy.ply")),
        shape("serialized", EVEN, &file("meshes/double.serialized")),
    ];
    if inside.is_empty() {
        all.push(group("<shape type='sphere'/>"));
        all.push(group(&shape("obj", EVEN, &file("bumpy.obj"))));
    }
    all
}

/// What has no area of its own: its parts are shapes of other kinds, seen through it.
fn is_group(xml: &str) -> bool {
    plugin_of(xml) == "shapegroup"
}

#[test]
fn every_shape_is_configured() {
    // An instance comes after its group.
    let shapes = shapes("");
    let instances = shapes.iter().filter(|xml| xml.contains("type='instance'")).map(|_| "instance");
    assert_every_plugin_is_configured(ObjectKind::Shape, shapes.iter().map(|xml| plugin_of(xml)).chain(instances));
}

/// A shape alone in the world.
struct Traced {
    shape: Arc<dyn Shape>,
    scene: Scene,
}

impl Traced {
    fn new(xml: &str) -> Self {
        match build(xml) {
            Object::Shape(built) => Traced::of(built),
            _ => panic!("{xml}: not a shape"),
        }
    }

    fn of(built: BuiltShape) -> Self {
        let shape = built.shape.clone();
        Traced { shape, scene: Scene::new(vec![built], &[], Vec::new(), None).expect("a scene") }
    }

    fn hit(&self, o: Vec3, d: Vec3) -> Option<SurfaceHit> {
        self.scene.intersect_surface(&Ray::new(o, d))
    }

    fn sphere(&self) -> (Vec3, f32) {
        self.shape.bounds().bounding_sphere()
    }
}

/// Whether samples lie on the surface that rays hit, with the same normal, coordinates and density.
fn misplaced(traced: &Traced) -> Option<String> {
    let mut pcg = Pcg32::new(2, 9);
    let (_, radius) = traced.sphere();
    for _ in 0..2000 {
        let Some(sample) = traced.shape.sample_area(uniform(&mut pcg)) else { return Some("no sample".to_owned()) };
        let above = 1e-3 * radius;
        let Some(hit) = traced.hit(sample.p + sample.n * above, -sample.n) else {
            return Some(format!("nothing at {}", sample.p));
        };
        let uv = (hit.uv - sample.uv).abs();
        let wrapped = uv.min((Vec2::ONE - uv).abs()).max_element();
        let fits = (hit.p - sample.p).length() < 1e-5 * radius.max(1.0)
            && (hit.n - sample.n).length() < 1e-4
            && wrapped < 1e-3
            && (sample.pdf * traced.shape.area() - 1.0).abs() < 1e-5;
        if !fits {
            return Some(format!("{sample:?} but {hit:?}, area {}", traced.shape.area()));
        }
    }
    None
}

#[test]
fn samples_lie_on_the_surface() {
    for xml in shapes("").iter().filter(|xml| !is_group(xml)) {
        assert_eq!(misplaced(&Traced::new(xml)), None, "{xml}");
    }
}

/// Points where isotropic lines meet the shape: the number of lines through a surface element is proportional to its
/// area (Cauchy and Crofton). At most one of each line, all with the same chance, so that they are independent; and
/// the number of crossings of each line.
fn crossings(traced: &Traced, lines: u32, most: usize, mut each: impl FnMut(Vec3)) -> Vec<usize> {
    let mut pcg = Pcg32::new(8, 1);
    let (center, radius) = traced.sphere();
    let mut counts = Vec::new();
    for _ in 0..lines {
        let d = warp::square_to_sphere(uniform(&mut pcg));
        let across = warp::square_to_disk_concentric(uniform(&mut pcg)) * radius;
        let frame = Frame::from_normal(d);
        let mut o = center - d * (2.0 * radius) + frame.s * across.x + frame.t * across.y;
        let chosen = (pcg.next_f32() * most as f32) as usize;
        let mut count = 0;
        while let Some(hit) = traced.hit(o, d) {
            if count == chosen {
                each(hit.p);
            }
            count += 1;
            o = hit.origin_towards(d);
        }
        counts.push(count);
    }
    counts
}

/// Area samples against those points, over 7³ cells of the bounding box; and the area against their number.
fn area_tests(traced: &Traced) -> [Chi2; 2] {
    const CELLS: f32 = 7.0;
    let bounds = traced.shape.bounds();
    let (_, radius) = traced.sphere();
    let cell = |p: Vec3| {
        let [x, y, z] =
            ((p - bounds.min) / bounds.extent() * CELLS).clamp(Vec3::ZERO, Vec3::splat(CELLS - 1.0)).to_array();
        (x as usize * 7 + y as usize) * 7 + z as usize
    };
    // A line with more crossings than all of these is too rare to count.
    let most = crossings(traced, LINES / 10, 1, |_| ()).into_iter().max().unwrap_or(0);
    let (mut lines, mut samples) = ([0u64; 343], [0u64; 343]);
    let counts = crossings(traced, LINES, most, |p| lines[cell(p)] += 1);
    let mut pcg = Pcg32::new(5, 1);
    for _ in 0..lines.iter().sum() {
        if let Some(sample) = traced.shape.sample_area(uniform(&mut pcg)) {
            samples[cell(sample.p)] += 1;
        }
    }
    // A sphere of that radius is crossed twice by every line.
    let n = counts.len() as f64;
    let mean = counts.iter().sum::<usize>() as f64 / n;
    let variance = counts.iter().map(|c| (*c as f64 - mean).powi(2)).sum::<f64>() / n;
    let expected = f64::from(traced.shape.area()) / (2.0 * PI * f64::from(radius * radius));
    let area = Chi2::of_statistic((mean - expected).powi(2) * n / variance, 1);
    [area, same_distribution(&lines, &samples)]
}

#[test]
fn areas_are_true_and_samples_uniform() {
    let shapes: Vec<_> = shapes("").into_iter().filter(|xml| !is_group(xml)).collect();
    let tests: Vec<[Chi2; 2]> = shapes.par_iter().map(|xml| area_tests(&Traced::new(xml))).collect();
    let cases: Vec<_> = (0..shapes.len()).flat_map(|shape| [(shape, 0), (shape, 1)]).collect();
    let describe = |(shape, test): &(usize, usize)| format!("{} of {}", ["area", "samples"][*test], shapes[*shape]);
    assert_none(&failures(&cases, describe, |(shape, test)| tests[*shape][*test]));
}

/// From outside, from within the box around the shape, from close to it, and from afar.
pub fn viewpoints(shape: &dyn Shape) -> Vec<Vec3> {
    let (center, radius) = shape.bounds().bounding_sphere();
    let above = shape.sample_area(Vec2::new(0.3, 0.6)).expect("a point");
    vec![
        center + Vec3::new(1.0, 2.0, 2.0) * radius,
        center + Vec3::new(-0.9, 0.5, 0.7) * radius,
        center + Vec3::new(0.1, 0.05, 0.3) * radius,
        above.p + above.n * (0.3 * radius),
        above.p + above.n * 1e-2,
        center + Vec3::new(-3e3, 1e3, 2e3) * radius,
    ]
}

/// Whether a sample has another density than one that asks about it, or does not lie where it says.
fn disagreement(shape: &dyn Shape) -> Option<String> {
    let mut pcg = Pcg32::new(4, 4);
    for from in viewpoints(shape) {
        for _ in 0..1000 {
            let Some((point, _, pdf)) = shape.sample_direct(from, uniform(&mut pcg)) else { continue };
            let asked = shape.pdf_direct(from, &point);
            let apart = (from + point.d * point.distance - point.p).length();
            let fits = (asked / pdf - 1.0).abs() < 1e-4
                && point.d.is_normalized()
                && point.n.is_normalized()
                && apart < 1e-5 * (1.0 + from.length());
            if !fits {
                return Some(format!("from {from}: {point:?}, {pdf} and {asked}"));
            }
        }
    }
    None
}

#[test]
fn densities_of_samples_are_those_that_are_asked_for() {
    for xml in shapes("").iter().filter(|xml| !is_group(xml)) {
        assert_eq!(disagreement(&*Traced::new(xml).shape), None, "{xml}");
    }
}

#[test]
fn hc_g19_on_and_in_the_surface_all_is_finite() {
    let mut pcg = Pcg32::new(1, 6);
    for xml in shapes("").iter().filter(|xml| !is_group(xml)) {
        let shape = Traced::new(xml).shape;
        for _ in 0..500 {
            let on = shape.sample_area(uniform(&mut pcg)).expect("a point");
            for height in [0.0, 1e-6, -1e-6, 1e-3, -1e-3] {
                let from = on.p + on.n * height;
                if let Some((point, p_error, pdf)) = shape.sample_direct(from, uniform(&mut pcg)) {
                    assert!(pdf.is_finite() && pdf > 0.0 && p_error.is_finite(), "{xml}");
                    assert!(point.d.is_normalized() && shape.pdf_direct(from, &point).is_finite(), "{xml}");
                }
            }
        }
    }
}

/// What does not fit together in a hit, or between it and hits beside it.
fn misfit(traced: &Traced) -> Option<String> {
    let mut pcg = Pcg32::new(9, 2);
    let (center, radius) = traced.sphere();
    let (mut hits, mut slopes) = (0, 0);
    for _ in 0..20_000 {
        let d = warp::square_to_sphere(uniform(&mut pcg));
        let across = warp::square_to_disk_concentric(uniform(&mut pcg)) * radius;
        let rays = Frame::from_normal(d);
        let o = center - d * (2.0 * radius) + rays.s * across.x + rays.t * across.y;
        let Some(hit) = traced.hit(o, d).filter(|hit| hit.n.dot(d).abs() > 0.3) else { continue };
        hits += 1;
        let Frame { s, t, n } = hit.frame;
        let tangent = hit.dp_du - n * n.dot(hit.dp_du);
        let consistent = (o + d * hit.t - hit.p).length() < 1e-5 * radius
            && [s, t, n, hit.n].iter().all(|v| v.is_normalized())
            && s.cross(t).dot(n) > 0.9999
            && n.dot(hit.n) > 0.0
            && (hit.to_world(hit.wi) + d).length() < 1e-5
            && (tangent.length() < 1e-3 * radius || tangent.normalize().dot(s) > 0.9999);
        if !consistent {
            return Some(format!("{hit:?}"));
        }
        // Central differences over two hits beside this one, on the same primitive.
        let turn = (std::f32::consts::TAU * pcg.next_f32()).sin_cos();
        let step = (rays.s * turn.0 + rays.t * turn.1) * (3e-4 * radius);
        let [Some(before), Some(after)] = [o - step, o + step].map(|o| traced.hit(o, d)) else { continue };
        let is_regular = hit.dp_du.length() > 0.1 * radius && hit.dp_dv.length() > 0.1 * radius;
        let (dp, duv) = (after.p - before.p, after.uv - before.uv);
        let near = |hit: &SurfaceHit, other: &SurfaceHit| {
            hit.prim == other.prim && hit.n.dot(other.n) > 0.99 && (hit.p - other.p).length() < 2e-3 * radius
        };
        if !(is_regular && near(&hit, &before) && near(&hit, &after) && duv.abs().max_element() < 0.5) {
            continue;
        }
        slopes += 1;
        let predicted = hit.dp_du * duv.x + hit.dp_dv * duv.y;
        if (dp - predicted).length() > 1e-2 * dp.length() || dp.dot(hit.n).abs() > 1e-2 * dp.length() {
            return Some(format!("{dp} and {predicted} at {hit:?}"));
        }
    }
    (hits < 1000 || slopes < 200).then(|| format!("only {hits} hits and {slopes} slopes"))
}

#[test]
fn hits_fit_the_geometry() {
    let misfits: Vec<String> = shapes("")
        .par_iter()
        .filter_map(|xml| misfit(&Traced::new(xml)).map(|found| format!("{xml}: {found}")))
        .collect();
    assert_none(&misfits);
}
