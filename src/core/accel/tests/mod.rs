//! The tree against brute force, and the hard cases of geometry.

mod analytic;

use super::triangle::{Shear, is_hittable};
use super::*;
use crate::stats::figures::measured;
use analytic::Ball;
use std::time::Instant;

const ALL: [BuildOptions; 4] = [
    BuildOptions { builder: BuilderKind::BinnedSah, portable: false },
    BuildOptions { builder: BuilderKind::BinnedSah, portable: true },
    BuildOptions { builder: BuilderKind::Ploc, portable: false },
    BuildOptions { builder: BuilderKind::Ploc, portable: true },
];
const FAR: Vec3 = Vec3::new(148_376.0, 1234.0, -223_423.0);

/// A permuted congruential generator (O'Neill 2014), for tests only.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u32 {
        let old = self.0;
        self.0 = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32)
    }

    /// Uniform in [−1, 1).
    fn signed(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / 8_388_608.0 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

/// An owned mesh.
#[derive(Clone, Default)]
struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn push(&mut self, triangle: [Vec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(triangle);
        self.triangles.push([first, first + 1, first + 2]);
    }

    fn soup(count: usize, size: f32, random: &mut Random) -> Self {
        let mut mesh = Self::default();
        for _ in 0..count {
            let center = random.vector();
            mesh.push([0; 3].map(|_| center + random.vector() * size));
        }
        mesh
    }

    /// A closed sphere of radius 1: an octahedron, each edge halved `levels` times.
    fn sphere(levels: usize) -> Self {
        let positions = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let mut mesh = Self { positions, triangles };
        for _ in 0..levels {
            let mut halves = std::collections::HashMap::new();
            let old = std::mem::take(&mut mesh.triangles);
            let mut half = |a: u32, b: u32, positions: &mut Vec<Vec3>| {
                *halves.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            for [a, b, c] in old {
                let p = &mut mesh.positions;
                let [ab, bc, ca] = [half(a, b, p), half(b, c, p), half(c, a, p)];
                mesh.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
        }
        mesh
    }

    /// `n` by `n` squares in the plane z = `z` over [0, 1]².
    fn grid(n: u32, z: f32) -> Self {
        let at = |x: u32, y: u32| y * (n + 1) + x;
        let points = (0..=n).flat_map(|y| (0..=n).map(move |x| (x, y)));
        let squares = (0..n).flat_map(|y| (0..n).map(move |x| (x, y)));
        Self {
            positions: points.map(|(x, y)| Vec3::new(x as f32 / n as f32, y as f32 / n as f32, z)).collect(),
            triangles: squares
                .flat_map(|(x, y)| {
                    let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                    [[a, b, c], [a, c, d]]
                })
                .collect(),
        }
    }

    fn moved(&self, scale: f32, offset: Vec3) -> Self {
        Self { positions: self.positions.iter().map(|p| *p * scale + offset).collect(), ..self.clone() }
    }

    fn geometry(&self) -> Geometry<'_> {
        Geometry::Mesh { positions: &self.positions, triangles: &self.triangles }
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }
}

fn build(meshes: &[&Mesh], options: &BuildOptions) -> Accel {
    let items: Vec<_> = meshes.iter().enumerate().map(|(i, mesh)| (i as u32, mesh.geometry())).collect();
    let accel = Accel::build(&items, options).expect("meshes are valid");
    assert_eq!(accel.validate(), Ok(()));
    accel
}

fn brute_force(meshes: &[&Mesh], ray: &Ray) -> Option<Hit> {
    let shear = Shear::new(ray.o, ray.d);
    let mut best: Option<Hit> = None;
    let mut first = 0;
    for (shape, mesh) in meshes.iter().enumerate() {
        for prim in 0..mesh.triangles.len() {
            let corners = mesh.corners(prim);
            if !is_hittable(corners) {
                continue;
            }
            let Some(hit) = shear.intersect(shear.permuted(corners)) else { continue };
            if hit.t > ray.t_min && hit.t < best.map_or(ray.t_max, |b| b.t) {
                let (shape, prim) = (shape as u32, prim as u32);
                let triangle = first + prim;
                best = Some(Hit { t: hit.t, u: hit.u, v: hit.v, shape, prim, instance: NO_INSTANCE, triangle });
            }
        }
        first += mesh.triangles.len() as u32;
    }
    best
}

/// Rays that begin around a scene in [−1, 1]³ and look into it; some along axes, some of finite length.
fn test_ray(i: usize, random: &mut Random) -> Ray {
    let o = random.vector() * if i.is_multiple_of(3) { 1.0 } else { 4.0 };
    let mut d = random.vector() - o * if i.is_multiple_of(3) { 0.0 } else { 0.5 };
    if i.is_multiple_of(5) {
        let axis = i / 5 % 3;
        d = Vec3::from_array(std::array::from_fn(|a| if a == axis { d[axis] } else { 0.0 }));
    }
    let t_max = if i.is_multiple_of(7) { random.signed().abs() } else { f32::INFINITY };
    Ray { t_min: if i.is_multiple_of(11) { 0.1 } else { 0.0 }, t_max, ..Ray::new(o, d) }
}

#[test]
fn hc_g18_every_builder_and_path_equals_brute_force_bit_for_bit() {
    for (seed, (count, size)) in [(1, 0.5), (9, 1.0), (300, 0.3), (1000, 0.1), (1000, 1.5)].into_iter().enumerate() {
        let mut random = Random(seed as u64);
        let [a, b] = [Mesh::soup(count, size, &mut random), Mesh::soup(count / 2, size, &mut random)];
        let accels = ALL.map(|options| build(&[&a, &b], &options));
        for i in 0..2500 {
            let ray = test_ray(i, &mut random);
            let expected = brute_force(&[&a, &b], &ray);
            for (accel, options) in accels.iter().zip(&ALL) {
                assert_eq!(accel.intersect(&ray), expected, "{options:?} {ray:?}");
                assert_eq!(accel.occluded(&ray), expected.is_some(), "{options:?} {ray:?}");
                // Limits at the very hit: it lies neither before it nor after it.
                let Some(hit) = expected else { continue };
                assert!(!accel.occluded(&Ray { t_max: hit.t, ..ray }), "{options:?} {ray:?}");
                assert!(accel.occluded(&Ray { t_max: hit.t.next_up(), ..ray }), "{options:?} {ray:?}");
                assert!(accel.occluded(&Ray { t_min: hit.t.next_down(), ..ray }), "{options:?} {ray:?}");
                let beyond = Ray { t_min: hit.t, ..ray };
                let expected = brute_force(&[&a, &b], &beyond);
                assert_eq!(accel.intersect(&beyond), expected, "{options:?} {beyond:?}");
                assert_eq!(accel.occluded(&beyond), expected.is_some(), "{options:?} {beyond:?}");
            }
        }
    }
}

#[test]
fn equal_distances_go_to_the_smaller_shape_and_triangle() {
    let mesh = Mesh::grid(6, 0.0);
    for options in ALL {
        // Every triangle is there four times, and rays through grid points meet up to six of each.
        let items: Vec<_> = [7, 3, 3, 5].map(|shape| (shape, mesh.geometry())).to_vec();
        let accel = Accel::build(&items, &options).unwrap();
        for p in &mesh.positions {
            let ray = Ray::new(Vec3::new(p.x, p.y, 2.0), Vec3::NEG_Z);
            let hit = accel.intersect(&ray).unwrap();
            let expected = brute_force(&[&mesh], &ray).unwrap();
            assert_eq!((hit.shape, hit.prim, hit.t), (3, expected.prim, expected.t));
        }
    }
}

#[test]
fn hc_g01_no_ray_leaves_a_closed_sphere() {
    let sphere = Mesh::sphere(6);
    for (offset, allowed) in [(Vec3::ZERO, 0), (FAR, 0)] {
        let mesh = sphere.moved(1.0, offset);
        for options in [ALL[0], ALL[1]] {
            let accel = build(&[&mesh], &options);
            let mut random = Random(4);
            let mut misses = 0;
            for _ in 0..50_000 {
                let ray = Ray::new(offset + random.vector() * 0.25, random.vector());
                misses += usize::from(accel.intersect(&ray).is_none()) + usize::from(!accel.occluded(&ray));
            }
            assert!(misses <= allowed, "{misses} at {offset}");
        }
    }
    measured("hc_g01_no_ray_leaves_a_closed_sphere", "0 of 200 000 rays escape");
}

#[test]
fn hc_g02_rays_at_vertices_and_edges_hit() {
    let mut aimed = 0;
    let sphere = Mesh::sphere(5);
    for (scale, offset) in
        [(1.0, Vec3::ZERO), (1e-8, Vec3::ZERO), (1e8, Vec3::ZERO), (10.0, FAR), (1.0, Vec3::splat(3.0))]
    {
        let mesh = sphere.moved(scale, offset);
        for options in [ALL[0], ALL[1], ALL[2]] {
            let accel = build(&[&mesh], &options);
            for o in [offset, offset + Vec3::new(0.1, -0.2, 0.3) * scale] {
                for triangle in 0..mesh.triangles.len() {
                    let [a, b, c] = mesh.corners(triangle);
                    for target in [a, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
                        let ray = Ray::new(o, target - o);
                        let hit = accel.intersect(&ray);
                        assert!(hit.is_some(), "{options:?}, scale {scale} at {offset}: {ray:?}");
                        assert!(accel.occluded(&ray));
                        aimed += 1;
                    }
                }
            }
        }
    }
    measured("hc_g02_rays_at_vertices_and_edges_hit", format!("0 of {aimed} rays escape"));
}

#[test]
fn hits_at_every_scale_equal_brute_force() {
    for exponent in [-12_i32, -8, -4, 4, 8, 12] {
        let mut random = Random(exponent.unsigned_abs().into());
        let scale = 10.0_f32.powi(exponent);
        let mesh = Mesh::soup(300, 0.3, &mut random).moved(scale, Vec3::ZERO);
        let accels = ALL.map(|options| build(&[&mesh], &options));
        for i in 0..500 {
            let unit = test_ray(i, &mut random);
            // Short and long directions alike: distances then range over 10^±12 too.
            let d = if i % 2 == 0 { unit.d } else { unit.d * scale };
            let ray = Ray::new(unit.o * scale, d);
            let expected = brute_force(&[&mesh], &ray);
            for accel in &accels {
                let hit = accel.intersect(&ray);
                assert_eq!(hit, expected, "{ray:?}");
                assert_eq!(accel.occluded(&ray), expected.is_some(), "{ray:?}");
            }
        }
    }
}

#[test]
fn hc_g03_rays_leaving_a_triangle_by_its_error_bound_do_not_return() {
    let mut random = Random(3);
    let gamma_7 = 7.0 * f32::EPSILON * 0.5 / (1.0 - 7.0 * f32::EPSILON * 0.5);
    let mut left = 0;
    while left < 100_000 {
        let [size, place] = [0; 2].map(|_| 10.0_f32.powf(random.signed() * 8.0));
        let offset = random.vector() * place;
        let corners = [0; 3].map(|_| offset + random.vector() * size);
        let target = (corners[0] + corners[1] + corners[2]) / 3.0;
        let o = target + random.vector() * size * 10.0;
        if !is_hittable(corners) {
            continue;
        }
        let shear = Shear::new(o, target - o);
        let Some(hit) = shear.intersect(shear.permuted(corners)) else { continue };
        let parts = [corners[0] * (1.0 - hit.u - hit.v), corners[1] * hit.u, corners[2] * hit.v];
        let p = parts[0] + parts[1] + parts[2];
        let error = (parts[0].abs() + parts[1].abs() + parts[2].abs()) * gamma_7;
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        assert!((p.as_dvec3() - a).dot(normal).abs() <= error.as_dvec3().dot(normal.abs()), "{corners:?} {hit:?}");

        // Off the plane by the error bound, then outwards by the rounding of that sum (Pharr et al. 2023, 6.8.6).
        let n = normal.as_vec3();
        let moved = p + n * (n.abs().dot(error) * (1.0 + 4.0 * f32::EPSILON));
        let start = Vec3::from_array([0, 1, 2].map(|axis| match n[axis] {
            x if x > 0.0 => moved[axis].next_up(),
            x if x < 0.0 => moved[axis].next_down(),
            _ => moved[axis],
        }));
        for _ in 0..4 {
            let mut d = random.vector();
            d *= d.dot(n).signum();
            let shear = Shear::new(start, d);
            let again = shear.intersect(shear.permuted(corners));
            assert!(again.is_none_or(|hit| hit.t <= 0.0), "{corners:?} {start:?} {d:?} {again:?}");
            left += 1;
        }
    }
    measured("hc_g03_rays_leaving_a_triangle_by_its_error_bound_do_not_return", format!("0 of {left} rays come back"));
}

#[test]
fn hc_g05_a_room_far_away_has_no_holes() {
    let offset = Vec3::splat(1e5);
    let mut room = Mesh::default();
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            let n = Vec3::AXES[axis] * side;
            let [s, t] = [Vec3::AXES[(axis + 1) % 3] * 0.5, Vec3::AXES[(axis + 2) % 3] * 0.5];
            room.push([n - s - t, n + s - t, n + s + t]);
            room.push([n - s - t, n + s + t, n - s + t]);
        }
    }
    let accel = build(&[&room.moved(1.0, offset)], &ALL[0]);
    let mut random = Random(5);
    for _ in 0..50_000 {
        let ray = Ray::new(offset + random.vector() * 0.4, random.vector());
        assert!(accel.intersect(&ray).is_some(), "{ray:?}");
    }
}

#[test]
fn hc_g06_degenerate_triangles_are_counted_and_never_hit() {
    let mut mesh = Mesh::default();
    let (o, x) = (Vec3::ZERO, Vec3::X);
    for bad in [[o, x, x], [o, x, x * 3.0], [o, o, o], [o, x * 1e-20, Vec3::Y * 1e-20], [o, x, Vec3::NAN]] {
        mesh.push(bad);
    }
    for options in ALL {
        let accel = build(&[&mesh], &options);
        assert_eq!(accel.stats().degenerate, 5);
        assert_eq!(accel.stats().primitives, 0);
        assert!(accel.bounds().is_empty());
        assert_eq!(accel.intersect(&Ray::new(Vec3::new(0.5, 0.0, 1.0), Vec3::NEG_Z)), None);

        let mut mixed = mesh.clone();
        mixed.push([Vec3::ZERO, Vec3::X, Vec3::Y]);
        let hit = build(&[&mixed], &options).intersect(&Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z));
        assert_eq!(hit.map(|h| (h.t, h.prim)), Some((1.0, 5)));
    }
}

#[test]
fn hc_g09_coincident_triangles_build_quickly_and_are_traversed() {
    let count = 100_000;
    let mut random = Random(9);
    let scattered = Mesh::soup(count, 0.02, &mut random);
    let one = Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]; count] };
    for options in [ALL[0], ALL[2]] {
        // The quickest of three, since other tests run at the same time.
        let time = |mesh: &Mesh| {
            let once = || {
                let start = Instant::now();
                let accel = Accel::build(&[(0, mesh.geometry())], &options);
                (start.elapsed(), accel.is_ok())
            };
            [once(), once(), once()].into_iter().min().map(|(elapsed, _)| elapsed)
        };
        let (usual, coincident) = (time(&scattered).unwrap(), time(&one).unwrap());
        let accel = build(&[&one], &options);
        assert!(coincident < usual * 4, "{coincident:?} against {usual:?}");
        let hit = accel.intersect(&Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z)).unwrap();
        assert_eq!((hit.t, hit.prim), (1.0, 0));
        assert!(accel.occluded(&Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z)));
    }
}

#[test]
fn hc_g10_huge_and_flat_scenes_validate() {
    let mut mesh = Mesh::default();
    mesh.push([Vec3::splat(-1e38), Vec3::new(1e38, 0.0, 0.0), Vec3::new(0.0, 1e38, 0.0)]);
    mesh.push([Vec3::ZERO, Vec3::X, Vec3::Y]);
    for options in ALL {
        let accel = build(&[&mesh, &Mesh::grid(20, 0.0)], &options);
        let mut random = Random(10);
        for _ in 0..1000 {
            let _ = accel.intersect(&Ray::new(random.vector(), random.vector()));
        }
    }
    let endless = Arc::new(Ball { center: Vec3::ZERO, radius: f32::INFINITY });
    let error = Accel::build(&[(4, Geometry::Analytic(endless))], &BuildOptions::default()).err();
    assert_eq!(error.as_deref(), Some("shape 4: its bounds are not finite"));
}

#[test]
fn hc_g11_few_and_no_primitives() {
    for options in ALL {
        for count in 0..=3 {
            let mut mesh = Mesh::default();
            for i in 0..count {
                let z = Vec3::Z * i as f32;
                mesh.push([z, Vec3::X + z, Vec3::Y + z]);
            }
            let accel = build(&[&mesh], &options);
            let down = Ray::new(Vec3::new(0.25, 0.25, 10.0), Vec3::NEG_Z);
            let expected = (count > 0).then(|| 10.0 - (count - 1) as f32);
            assert_eq!(accel.intersect(&down).map(|h| h.t), expected);
            assert_eq!(accel.occluded(&down), count > 0);
            assert_eq!(accel.stats().primitives, count);
        }
        assert!(Accel::build(&[], &options).unwrap().intersect(&Ray::new(Vec3::ZERO, Vec3::X)).is_none());
    }
}

#[test]
fn hc_g12_garbage_meshes_build_and_trace() {
    for seed in 0..1000 {
        let mut random = Random(seed);
        let mut mesh = Mesh::default();
        for _ in 0..random.bits() % 60 {
            mesh.push([0; 3].map(|_| Vec3::from_array([0; 3].map(|_| f32::from_bits(random.bits())))));
        }
        let accel = build(&[&mesh], &ALL[seed as usize % 4]);
        for _ in 0..100 {
            let [o, d] = [0; 2].map(|_| Vec3::from_array([0; 3].map(|_| f32::from_bits(random.bits()))));
            for ray in [Ray::new(o, d), Ray::new(random.vector(), random.vector())] {
                if let Some(hit) = accel.intersect(&ray) {
                    assert!(hit.t > 0.0 && hit.t.is_finite(), "{hit:?}");
                }
                let _ = accel.occluded(&ray);
            }
        }
    }
    let outside = Mesh { positions: vec![Vec3::ZERO; 3], triangles: vec![[0, 1, 2], [0, 1, 3]] };
    let error = Accel::build(&[(2, outside.geometry())], &BuildOptions::default()).err();
    assert_eq!(error.as_deref(), Some("shape 2: triangle 1 refers to vertices [0, 1, 3] of 3"));
}

#[test]
fn hc_g13_rays_that_are_none_miss() {
    let accel = build(&[&Mesh::sphere(4)], &ALL[0]);
    let good = Ray::new(Vec3::ZERO, Vec3::ONE);
    assert!(accel.intersect(&good).is_some());
    let mut bad = vec![Ray { d: Vec3::ZERO, ..good }];
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut spoiled = Vec3::ONE;
            spoiled[axis] = x;
            bad.extend([Ray { o: spoiled, ..good }, Ray { d: spoiled, ..good }]);
        }
    }
    for t_max in [-1.0, 0.0, f32::NAN, f32::NEG_INFINITY] {
        bad.push(Ray { t_max, ..good });
    }
    bad.extend([Ray { t_min: f32::NAN, ..good }, Ray { t_min: f32::INFINITY, ..good }]);
    for ray in &bad {
        assert_eq!(accel.intersect(ray), None, "{ray:?}");
        assert!(!accel.occluded(ray), "{ray:?}");
    }
    let negative = Ray { t_min: -5.0, ..good };
    assert_eq!(accel.intersect(&negative), accel.intersect(&good));
}

#[test]
fn hc_g14_rays_within_planes_of_boxes_and_triangles() {
    // A closed cube of 8 × 8 squares a side: rays along its grid lines and in planes of its squares.
    let n = 8;
    let mut cube = Mesh::default();
    for side in [0.0, 1.0] {
        let face = Mesh::grid(n, side);
        for axis in 0..3 {
            for triangle in 0..face.triangles.len() {
                cube.push(face.corners(triangle).map(|p| match axis {
                    0 => p,
                    1 => Vec3::new(p.z, p.x, p.y),
                    _ => Vec3::new(p.y, p.z, p.x),
                }));
            }
        }
    }
    for options in ALL {
        let accel = build(&[&cube], &options);
        for axis in 0..3 {
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                let [s, t] = [i, j].map(|k| k as f32 / n as f32);
                let mut o = Vec3::ZERO;
                o[axis] = -1.0;
                o[(axis + 1) % 3] = s;
                o[(axis + 2) % 3] = t;
                let ray = Ray::new(o, Vec3::AXES[axis]);
                let hit = accel.intersect(&ray).map(|hit| hit.t);
                assert_eq!(hit, Some(1.0), "{options:?} {ray:?}");
                // The side walls, which the ray lies in, are no hits: from the middle the far wall is next.
                o[axis] = 0.5;
                assert_eq!(accel.intersect(&Ray { o, ..ray }).map(|hit| hit.t), Some(0.5));
            }
        }
    }
}

#[test]
fn builds_are_the_same_for_any_number_of_threads() {
    let mut random = Random(16);
    let mesh = Mesh::soup(30_000, 0.05, &mut random);
    for options in [ALL[0], ALL[2]] {
        let built = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| build(&[&mesh], &options))
        });
        let [one, two] = built.each_ref().map(|accel| {
            let boxes = accel.tree.nodes.iter().flat_map(|n| n.rows.iter().flatten().map(|x| x.to_bits()));
            let words = accel.tree.nodes.iter().flat_map(|n| n.children.map(|c| c.0));
            let ids = accel.tree.packs.iter().flat_map(|p| p.ids);
            boxes.chain(words).chain(ids).collect::<Vec<_>>()
        });
        assert!(one == two);
    }
}
