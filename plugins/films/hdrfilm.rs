//! `hdrfilm`: a picture with linear values of any size.
//!
//! A pixel is the ratio of two sums over the samples near it: values times filter weights, and filter weights. With
//! `crop_*`, only a window is rendered; the camera still belongs to the full film.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `width`, `height` | integer | 768, 576 | size in pixels, at most 65536 each |
//! | `crop_offset_x`, `crop_offset_y` | integer | 0, 0 | first pixel of the window |
//! | `crop_width`, `crop_height` | integer | all that is left | size of the window and of the picture |
//! | `sample_border` | boolean | false | also sample a border as wide as the filter around the window |
//! | `pixel_format` | luminance, luminance_alpha, rgb, rgba, xyz, xyza | rgb | channels in the file |
//! | `component_format` | float16, float32, uint32 | float16 | precision in the file |
//! | `file_format` | openexr, exr, rgbe, pfm | openexr | kind of file, unless the output's name says otherwise |
//! | nested `rfilter` | | `gaussian` | reconstruction filter |
//!
//! ```xml
//! <film type="hdrfilm">
//!     <integer name="width" value="1280"/>
//!     <integer name="height" value="720"/>
//!     <rfilter type="box"/>
//! </film>
//! ```

use lucerna_core::interfaces::{ComponentFormat, FileFormat, Film, FilmSettings, PixelFormat};
use lucerna_core::math::UVec2;
use lucerna_core::scene::description::ObjectKind;
use lucerna_core::scene::{Built, Constructor, Failed, Param, Plugin, Properties};
use std::sync::Arc;

/// Pixels along one side at most: a wider picture is a slip of the pen.
const LONGEST_SIDE: f64 = 65536.0;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "hdrfilm",
    aliases: &[],
    summary: "picture with linear values of any size",
    params: &[&[
        Param::int("width", 768, "pixels per row").range(1.0, LONGEST_SIDE),
        Param::int("height", 576, "pixels per column").range(1.0, LONGEST_SIDE),
        Param::int("crop_offset_x", 0, "first column of the window").range(0.0, LONGEST_SIDE),
        Param::int("crop_offset_y", 0, "first row of the window").range(0.0, LONGEST_SIDE),
        Param::int_opt("crop_width", "columns of the window and of the picture").range(1.0, LONGEST_SIDE),
        Param::int_opt("crop_height", "rows of the window and of the picture").range(1.0, LONGEST_SIDE),
        Param::bool("sample_border", false, "also sample a border as wide as the filter"),
        Param::choice(
            "pixel_format",
            &["luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza"],
            "rgb",
            "channels in the file",
        ),
        Param::choice("component_format", &["float16", "float32", "uint32"], "float16", "precision in the file"),
        Param::choice("file_format", &["openexr", "exr", "rgbe", "pfm"], "openexr", "kind of file"),
        Param::ignored("banner", "for the reference renderer only"),
        Param::ignored("compensate", "sums are always compensated"),
        Param::child(ObjectKind::Rfilter, 0, 1, "reconstruction filter"),
    ]],
    build: Constructor::Film(build),
};

fn build(p: &Properties<'_>) -> Built<dyn Film> {
    let (width, offset_x, crop_width) = window(p, "width", "crop_offset_x", "crop_width")?;
    let (height, offset_y, crop_height) = window(p, "height", "crop_offset_y", "crop_height")?;
    let settings = FilmSettings {
        size: UVec2::new(width, height),
        crop_offset: UVec2::new(offset_x, offset_y),
        crop_size: UVec2::new(crop_width, crop_height),
        sample_border: p.bool("sample_border"),
        filter: p.rfilter().ok_or(Failed)?,
        pixel_format: match p.choice("pixel_format") {
            "luminance" => PixelFormat::Luminance,
            "luminance_alpha" => PixelFormat::LuminanceAlpha,
            "rgba" => PixelFormat::Rgba,
            "xyz" => PixelFormat::Xyz,
            "xyza" => PixelFormat::Xyza,
            _ => PixelFormat::Rgb,
        },
        component_format: match p.choice("component_format") {
            "float32" => ComponentFormat::Float32,
            "uint32" => ComponentFormat::Uint32,
            _ => ComponentFormat::Float16,
        },
        file_format: match p.choice("file_format") {
            "rgbe" => FileFormat::Rgbe,
            "pfm" => FileFormat::Pfm,
            _ => FileFormat::OpenExr,
        },
    };
    Ok(Arc::new(HdrFilm(settings)))
}

/// Size of the film, and start and size of the window, along one axis.
fn window(p: &Properties<'_>, size: &str, offset: &str, crop: &str) -> Result<(u32, u32, u32), Failed> {
    let (film, start) = (p.int(size), p.int(offset));
    let length = p.int_opt(crop).unwrap_or(film - start);
    if length < 1 || start + length > film {
        let blame = if p.has(crop) { crop } else { offset };
        return Err(p.error(blame, format!("the crop window does not lie within the {film} pixels of \"{size}\"")));
    }
    // The table keeps all three below 2¹⁷.
    Ok((film as u32, start as u32, length as u32))
}

struct HdrFilm(FilmSettings);

impl Film for HdrFilm {
    fn settings(&self) -> &FilmSettings {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Draft;
    use lucerna_core::scene::Object;

    fn draft() -> Draft {
        Draft::new(ObjectKind::Film, "hdrfilm").int("width", 40).int("height", 30)
    }

    fn settings(draft: &Draft) -> FilmSettings {
        match draft.build() {
            Ok(Object::Film(film)) => film.settings().clone(),
            Ok(_) => panic!("not a film"),
            Err(errors) => panic!("{errors}"),
        }
    }

    #[test]
    fn the_window_is_what_is_asked_for_or_left() {
        let all = settings(&draft());
        assert_eq!((all.size, all.crop_offset, all.crop_size), (UVec2::new(40, 30), UVec2::ZERO, UVec2::new(40, 30)));
        assert_eq!(all.filter.radius(), 2.0);
        let one = settings(&draft().int("crop_offset_x", 39).int("crop_width", 1).int("crop_offset_y", 10));
        assert_eq!((one.crop_offset, one.crop_size), (UVec2::new(39, 10), UVec2::new(1, 20)));
        let words = draft().string("pixel_format", "RGBA").string("component_format", "float32");
        let words = settings(&words.string("file_format", "pfm"));
        assert_eq!(words.pixel_format, PixelFormat::Rgba);
        assert_eq!((words.component_format, words.file_format), (ComponentFormat::Float32, FileFormat::Pfm));
    }

    #[test]
    fn hc_e09_e10_senseless_sizes_are_refused() {
        assert!(draft().int("crop_offset_x", 40).errors().contains("crop window"));
        assert!(draft().int("crop_offset_y", 20).int("crop_height", 11).errors().contains("crop window"));
        for size in [-5, 0, 65_537, 2_000_000] {
            let film = Draft::new(ObjectKind::Film, "hdrfilm").int("width", size);
            assert!(film.errors().contains("width"), "{size}");
        }
        assert!(draft().string("pixel_format", "cmyk").errors().contains("pixel_format"));
    }
}
