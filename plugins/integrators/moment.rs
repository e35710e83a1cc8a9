//! `moment`: nested integrators and their second moments.
//!
//! For each nested integrator the channels `<name>.X`, `.Y`, `.Z` hold its colour in CIE XYZ, after its own extra
//! channels; then every channel `c` is repeated as `m2_c` with its square. The picture's colour is that of the first.
//!
//! ```xml
//! <integrator type="moment">
//!     <integrator type="path" name="image"/>
//! </integrator>
//! ```

use super::common::{COMMON, HIDE_IGNORED, timeout};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, CameraRay, Integrator, Radiance, RadianceEstimator};
use lucerna_core::render::{RenderContext, RenderError, Report, render_estimator};
use lucerna_core::sampling::Stream;
use lucerna_core::scene::{Built, Constructor, ObjectKind, Param, Plugin, Properties, Scene};
use std::sync::Arc;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "moment",
    aliases: &[],
    summary: "nested integrators and their second moments",
    params: &[COMMON, HIDE_IGNORED, &[Param::child(ObjectKind::Integrator, 1, usize::MAX, "what is measured")]],
    build: Constructor::Integrator(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Integrator> {
    let mut nested = Vec::new();
    let mut names = Vec::new();
    for (name, integrator) in p.integrators() {
        if integrator.estimator().is_none() {
            return Err(p.error(name, format!("integrator \"{name}\" cannot be nested")));
        }
        let own = integrator.aov_names();
        names.extend(own.iter().map(|aov| format!("{name}.{aov}")));
        names.extend(["X", "Y", "Z"].map(|c| format!("{name}.{c}")));
        nested.push((integrator, own.len()));
    }
    let squares: Vec<String> = names.iter().map(|n| format!("m2_{n}")).collect();
    names.extend(squares);
    Ok(Arc::new(Moment { nested, names, timeout: timeout(p) }))
}

struct Moment {
    /// Integrators with the number of their own extra channels.
    nested: Vec<(Arc<dyn Integrator>, usize)>,
    names: Vec<String>,
    timeout: Option<f64>,
}

impl Integrator for Moment {
    fn render(&self, cx: &mut RenderContext<'_>) -> Result<Report, RenderError> {
        render_estimator(cx, self)
    }

    fn aov_names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn timeout(&self) -> Option<f64> {
        self.timeout
    }

    fn estimator(&self) -> Option<&dyn RadianceEstimator> {
        Some(self)
    }
}

impl RadianceEstimator for Moment {
    fn wants_differentials(&self) -> bool {
        self.nested.iter().any(|(i, _)| i.estimator().is_some_and(RadianceEstimator::wants_differentials))
    }

    fn radiance(
        &self,
        scene: &Scene,
        camera: &CameraRay,
        stream: &mut Stream<'_>,
        arena: &mut Arena,
        aovs: &mut [f32],
    ) -> Radiance {
        let (values, squares) = aovs.split_at_mut(self.names.len() / 2);
        let mut first = None;
        let mut rays = 0;
        let mut at = 0;
        for (integrator, own) in &self.nested {
            let Some(estimator) = integrator.estimator() else { continue };
            let found = estimator.radiance(scene, camera, stream, arena, &mut values[at..at + own]);
            at += own;
            values[at..at + 3].copy_from_slice(&found.rgb.to_xyz());
            at += 3;
            rays += found.rays;
            first.get_or_insert(found);
        }
        for (square, value) in squares.iter_mut().zip(values.iter()) {
            *square = value * value;
        }
        let first = first.unwrap_or(Radiance { rgb: Rgb::BLACK, alpha: 0.0, rays: 0 });
        Radiance { rays, ..first }
    }
}
