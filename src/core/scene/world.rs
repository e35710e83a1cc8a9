//! A scene that can be rendered.

use super::object::{BuiltSensor, BuiltShape};
use crate::accel::{Accel, BuildOptions, Geometry, Hit, NO_INSTANCE, NO_TRIANGLE, Ray};
use crate::interfaces::{Bsdf, Emitter, EmitterFlags, Integrator, Light, LightPoint, LightSample, Lobes, SurfaceHit};
use crate::math::{ONE_MINUS_EPSILON, Transform, Vec2, Vec3};
use crate::sampling::Discrete;
use std::sync::Arc;

/// Index of an emitter in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EmitterId(pub u32);

/// The emitter of a shape that has none, in the table of a [`Scene`].
const NO_EMITTER: u32 = u32::MAX;

/// Shapes that are placed many times by instances. Has no lights.
pub struct ShapeGroup {
    shapes: Vec<BuiltShape>,
    accel: Accel,
}

impl AsRef<Accel> for ShapeGroup {
    fn as_ref(&self) -> &Accel {
        &self.accel
    }
}

impl ShapeGroup {
    /// Builds the acceleration structure over the shapes.
    pub fn new(shapes: Vec<BuiltShape>) -> Result<Self, String> {
        let accel = build_accel(&shapes)?;
        Ok(ShapeGroup { shapes, accel })
    }

    /// The acceleration structure, in the group's own space.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// The shapes.
    pub fn shapes(&self) -> &[BuiltShape] {
        &self.shapes
    }
}

fn build_accel(shapes: &[BuiltShape]) -> Result<Accel, String> {
    let items: Vec<(u32, Geometry<'_>)> =
        shapes.iter().enumerate().map(|(i, s)| (i as u32, s.shape.geometry())).collect();
    Accel::build(&items, &BuildOptions::default())
}

/// How an emitter is picked.
enum LightChoice {
    /// None gives off light.
    Nothing,
    /// All have the same chance.
    Uniform,
    /// By weight.
    Weighted(Discrete),
}

impl LightChoice {
    /// By the scene's weights, but never one that gives off no light: a black one, or one without area.
    fn new(emitters: &[Arc<dyn Emitter>]) -> Result<Self, String> {
        if !emitters.is_empty() && emitters.iter().all(|e| e.sampling_weight() == 0.0) {
            return Err("the sampling weights of all emitters are zero".to_owned());
        }
        // The power of what surrounds a scene grows with its size; whether it is zero must not depend on that.
        let weight = |e: &Arc<dyn Emitter>| if e.power(Vec3::ZERO, 1.0) == 0.0 { 0.0 } else { e.sampling_weight() };
        if !emitters.is_empty() && emitters.iter().all(|e| weight(e) == 1.0) {
            return Ok(LightChoice::Uniform);
        }
        let weighted = Discrete::new(emitters.iter().map(|e| f64::from(weight(e))));
        Ok(weighted.map_or(LightChoice::Nothing, LightChoice::Weighted))
    }
}

/// A scene ready to render. Nothing in it changes any more.
pub struct Scene {
    shapes: Vec<BuiltShape>,
    emitters: Vec<Arc<dyn Emitter>>,
    /// For each emitter, the number of its shape's first triangle for [`Ray::ends`].
    pub(super) first_triangles: Vec<u32>,
    /// For each shape its emitter, or [`NO_EMITTER`].
    emitter_of_shape: Vec<u32>,
    environment: Option<EmitterId>,
    accel: Accel,
    sensors: Vec<BuiltSensor>,
    integrator: Option<Arc<dyn Integrator>>,
    light_choice: LightChoice,
    /// See [`use_reference_offsets`](Scene::use_reference_offsets).
    reference_offsets: bool,
}

impl Scene {
    /// Puts a scene together. `emitters` are those that sit on no shape. Emitters are numbered shapes' first, then
    /// the others, unless `order` (a shape index for a shape's light, or the index of a free emitter) says otherwise.
    pub fn new(
        shapes: Vec<BuiltShape>,
        order: &[EmitterSource],
        sensors: Vec<BuiltSensor>,
        integrator: Option<Arc<dyn Integrator>>,
    ) -> Result<Self, String> {
        let accel = build_accel(&shapes)?;
        let mut emitter_of_shape = vec![NO_EMITTER; shapes.len()];
        let mut emitters: Vec<Arc<dyn Emitter>> = Vec::with_capacity(order.len());
        let mut environment = None;
        let mut first_triangles = Vec::with_capacity(order.len());
        for source in order {
            let id = emitters.len() as u32;
            match source {
                EmitterSource::Shape(shape) => {
                    if let Some(emitter) = &shapes[*shape].emitter {
                        emitter_of_shape[*shape] = id;
                        emitters.push(emitter.clone());
                        first_triangles.push(accel.first_triangle(*shape as u32).unwrap_or(NO_TRIANGLE));
                    }
                }
                EmitterSource::Free(emitter) => {
                    if emitter.flags().has(EmitterFlags::ENVIRONMENT) {
                        environment = Some(EmitterId(id));
                    }
                    emitters.push(emitter.clone());
                    first_triangles.push(NO_TRIANGLE);
                }
            }
        }
        let light_choice = LightChoice::new(&emitters)?;
        Ok(Scene {
            shapes,
            emitters,
            first_triangles,
            emitter_of_shape,
            environment,
            accel,
            sensors,
            integrator,
            light_choice,
            reference_offsets: false,
        })
    }

    /// The nearest hit.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.accel.intersect(ray)
    }

    /// Whether anything lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.accel.occluded(ray)
    }

    /// The nearest hit in full.
    #[inline]
    pub fn intersect_surface(&self, ray: &Ray) -> Option<SurfaceHit> {
        let mut surface = SurfaceHit::default();
        self.find_surface(ray, &mut surface).then_some(surface)
    }

    /// The nearest hit in full, written in place; whether there is any.
    #[inline]
    pub fn find_surface(&self, ray: &Ray, surface: &mut SurfaceHit) -> bool {
        let hit = self.intersect(ray);
        if let Some(hit) = &hit {
            self.surface(ray, hit, surface);
        }
        hit.is_some()
    }

    /// A hit in full, written in place.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit, surface: &mut SurfaceHit) {
        if hit.instance == NO_INSTANCE {
            self.shapes[hit.shape as usize].shape.surface(ray, hit, surface);
        } else {
            self.instance_surface(ray, hit, surface);
        }
        surface.shape = hit.shape;
        surface.prim = hit.prim;
        surface.instance = hit.instance;
        surface.triangle = hit.triangle;
        surface.wi = surface.frame.to_local(-ray.d);
        if self.reference_offsets {
            surface.p_error = reference_offset(surface);
        }
    }

    /// Lets rays start as far off surfaces as the reference's do, instead of just outside the rounding error, and lets
    /// them pass where [`keeps_sides`](Self::keeps_sides) would not: only for comparisons sample for sample. Light leaks
    /// through thin gaps and tilted normals, as in the reference.
    pub fn use_reference_offsets(&mut self) {
        self.reference_offsets = true;
    }

    /// Whether light that is scattered into local direction `wo` leaves on the side that its shading frame says: what
    /// is reflected on the side it came from, what is transmitted on the other. Where shading normals are tilted, light
    /// would pass through opaque surfaces otherwise.
    #[inline]
    pub fn keeps_sides(&self, hit: &SurfaceHit, wo: Vec3) -> bool {
        if hit.frame.n == hit.n || self.reference_offsets {
            return true;
        }
        let n = hit.to_local(hit.n);
        (hit.wi.z * wo.z > 0.0) == (hit.wi.dot(n) * wo.dot(n) > 0.0)
    }

    #[cold]
    fn instance_surface(&self, ray: &Ray, hit: &Hit, surface: &mut SurfaceHit) {
        let instance = &self.shapes[hit.instance as usize].shape;
        match instance.instance() {
            Some(instance) => {
                let shape = &instance.group().shapes[hit.shape as usize].shape;
                shape.surface(&instance.local(ray), hit, surface);
                *surface = transform_hit(surface, &instance.to_world());
            }
            None => instance.surface(ray, hit, surface),
        }
    }

    fn built_shape(&self, hit: &SurfaceHit) -> &BuiltShape {
        if hit.instance == NO_INSTANCE {
            return &self.shapes[hit.shape as usize];
        }
        match self.shapes[hit.instance as usize].shape.instance() {
            Some(instance) => &instance.group().shapes[hit.shape as usize],
            None => &self.shapes[hit.instance as usize],
        }
    }

    /// The material at a hit.
    #[inline]
    pub fn bsdf(&self, hit: &SurfaceHit) -> &dyn Bsdf {
        &*self.built_shape(hit).bsdf
    }

    /// The emitter of the shape that was hit.
    #[inline]
    pub fn emitter_at(&self, hit: &SurfaceHit) -> Option<EmitterId> {
        if hit.instance != NO_INSTANCE {
            return None;
        }
        match self.emitter_of_shape[hit.shape as usize] {
            NO_EMITTER => None,
            id => Some(EmitterId(id)),
        }
    }

    /// An emitter.
    #[inline]
    pub fn emitter(&self, id: EmitterId) -> &dyn Emitter {
        &*self.emitters[id.0 as usize]
    }

    /// All emitters.
    pub fn emitters(&self) -> &[Arc<dyn Emitter>] {
        &self.emitters
    }

    /// The emitter that surrounds the scene.
    #[inline]
    pub fn environment(&self) -> Option<EmitterId> {
        self.environment
    }

    /// Whether there are surfaces through which a ray sees lights that emitter sampling cannot.
    pub fn has_windows(&self) -> bool {
        let is_window = |shape: &BuiltShape| shape.bsdf.lobes().intersects(Lobes::NULL | Lobes::DELTA_TRANSMISSION);
        self.shapes.iter().any(|shape| match shape.shape.instance() {
            Some(instance) => instance.group().shapes.iter().any(is_window),
            None => is_window(shape),
        })
    }

    /// All shapes.
    pub fn shapes(&self) -> &[BuiltShape] {
        &self.shapes
    }

    /// All sensors.
    pub fn sensors(&self) -> &[BuiltSensor] {
        &self.sensors
    }

    /// The integrator the scene asks for.
    pub fn integrator(&self) -> Option<&Arc<dyn Integrator>> {
        self.integrator.as_ref()
    }

    /// The acceleration structure.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// Centre and radius of the sphere around everything.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        self.accel.bounds().bounding_sphere()
    }

    /// Chance with which [`choose_emitter`](Self::choose_emitter) picks an emitter.
    #[inline]
    pub fn emitter_pmf(&self, id: EmitterId) -> f32 {
        match &self.light_choice {
            LightChoice::Nothing => 0.0,
            LightChoice::Uniform => 1.0 / self.emitters.len() as f32,
            LightChoice::Weighted(distribution) => distribution.pmf(id.0),
        }
    }

    /// Picks an emitter by the scene's weights and gives back what is left of `u`.
    #[inline]
    pub fn choose_emitter(&self, u: f32) -> Option<(EmitterId, f32, f32)> {
        match (&self.light_choice, self.emitters.len()) {
            (LightChoice::Nothing, _) => None,
            (LightChoice::Uniform, 1) => Some((EmitterId(0), 1.0, u)),
            (LightChoice::Uniform, count) => {
                let scaled = u * count as f32;
                let index = (scaled as u32).min(count as u32 - 1);
                Some((EmitterId(index), 1.0 / count as f32, (scaled - index as f32).min(ONE_MINUS_EPSILON)))
            }
            (LightChoice::Weighted(distribution), _) => {
                let (index, rest) = distribution.sample_reuse(u);
                Some((EmitterId(index), distribution.pmf(index), rest))
            }
        }
    }

    /// Picks an emitter by the scene's weights and samples it as seen from `from`. The chance of the pick is part of
    /// density and weight. Visibility is not tested.
    #[inline]
    pub fn sample_emitter(&self, from: Vec3, mut u2: Vec2) -> Option<(EmitterId, LightSample)> {
        let (id, pmf, rest) = self.choose_emitter(u2.x)?;
        u2.x = rest;
        Some((id, self.sample_light(Light::whole(id), pmf, from, u2)?))
    }

    /// Density with which [`sample_emitter`](Self::sample_emitter) gives this point of this emitter.
    #[inline]
    pub fn pdf_emitter(&self, id: EmitterId, from: Vec3, point: &LightPoint) -> f32 {
        self.emitter(id).pdf_direct(from, point) * self.emitter_pmf(id)
    }

    /// Whether light from the sample reaches the hit.
    #[inline]
    pub fn visible(&self, hit: &SurfaceHit, light: &LightSample) -> bool {
        !self.occluded(&shadow_ray(hit, light))
    }
}

/// The error bound that makes a ray start `(1 + max|p|) ε` off the surface, with the reference's ε of 1500 roundoffs.
#[cold]
fn reference_offset(hit: &SurfaceHit) -> Vec3 {
    const EPSILON: f32 = 1500.0 * f32::EPSILON * 0.5;
    hit.n.abs() * ((1.0 + hit.p.abs().max_element()) * EPSILON)
}

/// The ray from a hit to a light sample: it ends just before the error box of the light's point.
#[inline]
pub fn shadow_ray(hit: &SurfaceHit, light: &LightSample) -> Ray {
    let point = &light.point;
    if point.distance.is_infinite() {
        return hit.leave(point.d);
    }
    let o = hit.origin_towards(point.d);
    let to = crate::math::error_bounds::offset_origin(point.p, light.p_error, point.n, o - point.p);
    Ray { o, d: to - o, t_min: 0.0, t_max: 1.0, ends: [hit.triangle, point.triangle] }
}

/// A hit of a group's shape in world space.
fn transform_hit(hit: &SurfaceHit, to_world: &Transform) -> SurfaceHit {
    use crate::math::{Frame, error_bounds::gamma};
    let p = to_world.point(hit.p);
    // Error of the point in the group, carried through the matrix, plus the rounding of the transform itself
    // (Pharr, Jakob, Humphreys 2023, section 6.8.1) and that of the leaving ray when it is taken back to the group.
    let abs = |v: Vec3| {
        let m = to_world.matrix;
        m.x_axis.truncate().abs() * v.x.abs()
            + m.y_axis.truncate().abs() * v.y.abs()
            + m.z_axis.truncate().abs() * v.z.abs()
    };
    let p_error =
        abs(hit.p_error) * (1.0 + gamma(3)) + (abs(hit.p) + to_world.matrix.w_axis.truncate().abs()) * gamma(6);
    // A mirroring instance must not turn the normals of its group over: the reference does not either.
    let n = to_world.normal(hit.n).normalize_or_zero();
    let shading = to_world.normal(hit.frame.n).normalize_or_zero();
    let dp_du = to_world.vector(hit.dp_du);
    SurfaceHit {
        p,
        p_error,
        n,
        frame: Frame::from_tangent(shading, dp_du),
        dp_du,
        dp_dv: to_world.vector(hit.dp_dv),
        ..*hit
    }
}

/// Where an emitter of the scene comes from.
pub enum EmitterSource {
    /// The light of the shape with this index.
    Shape(usize),
    /// A light on no shape.
    Free(Arc<dyn Emitter>),
}
