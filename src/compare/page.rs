//! The report: a folder that opens from disk and needs no network. `index.html` tells the findings, `viewer.html` shows
//! the pictures; `results.json` and `results.csv` hold the numbers, `data` the pictures as float values.

use super::plot::{Curve, Dot, Plot, marker};
use super::results::{MethodResult, Point, SceneResult, to_csv, to_json};
use super::{Options, machine};
use crate::check::maps::{exposed, exposure};
use crate::check::page::escape;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use lucerna_core::image::{Image, png};
use lucerna_core::stats::metrics::{EPSILON, Errors, Interval};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

const STYLE: &str = include_str!("page/style.css");
const VIEWER: [(&str, &str); 3] = [
    ("viewer.html", include_str!("page/viewer.html")),
    ("viewer.css", include_str!("page/viewer.css")),
    ("viewer.js", include_str!("page/viewer.js")),
];

/// Places that are shown enlarged.
const CROPS: usize = 3;

/// Writes the report.
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    scenes: &[SceneResult],
    failed: &[(PathBuf, String)],
    options: &Options,
    command: &str,
) -> Result<(), String> {
    let put = |name: &str, text: &str| {
        let path = options.output.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    let data = options.output.join("data");
    std::fs::create_dir_all(&data).map_err(|e| format!("{}: {e}", data.display()))?;
    put("results.json", &format!("{:#}\n", to_json(scenes, failed, options, command)))?;
    put("results.csv", &to_csv(scenes, options))?;
    for (name, text) in VIEWER {
        put(name, text)?;
    }
    let mut list = Vec::new();
    for (number, scene) in scenes.iter().enumerate() {
        let shown: Vec<(&str, &[f32])> = pictures(scene);
        for (image, (_, values)) in shown.iter().enumerate() {
            let name = format!("{number}-{image}");
            put(&format!("data/{name}.js"), &format!("LUCERNA_PICTURE(\"{name}\", \"{}\");\n", floats(scene, values)))?;
        }
        list.push(json!({
            "name": scene.scene.display().to_string(),
            "size": scene.truth.size,
            "exposure": exposure(&picture(scene, &scene.truth.values)),
            "images": shown.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        }));
    }
    put("data/list.js", &format!("window.LUCERNA_SCENES = {};\n", json!(list)))?;
    put("index.html", &index(scenes, failed, options, command)?)
}

/// The pictures of a scene: the reference, and one of each method that has some.
fn pictures(scene: &SceneResult) -> Vec<(&str, &[f32])> {
    let methods = scene.methods.iter().filter(|m| m.failed.is_none());
    let methods = methods.map(|m| (m.method.name.as_str(), m.picture.as_slice()));
    std::iter::once(("reference", scene.truth.values.as_slice())).chain(methods).collect()
}

/// Values as base64 of little-endian floats, three a pixel.
fn floats(scene: &SceneResult, values: &[f32]) -> String {
    let channels = scene.truth.channels.len();
    let pixels = values.chunks_exact(channels);
    let rgb = pixels.flat_map(|p| [p[0], p[1.min(channels - 1)], p[channels - 1]]);
    STANDARD.encode(rgb.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
}

fn picture(scene: &SceneResult, values: &[f32]) -> Image {
    let [width, height] = scene.truth.size;
    Image { width, height, channels: scene.truth.channels.clone(), data: values.to_vec() }
}

/// A factor with its interval, in words: `1.86 × [1.70, 2.03]`.
pub fn times(found: &Interval) -> String {
    let bounds = found.bounds.map(|[low, high]| format!(" [{}, {}]", digits(low), digits(high)));
    format!("{} ×{}", digits(found.value), bounds.unwrap_or_default())
}

/// Three digits.
fn digits(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (0.001..100_000.0).contains(&size) {
        let places = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.places$}")
    } else {
        // With a sign at which lines do not break.
        format!("{value:.2e}").replace('-', "−")
    }
}

fn index(
    scenes: &[SceneResult],
    failed: &[(PathBuf, String)],
    options: &Options,
    command: &str,
) -> Result<String, String> {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Lucerna: speed against error</title>\n<style>{STYLE}</style></head>\n<body>\n\
         <header><h1>Speed against error</h1><p class=\"soft\">Lucerna {}, {}, {} threads; {} runs of each method, {}</p></header>\n",
        env!("CARGO_PKG_VERSION"),
        escape(&machine()),
        rayon::current_num_threads(),
        options.seeds,
        escape(&options.budgets.names().join(", ")),
    );
    for (number, scene) in scenes.iter().enumerate() {
        html.push_str(&section(scene, number, options)?);
    }
    for (scene, why) in failed {
        let (scene, why) = (escape(&scene.display().to_string()), escape(why));
        let _ = writeln!(html, "<section><h2>{scene}</h2><p class=\"failed\">Failed: {why}</p></section>");
    }
    let _ = write!(
        html,
        "<section><h2>How to read this</h2>{EXPLANATION}<h3>Again</h3><pre>{}</pre>\
         <p class=\"soft\">All numbers are in <a href=\"results.json\">results.json</a>, every run in <a href=\"results.csv\">results.csv</a>.</p></section>\n</body></html>\n",
        escape(command)
    );
    Ok(html)
}

fn section(scene: &SceneResult, number: usize, options: &Options) -> Result<String, String> {
    let truth = &scene.truth;
    let [width, height] = truth.size;
    let name = escape(&scene.scene.display().to_string());
    let noise = match (truth.noise, truth.reached) {
        (None, _) => "its noise is not known".to_owned(),
        (Some([mse, ..]), Some(false)) => {
            format!("its noise, {} in MSE, is <b>above a hundredth of the best method’s error</b>", digits(mse))
        }
        (Some([mse, ..]), _) => format!("its noise adds {} to an MSE", digits(mse)),
    };
    let mut html = format!(
        "<section><h2>{name}</h2>\n<p class=\"lead\">{}</p>\n\
         <p class=\"soft\">{width} × {height} pixels. Reference: {}; {noise}.</p>\n",
        lead(scene, options),
        escape(&truth.source)
    );
    let names = options.budgets.names();
    for (budget, name) in names.iter().enumerate().rev() {
        let table = table(scene, budget, name);
        // The longest budget counts; the others are there for who asks.
        let _ = match budget + 1 == names.len() {
            true => write!(html, "{table}"),
            false => write!(html, "<details><summary>{}</summary>{table}</details>", escape(name)),
        };
    }
    let seconds = |p: &Point| p.time().value;
    let samples = |p: &Point| f64::from(p.spp);
    let floor = truth.noise.map(|n| (n[1], "noise of the reference"));
    let over_time = plot(scene, "relMSE over seconds", "seconds", seconds, floor);
    let over_samples = plot(scene, "relMSE over samples per pixel", "samples per pixel", samples, floor);
    let _ = write!(html, "<h3>Error as time and samples grow</h3>{}", legend(scene));
    let _ =
        write!(html, "<div class=\"plots\"><div>{over_time}</div><div>{over_samples}</div></div>\n{}", slopes(scene));
    html.push_str(&crops(scene)?);
    let _ = writeln!(html, "<a class=\"button\" href=\"viewer.html#scene={number}\">Open the pictures</a>\n</section>");
    Ok(html)
}

/// The finding in a sentence.
fn lead(scene: &SceneResult, options: &Options) -> String {
    let budget = options.budgets.names().len() - 1;
    let gain = |i: usize| scene.gain(i, budget, |e| e.rel_mse).filter(|_| i != scene.baseline);
    let unbiased = |i: &usize| scene.methods[*i].last().and_then(|p| scene.is_biased(p)) != Some(true);
    let gains = (0..scene.methods.len()).filter(unbiased).filter_map(|i| Some((i, gain(i)?)));
    let best = gains.max_by(|a, b| a.1.value.total_cmp(&b.1.value));
    let bold = |i: usize| format!("<b>{}</b>", escape(&scene.methods[i].method.name));
    let mut text = match best {
        Some((i, gain)) if gain.value > 1.0 => {
            let sure = if gain.excludes(1.0) { "" } else { ", which may be chance" };
            format!("{} is {} as efficient as {} by relMSE{sure}.", bold(i), times(&gain), bold(scene.baseline))
        }
        Some(_) => format!("{} is the most efficient by relMSE.", bold(scene.baseline)),
        None => String::new(),
    };
    let biased: Vec<String> = (0..scene.methods.len()).filter(|i| !unbiased(i)).map(bold).collect();
    if !biased.is_empty() {
        let (are, their) = if biased.len() == 1 { ("is", "its picture is") } else { ("are", "their pictures are") };
        let _ = write!(
            text,
            " {} {are} biased: {their} brighter or darker than the reference by more than noise.",
            biased.join(", ")
        );
    }
    text
}

fn table(scene: &SceneResult, budget: usize, name: &str) -> String {
    let mut html = format!(
        "<div class=\"scroll\"><table><caption>{}: means of the runs, with intervals of 95 %</caption><thead><tr><th>method</th>\
         <th>efficiency (relMSE)</th><th>efficiency (MSE)</th><th>time a sample</th><th>mean</th><th>bias² in MSE</th><th>spp</th><th>seconds</th>\
         <th>relMSE</th><th>without worst 0.1 %</th><th>MSE</th><th>MAPE</th><th>SMAPE</th><th>fireflies</th></tr></thead>\n<tbody>\n",
        escape(name)
    );
    for (i, method) in scene.methods.iter().enumerate() {
        let base = if i == scene.baseline { "<small>baseline</small>" } else { "" };
        let what = escape(&method.method.describe());
        let _ = write!(html, "<tr><th title=\"{what}\">{}{}{base}</th>", key(i), escape(&method.method.name));
        if let Some(why) = &method.failed {
            let _ = writeln!(html, "<td class=\"left failed\" colspan=\"13\">failed: {}</td></tr>", escape(why));
            continue;
        }
        let Some((point, _)) = scene
            .pair(i, budget)
            .or_else(|| Some((method.points.get(*method.stops.get(budget)?)?, method.points.first()?)))
        else {
            html.push_str("</tr>\n");
            continue;
        };
        // A biased method gains nothing that counts.
        let is_biased = scene.is_biased(point) == Some(true);
        let ratio = |found: Option<Interval>, more_is_better: bool| {
            let Some(found) = found else { return cell("–", None, "") };
            let class = match found.excludes(1.0) && i != scene.baseline {
                true if (found.value > 1.0) == more_is_better => {
                    if is_biased {
                        ""
                    } else {
                        "better"
                    }
                }
                true => "worse",
                false => "",
            };
            cell(
                &format!("{} ×", digits(found.value)),
                found.bounds.filter(|_| i != scene.baseline).map(|b| b.map(digits)),
                class,
            )
        };
        html.push_str(&ratio(scene.gain(i, budget, |e| e.rel_mse), true));
        html.push_str(&ratio(scene.gain(i, budget, |e| e.mse), true));
        html.push_str(&ratio(scene.slowdown(i, budget), false));
        let difference = point.mean_difference(&scene.truth);
        let percent = |v: f64| format!("{:+.2} %", 100.0 * v);
        let class = if is_biased { "worse" } else { "" };
        html.push_str(&cell(&percent(difference.value), difference.bounds.map(|b| b.map(percent)), class));
        let share = point.bias_squared.map(|b| 100.0 * b / point.mean(|e| e.mse).value);
        html.push_str(&cell(&share.map_or_else(|| "–".to_owned(), |s| format!("{s:.0} %")), None, ""));
        html.push_str(&cell(&point.spp.to_string(), None, ""));
        let plain = |found: Interval| cell(&digits(found.value), found.bounds.map(|b| b.map(digits)), "");
        html.push_str(&plain(point.time()));
        let measures: [fn(&Errors) -> f64; 5] =
            [|e| e.rel_mse, |e| e.rel_mse_trimmed, |e| e.mse, |e| e.mape, |e| e.smape];
        for measure in measures {
            html.push_str(&plain(point.mean(measure)));
        }
        html.push_str(&cell(&digits(point.mean(|e| e.fireflies as f64).value), None, ""));
        let left_out: usize = point.errors.iter().map(|e| e.left_out).sum();
        html.push_str("</tr>\n");
        if left_out > 0 {
            let _ = writeln!(
                html,
                "<tr><td class=\"left failed\" colspan=\"14\">{left_out} pixels are not finite and were left out</td></tr>"
            );
        }
    }
    html.push_str("</tbody></table></div>\n");
    html
}

fn cell(text: &str, bounds: Option<[String; 2]>, class: &str) -> String {
    let small = bounds.map(|[low, high]| format!("<small>{low} … {high}</small>")).unwrap_or_default();
    format!("<td class=\"{class}\">{text}{small}</td>")
}

/// The marker of a method, as in the plots.
fn key(number: usize) -> String {
    format!(
        "<svg class=\"key c{}\" viewBox=\"0 0 14 14\" aria-hidden=\"true\">{}</svg>",
        number % 8,
        marker(number, 7.0, 7.0)
    )
}

fn working(scene: &SceneResult) -> impl Iterator<Item = (usize, &MethodResult)> {
    scene.methods.iter().enumerate().filter(|(_, m)| m.failed.is_none())
}

fn legend(scene: &SceneResult) -> String {
    let items = working(scene).map(|(i, m)| format!("<li>{}{}</li>", key(i), escape(&m.method.name)));
    format!("<ul class=\"legend\">{}</ul>", items.collect::<String>())
}

fn plot(
    scene: &SceneResult,
    label: &str,
    x: &str,
    along: impl Fn(&Point) -> f64,
    floor: Option<(f64, &str)>,
) -> String {
    let curves = working(scene).map(|(number, method)| {
        let dots = method.points.iter().map(|point| {
            let error = point.mean(|e| e.rel_mse);
            let name = escape(&method.method.name);
            let title =
                format!("{name}: {} spp, {} s, relMSE {}", point.spp, digits(point.time().value), digits(error.value));
            Dot { x: along(point), y: error.value, bounds: error.bounds, title }
        });
        Curve { number, dots: dots.collect() }
    });
    Plot { label, x, y: "relMSE", curves: curves.collect(), floor }.svg()
}

/// How fast errors fall.
fn slopes(scene: &SceneResult) -> String {
    let text = |found: Option<Interval>| {
        let bounds = found.and_then(|f| f.bounds).map(|[low, high]| format!(" ({low:.2} … {high:.2})"));
        found.map_or_else(|| "–".to_owned(), |f| format!("{:.2}{}", f.value, bounds.unwrap_or_default()))
    };
    let rows = working(scene).map(|(i, method)| {
        let [samples, seconds] = method.slopes().map(text);
        format!("<tr><th>{}{}</th><td>{samples}</td><td>{seconds}</td></tr>", key(i), escape(&method.method.name))
    });
    format!(
        "<details><summary>Slopes of log MSE</summary><div class=\"scroll\"><table><caption>−1 is that of independent samples; \
         a flat curve is one that bias, or the reference’s noise, holds up</caption><thead><tr><th>method</th><th>over log samples</th>\
         <th>over log seconds</th></tr></thead><tbody>{}</tbody></table></div></details>\n",
        rows.collect::<String>()
    )
}

/// The places where errors are largest, for all methods the same.
fn crops(scene: &SceneResult) -> Result<String, String> {
    let [width, height] = scene.truth.size;
    let edge = (width.min(height) / 4).clamp(8, 96).min(width.min(height));
    let places = worst_places(scene, edge);
    let bright = exposure(&picture(scene, &scene.truth.values));
    let frames: String =
        places.iter().map(|[x, y]| format!("<rect x=\"{x}\" y=\"{y}\" width=\"{edge}\" height=\"{edge}\"/>")).collect();
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
        for place in &places {
            let part = inline(&exposed(&cut(&whole, *place, edge), bright))?;
            let _ = write!(html, "<img alt=\"{name}, part at {}, {}\" src=\"{part}\">", place[0], place[1]);
        }
        let _ = writeln!(html, "</div><figcaption>{name}</figcaption></figure>");
    }
    html.push_str("</div>\n");
    Ok(html)
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

const EXPLANATION: &str = "
<dl>
<dt>efficiency</dt><dd>1 / (error · seconds), over that of the baseline: 2 × is the same error in half of the time. Ratios are taken run by run
between neighbours and averaged as logarithms. Coloured where the interval excludes 1. The efficiency of a biased method grows no further with time.</dd>
<dt>time a sample</dt><dd>Seconds over samples per pixel, over that of the baseline: above 1 is slower.</dd>
<dt>MSE, relMSE</dt><dd>Mean of (x − r)², and of (x − r)² / (r² + 0.01), over pixels and channels; a few fireflies can dominate both, therefore
relMSE also without the 0.1 % worst pixels.</dd>
<dt>MAPE, SMAPE</dt><dd>Mean of |x − r| / (|r| + 0.01), and of |x − r| / (|x| + |r| + 0.01).</dd>
<dt>mean</dt><dd>How much brighter or darker the whole picture is than the reference. Coloured if that is more than noise (5 % in all methods together).</dd>
<dt>bias² in MSE</dt><dd>The part of the MSE that more samples do not reduce, estimated from the spread of the runs; around 0 (also below) where there is none.</dd>
<dt>fireflies</dt><dd>Pixels brighter than the reference by more than ten times √(r² + 0.01).</dd>
<dt>intervals</dt><dd>Where the true value is with a chance of 95 %, from the spread of the runs (Student). With few runs they are wide, and
rough where single fireflies decide.</dd>
<dt>curves</dt><dd>Each point is a picture of its own, rendered from the beginning. The noise of the reference is part of all errors and shown as a line.</dd>
</dl>
";
