//! How the kernel of `path` asks roulette: compiled in where it goes by the throughput, so that others cost it nothing.

use crate::roulettes::ByThroughput;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Outlook, PathState, Roulette};

/// What roulette decides.
pub(super) trait Decides {
    /// Whether paths may split, or end before they are scattered.
    const BRANCHES: bool;

    /// See [`Roulette::branches`].
    fn branches(&self, path: &PathState, albedo: Rgb, outlook: Option<Outlook>) -> f32;

    /// See [`Roulette::survival`].
    fn survival(&self, path: &PathState) -> f32;
}

/// As the reference.
impl Decides for ByThroughput {
    const BRANCHES: bool = false;

    #[inline(always)]
    fn branches(&self, _path: &PathState, _albedo: Rgb, _outlook: Option<Outlook>) -> f32 {
        1.0
    }

    #[inline(always)]
    fn survival(&self, path: &PathState) -> f32 {
        Roulette::survival(self, path)
    }
}

impl Decides for &dyn Roulette {
    const BRANCHES: bool = true;

    #[inline]
    fn branches(&self, path: &PathState, albedo: Rgb, outlook: Option<Outlook>) -> f32 {
        Roulette::branches(*self, path, albedo, outlook)
    }

    #[inline]
    fn survival(&self, path: &PathState) -> f32 {
        Roulette::survival(*self, path)
    }
}
