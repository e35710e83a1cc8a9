//! What integrators share: common parameters, multiple importance sampling, light that a ray runs into.

use super::lights::PickLights;
pub use crate::roulettes::survival;
use lucerna_core::accel::Ray;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{
    Bxdf, EmitterFlags, Integrator, LightPoint, LightSample, LightVertex, RadianceEstimator, SurfaceHit, Transport,
};
use lucerna_core::math::Vec2;
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{EmitterId, Failed, Param, Properties, Scene};
use std::sync::Arc;

/// Parameters of every integrator.
pub const COMMON: &[Param] = &[
    Param::float("timeout", -1.0, "seconds after which rendering stops; negative or 0: never (see also --seconds)"),
    Param::ignored("block_size", "hint for the reference renderer"),
    Param::ignored("samples_per_pass", "hint for the reference renderer"),
];

/// A parameter of integrators that gather light.
pub const HIDE: Param = Param::bool("hide_emitters", false, "lights are not seen directly");

/// The same parameter where it means nothing.
pub const HIDE_IGNORED: &[Param] = &[Param::ignored("hide_emitters", "of no effect: no light is gathered here")];

/// Parameters of integrators that follow paths.
pub const PATH: &[Param] = &[
    HIDE,
    Param::int("max_depth", -1, "longest path: 1 sees lights only, 2 direct light, -1 no limit").at_least(-1.0),
    Param::int("rr_depth", 5, "depth from which Russian roulette may end a path").at_least(1.0),
];

/// Seconds after which the scene wants rendering to stop, from [`COMMON`].
pub fn timeout(p: &Properties<'_>) -> Option<f64> {
    Some(p.double("timeout")).filter(|seconds| *seconds > 0.0)
}

/// How long paths get.
#[derive(Clone, Copy, Debug)]
pub struct PathLimits {
    /// Largest number of surface events plus one.
    pub max_depth: u32,
    /// Depth from which roulette is played.
    pub rr_depth: u32,
    /// Lights are invisible to the camera.
    pub hide_emitters: bool,
}

impl PathLimits {
    /// From [`PATH`].
    pub fn new(p: &Properties<'_>) -> Self {
        let number = |name: &str| u32::try_from(p.int(name)).unwrap_or(u32::MAX);
        PathLimits {
            max_depth: number("max_depth"),
            rr_depth: number("rr_depth"),
            hide_emitters: p.bool("hide_emitters"),
        }
    }
}

/// Power heuristic with exponent 2 (Veach 1997, section 9.2): the weight of the strategy with density `a`.
#[inline]
pub fn mis_weight(a: f32, b: f32) -> f32 {
    let (a, b) = (a * a, b * b);
    let weight = a / (a + b);
    if weight.is_finite() { weight } else { 0.0 }
}

/// Balance heuristic (Veach 1997, section 9.2): the weight of the strategy with density `a`.
#[inline]
pub fn balance_weight(a: f32, b: f32) -> f32 {
    let weight = a / (a + b);
    if weight.is_finite() { weight } else { 0.0 }
}

/// The numbers for a BSDF sample, drawn as the reference draws them in `direct` and the volume integrators: its compiler
/// evaluates the arguments from the last to the first. In `path` the order is written out, and the other.
#[inline]
pub fn pair_before_single(stream: &mut Stream<'_>) -> (f32, Vec2) {
    let pair = stream.next_2d();
    (stream.next_1d(), pair)
}

/// Where a path was last scattered into a density: what a light found by chance is weighted against.
#[derive(Clone, Copy)]
pub struct Scattered {
    /// The vertex.
    pub from: LightVertex,
    /// Density of the direction taken, per solid angle.
    pub pdf: f32,
}

/// The emitter a ray has run into, and its radiance; `None` where nothing shines.
#[inline]
pub fn emission(scene: &Scene, ray: &Ray, hit: Option<&SurfaceHit>) -> Option<(EmitterId, Rgb)> {
    let (id, radiance) = match hit {
        Some(hit) => {
            let id = scene.emitter_at(hit)?;
            (id, scene.emitter(id).radiance(hit))
        }
        None => {
            let id = scene.environment()?;
            (id, scene.emitter(id).background(ray.d))
        }
    };
    (!radiance.is_black()).then_some((id, radiance))
}

/// Light that a ray has run into.
#[derive(Clone, Copy)]
pub struct Met {
    /// Its radiance, with its weight against the sampling of lights.
    pub light: Rgb,
    /// The sampling of lights could not have found it.
    pub alone: bool,
}

/// As [`emission`], weighted by `heuristic` against the sampling of lights if the path was scattered into a density
/// before.
#[inline(always)]
pub fn weighted_emission(
    scene: &Scene,
    lights: &impl PickLights,
    ray: &Ray,
    hit: Option<&SurfaceHit>,
    last: Option<Scattered>,
    heuristic: impl Fn(f32, f32) -> f32,
) -> Option<Met> {
    let (id, radiance) = emission(scene, ray, hit)?;
    let Some(last) = last else { return Some(Met { light: radiance, alone: true }) };
    let point = match hit {
        Some(hit) => LightPoint::of_hit(last.from.p, hit, ray.d),
        None => LightPoint::of_environment(ray.d),
    };
    let pdf = lights.pdf(scene, id, &last.from, &point);
    Some(Met { light: radiance * heuristic(last.pdf, pdf), alone: pdf == 0.0 })
}

/// What a hit would scatter of a light sample if nothing stood between, unweighted, and the density of sampling its
/// direction from the BSDF.
#[inline(always)]
pub fn scattered(scene: &Scene, hit: &SurfaceHit, bxdf: &dyn Bxdf, light: &LightSample) -> (Rgb, f32) {
    let wo = hit.to_local(light.point.d);
    let (value, pdf) = bxdf.eval_pdf(hit.wi, wo, Transport::Radiance);
    let contribution = value * light.weight;
    if contribution.is_black() || !scene.keeps_sides(hit, wo) {
        return (Rgb::BLACK, pdf);
    }
    (contribution, pdf)
}

/// The first hit, or where lights are `hidden` the first that gives off none, written in place. Whether there is any.
#[inline]
pub fn find_surface(scene: &Scene, ray: &Ray, hidden: bool, hit: &mut SurfaceHit, rays: &mut u32) -> bool {
    if hidden {
        return find_surface_without_light(scene, ray, hit, rays);
    }
    *rays += 1;
    scene.find_surface(ray, hit)
}

fn find_surface_without_light(scene: &Scene, ray: &Ray, hit: &mut SurfaceHit, rays: &mut u32) -> bool {
    let mut ray = *ray;
    loop {
        *rays += 1;
        if !scene.find_surface(&ray, hit) {
            return false;
        }
        let shines = scene.emitter_at(hit).is_some_and(|id| scene.emitter(id).flags().has(EmitterFlags::SURFACE));
        if !shines {
            return true;
        }
        ray = Ray { t_max: ray.t_max - hit.t, ..hit.leave(ray.d) };
    }
}

/// An integrator inside another one.
pub struct Nested<'a> {
    /// The name it was given.
    pub name: String,
    /// Its own extra channels.
    pub aovs: Vec<String>,
    inner: Inner<'a>,
}

/// What is inside: the integrator, or its estimator as it was made ready for a scene.
enum Inner<'a> {
    Integrator(Arc<dyn Integrator>),
    Same(&'a dyn RadianceEstimator),
    Prepared(Box<dyn RadianceEstimator + 'a>),
}

impl Nested<'_> {
    /// All nested integrators in file order; one that is no forward estimator is an error.
    pub fn all(p: &Properties<'_>) -> Result<Vec<Nested<'static>>, Failed> {
        let nest = |(name, integrator): (&str, Arc<dyn Integrator>)| match integrator.estimator() {
            Some(_) => {
                let (name, aovs) = (name.to_owned(), integrator.aov_names());
                Ok(Nested { name, aovs, inner: Inner::Integrator(integrator) })
            }
            None => Err(p.error(name, format!("integrator \"{name}\" cannot be nested"))),
        };
        p.integrators().into_iter().map(nest).collect()
    }

    /// All of them ready for a scene; `None` where nothing has to be made.
    pub fn prepare<'b>(nested: &'b [Nested<'_>], scene: &Scene) -> Option<Vec<Nested<'b>>> {
        let mut any = false;
        let ready = nested.iter().filter_map(|n| {
            let estimator = n.estimator()?;
            let inner = match estimator.prepare(scene) {
                Some(prepared) => {
                    any = true;
                    Inner::Prepared(prepared)
                }
                None => Inner::Same(estimator),
            };
            Some(Nested { name: n.name.clone(), aovs: n.aovs.clone(), inner })
        });
        let ready = ready.collect();
        any.then_some(ready)
    }

    /// Its own extra channels as the outer integrator names them.
    pub fn aov_names(&self) -> impl Iterator<Item = String> {
        self.aovs.iter().map(|aov| format!("{}.{aov}", self.name))
    }

    /// The estimator; always there for what [`all`](Self::all) gave.
    pub fn estimator(&self) -> Option<&dyn RadianceEstimator> {
        match &self.inner {
            Inner::Integrator(integrator) => integrator.estimator(),
            Inner::Same(estimator) => Some(*estimator),
            Inner::Prepared(estimator) => Some(&**estimator),
        }
    }

    /// Whether any of them reads ray differentials.
    pub fn want_differentials(nested: &[Nested<'_>]) -> bool {
        nested.iter().any(|n| n.estimator().is_some_and(RadianceEstimator::wants_differentials))
    }
}

/// Replaces the estimator-independent part of a plugin: an integrator that is a plain forward estimator, with a field
/// `timeout`.
macro_rules! forward_integrator {
    ($type:ty) => {
        forward_integrator!($type, |_| Vec::new());
    };
    ($type:ty, $aov_names:expr) => {
        impl lucerna_core::interfaces::Integrator for $type {
            fn render(
                &self,
                cx: &mut lucerna_core::render::RenderContext<'_>,
            ) -> Result<lucerna_core::render::Report, lucerna_core::render::RenderError> {
                lucerna_core::render::render_estimator(cx, self)
            }

            fn aov_names(&self) -> Vec<String> {
                let names: fn(&$type) -> Vec<String> = $aov_names;
                names(self)
            }

            fn timeout(&self) -> Option<f64> {
                self.timeout
            }

            fn estimator(&self) -> Option<&dyn lucerna_core::interfaces::RadianceEstimator> {
                Some(self)
            }
        }
    };
}
pub(crate) use forward_integrator;
