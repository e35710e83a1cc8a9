//! Where the light of a cluster starts and goes, and what it may bring to a vertex.

use lucerna_core::interfaces::{LightBounds, LightVertex};
use lucerna_core::math::{Aabb, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Lights together: their box, a cone of their normals, and what they give off.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    pub bounds: Aabb,
    /// Unit middle of the cone of normals.
    pub axis: Vec3,
    /// Half its opening angle, and the angle from it in which light is given off; radians.
    pub theta_o: f32,
    pub theta_e: f32,
    /// Sum of the lights' intensities in W·sr⁻¹, in double precision so that no light vanishes in it.
    pub intensity: f64,
}

impl Cluster {
    /// A single light with a sampling weight.
    pub fn of_light(light: &LightBounds, weight: f64) -> Self {
        // Room for the rounding of a box's middle and extent, so that no point of the light is outside of them.
        let LightBounds { bounds, axis, theta_o, theta_e, intensity } = *light;
        let room = bounds.min.abs().max(bounds.max.abs()) * (4.0 * f32::EPSILON);
        let usable = bounds.is_finite() && intensity > 0.0 && axis.is_finite();
        let intensity = if usable { f64::from(intensity.min(f32::MAX)) * weight } else { 0.0 };
        // Very faint is not dark; smaller numbers are zero in a node.
        let intensity = if intensity > 0.0 { intensity.max(f64::from(f32::MIN_POSITIVE)) } else { 0.0 };
        let bounds = Aabb { min: bounds.min - room, max: bounds.max + room };
        Cluster { bounds, axis, theta_o, theta_e, intensity }
    }

    /// Both together (Conty Estevez and Kulla 2018, algorithm 1).
    pub fn union(&self, other: &Cluster) -> Cluster {
        let (axis, theta_o) = join_cones((self.axis, self.theta_o), (other.axis, other.theta_o));
        Cluster {
            bounds: self.bounds.union(other.bounds),
            axis,
            theta_o,
            theta_e: self.theta_e.max(other.theta_e),
            intensity: self.intensity + other.intensity,
        }
    }

    /// Cost of a node with these lights, but for a factor (equations 1 and 2).
    pub fn cost(&self) -> f64 {
        // A box without area, of lights in a line, still is better short than long.
        let area = self.bounds.half_area() + 1e-2 * self.bounds.extent().length_squared();
        self.intensity * f64::from(area) * f64::from(self.orientation())
    }

    /// Measure of the directions light goes to.
    fn orientation(&self) -> f32 {
        let (theta_o, theta_w) = (self.theta_o, (self.theta_o + self.theta_e).min(PI));
        let (sin_o, cos_o) = theta_o.sin_cos();
        let falloff = 2.0 * theta_w * sin_o - (theta_o - 2.0 * theta_w).cos() - 2.0 * theta_o * sin_o + cos_o;
        (2.0 * PI * (1.0 - cos_o) + FRAC_PI_2 * falloff).max(1e-3)
    }
}

/// A cone around two cones.
fn join_cones(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    let cross = wide.0.cross(narrow.0);
    let sin = cross.length();
    let between = sin.atan2(wide.0.dot(narrow.0));
    if (between + narrow.1).min(PI) <= wide.1 {
        return wide;
    }
    let theta = 0.5 * (wide.1 + between + narrow.1);
    if theta >= PI {
        return (wide.0, PI);
    }
    if sin < 1e-6 {
        // In one line: next to each other the wide one's axis will do, back to back there is no way to turn.
        return if between < 1.0 { (wide.0, (between + narrow.1).max(wide.1)) } else { (wide.0, PI) };
    }
    let (sin_turn, cos_turn) = (theta - wide.1).sin_cos();
    let axis = wide.0 * cos_turn + (cross / sin).cross(wide.0) * sin_turn;
    (axis.normalize_or(wide.0), theta)
}

/// What of a node's bounds the importance looks at.
pub struct Seen {
    pub bounds: Aabb,
    pub axis: Vec3,
    pub cos_o: f32,
    pub cos_e: f32,
}

/// Cosines that are this far beyond a bound may come from rounding.
const SLACK: f32 = 1e-4;

/// Least factor for an angle that is within its bounds: light that goes nearly along a surface.
const GRAZING: f32 = 1e-2;

/// Cosine and sine of `a - b`, or of 0 if `b` is larger: angles in [0, π], each as its cosine and sine.
#[inline]
fn angle_beyond(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    if a.0 >= b.0 { (1.0, 0.0) } else { (a.0 * b.0 + a.1 * b.1, a.1 * b.0 - a.0 * b.1) }
}

#[inline]
fn with_sine(cos: f32) -> (f32, f32) {
    (cos, (1.0 - cos * cos).max(0.0).sqrt())
}

impl Seen {
    /// Irradiance that the lights may cause at the vertex, per intensity (Conty Estevez and Kulla 2018, equation 3). Zero
    /// only if no point of them can light it.
    #[inline]
    pub fn importance(&self, from: &LightVertex) -> f64 {
        let to = self.bounds.center() - from.p;
        let half = self.bounds.extent() * 0.5;
        let (distance2, radius2) = (to.length_squared(), half.length_squared());
        // Squares that leave the range of numbers: then only the intensity counts.
        if !(distance2 < 1e37 && radius2 < 1e37) {
            return 1e-37;
        }
        // The mean of 1/d² over a ball of radius R is 3/R² in its middle and 1/d² far away; a box is like a ball with
        // R² of half its squared half diagonal.
        let falloff = 1.0 / f64::from((distance2 + radius2 * (1.0 / 6.0)).max(f32::MIN_POSITIVE));
        if distance2 <= radius2 * (1.0 + SLACK) {
            return falloff;
        }
        let d = to / distance2.sqrt();
        let sin2_u = radius2 / distance2;
        let uncertain = ((1.0 - sin2_u).sqrt(), sin2_u.sqrt());
        let at_light = with_sine(-self.axis.dot(d));
        let (cos_light, _) = angle_beyond(angle_beyond(at_light, with_sine(self.cos_o)), uncertain);
        if cos_light < self.cos_e - SLACK {
            return 0.0;
        }
        let mut cos_surface = 1.0;
        if from.n != Vec3::ZERO {
            (cos_surface, _) = angle_beyond(with_sine(from.n.dot(d)), uncertain);
            if cos_surface < -SLACK {
                return 0.0;
            }
        }
        falloff * f64::from(cos_light.max(GRAZING) * cos_surface.max(GRAZING))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna_core::math::Vec2;
    use lucerna_core::sampling::{Pcg32, warp};

    fn direction(pcg: &mut Pcg32) -> Vec3 {
        warp::square_to_sphere(Vec2::new(pcg.next_f32(), pcg.next_f32()))
    }

    #[test]
    fn a_joined_cone_holds_both() {
        let mut pcg = Pcg32::new(1, 1);
        let mut proper = 0;
        for i in 0..2000 {
            let (a, mut b) = (direction(&mut pcg), direction(&mut pcg));
            if i % 3 == 0 {
                b = (a + b * 10f32.powi(-(i % 7))).normalize();
            }
            if i % 50 == 0 {
                b = if i % 100 == 0 { a } else { -a };
            }
            let [oa, ob] = [0, 1].map(|_| pcg.next_f32().powi(3) * PI);
            let (axis, theta) = join_cones((a, oa), (b, ob));
            proper += u32::from(theta < PI);
            assert!(axis.is_normalized());
            for (other, half) in [(a, oa), (b, ob)] {
                let needed = (axis.cross(other).length().atan2(axis.dot(other)) + half).min(PI);
                assert!(needed <= theta + 1e-5, "{a} {oa} {b} {ob}: {axis} {theta} {needed}");
            }
            assert!(
                theta <= 0.5 * (oa + ob + a.angle_between(b)).min(2.0 * PI) + 1e-3
                    || theta == oa.max(ob)
                    || theta == PI
            );
        }
        assert!(proper > 500);
    }

    /// Nor has it one that is out of proportion to what a point of the cluster brings.
    #[test]
    fn no_lit_vertex_has_importance_zero() {
        let mut pcg = Pcg32::new(4, 1);
        let mut lit = 0;
        for _ in 0..20_000 {
            let normals: Vec<Vec3> = (0..3).map(|_| direction(&mut pcg)).collect();
            let places: Vec<Vec3> = (0..3).map(|_| direction(&mut pcg) * pcg.next_f32()).collect();
            let one = |i: usize| {
                let bounds = Aabb::of_points([places[i]]);
                let light = LightBounds { bounds, axis: normals[i], theta_o: 0.0, theta_e: FRAC_PI_2, intensity: 1.0 };
                Cluster::of_light(&light, 1.0)
            };
            let c = one(0).union(&one(1)).union(&one(2));
            let seen = Seen { bounds: c.bounds, axis: c.axis, cos_o: c.theta_o.cos(), cos_e: c.theta_e.cos() };
            let from = LightVertex { p: direction(&mut pcg) * (3.0 * pcg.next_f32()), n: direction(&mut pcg) };
            let brings = |i: usize| {
                let to = places[i] - from.p;
                to.dot(from.n).max(0.0) * (-to).dot(normals[i]).max(0.0) / to.length_squared().powi(2)
            };
            let most = (0..3).map(brings).fold(0.0, f32::max);
            if most > 0.0 {
                lit += 1;
                let radius2 = 0.25 * c.bounds.extent().length_squared();
                let distance2 = (0..3).map(|i| places[i].distance_squared(from.p)).fold(f32::INFINITY, f32::min);
                let clamped = most * distance2 / (distance2.sqrt() + 2.0 * radius2.sqrt()).powi(2).max(radius2);
                let importance = seen.importance(&from);
                assert!(importance >= f64::from(clamped) * 0.99, "{importance} {clamped} {from:?} {c:?}");
            }
        }
        assert!(lit > 5000, "{lit}");
    }
}
