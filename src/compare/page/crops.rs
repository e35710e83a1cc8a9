//! The places where methods differ most, enlarged.

use super::{picture, pictures, working};
use crate::check::maps::{exposed, exposure};
use crate::check::page::escape;
use crate::compare::results::SceneResult;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use lucerna_core::image::{Image, png};
use lucerna_core::stats::metrics::EPSILON;
use std::fmt::Write as _;

/// Places that are shown enlarged.
const CROPS: usize = 3;

/// The places where errors are largest, for all methods the same.
pub fn crops(scene: &SceneResult, number: usize) -> Result<String, String> {
    let [width, height] = scene.truth.size;
    let places = places(scene);
    let bright = exposure(&picture(scene, &scene.truth.values));
    let frame = |[x, y, edge]: &[u32; 3]| format!("<rect x=\"{x}\" y=\"{y}\" width=\"{edge}\" height=\"{edge}\"/>");
    let frames: String = places.iter().map(frame).collect();
    let reference = picture(scene, &scene.truth.values);
    let mut html = format!(
        "<h3>Where errors are largest</h3>\n<div class=\"crops\"><figure><div class=\"whole\"><img alt=\"reference\" src=\"{}\">\
         <svg viewBox=\"0 0 {width} {height}\">{frames}</svg></div><figcaption>reference</figcaption></figure>\n",
        inline(&exposed(&reference, bright))?
    );
    for (name, values) in pictures(scene) {
        let whole = picture(scene, values);
        let name = escape(name);
        html.push_str("<figure><div class=\"row\">");
        for (place, [x, y, edge]) in places.iter().enumerate() {
            let part = inline(&exposed(&cut(&whole, [*x, *y], *edge), bright))?;
            let _ = write!(
                html,
                "<a href=\"viewer.html#scene={number}&amp;place={place}\"><img alt=\"{name}, part at {x}, {y}\" src=\"{part}\"></a>"
            );
        }
        let _ = writeln!(html, "</div><figcaption>{name}</figcaption></figure>");
    }
    html.push_str("</div>\n");
    Ok(html)
}

/// Where to look closer: left, top and edge of squares.
pub fn places(scene: &SceneResult) -> Vec<[u32; 3]> {
    let [width, height] = scene.truth.size;
    let edge = (width.min(height) / 4).clamp(8, 96).min(width.min(height));
    worst_places(scene, edge).into_iter().map(|[x, y]| [x, y, edge]).collect()
}

/// Up to [`CROPS`] squares of a grid with the largest relative errors of all methods together.
fn worst_places(scene: &SceneResult, edge: u32) -> Vec<[u32; 2]> {
    let [width, height] = scene.truth.size;
    let (columns, rows, channels) = (width / edge, height / edge, scene.truth.channels.len());
    let mut sums = vec![0.0_f64; (columns * rows) as usize];
    for (_, method) in working(scene) {
        for (i, (x, r)) in method.picture.iter().zip(&scene.truth.values).enumerate() {
            let pixel = (i / channels) as u32;
            let (column, row) = (pixel % width / edge, pixel / width / edge);
            let (x, r) = (f64::from(*x), f64::from(*r));
            let error = (x - r).powi(2) / (r * r + EPSILON);
            if column < columns && row < rows && error.is_finite() {
                // Single fireflies must not choose.
                sums[(row * columns + column) as usize] += error.min(4.0);
            }
        }
    }
    let mut order: Vec<u32> = (0..columns * rows).collect();
    order.sort_by(|a, b| sums[*b as usize].total_cmp(&sums[*a as usize]));
    order.into_iter().take(CROPS).map(|i| [i % columns * edge, i / columns * edge]).collect()
}

fn cut(image: &Image, [left, top]: [u32; 2], edge: u32) -> Image {
    let rows = (top..top + edge).flat_map(|y| (left..left + edge).flat_map(move |x| image.pixel(x, y)));
    Image { width: edge, height: edge, channels: image.channels.clone(), data: rows.copied().collect() }
}

/// A picture as the address of its own content.
fn inline(image: &Image) -> Result<String, String> {
    let bytes = png::encode_srgb(image).map_err(|e| e.to_string())?;
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}
