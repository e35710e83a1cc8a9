//! Statistics that tests and comparisons rest on.

pub mod chi2;
pub mod figures;
