//! Lucerna.
fn main() {}
