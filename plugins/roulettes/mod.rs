//! All decisions whether paths go on: one file each, one line each in [`PLUGINS`].
//!
//! They are nested in the integrator `path`, or named with `--roulette`. Without one a path goes by its throughput, and
//! a guided one by what it is expected to bring (`adjoint`).

mod adjoint;
mod albedo;
mod efficiency;
mod throughput;

pub(crate) use adjoint::by_default;
use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{LEAST_SURVIVAL, PathState, continuations};
use lucerna_core::scene::Plugin;
pub(crate) use throughput::ByThroughput;

/// The table of all of them.
pub const PLUGINS: &[Plugin] = &[throughput::PLUGIN, albedo::PLUGIN, adjoint::PLUGIN, efficiency::PLUGIN];

/// Survival probability of Russian roulette: the throughput's largest channel, with the compression of radiance in
/// optically dense media taken out, at most 0.95 so that total internal reflection ends too.
#[inline]
pub fn survival(throughput: Rgb, eta: f32) -> f32 {
    (throughput.max_component() * eta * eta).min(0.95)
}

/// Vertices after which a path that something learnt decides about goes on with [`survival`]'s largest probability at
/// most: it ends, even where no light is ever lost.
const LONG: u32 = 64;

/// What roulette does where nothing has been learnt: nothing before it is due, then as [`survival`], but not less than
/// [`LEAST_SURVIVAL`].
fn unlearnt(path: &PathState) -> f32 {
    if path.due { survival(path.prospects, path.eta).max(LEAST_SURVIVAL) } else { 1.0 }
}

/// The survival of a path whose branches are decided elsewhere: delta lobes go by what they alone have left of the light.
/// The throughput has no say, for behind a guide it is the lower, the more light is thought to be ahead: judged by it, paths
/// that a guide sends to a lamp through glass would end at the glass, and the few that are left count many times.
fn survival_after_branches(path: &PathState) -> f32 {
    limited(path, continuations(path.passage).min(1.0))
}

/// An answer from what has been learnt, limited after many vertices.
fn limited(path: &PathState, answer: f32) -> f32 {
    if path.depth < LONG { answer } else { answer.min(0.95) }
}
