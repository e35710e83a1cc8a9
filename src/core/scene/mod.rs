//! From an XML file to a scene that can be rendered.
//!
//! ```text
//! scene.xml ─ xml ─► Description ─ resolve ─► references joined ─ upgrade ─► Description in today's names
//!           ─ check ─► every parameter known and in range ─ instantiate ► Scene
//! ```
//!
//! References are joined before the upgrade, because what an old material or texture becomes depends on the objects
//! that it refers to.

pub mod check;
mod clamped;
pub mod description;
pub mod error;
mod instantiate;
mod lights;
mod notes;
pub mod object;
pub mod param;
pub mod properties;
pub mod registry;
pub mod resolve;
pub mod upgrade;
mod world;
pub mod write;
pub mod xml;

pub use description::{Description, Node, NodeId, ObjectKind, Parameter, SpectrumValue, Value};
pub use error::{Location, SceneError, SceneErrors, did_you_mean};
#[doc(hidden)]
pub use instantiate::trace_reads;
pub use instantiate::{Instantiated, build_one, instantiate};
pub use object::{BuiltSensor, BuiltShape, Object};
pub use param::{Param, Slot};
pub use properties::Properties;
pub use registry::{Built, Constructor, Failed, Plugin, Registry};
pub use world::{EmitterId, EmitterSource, Scene, ShapeGroup, shadow_ray};
