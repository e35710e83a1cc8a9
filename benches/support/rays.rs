//! Rays as renderers trace them.

use super::mesh::Mesh;
use lucerna::core::accel::{Accel, NO_TRIANGLE, Ray};
use lucerna::core::interfaces::Sensor;
use lucerna::core::math::{Frame, UVec2, Vec2, Vec3};
use lucerna::core::sampling::{Pcg32, warp};

/// Rays of one kind, in the order of the pixels they are for.
pub struct RaySet {
    pub name: &'static str,
    /// Whether it is asked if anything is hit, and not what first.
    pub any: bool,
    pub rays: Vec<Ray>,
}

/// The part of the scene's size that secondary rays keep away from the surface they start on: so much that rounding does not
/// decide whether they hit it again, which is not what is compared.
const CLEARANCE: f32 = 1e-5;

/// The rays of a pinhole camera that looks down on [`landscape`](super::mesh::landscape), row by row.
pub fn above_landscape(pixels: u32) -> RaySet {
    let eye = Vec3::new(0.3, 0.9, 1.3);
    let forward = (Vec3::new(0.0, -0.05, 0.1) - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let down = forward.cross(right);
    primary(UVec2::splat((pixels as f32).sqrt() as u32), |film| {
        let offset = film - 0.5;
        Ray::new(eye, (forward + offset.x * right + offset.y * down).normalize())
    })
}

/// The rays of a sensor through the middles of about so many pixels, row by row.
pub fn of_sensor(sensor: &dyn Sensor, film: UVec2, pixels: u32) -> RaySet {
    let scale = (pixels as f32 / (film.x as f32 * film.y as f32)).sqrt();
    primary((film.as_vec2() * scale).as_uvec2().max(UVec2::ONE), |film| sensor.ray(film, Vec2::splat(0.5)).ray)
}

fn primary(size: UVec2, ray: impl Fn(Vec2) -> Ray) -> RaySet {
    let middle = |x: u32, y: u32| (UVec2::new(x, y).as_vec2() + 0.5) / size.as_vec2();
    let rays = (0..size.y).flat_map(|y| (0..size.x).map(move |x| (x, y))).map(|(x, y)| ray(middle(x, y))).collect();
    RaySet { name: "primary", any: false, rays }
}

/// From each point that primary rays hit, a ray in a direction that is cosine-distributed.
pub fn diffuse(mesh: &Mesh, accel: &Accel, primary: &RaySet) -> RaySet {
    let mut pcg = Pcg32::new(2, 2);
    let clearance = clearance(accel);
    let leave = |(p, n): (Vec3, Vec3)| {
        let d = Frame::from_normal(n).to_world(warp::square_to_cosine_hemisphere(uniform(&mut pcg)));
        Ray { t_min: clearance, ..Ray::new(p, d) }
    };
    RaySet { name: "diffuse", any: false, rays: hits(mesh, accel, primary).map(leave).collect() }
}

/// From each point that primary rays hit, the segment to a random point of the box around everything.
pub fn shadow(mesh: &Mesh, accel: &Accel, primary: &RaySet) -> RaySet {
    let mut pcg = Pcg32::new(3, 3);
    let (clearance, bounds) = (clearance(accel), accel.bounds());
    let connect = |(p, _): (Vec3, Vec3)| {
        let [u, v] = [uniform(&mut pcg), uniform(&mut pcg)];
        let d = bounds.min + (bounds.max - bounds.min) * Vec3::new(u.x, u.y, v.x) - p;
        Ray { o: p, d, t_min: clearance / d.length(), t_max: 1.0, ends: [NO_TRIANGLE; 2] }
    };
    RaySet { name: "shadow", any: true, rays: hits(mesh, accel, primary).map(connect).collect() }
}

fn clearance(accel: &Accel) -> f32 {
    let (center, radius) = accel.bounds().bounding_sphere();
    CLEARANCE * (center.length() + radius)
}

/// Where the rays hit, with the normals on the side they come from.
fn hits<'a>(mesh: &'a Mesh, accel: &'a Accel, rays: &'a RaySet) -> impl Iterator<Item = (Vec3, Vec3)> + 'a {
    rays.rays.iter().filter_map(|ray| {
        let hit = accel.intersect(ray)?;
        let [a, b, c] = mesh.triangles[hit.prim as usize].map(|i| mesh.positions[i as usize]);
        let n = (b - a).cross(c - a).normalize();
        let p = a + hit.u * (b - a) + hit.v * (c - a);
        Some((p, if n.dot(ray.d) > 0.0 { -n } else { n }))
    })
}

fn uniform(pcg: &mut Pcg32) -> Vec2 {
    let x = pcg.next_f32();
    Vec2::new(x, pcg.next_f32())
}
