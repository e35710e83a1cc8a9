//! Closed forms made once at load where no texture varies them, and at each hit where one does.

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Arena, Bsdf, Bxdf, ColorSource, Lobes, ScalarSource, SurfaceHit};
use std::sync::Arc;

/// How a closed form follows from textures.
pub trait Recipe: Send + Sync + 'static {
    /// The closed form: plain data, since arena values are never dropped.
    type Form: Bxdf + Copy + 'static;

    /// All lobes that can occur anywhere.
    fn lobes(&self) -> Lobes;

    /// Whether the form is the same everywhere.
    fn is_constant(&self) -> bool;

    /// The form at a hit.
    fn at(&self, hit: &SurfaceHit) -> Self::Form;

    /// See [`Bsdf::null_transmission`].
    fn null_transmission(&self, _hit: &SurfaceHit) -> Rgb {
        Rgb::BLACK
    }

    /// See [`Bsdf::diffuse_reflectance`]; `None` asks for its default.
    fn diffuse_reflectance(&self, _hit: &SurfaceHit) -> Option<Rgb> {
        None
    }
}

/// The BSDF of a recipe.
pub fn bsdf<R: Recipe>(recipe: R) -> Arc<dyn Bsdf> {
    let constant = recipe.is_constant().then(|| recipe.at(&SurfaceHit::default()));
    Arc::new(FromRecipe { recipe, constant })
}

struct FromRecipe<R: Recipe> {
    recipe: R,
    constant: Option<R::Form>,
}

impl<R: Recipe> Bsdf for FromRecipe<R> {
    fn lobes(&self) -> Lobes {
        self.recipe.lobes()
    }

    fn resolve<'a>(&'a self, hit: &SurfaceHit, arena: &'a Arena) -> &'a dyn Bxdf {
        match &self.constant {
            Some(form) => form,
            None => arena.alloc(self.recipe.at(hit)),
        }
    }

    fn null_transmission(&self, hit: &SurfaceHit) -> Rgb {
        self.recipe.null_transmission(hit)
    }

    fn diffuse_reflectance(&self, hit: &SurfaceHit, arena: &Arena) -> Rgb {
        self.recipe.diffuse_reflectance(hit).unwrap_or_else(|| default_diffuse_reflectance(self, hit, arena))
    }
}

/// π times the value straight up.
fn default_diffuse_reflectance(bsdf: &dyn Bsdf, hit: &SurfaceHit, arena: &Arena) -> Rgb {
    use lucerna_core::{interfaces::Transport, math::Vec3};
    bsdf.resolve(hit, arena).eval_pdf(hit.wi, Vec3::Z, Transport::Radiance).0 * std::f32::consts::PI
}

/// Whether all of some colours are the same everywhere.
pub fn all_constant(colors: &[&ColorSource]) -> bool {
    colors.iter().all(|c| c.constant().is_some())
}

/// Whether all of some scalars are the same everywhere.
pub fn all_constant_scalars(scalars: &[&ScalarSource]) -> bool {
    scalars.iter().all(|s| s.constant().is_some())
}
