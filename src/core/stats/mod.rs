//! Statistics that tests and comparisons rest on.

pub mod agreement;
pub mod chi2;
pub mod doublings;
pub mod figures;
pub mod flip;
pub mod images;
mod measured;
pub mod metrics;
pub mod ranks;
pub mod student;

pub use measured::{Measured, TILE};
