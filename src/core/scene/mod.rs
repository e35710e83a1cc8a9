//! From an XML file to a scene that can be rendered.
//!
//! ```text
//! scene.xml ─ xml ─► Description ─ upgrade ─► Description in today's names ─ resolve ─► references joined
//!           ─ instantiate ► Scene
//! ```

pub mod description;
pub mod error;
mod notes;
pub mod resolve;
pub mod xml;

pub use description::{Description, Node, NodeId, ObjectKind, Parameter, SpectrumValue, Value};
pub use error::{Location, SceneError, SceneErrors, did_you_mean};
