//! Meshes of any size that need no file.

use lucerna::core::accel::{Accel, BuildOptions, Geometry};
use lucerna::core::math::{Vec2, Vec3};
use lucerna::core::sampling::{Pcg32, warp};
use lucerna::core::scene::Scene;
use std::f32::consts::TAU;

/// Triangles by index into positions.
#[derive(Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// Hills with bumpy boulders on them, in a box of about 2 × 0.6 × 2 around the origin with y up. Half of the triangles
/// are ground, in a regular grid; the other half are boulders, small ones with as many triangles as large ones. The same
/// for the same number, which is met to some percent.
pub fn landscape(triangles: usize) -> Mesh {
    const BOULDERS: usize = 256;
    let mut pcg = Pcg32::new(1, 1);
    let mut mesh = Mesh::default();
    let hills = Waves::new(&mut pcg, 7);
    let height = |x: f32, z: f32| 0.15 * hills.at(Vec3::new(x, 0.0, z));

    let cells = (triangles as f32 / 4.0).sqrt().ceil() as usize;
    mesh.add_grid(cells, cells, |u| {
        let [x, z] = (2.0 * u - 1.0).to_array();
        Vec3::new(x, height(x, z), z)
    });
    let rings = (triangles as f32 / (8 * BOULDERS) as f32).sqrt().ceil() as usize;
    for _ in 0..BOULDERS {
        let [x, z, size] = [(); 3].map(|()| pcg.next_f32());
        let [x, z, radius] = [1.9 * x - 0.95, 1.9 * z - 0.95, 0.01 + 0.07 * size * size];
        let center = Vec3::new(x, height(x, z), z);
        let bumps = Waves::new(&mut pcg, 4);
        mesh.add_grid(2 * rings, rings, |u| {
            let [sin_phi, cos_phi] = [(TAU * u.x).sin(), (TAU * u.x).cos()];
            let [sin_theta, cos_theta] = [(0.5 * TAU * u.y).sin(), (0.5 * TAU * u.y).cos()];
            let n = Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi);
            center + n * radius * (1.0 + 0.2 * bumps.at(n))
        });
    }
    mesh
}

/// All meshes of a scene in world space, those of instances as often as they are placed, and the number of shapes that
/// are something else and left out.
pub fn of_scene(scene: &Scene) -> (Mesh, usize) {
    let (mut mesh, mut others) = (Mesh::default(), 0);
    for built in scene.shapes() {
        match (built.shape.geometry(), built.shape.instance()) {
            (Geometry::Mesh { positions, triangles }, _) => mesh.add(positions.iter().copied(), triangles),
            (_, Some(instance)) => {
                let to_world = instance.to_world();
                for member in instance.group().shapes() {
                    match member.shape.geometry() {
                        Geometry::Mesh { positions, triangles } => {
                            mesh.add(positions.iter().map(|p| to_world.point(*p)), triangles);
                        }
                        Geometry::Analytic(_) => others += 1,
                    }
                }
            }
            _ => others += 1,
        }
    }
    (mesh, others)
}

impl Mesh {
    /// The tree over it, as a scene with this one shape has it.
    pub fn build(&self) -> Accel {
        let geometry = Geometry::Mesh { positions: &self.positions, triangles: &self.triangles };
        Accel::build(&[(0, geometry)], &BuildOptions::default()).expect("a tree")
    }

    fn add(&mut self, positions: impl Iterator<Item = Vec3>, triangles: &[[u32; 3]]) {
        let first = self.positions.len() as u32;
        self.positions.extend(positions);
        self.triangles.extend(triangles.iter().map(|corners| corners.map(|i| i + first)));
    }

    /// The image of [0, 1]², cut into cells of two triangles.
    fn add_grid(&mut self, columns: usize, rows: usize, point: impl Fn(Vec2) -> Vec3) {
        let first = self.positions.len();
        for j in 0..=rows {
            for i in 0..=columns {
                self.positions.push(point(Vec2::new(i as f32 / columns as f32, j as f32 / rows as f32)));
            }
        }
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let corner = |dj: usize, di: usize| (first + (j + dj) * (columns + 1) + i + di) as u32;
            self.triangles.push([corner(0, 0), corner(1, 0), corner(1, 1)]);
            self.triangles.push([corner(0, 0), corner(1, 1), corner(0, 1)]);
        }
    }
}

/// A sum of plane waves of random directions, each twice as short and half as high as the one before.
struct Waves(Vec<(Vec3, f32, f32)>);

impl Waves {
    fn new(pcg: &mut Pcg32, octaves: u32) -> Self {
        let wave = |octave| {
            let [x, y, phase] = [(); 3].map(|()| pcg.next_f32());
            let scale = 2_f32.powi(octave as i32);
            (warp::square_to_sphere(Vec2::new(x, y)) * 3.0 * scale, TAU * phase, scale.recip())
        };
        Waves((0..octaves).map(wave).collect())
    }

    fn at(&self, p: Vec3) -> f32 {
        self.0.iter().map(|(k, phase, height)| height * (k.dot(p) + phase).sin()).sum()
    }
}
