//! Statistics that tests and comparisons rest on.

pub mod chi2;
