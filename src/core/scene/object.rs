//! A built object of any kind.

use crate::interfaces::{
    Bsdf, Emitter, Film, Guide, Integrator, LightSampler, Rfilter, Roulette, Sampler, Sensor, Shape, Texture,
};
use std::sync::Arc;

/// A shape with what the scene hangs on it.
#[derive(Clone)]
pub struct BuiltShape {
    /// The geometry.
    pub shape: Arc<dyn Shape>,
    /// Its material.
    pub bsdf: Arc<dyn Bsdf>,
    /// The light it gives off.
    pub emitter: Option<Arc<dyn Emitter>>,
}

/// A sensor with its film and sampler.
#[derive(Clone)]
pub struct BuiltSensor {
    /// The camera.
    pub sensor: Arc<dyn Sensor>,
    /// Its film.
    pub film: Arc<dyn Film>,
    /// Where its random numbers come from.
    pub sampler: Arc<dyn Sampler>,
}

/// A built object.
#[derive(Clone)]
#[allow(missing_docs)]
pub enum Object {
    Integrator(Arc<dyn Integrator>),
    Sensor(BuiltSensor),
    Film(Arc<dyn Film>),
    Rfilter(Arc<dyn Rfilter>),
    Sampler(Arc<dyn Sampler>),
    Emitter(Arc<dyn Emitter>),
    Shape(BuiltShape),
    LightSampler(Arc<dyn LightSampler>),
    Bsdf(Arc<dyn Bsdf>),
    Texture(Arc<dyn Texture>),
    Guide(Arc<dyn Guide>),
    Roulette(Arc<dyn Roulette>),
}
