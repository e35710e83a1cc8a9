//! Passes, tiles, budget, progress (types only).
use std::marker::PhantomData;
/// Context.
pub struct RenderContext<'a>(PhantomData<&'a ()>);
/// Report.
pub struct Report;
/// Error.
#[derive(Debug)]
pub struct RenderError(pub String);
