//! What is kept of the samples.

use super::Rfilter;
use crate::math::UVec2;
use std::sync::Arc;

/// The channels of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// Y
    Luminance,
    /// Y, A
    LuminanceAlpha,
    /// R, G, B
    Rgb,
    /// R, G, B, A
    Rgba,
    /// X, Y, Z of CIE 1931
    Xyz,
    /// X, Y, Z, A
    Xyza,
}

/// How a number is stored in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComponentFormat {
    /// Half precision.
    Float16,
    /// Single precision.
    Float32,
    /// Unsigned integer.
    Uint32,
}

/// The file format a film asks for; the output's extension overrides it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// OpenEXR
    OpenExr,
    /// Radiance RGBE
    Rgbe,
    /// Portable float map
    Pfm,
}

/// Everything a film says about its picture.
#[derive(Clone)]
pub struct FilmSettings {
    /// Full size in pixels; the camera belongs to it.
    pub size: UVec2,
    /// First pixel of the crop window.
    pub crop_offset: UVec2,
    /// Size of the crop window and of the picture.
    pub crop_size: UVec2,
    /// Also sample a border as wide as the filter around the crop window.
    pub sample_border: bool,
    /// Reconstruction filter.
    pub filter: Arc<dyn Rfilter>,
    /// Channels.
    pub pixel_format: PixelFormat,
    /// Precision in the file.
    pub component_format: ComponentFormat,
    /// File format.
    pub file_format: FileFormat,
}

/// A film plugin.
pub trait Film: Send + Sync {
    /// Size, window, filter and formats.
    fn settings(&self) -> &FilmSettings;
}
