//! Films (E09).

use super::{PATH, colors, render, support};
use lucerna::core::scene::Scene;
use lucerna::core::stats::figures::measured;
use std::path::Path;

fn film(settings: &str, filter: &str) -> Scene {
    let text = format!(
        "<scene version='3.0.0'>{PATH}<sensor type='perspective'><film type='hdrfilm'>{settings}\
         <rfilter type='{filter}'/></film></sensor><emitter type='constant'/></scene>"
    );
    support::load_text(&text, Path::new("."))
}

fn size(width: u32, height: u32) -> String {
    format!("<integer name='width' value='{width}'/><integer name='height' value='{height}'/>")
}

/// A sky of radiance 1 stays 1 in every pixel, however small the film and wide the filter.
#[test]
fn hc_e09_smallest_films_and_crops() {
    let crop = "<integer name='crop_offset_x' value='7'/><integer name='crop_offset_y' value='3'/>\
                <integer name='crop_width' value='1'/><integer name='crop_height' value='1'/>";
    let mut off = 0.0_f32;
    for filter in ["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"] {
        for (settings, pixels) in [(size(1, 1), 1), (size(1, 5), 5), (size(8, 4) + crop, 1), (size(2, 1), 2)] {
            let picture = render(&film(&settings, filter), 16);
            assert_eq!(picture.width * picture.height, pixels, "{settings}");
            off = colors(&picture).fold(off, |off, v| off.max((v - 1.0).abs()));
        }
    }
    measured("hc_e09_smallest_films_and_crops", format!("off by at most {off:.0e}"));
    assert!(off <= 1e-6, "{off}");
}
