//! What a Lucerna plugin is written against.
//!
//! The core knows no plugin by name. It offers mathematics ([`math`]), sampling ([`sampling`]), colour ([`color`]),
//! the traits a plugin implements ([`interfaces`]), the way from an XML file to a scene ([`scene`]), ray
//! acceleration ([`accel`]), the pass and tile loop ([`render`]), and image and mesh files ([`image`], [`io`]).
//!
//! The conventions that every module shares are stated once, in [`interfaces`].
#![deny(unsafe_code)]

pub mod accel;
pub mod color;
pub mod image;
pub mod interfaces;
pub mod io;
pub mod math;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod stats;
