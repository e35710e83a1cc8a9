//! The report: one page with everything in it, for whoever made the scene.

use super::maps::{Map, maps};
use super::{Findings, Outcome, Verdict};
use base64::Engine as _;
use lucerna_core::image::Image;
use lucerna_core::stats::TILE;
use lucerna_core::stats::images::{Comparison, Scale};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Places that are listed.
const MOST_PLACES: usize = 8;

/// Pictures are shown at least this wide, in whole multiples.
const SHOWN_WIDTH: u32 = 360;

/// The worst |t| of a test, and the one that is allowed; the first is cut at 999.9.
pub fn worst(comparison: &Comparison, scale: Scale) -> [f64; 2] {
    let (value, limit) = comparison.test(scale).worst();
    [value.t.abs().min(999.9), limit]
}

/// Writes the pictures of a scene into a folder of its own; gives its part of the page. `number` keeps scenes of the same
/// name apart.
///
/// # Errors
/// If a file cannot be written.
pub fn write_section(output: &Path, outcome: &Outcome, number: usize) -> Result<Option<String>, String> {
    let Some(findings) = &outcome.findings else { return Ok(None) };
    let stem = |path: Option<&Path>| path.and_then(Path::file_stem).map(|s| s.to_string_lossy().into_owned());
    let parts = [stem(outcome.scene.parent()), stem(Some(&outcome.scene))];
    let name = parts.into_iter().flatten().collect::<Vec<_>>().join("-");
    let folder = output.join(format!("{:02}-{name}", number + 1));
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let maps = maps(findings)?;
    for map in &maps {
        map.write(&folder)?;
    }
    Ok(Some(section(outcome, findings, &maps, &folder)))
}

/// Writes the page.
///
/// # Errors
/// If it cannot be written.
pub fn write(output: &Path, sections: &[String], summary: &str) -> Result<PathBuf, String> {
    let path = output.join("report.html");
    let text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Lucerna against the reference</title>\n<style>{STYLE}</style></head>\n<body>\n\
         <header><h1>Lucerna against the reference</h1><p>{}</p></header>\n{}\n\
         <footer><h2>How to read this</h2>{EXPLANATION}</footer>\n<script>{SCRIPT}</script>\n</body></html>\n",
        escape(summary),
        sections.join("\n")
    );
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(path)
}

fn section(outcome: &Outcome, findings: &Findings, maps: &[Map], folder: &Path) -> String {
    let mut html = String::new();
    let class = match outcome.verdict {
        Verdict::Agrees => "good",
        Verdict::Differs => "bad",
        _ => "so",
    };
    let _ = writeln!(
        html,
        "<section><h2>{} <span class=\"{class}\">{}</span></h2>\n<p>{}</p>",
        escape(&outcome.scene.display().to_string()),
        outcome.verdict.text(),
        sentence(outcome, findings)
    );
    let Image { width, height, .. } = findings.theirs;
    let _ = writeln!(
        html,
        "<p class=\"small\">{width} × {height} pixels. Reference: {}, {} samples per pixel. Lucerna: {} samples per pixel. \
         Rendered in {:.1} s, the reference in {:.1} s. Files: {}</p>",
        escape(&outcome.reference),
        outcome.spp[1],
        outcome.spp[0],
        outcome.seconds[0],
        outcome.seconds[1],
        escape(&folder.display().to_string())
    );
    if !outcome.notes.is_empty() {
        let notes: String = outcome.notes.iter().map(|note| format!("<li>{}</li>", escape(note))).collect();
        let _ = writeln!(html, "<ul>{notes}</ul>");
    }
    if let Some(comparison) = &findings.comparison {
        html.push_str(&tests_table(comparison));
    }
    html.push_str("<div class=\"maps\">\n");
    for map in maps {
        html.push_str(&figure(map, findings, maps));
    }
    html.push_str("</div>\n");
    if let Some(comparison) = &findings.comparison {
        html.push_str(&places_table(comparison));
    }
    html.push_str("</section>\n");
    html
}

/// What was found, in a sentence.
fn sentence(outcome: &Outcome, findings: &Findings) -> String {
    if let Some(found) = &findings.agreement {
        return format!(
            "{:.3} % of the pixels follow the reference's samples; the worst pixel is at {}, {}.",
            100.0 * found.share,
            found.worst_pixel[0],
            found.worst_pixel[1]
        );
    }
    let Some(comparison) = &findings.comparison else { return String::new() };
    let (mean, error) = comparison.mean_difference();
    let where_it_differs: Vec<String> = (comparison.tests.iter().filter(|test| !test.passes()))
        .map(|test| match test.scale {
            Scale::Pixel => format!("{} single pixel values", test.failed.len()),
            Scale::Tile => format!("{} of {} tile means", test.failed.len(), test.values.len()),
            Scale::Mean => "the mean of the picture".to_owned(),
        })
        .collect();
    let what = match (outcome.verdict, where_it_differs.is_empty()) {
        (Verdict::Offset, _) => format!(
            "The pictures differ in {}, and agree as soon as Lucerna's rays start as far off surfaces as the reference's: \
             light leaks through thin gaps in the reference.",
            where_it_differs.join(", ")
        ),
        (_, true) => "The pictures differ by no more than noise.".to_owned(),
        _ => format!("The pictures differ by more than noise in {}.", where_it_differs.join(", ")),
    };
    format!(
        "{what} On the whole, Lucerna is {:.3} % {} (± {:.3} %); an error of {:.2} % in the mean would have been found.",
        100.0 * mean.abs(),
        if mean < 0.0 { "darker" } else { "brighter" },
        100.0 * error,
        100.0 * comparison.detectable()
    )
}

fn tests_table(comparison: &Comparison) -> String {
    let mut rows = String::new();
    for test in &comparison.tests {
        let (what, [worst, limit]) = (
            match test.scale {
                Scale::Pixel => "single pixels",
                Scale::Tile => "tiles of 8 × 8 pixels",
                Scale::Mean => "mean of the picture",
            },
            worst(comparison, test.scale),
        );
        let verdict =
            if test.passes() { "<span class=\"good\">agree</span>" } else { "<span class=\"bad\">differ</span>" };
        let _ = writeln!(
            rows,
            "<tr><td>{what}</td><td>{verdict}</td><td>{worst:.1} σ</td><td>{limit:.1} σ</td><td>{} of {}</td></tr>",
            test.failed.len(),
            test.values.len()
        );
    }
    format!(
        "<table><tr><th>test</th><th></th><th>worst</th><th>allowed</th><th>values beyond</th></tr>\n{rows}</table>\n"
    )
}

/// The places that are farthest off: tiles if any fail, else pixels.
fn places_table(comparison: &Comparison) -> String {
    let Some(test) = [Scale::Tile, Scale::Pixel].map(|s| comparison.test(s)).into_iter().find(|t| !t.passes()) else {
        return String::new();
    };
    let mut worst: Vec<usize> = test.failed.clone();
    worst.sort_by(|a, b| test.values[*b].t.abs().total_cmp(&test.values[*a].t.abs()));
    let mut rows = String::new();
    for &index in worst.iter().take(MOST_PLACES) {
        let (value, ([x, y], channel)) = (test.values[index], comparison.place(test.scale, index));
        let percent = if value.theirs == 0.0 {
            "from nothing".to_owned()
        } else {
            format!("{:+.2} %", 100.0 * (value.ours / value.theirs - 1.0))
        };
        let _ = writeln!(
            rows,
            "<tr><td>{x}, {y}</td><td>{}</td><td>{:.5}</td><td>{:.5}</td><td>{percent}</td><td>{:+.1} σ</td></tr>",
            escape(channel),
            value.ours,
            value.theirs,
            value.t.clamp(-999.9, 999.9)
        );
    }
    let what = if test.scale == Scale::Tile { "Tiles" } else { "Pixels" };
    format!(
        "<h3>{what} farthest off</h3>\n<table><tr><th>x, y</th><th>channel</th><th>Lucerna</th><th>reference</th>\
         <th>difference</th><th></th></tr>\n{rows}</table>\n"
    )
}

fn figure(map: &Map, findings: &Findings, maps: &[Map]) -> String {
    let Image { width, height, .. } = findings.theirs;
    let factor = SHOWN_WIDTH.div_ceil(width).max(1);
    let data = |map: &Map| base64::engine::general_purpose::STANDARD.encode(&map.png);
    // Lucerna's picture turns into the reference's under the pointer.
    let other = maps.iter().find(|other| map.name == "image" && other.name == "reference");
    let (extra, hint) = match other {
        Some(other) => (
            format!(" class=\"swap\" data-other=\"data:image/png;base64,{}\"", data(other)),
            " (point at it to see the reference)",
        ),
        None => (String::new(), ""),
    };
    format!(
        "<figure><div class=\"frame\"><img width=\"{}\" height=\"{}\" alt=\"{}\" src=\"data:image/png;base64,{}\"{extra}>{}</div>\
         <figcaption>{}{hint}</figcaption></figure>\n",
        width * factor,
        height * factor,
        map.name,
        data(map),
        marks(findings, [width, height]),
        escape(&map.caption)
    )
}

/// Frames around the tiles that differ.
fn marks(findings: &Findings, [width, height]: [u32; 2]) -> String {
    let Some(comparison) = &findings.comparison else { return String::new() };
    let test = comparison.test(Scale::Tile);
    let mut places: Vec<[u32; 2]> = test.failed.iter().map(|&i| comparison.place(Scale::Tile, i).0).collect();
    places.dedup();
    let frames: String = (places.iter().take(400))
        .map(|[x, y]| format!("<rect x=\"{x}\" y=\"{y}\" width=\"{TILE}\" height=\"{TILE}\"/>"))
        .collect();
    format!("<svg viewBox=\"0 0 {width} {height}\">{frames}</svg>")
}

pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

const STYLE: &str = "
:root { color-scheme: light dark; --line: #8884; --soft: #8888; --good: #1a7f37; --bad: #c62828; --so: #9a6700; }
@media (prefers-color-scheme: dark) { :root { --good: #57c374; --bad: #ff7b72; --so: #e3b341; } }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.5rem; margin: 0; } h2 { font-size: 1.15rem; overflow-wrap: anywhere; } h3 { font-size: 1rem; }
header p { margin: .2rem 0 0; } section { border-top: 1px solid var(--line); margin-top: 1.6rem; padding-top: .4rem; }
footer { border-top: 1px solid var(--line); margin-top: 2rem; font-size: .92rem; max-width: 46rem; }
.small { font-size: .86rem; opacity: .75; overflow-wrap: anywhere; }
.good, .bad, .so { font-weight: 600; } .good { color: var(--good); } .bad { color: var(--bad); } .so { color: var(--so); }
h2 span { border: 1px solid currentColor; border-radius: 1em; padding: 0 .6em; font-size: .85rem; margin-left: .4em; }
table { border-collapse: collapse; margin: .6rem 0; display: block; max-width: 100%; overflow-x: auto; } th { font-weight: 600; }
td, th { padding: .15rem .9rem .15rem 0; text-align: left; border-bottom: 1px solid var(--line);
  font-variant-numeric: tabular-nums; }
.maps { display: flex; flex-wrap: wrap; gap: 1rem; margin: 1rem 0; } figure { margin: 0; max-width: 100%; }
.frame { position: relative; display: inline-block; max-width: 100%; line-height: 0; border: 1px solid var(--soft); }
.frame img { image-rendering: pixelated; max-width: 100%; height: auto; }
.frame svg { position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none; }
.frame rect { fill: none; stroke: #ff9500; stroke-width: .7; }
figcaption { font-size: .86rem; max-width: 24rem; opacity: .8; }
";

const SCRIPT: &str = "
for (const image of document.querySelectorAll('img.swap')) {
  const own = image.src;
  image.addEventListener('pointerenter', () => { image.src = image.dataset.other; });
  image.addEventListener('pointerleave', () => { image.src = own; });
}
";

const EXPLANATION: &str = "
<p>Both renderers made each picture several times with different random numbers. How much these passes scatter tells how
far apart two right pictures may be: the standard error σ. Three tests ask whether they are farther apart: of single
pixels, which find a wrong texel; of means over tiles of 8 × 8 pixels, which find a wrong shadow that is too faint for one
pixel; and of the mean of the whole picture, which finds a wrong brightness. Each channel is tested for itself. What is
allowed grows with the number of values, so that a right picture hardly ever fails.</p>
<p>In the maps, scattered faint red and blue is noise. Areas of one colour are not: orange frames mark the tiles that
differ by more than noise.</p>
";
