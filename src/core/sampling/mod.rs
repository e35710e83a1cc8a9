//! Random numbers, low-discrepancy points, warps and tabulated distributions.

mod bilinear_2d;
mod discrete_2d;
mod distribution;
mod pcg32;
mod reservoir;
pub mod sobol;
mod stream;
pub mod warp;

pub use bilinear_2d::Bilinear2d;
pub use discrete_2d::Discrete2d;
pub use distribution::Discrete;
pub use pcg32::Pcg32;
pub use reservoir::{Reservoir, r2};
pub use stream::{PointSet, Stream};
