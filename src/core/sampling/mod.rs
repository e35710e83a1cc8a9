//! Random numbers, low-discrepancy points, warps and tabulated distributions.

mod distribution;
mod pcg32;
pub mod sobol;
mod stream;
pub mod warp;

pub use distribution::Discrete;
pub use pcg32::Pcg32;
pub use stream::{PointSet, Stream};
