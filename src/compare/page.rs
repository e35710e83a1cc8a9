//! The report: a folder that opens from disk and needs no network. `index.html` tells the findings, with a page for each scene
//! if there are several, `viewer.html` shows the pictures; `results.json`, `results.csv` and `results.tex` hold the
//! numbers, `method.toml` the methods, `data` the pictures as float values.

mod crops;
mod table;

use super::Options;
use super::facts::Facts;
use super::plot::{Bar, Curve, Dot, Forest, Plot, marker};
use super::results::{MethodResult, Point, SceneResult};
use super::tables::{to_csv, to_json, to_latex};
use crate::check::maps::exposure;
use crate::check::page::escape;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use lucerna_core::image::Image;
use lucerna_core::stats::metrics::Interval;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

const STYLE: &str = include_str!("page/style.css");
const EXPLANATION: &str = include_str!("page/explanation.html");
const VIEWER: [(&str, &str); 4] = [
    ("viewer.html", include_str!("page/viewer.html")),
    ("viewer.css", include_str!("page/viewer.css")),
    ("colors.js", include_str!("page/colors.js")),
    ("viewer.js", include_str!("page/viewer.js")),
];

/// Writes the pictures of a scene, the one with this number in the report.
///
/// # Errors
/// If a file cannot be written.
pub fn write_pictures(scene: &SceneResult, number: usize, options: &Options) -> Result<(), String> {
    let maps = std::iter::once(&[][..]).chain(working(scene).map(|(_, method)| method.flip_map.as_slice()));
    for (image, ((_, values), map)) in pictures(scene).into_iter().zip(maps).enumerate() {
        let name = format!("{number}-{image}");
        let (values, map) = (floats(&three(scene, values)), floats(map));
        let text = format!("LUCERNA_PICTURE(\"{name}\", \"{values}\", \"{map}\");\n");
        put(options, &format!("data/{name}.js"), &text)?;
    }
    Ok(())
}

/// Writes a file of the report.
fn put(options: &Options, name: &str, text: &str) -> Result<(), String> {
    let path = options.output.join(name);
    let folder = path.parent().unwrap_or(&options.output);
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes the report, but for [the pictures](write_pictures).
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    scenes: &[SceneResult],
    failed: &[(PathBuf, String)],
    options: &Options,
    facts: &Facts,
) -> Result<(), String> {
    let put = |name: &str, text: &str| put(options, name, text);
    put("results.json", &format!("{:#}\n", to_json(scenes, failed, options, facts)))?;
    put("results.csv", &to_csv(scenes, options))?;
    put("results.tex", &to_latex(scenes, options))?;
    put("method.toml", &facts.methods)?;
    for (name, text) in VIEWER {
        put(name, text)?;
    }
    let mut list = Vec::new();
    for scene in scenes {
        list.push(json!({
            "name": scene.scene.display().to_string(),
            "size": scene.truth.size,
            "exposure": exposure(&picture(scene, &scene.truth.values)),
            "images": pictures(scene).iter().map(|(name, _)| *name).collect::<Vec<_>>(),
            "places": crops::places(scene),
        }));
    }
    put("data/list.js", &format!("window.LUCERNA_SCENES = {};\n", json!(list)))?;
    if scenes.len() > 1 {
        for (number, scene) in scenes.iter().enumerate() {
            let title = format!("{}: speed against error", short_name(scene));
            let back = "<p><a href=\"index.html\">All scenes</a></p>";
            let body = format!("{back}{}", section(scene, number, options)?);
            put(&scene_page(number), &whole(&title, &short_name(scene), facts, options, &body))?;
        }
    }
    put("index.html", &index(scenes, failed, options, facts)?)
}

/// The file of a scene's own page.
fn scene_page(number: usize) -> String {
    format!("scene-{}.html", number + 1)
}

/// What a scene is called in a table: its folder, if the file's name says nothing.
fn short_name(scene: &SceneResult) -> String {
    let part = |path: Option<&std::path::Path>| Some(path?.file_stem()?.to_string_lossy().into_owned());
    let stem = part(Some(&scene.scene)).unwrap_or_default();
    match part(scene.scene.parent()) {
        Some(folder) if stem.starts_with("scene") => folder,
        _ => stem,
    }
}

/// The pictures of a scene: the reference, and one of each method that has some.
fn pictures(scene: &SceneResult) -> Vec<(&str, &[f32])> {
    let methods = scene.methods.iter().filter(|m| m.failed.is_none());
    let methods = methods.map(|m| (m.method.name.as_str(), m.picture.as_slice()));
    std::iter::once(("reference", scene.truth.values.as_slice())).chain(methods).collect()
}

/// Values as base64 of little-endian floats.
fn floats(values: &[f32]) -> String {
    STANDARD.encode(values.iter().copied().flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
}

/// Three values a pixel, grey ones repeated.
fn three(scene: &SceneResult, values: &[f32]) -> Vec<f32> {
    let channels = scene.truth.channels.len();
    let pixels = values.chunks_exact(channels);
    pixels.flat_map(|p| [p[0], p[1.min(channels - 1)], p[channels - 1]]).collect()
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
pub fn digits(value: f64) -> String {
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

/// A page with its head.
fn whole(title: &str, heading: &str, facts: &Facts, options: &Options, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>{STYLE}</style></head>\n<body>\n\
         <header><p class=\"mark\">Lucerna</p><h1>{}</h1><p class=\"soft\">{}, {} threads; {} runs of each method, {}; {}</p></header>\n{body}</body></html>\n",
        escape(title),
        escape(heading),
        escape(facts.get("processor")),
        escape(facts.get("threads")),
        options.seeds,
        escape(&options.budgets.names().join(", ")),
        escape(facts.get("started")),
    )
}

fn index(
    scenes: &[SceneResult],
    failed: &[(PathBuf, String)],
    options: &Options,
    facts: &Facts,
) -> Result<String, String> {
    let mut html = String::new();
    if let [scene] = scenes {
        html.push_str(&section(scene, 0, options)?);
    } else {
        let budget = options.budgets.names().len().saturating_sub(1);
        let _ = write!(html, "<section>{}</section>", table::overview(scenes, budget, scene_page));
        for (number, scene) in scenes.iter().enumerate() {
            html.push_str(&card(scene, number, options));
        }
    }
    for (scene, why) in failed {
        let (scene, why) = (escape(&scene.display().to_string()), escape(why));
        let _ = writeln!(html, "<section><h2>{scene}</h2><p class=\"failed\">Failed: {why}</p></section>");
    }
    let list: String =
        facts.list.iter().map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>", escape(name), escape(value))).collect();
    let _ = writeln!(
        html,
        "<section><h2>How to read this</h2>{EXPLANATION}<h3>Made with</h3><dl>{list}</dl><h3>Again</h3><pre>{}</pre>\
         <p class=\"soft\">All numbers are in <a href=\"results.json\">results.json</a>, every run in <a href=\"results.csv\">results.csv</a>, a table \
         for LaTeX in <a href=\"results.tex\">results.tex</a>, the methods in <a href=\"method.toml\">method.toml</a>.</p></section>",
        escape(&facts.command)
    );
    Ok(whole("Lucerna: speed against error", "Speed against error", facts, options, &html))
}

/// What the first page tells of one scene among several.
fn card(scene: &SceneResult, number: usize, options: &Options) -> String {
    let budget = options.budgets.names().len().saturating_sub(1);
    format!(
        "<section><h2><a href=\"{0}\">{1}</a></h2>\n<p class=\"lead\">{2}</p>\n<div class=\"plots\"><div>{3}</div><div>{4}</div></div>\n\
         <p><a class=\"button\" href=\"{0}\">All about this scene</a> <a class=\"button\" href=\"viewer.html#scene={number}\">Open the pictures</a></p></section>\n",
        scene_page(number),
        escape(&short_name(scene)),
        lead(scene, options),
        forest(scene, budget),
        over_time(scene),
    )
}

fn section(scene: &SceneResult, number: usize, options: &Options) -> Result<String, String> {
    let truth = &scene.truth;
    let [width, height] = truth.size;
    let name = escape(&scene.scene.display().to_string());
    let noise = match (truth.noise, truth.reached) {
        (None, _) => "its noise is not known".to_owned(),
        (Some([mse, ..]), Some(false)) => {
            format!(
                "its noise, {} in MSE, is <b>above a hundredth of the best method’s error</b> (results.json also has efficiencies without it)",
                digits(mse)
            )
        }
        (Some([mse, ..]), _) => format!("its noise adds {} to an MSE", digits(mse)),
    };
    let names = options.budgets.names();
    let budget = names.len().saturating_sub(1);
    let mut html = format!(
        "<section><h2>{name}</h2>\n<p class=\"lead\">{}</p>\n\
         <p class=\"soft\">{width} × {height} pixels. Reference: {}; {noise}.</p>\n\
         <div class=\"plots\"><div>{}</div><div>{}</div></div>\n{}",
        lead(scene, options),
        escape(&truth.source),
        forest(scene, budget),
        over_time(scene),
        table::summary(scene, budget, options),
    );
    for (budget, name) in names.iter().enumerate().rev() {
        let table = table::measures(scene, budget, name);
        let _ = write!(html, "<details><summary>All measures, {}</summary>{table}</details>", escape(name));
    }
    let samples = |p: &Point| f64::from(p.spp);
    let over_samples = plot(scene, "relMSE over samples per pixel", "samples per pixel", samples);
    let _ = writeln!(
        html,
        "<details><summary>Error as samples grow, and slopes</summary>{}<div class=\"plots\"><div>{over_samples}</div><div>{}</div></div></details>",
        legend(scene),
        slopes(scene)
    );
    html.push_str(&crops::crops(scene, number)?);
    let _ = writeln!(
        html,
        "<p><a class=\"button\" href=\"viewer.html#scene={number}\">Open the pictures</a></p>\n</section>"
    );
    Ok(html)
}

/// Efficiencies as dots and bars, the best on top.
fn forest(scene: &SceneResult, budget: usize) -> String {
    let bar = |(i, method): (usize, &MethodResult)| {
        let gain = scene.gain(i, budget, |e| e.rel_mse)?;
        let biased = method.last().and_then(|point| scene.is_biased(point)) == Some(true);
        let bounds = gain.bounds.filter(|_| i != scene.baseline);
        let note = if biased { " (biased)" } else { "" };
        let title = format!("{}: {}{note}", method.method.name, times(&gain));
        Some(Bar { number: i, name: format!("{}{note}", method.method.name), value: gain.value, bounds, title })
    };
    let mut bars: Vec<Bar> = working(scene).filter_map(bar).collect();
    bars.sort_by(|a, b| b.value.total_cmp(&a.value));
    let base = &scene.methods[scene.baseline].method.name;
    let label = format!("efficiency (relMSE) over that of {base}; right is better");
    match bars.len() {
        0 | 1 => String::new(),
        _ => Forest { label, bars }.svg(),
    }
}

fn over_time(scene: &SceneResult) -> String {
    plot(scene, "relMSE over seconds", "seconds", |p| p.time().value)
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
        Some(_) if unbiased(&scene.baseline) => {
            format!("{} is the most efficient by relMSE.", bold(scene.baseline))
        }
        Some(_) => format!("None is more efficient than {} by relMSE.", bold(scene.baseline)),
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

/// A method's name, with places where lines may break.
fn label(name: &str) -> String {
    let breaks = |text: String, sign: &str| text.replace(sign, &format!("{sign}<wbr>"));
    [":", "=", ","].iter().fold(escape(name), |text, sign| breaks(text, sign))
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

fn plot(scene: &SceneResult, label: &str, x: &str, along: impl Fn(&Point) -> f64) -> String {
    let floor = scene.truth.noise.map(|n| (n[1], "noise of the reference")).filter(|(noise, _)| *noise > 0.0);
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
        let points = if method.is_sequence { "of one run" } else { "each its own run" };
        let name = label(&method.method.name);
        format!("<tr><th>{}{name}</th><td>{samples}</td><td>{seconds}</td><td>{points}</td></tr>", key(i))
    });
    format!(
        "<div class=\"scroll\" tabindex=\"0\"><table><caption>Slopes of log MSE: −1 is that of independent samples; \
         a flat curve is one that bias, or the reference’s noise, holds up</caption><thead><tr><th>method</th><th>over log samples</th>\
         <th>over log seconds</th><th>points</th></tr></thead><tbody>{}</tbody></table></div>\n",
        rows.collect::<String>()
    )
}
