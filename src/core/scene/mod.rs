//! From an XML file to a scene that can be rendered.
//!
//! ```text
//! scene.xml ─ xml ─► Description ─ resolve ─► references joined ─ upgrade ─► Description in today's names
//!           ─ instantiate ► Scene
//! ```
//!
//! References are joined before the upgrade, because what an old material or texture becomes depends on the objects
//! that it refers to.

pub mod description;
pub mod error;
mod notes;
pub mod resolve;
pub mod upgrade;
pub mod write;
pub mod xml;

pub use description::{Description, Node, NodeId, ObjectKind, Parameter, SpectrumValue, Value};
pub use error::{Location, SceneError, SceneErrors, did_you_mean};
