//! Reconstruction filters.

/// A separable reconstruction filter, symmetric about 0. Units are pixels.
pub trait Rfilter: Send + Sync {
    /// The filter is zero at this distance and beyond.
    fn radius(&self) -> f32;

    /// Value at a distance; may be negative, need not be normalised.
    fn eval(&self, x: f32) -> f32;

    /// Every sample counts with weight 1 for the pixel it falls in and for no other.
    fn is_box(&self) -> bool {
        false
    }
}
