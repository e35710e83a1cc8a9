//! The tables of the report.

use super::{digits, key, label};
use crate::check::page::escape;
use crate::compare::Options;
use crate::compare::results::{MethodResult, Point, Reached, SceneResult};
use crate::compare::tables::at_budget;
use lucerna_core::stats::metrics::{Errors, Interval};
use std::fmt::Write as _;

/// What a reader looks for first: who is better, by how much, and is it right?
pub fn summary(scene: &SceneResult, budget: usize, options: &Options) -> String {
    let target = scene.target(options.target);
    let until = target.map_or_else(|| "an error".to_owned(), |error| format!("relMSE {}", digits(error)));
    let head = [
        "efficiency<small>relMSE, over the baseline’s</small>".to_owned(),
        "efficiency<small>MSE, over the baseline’s</small>".to_owned(),
        format!("time to<small>{until}</small>"),
        "processor time<small>a sample, over the baseline’s</small>".to_owned(),
        "mean<small>over the reference’s, in %</small>".to_owned(),
        "relMSE".to_owned(),
        "FLIP<small>HDR</small>".to_owned(),
    ];
    rows(scene, budget, "Longest runs", &head, |i, point| {
        // A biased method gains nothing that counts.
        let biased = scene.is_biased(point) == Some(true);
        let gain = |found| ratio(found, i == scene.baseline, (!biased).then_some("better"), Some("worse"));
        let slowdown = scene.processor_slowdown(i, budget).or_else(|| scene.slowdown(i, budget));
        let difference = point.mean_difference(&scene.truth);
        let reached = target.and_then(|target| scene.methods[i].time_to(target));
        vec![
            gain(scene.gain(i, budget, |e| e.rel_mse)),
            gain(scene.gain(i, budget, |e| e.mse)),
            time_to(reached),
            ratio(slowdown, i == scene.baseline, Some("worse"), Some("better")),
            cell(
                &percent(difference.value),
                difference.bounds.map(|b| b.map(percent)),
                if biased { "worse" } else { "" },
            ),
            plain(point.mean(|e| e.rel_mse)),
            point.flip(1).map_or_else(nothing, plain),
        ]
    })
}

/// Every measure of a budget.
pub fn measures(scene: &SceneResult, budget: usize, name: &str) -> String {
    let head = [
        "spp",
        "seconds",
        "processor s",
        "memory<small>MiB</small>",
        "relMSE",
        "relMSE<small>without the worst 0.1 %</small>",
        "MSE",
        "MAPE",
        "SMAPE",
        "FLIP<small>LDR</small>",
        "FLIP<small>HDR</small>",
        "bias²<small>share of the MSE</small>",
        "fireflies",
        "1 / (relMSE · s)",
        "1 / (MSE · s)",
        "wall time<small>a sample, over the baseline’s</small>",
    ];
    rows(scene, budget, name, &head.map(str::to_owned), |i, point| {
        let optional = |found: Option<Interval>| found.map_or_else(nothing, plain);
        let measure = |f: fn(&Errors) -> f64| plain(point.mean(f));
        let efficiency = |f: fn(&Errors) -> f64| plain(Interval::of_mean(&point.efficiencies(f)));
        let mse = point.mean(|e| e.mse).value;
        let share = |v: f64| format!("{:.0} %", 100.0 * v / mse);
        let bias = point.bias_squared.filter(|_| mse > 0.0);
        vec![
            cell(&point.spp.to_string(), None, ""),
            plain(point.time()),
            optional(point.processor_time()),
            optional(point.memory()),
            measure(|e| e.rel_mse),
            measure(|e| e.rel_mse_trimmed),
            measure(|e| e.mse),
            measure(|e| e.mape),
            measure(|e| e.smape),
            optional(point.flip(0)),
            optional(point.flip(1)),
            bias.map_or_else(nothing, |b| cell(&share(b.value), b.bounds.map(|b| b.map(share)), "")),
            measure(|e| e.fireflies as f64),
            efficiency(|e| e.rel_mse),
            efficiency(|e| e.mse),
            ratio(scene.slowdown(i, budget), i == scene.baseline, Some("worse"), Some("better")),
        ]
    })
}

/// Efficiencies of all methods in all scenes, by relMSE and with the longest budget.
pub fn overview(scenes: &[SceneResult], budget: usize, link: impl Fn(usize) -> String) -> String {
    let mut html = "<div class=\"scroll\"><table><caption>Efficiency by relMSE against the baseline, in all scenes</caption><thead><tr><th>method</th>"
        .to_owned();
    for (number, scene) in scenes.iter().enumerate() {
        let _ = write!(html, "<th><a href=\"{}\">{}</a></th>", link(number), escape(&super::short_name(scene)));
    }
    html.push_str("<th>all<small>geometric mean</small></th></tr></thead>\n<tbody>\n");
    let names: Vec<&str> = scenes[0].methods.iter().map(|m| m.method.name.as_str()).collect();
    for (i, name) in names.iter().enumerate() {
        let _ = write!(html, "<tr><th>{}{}</th>", key(i), label(name));
        let (mut logs, mut whole) = (0.0, true);
        for scene in scenes {
            let gain = scene.gain(i, budget, |e| e.rel_mse);
            let biased = at_budget(&scene.methods[i], budget).and_then(|point| scene.is_biased(point)) == Some(true);
            logs += gain.map_or(0.0, |g| g.value.ln());
            whole &= gain.is_some() && !biased;
            match &scene.methods[i].failed {
                Some(why) => {
                    let _ = write!(html, "<td class=\"failed\" title=\"{}\">failed</td>", escape(why));
                }
                None if biased => html.push_str("<td class=\"failed\">biased</td>"),
                None => html.push_str(&ratio(gain, i == scene.baseline, Some("better"), Some("worse"))),
            }
        }
        let mean = (logs / scenes.len() as f64).exp();
        let _ = writeln!(html, "<td>{}</td></tr>", if whole { format!("{} ×", digits(mean)) } else { "–".to_owned() });
    }
    html.push_str("</tbody></table></div>\n");
    html
}

/// One row a method.
fn rows(
    scene: &SceneResult,
    budget: usize,
    name: &str,
    head: &[String],
    cells: impl Fn(usize, &Point) -> Vec<String>,
) -> String {
    let titles: String = head.iter().map(|title| format!("<th>{title}</th>")).collect();
    let mut html = format!(
        "<div class=\"scroll\" tabindex=\"0\"><table><caption>{}: means of the runs, with intervals of 95 %</caption>\
         <thead><tr><th>method</th>{titles}</tr></thead>\n<tbody>\n",
        escape(name)
    );
    for (i, method) in scene.methods.iter().enumerate() {
        html.push_str(&row_head(i, method, i == scene.baseline));
        match (&method.failed, at_budget(method, budget)) {
            (Some(why), _) => {
                let _ =
                    write!(html, "<td class=\"left failed\" colspan=\"{}\">failed: {}</td>", head.len(), escape(why));
            }
            (None, Some(point)) => html.push_str(&cells(i, point).concat()),
            (None, None) => {}
        }
        html.push_str("</tr>\n");
        let left_out: usize = at_budget(method, budget).map_or(0, |p| p.errors.iter().map(|e| e.left_out).sum());
        if left_out > 0 {
            let _ = writeln!(
                html,
                "<tr><td class=\"left failed\" colspan=\"{}\">{left_out} pixels of all runs are not finite and were left out</td></tr>",
                head.len() + 1
            );
        }
    }
    html.push_str("</tbody></table></div>\n");
    html
}

fn row_head(number: usize, method: &MethodResult, is_baseline: bool) -> String {
    let base = if is_baseline { "<small>baseline</small>" } else { "" };
    let what = escape(&method.method.describe());
    format!("<tr><th title=\"{what}\">{}{}{base}</th>", key(number), label(&method.method.name))
}

/// A ratio, coloured where its interval excludes 1.
fn ratio(found: Option<Interval>, is_baseline: bool, above: Option<&str>, below: Option<&str>) -> String {
    let Some(found) = found else { return nothing() };
    if is_baseline {
        return cell("1 ×", None, "");
    }
    let class = match found.excludes(1.0) {
        true if found.value > 1.0 => above,
        true => below,
        false => None,
    };
    cell(&format!("{} ×", digits(found.value)), found.bounds.map(|b| b.map(digits)), class.unwrap_or_default())
}

fn time_to(reached: Option<Reached>) -> String {
    match reached {
        Some(Reached::After(found)) => {
            cell(&format!("{} s", digits(found.value)), found.bounds.map(|b| b.map(digits)), "")
        }
        Some(Reached::NotWithin(seconds)) => cell(&format!("&gt; {} s", digits(seconds)), None, ""),
        None => nothing(),
    }
}

fn plain(found: Interval) -> String {
    cell(&digits(found.value), found.bounds.map(|b| b.map(digits)), "")
}

fn percent(value: f64) -> String {
    format!("{:+.2}", 100.0 * value).replace('-', "−")
}

fn nothing() -> String {
    cell("–", None, "")
}

fn cell(text: &str, bounds: Option<[String; 2]>, class: &str) -> String {
    let small = bounds.map(|[low, high]| format!("<small>{low} … {high}</small>")).unwrap_or_default();
    format!("<td class=\"{class}\">{text}{small}</td>")
}
