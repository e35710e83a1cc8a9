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

use super::common::{COMMON, HIDE_IGNORED, Nested, forward_integrator, timeout};
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, CameraRay, Integrator, Radiance, RadianceEstimator};
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
    let nested = Nested::all(p)?;
    let colour = |n: &Nested<'_>| ["X", "Y", "Z"].map(|c| format!("{}.{c}", n.name));
    let mut names: Vec<String> = nested.iter().flat_map(|n| n.aov_names().chain(colour(n))).collect();
    let squares: Vec<String> = names.iter().map(|n| format!("m2_{n}")).collect();
    names.extend(squares);
    Ok(Arc::new(Moment { nested, names, timeout: timeout(p) }))
}

struct Moment<'a> {
    nested: Vec<Nested<'a>>,
    names: Vec<String>,
    timeout: Option<f64>,
}

forward_integrator!(Moment<'static>, |this| this.names.clone());

impl RadianceEstimator for Moment<'_> {
    fn prepare(&self, scene: &Scene) -> Option<Box<dyn RadianceEstimator + '_>> {
        let nested = Nested::prepare(&self.nested, scene)?;
        Some(Box::new(Moment { nested, names: self.names.clone(), timeout: self.timeout }))
    }

    fn wants_differentials(&self) -> bool {
        Nested::want_differentials(&self.nested)
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
        for inner in &self.nested {
            let Some(estimator) = inner.estimator() else { continue };
            let own = inner.aovs.len();
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
