//! The list of hard cases, as far as it needs whole scenes, and the table of all of its tests.
//!
//! A hard case is something that is known to break renderers. Its number is in the names of its tests (`hc_g03_…`),
//! wherever they are; `table.rs` says what each asks and keeps `tests/hard_cases.md` complete.

#[path = "../support/mod.rs"]
mod support;

mod films;
mod geometry;
mod lights;
mod runs;
mod scattering;
mod table;

use lucerna::core::image::Image;
use lucerna::core::render::{Report, SampleOrder};
use lucerna::core::scene::Scene;
use std::path::Path;

/// A scene with a camera of `size` pixels a side that sees `body`: from (0, 0, 4) towards -z unless `sensor` says more.
fn scene(integrator: &str, size: u32, sensor: &str, body: &str) -> Scene {
    let text = format!(
        "<scene version='3.0.0'>{integrator}<sensor type='perspective'>{}<film type='hdrfilm'>\
         <integer name='width' value='{size}'/><integer name='height' value='{size}'/><rfilter type='box'/></film>\
         </sensor>{body}</scene>",
        if sensor.is_empty() { LOOKING_DOWN } else { sensor }
    );
    support::load_text(&text, Path::new(env!("CARGO_TARGET_TMPDIR")))
}

const PATH: &str = "<integrator type='path'/>";
const LOOKING_DOWN: &str = "<transform name='to_world'><lookat origin='0, 0, 4' target='0, 0, 0' up='0, 1, 0'/>\
                            </transform><float name='fov' value='40'/>";

/// Renders the first sensor; no sample may be bad.
fn render(scene: &Scene, spp: u32) -> Image {
    let (picture, report): (Image, Report) = support::render(scene, spp, 1, SampleOrder::PerSample);
    assert_eq!(report.bad.count, 0, "{:?}", report.bad.first);
    picture
}

/// Colour values only, without opacity.
fn colors(picture: &Image) -> impl Iterator<Item = f32> + '_ {
    picture.data.chunks_exact(picture.channels.len()).flat_map(|pixel| &pixel[..3]).copied()
}

fn mean(picture: &Image) -> f64 {
    colors(picture).map(f64::from).sum::<f64>() / (3 * picture.width * picture.height) as f64
}
