//! The findings as documents: JSON, CSV, a table for LaTeX, and the methods as a file.

use super::facts::Facts;
use super::results::{MethodResult, Point, Reached, SceneResult};
use super::{Options, page};
use lucerna_core::stats::metrics::{EPSILON, Errors, FIREFLY, Interval, TRIMMED};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

fn interval(found: Interval) -> Value {
    json!({ "value": found.value, "low": found.bounds.map(|b| b[0]), "high": found.bounds.map(|b| b[1]) })
}

/// The document of a comparison.
pub fn to_json(scenes: &[SceneResult], failed: &[(PathBuf, String)], options: &Options, facts: &Facts) -> Value {
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "command": facts.command,
        "machine": facts.to_json(),
        "seeds": options.seeds,
        "first_seed": options.seed,
        "budgets": options.budgets.names(),
        "confidence": 1.0 - Interval::MISS,
        "definitions": { "epsilon": EPSILON, "trimmed": TRIMMED, "firefly": FIREFLY },
        "scenes": scenes.iter().map(|scene| scene_json(scene, options)).collect::<Vec<_>>(),
        "failed_scenes": failed.iter().map(|(scene, why)| json!({ "scene": scene.display().to_string(), "failed": why })).collect::<Vec<_>>(),
    })
}

fn scene_json(scene: &SceneResult, options: &Options) -> Value {
    let truth = &scene.truth;
    let methods = scene.methods.iter().enumerate().map(|(i, method)| {
        let mut value = json!({ "name": method.method.name, "what": method.method.describe() });
        let target = scene.target(options.target);
        if let Some(why) = &method.failed {
            value["failed"] = json!(why);
            return value;
        }
        let [by_spp, by_seconds] = method.slopes();
        value["slopes"] = json!({ "samples": by_spp.map(interval), "seconds": by_seconds.map(interval) });
        value["time_to_target"] = match target.and_then(|target| method.time_to(target)) {
            Some(Reached::After(seconds)) => interval(seconds),
            Some(Reached::NotWithin(seconds)) => json!({ "not_within": seconds }),
            None => Value::Null,
        };
        value["points_of_one_run"] = json!(method.is_sequence);
        value["points"] = method.points.iter().map(|point| point_json(point, scene)).collect();
        let budgets = options.budgets.names().into_iter().enumerate().map(|(budget, name)| {
            json!({
                "budget": name,
                "spp": scene.pair(i, budget).map(|(ours, _)| ours.spp),
                "against_baseline": {
                    "efficiency_mse": scene.gain(i, budget, |e| e.mse).map(interval),
                    "efficiency_rel_mse": scene.gain(i, budget, |e| e.rel_mse).map(interval),
                    "efficiency_rel_mse_without_noise": scene.gain_without_noise(i, budget).map(interval),
                    "efficiency_rel_mse_trimmed": scene.gain(i, budget, |e| e.rel_mse_trimmed).map(interval),
                    "seconds_per_sample": scene.slowdown(i, budget).map(interval),
                    "processor_seconds_per_sample": scene.processor_slowdown(i, budget).map(interval),
                },
            })
        });
        value["budgets"] = budgets.collect();
        value
    });
    json!({
        "scene": scene.scene.display().to_string(),
        "size": truth.size,
        "reference": {
            "source": truth.source,
            "spp": truth.spp,
            "noise_mse": truth.noise.map(|n| n[0]),
            "noise_rel_mse": truth.noise.map(|n| n[1]),
            "is_good_enough": truth.reached,
        },
        "baseline": scene.methods[scene.baseline].method.name,
        "target_rel_mse": scene.target(options.target),
        "methods": methods.collect::<Vec<_>>(),
    })
}

fn point_json(point: &Point, scene: &SceneResult) -> Value {
    json!({
        "spp": point.spp,
        "of_run": point.of,
        "seconds": interval(point.time()),
        "processor_seconds": point.processor_time().map(interval),
        "peak_mib": point.memory().map(interval),
        "mse": interval(point.mean(|e| e.mse)),
        "rel_mse": interval(point.mean(|e| e.rel_mse)),
        "rel_mse_trimmed": interval(point.mean(|e| e.rel_mse_trimmed)),
        "mape": interval(point.mean(|e| e.mape)),
        "smape": interval(point.mean(|e| e.smape)),
        "flip_ldr": point.flip(0).map(interval),
        "flip_hdr": point.flip(1).map(interval),
        "fireflies": interval(point.mean(|e| e.fireflies as f64)),
        "left_out": point.errors.iter().map(|e| e.left_out).sum::<usize>(),
        "efficiency_mse": interval(Interval::of_mean(&point.efficiencies(|e| e.mse))),
        "efficiency_rel_mse": interval(Interval::of_mean(&point.efficiencies(|e| e.rel_mse))),
        "variance": point.variance,
        "bias_squared": point.bias_squared.map(interval),
        "mean_difference": interval(point.mean_difference(&scene.truth)),
        "is_biased": scene.is_biased(point),
    })
}

/// One line a run: comma-separated, with a head.
pub fn to_csv(scenes: &[SceneResult], options: &Options) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut text = "scene,method,spp,seed,seconds,mse,rel_mse,rel_mse_trimmed,mape,smape,mean_difference,fireflies,left_out,flip_ldr,flip_hdr,processor_seconds,peak_mib,failed\n".to_owned();
    for scene in scenes {
        let name = quoted(&scene.scene.display().to_string());
        for method in &scene.methods {
            let label = quoted(&method.method.name);
            if let Some(why) = &method.failed {
                let _ = writeln!(text, "{name},{label},,,,,,,,,,,,,,,,{}", quoted(why));
            }
            for point in &method.points {
                for (run, (e, seconds)) in point.errors.iter().zip(&point.seconds).enumerate() {
                    let seed = options.seed.wrapping_add(run as u32);
                    let cell = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
                    let flip = |kind: usize| cell(point.flip.get(run).map(|both| both[kind]));
                    let (cpu, memory) = (cell(point.cpu.get(run).copied()), cell(point.memory.get(run).copied()));
                    let _ = writeln!(
                        text,
                        "{name},{label},{},{seed},{seconds},{},{},{},{},{},{},{},{},{},{},{cpu},{memory},",
                        point.spp,
                        e.mse,
                        e.rel_mse,
                        e.rel_mse_trimmed,
                        e.mape,
                        e.smape,
                        e.mean_difference,
                        e.fireflies,
                        e.left_out,
                        flip(0),
                        flip(1)
                    );
                }
            }
        }
    }
    text
}

/// A table for LaTeX (with the package `booktabs`), of the longest budget of each scene.
pub fn to_latex(scenes: &[SceneResult], options: &Options) -> String {
    let names = options.budgets.names();
    let (budget, name) = (names.len().saturating_sub(1), names.last().map_or("", String::as_str));
    let mut text = format!(
        "% Lucerna {}: speed against error; means of {} runs and half the width of their 95 % intervals.\n% \\usepackage{{booktabs}}\n",
        env!("CARGO_PKG_VERSION"),
        options.seeds
    );
    for scene in scenes {
        let stem = scene.scene.file_stem().unwrap_or_default().to_string_lossy();
        let _ = writeln!(text, "\n% {}, {name}", scene.scene.display().to_string().replace('\n', " "));
        text.push_str("\\begin{tabular}{lrrrrrrr}\n\\toprule\n");
        let _ = writeln!(
            text,
            "{} & spp & time (s) & relMSE & MSE & FLIP & bias (\\%) & efficiency \\\\\n\\midrule",
            latex(&stem)
        );
        for (i, method) in scene.methods.iter().enumerate() {
            let name = latex(&method.method.name);
            let _ = match at_budget(method, budget) {
                None => writeln!(text, "{name} & \\multicolumn{{7}}{{l}}{{failed}} \\\\"),
                Some(point) => writeln!(text, "{name} & {} \\\\", latex_cells(scene, i, budget, point).join(" & ")),
            };
        }
        text.push_str("\\bottomrule\n\\end{tabular}\n");
    }
    text
}

/// The point of a budget, if the method has one.
pub fn at_budget(method: &MethodResult, budget: usize) -> Option<&Point> {
    method.points.get(*method.stops.get(budget)?).filter(|_| method.failed.is_none())
}

fn latex_cells(scene: &SceneResult, method: usize, budget: usize, point: &Point) -> [String; 7] {
    let measure = |f: fn(&Errors) -> f64| latex_number(&point.mean(f));
    let gain = match scene.gain(method, budget, |e| e.rel_mse) {
        _ if method == scene.baseline => "1".to_owned(),
        Some(gain) => latex_number(&gain),
        None => "--".to_owned(),
    };
    let difference = point.mean_difference(&scene.truth);
    let percent = Interval { value: 100.0 * difference.value, bounds: difference.bounds.map(|b| b.map(|v| 100.0 * v)) };
    [
        point.spp.to_string(),
        latex_number(&point.time()),
        measure(|e| e.rel_mse),
        measure(|e| e.mse),
        point.flip(1).map_or_else(|| "--".to_owned(), |found| latex_number(&found)),
        latex_number(&percent),
        gain,
    ]
}

/// A number and half the width of its interval.
fn latex_number(found: &Interval) -> String {
    let plain = |value: f64| match page::digits(value).replace('−', "-").split_once('e') {
        Some((front, exponent)) => format!("{front}\\cdot 10^{{{exponent}}}"),
        None => page::digits(value),
    };
    let half = found.bounds.map(|[low, high]| format!(" \\pm {}", plain(0.5 * (high - low))));
    format!("${}{}$", plain(found.value), half.unwrap_or_default())
}

/// Text for LaTeX.
fn latex(text: &str) -> String {
    let escaped = |c: char| match c {
        '&' | '%' | '$' | '#' | '_' | '{' | '}' => format!("\\{c}"),
        '\\' => "\\textbackslash{}".to_owned(),
        '~' => "\\textasciitilde{}".to_owned(),
        '^' => "\\textasciicircum{}".to_owned(),
        c => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_for_latex() {
        assert_eq!(latex("a_b:50%\\"), "a\\_b:50\\%\\textbackslash{}");
        let number = |value, bounds| latex_number(&Interval { value, bounds });
        assert_eq!(number(0.125, Some([0.1, 0.15])), "$0.125 \\pm 0.0250$");
        assert_eq!(number(1.5e-7, None), "$1.50\\cdot 10^{-7}$");
    }
}
