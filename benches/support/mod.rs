//! What the benches share: meshes, rays and objects from XML.
#![allow(dead_code)] // Each program uses its part.

pub mod mesh;
pub mod objects;
pub mod rays;
