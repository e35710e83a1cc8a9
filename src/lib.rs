//! Lucerna.
