//! Plots with two logarithmic axes, as SVG that takes its colours from the page.

use crate::check::page::escape;
use std::fmt::Write as _;

/// A point and its interval.
pub struct Dot {
    /// Where it is.
    pub x: f64,
    /// How high.
    pub y: f64,
    /// The interval of `y`.
    pub bounds: Option<[f64; 2]>,
    /// What is told when the mouse rests on it.
    pub title: String,
}

/// A curve; its number chooses colour, marker and dashes.
pub struct Curve {
    /// The number.
    pub number: usize,
    /// Its points, rising in x.
    pub dots: Vec<Dot>,
}

/// A plot.
pub struct Plot<'a> {
    /// What it shows, for those who cannot see it.
    pub label: &'a str,
    /// Name of the horizontal axis.
    pub x: &'a str,
    /// Name of the vertical axis.
    pub y: &'a str,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Height and name of a horizontal line.
    pub floor: Option<(f64, &'a str)>,
}

const SIZE: [f64; 2] = [560.0, 380.0];
/// Left, right, top, bottom.
const MARGINS: [f64; 4] = [64.0, 14.0, 12.0, 46.0];

/// A logarithmic axis: values from `low` to `high` on pixels from `from` to `to`.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Option<Self> {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            return None;
        }
        let middle = 0.5 * (low + high);
        let half = (0.53 * (high - low)).max(0.25);
        Some(Axis { low: middle - half, high: middle + half, from, to })
    }

    fn at(&self, value: f64) -> f64 {
        let part = (value.log10() - self.low) / (self.high - self.low);
        self.from + part.clamp(-0.05, 1.05) * (self.to - self.from)
    }

    /// Decades; 1, 2 and 5 where there are few; every second, third … decade where there are many.
    fn ticks(&self) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let step = (((self.high - self.low) / 7.0).ceil() as i32).max(1);
        let few: &[f64] = if self.high - self.low < 2.2 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let all = decades.filter(|d| d % step == 0).flat_map(|d| few.iter().map(move |f| f * 10_f64.powi(d)));
        all.filter(|v| (self.low..=self.high).contains(&v.log10())).collect()
    }
}

/// A number for an axis.
fn tick_text(value: f64) -> String {
    if (0.001..10_000.0).contains(&value) {
        return format!("{}", (value * 1e6).round() / 1e6);
    }
    let exponent = value.log10().floor();
    let digits: String = format!("{exponent}")
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            c => c.to_digit(10).and_then(|d| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(d as usize)).unwrap_or(c),
        })
        .collect();
    match (value / 10_f64.powf(exponent)).round() {
        1.0 => format!("10{digits}"),
        front => format!("{front}·10{digits}"),
    }
}

/// A marker of radius 4; their shapes tell curves apart without colours.
pub fn marker(number: usize, x: f64, y: f64) -> String {
    let polygon = |points: &[(f64, f64)]| {
        let text: Vec<String> = points.iter().map(|(dx, dy)| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
        format!("<polygon points=\"{}\"/>", text.join(" "))
    };
    match number % 6 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>"),
        1 => polygon(&[(-3.7, -3.7), (3.7, -3.7), (3.7, 3.7), (-3.7, 3.7)]),
        2 => polygon(&[(0.0, -5.0), (4.8, 3.6), (-4.8, 3.6)]),
        3 => polygon(&[(0.0, -5.4), (5.4, 0.0), (0.0, 5.4), (-5.4, 0.0)]),
        4 => polygon(&[(0.0, 5.0), (4.8, -3.6), (-4.8, -3.6)]),
        _ => polygon(&[
            (-5.0, -1.7),
            (-1.7, -1.7),
            (-1.7, -5.0),
            (1.7, -5.0),
            (1.7, -1.7),
            (5.0, -1.7),
            (5.0, 1.7),
            (1.7, 1.7),
            (1.7, 5.0),
            (-1.7, 5.0),
            (-1.7, 1.7),
            (-5.0, 1.7),
        ]),
    }
}

impl Plot<'_> {
    /// The picture; nothing if there is no point.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let [left, right, top, bottom] = MARGINS;
        let dots = || self.curves.iter().flat_map(|c| &c.dots);
        let heights = dots().flat_map(|d| [Some(d.y), d.bounds.map(|b| b[1])]).flatten();
        let heights = heights.chain(self.floor.map(|(y, _)| y));
        let (Some(x), Some(y)) =
            (Axis::new(dots().map(|d| d.x), left, width - right), Axis::new(heights, height - bottom, top))
        else {
            return String::new();
        };
        let mut svg = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">\n",
            self.label
        );
        let (x0, x1, y0, y1) = (left, width - right, height - bottom, top);
        for tick in x.ticks() {
            let at = x.at(tick);
            let text = tick_text(tick);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{at:.1}\" y1=\"{y0}\" x2=\"{at:.1}\" y2=\"{y1}\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{text}</text>",
                y0 + 16.0
            );
        }
        for tick in y.ticks() {
            let at = y.at(tick);
            let text = tick_text(tick);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{x0}\" y1=\"{at:.1}\" x2=\"{x1}\" y2=\"{at:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                x0 - 7.0,
                at + 4.0
            );
        }
        let middle = 0.5 * (y0 + y1);
        let _ = writeln!(
            svg,
            "<text class=\"axis\" x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            0.5 * (x0 + x1),
            height - 8.0,
            self.x
        );
        let _ = writeln!(
            svg,
            "<text class=\"axis\" transform=\"translate(14 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            self.y
        );
        if let Some((floor, name)) = self.floor {
            let at = y.at(floor);
            let _ = writeln!(
                svg,
                "<line class=\"floor\" x1=\"{x0}\" y1=\"{at:.1}\" x2=\"{x1}\" y2=\"{at:.1}\"/><text class=\"floor\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
                x1 - 4.0,
                at - 5.0
            );
        }
        for curve in &self.curves {
            let _ = writeln!(svg, "<g class=\"c{}\">", curve.number % 8);
            let line: Vec<String> =
                curve.dots.iter().filter(|d| d.y > 0.0).map(|d| format!("{:.1},{:.1}", x.at(d.x), y.at(d.y))).collect();
            let _ = writeln!(svg, "<polyline points=\"{}\"/>", line.join(" "));
            for dot in curve.dots.iter().filter(|d| d.y > 0.0) {
                let at = x.at(dot.x);
                let _ = write!(svg, "<g><title>{}</title>", dot.title);
                if let Some([low, high]) = dot.bounds {
                    // A bound below zero is off the axis.
                    let low = if low > 0.0 { y.at(low) } else { y0 };
                    let _ = write!(
                        svg,
                        "<line class=\"bar\" x1=\"{at:.1}\" y1=\"{low:.1}\" x2=\"{at:.1}\" y2=\"{:.1}\"/>",
                        y.at(high)
                    );
                }
                let _ = writeln!(svg, "{}</g>", marker(curve.number, at, y.at(dot.y)));
            }
            svg.push_str("</g>\n");
        }
        svg.push_str("</svg>\n");
        svg
    }
}

/// A value of one method on a common axis.
pub struct Bar {
    /// Chooses colour and marker.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// The value.
    pub value: f64,
    /// Its interval.
    pub bounds: Option<[f64; 2]>,
    /// What is told when the mouse rests on it.
    pub title: String,
}

/// Ratios below each other on one logarithmic axis, with a line at 1.
pub struct Forest {
    /// Name of the axis.
    pub label: String,
    /// From top to bottom.
    pub bars: Vec<Bar>,
}

impl Forest {
    /// The picture; nothing if there is no bar.
    pub fn svg(&self) -> String {
        const WIDTH: f64 = 560.0;
        const ROW: f64 = 26.0;
        // Names stand above their bars on the left, so that the axis has all of the width.
        let (x0, x1, y1) = (10.0, WIDTH - 10.0, 6.0);
        let y0 = y1 + 2.0 * ROW * self.bars.len() as f64 * 0.8;
        let step = (y0 - y1) / self.bars.len().max(1) as f64;
        let values = self.bars.iter().flat_map(|b| [Some(b.value), b.bounds.map(|b| b[0]), b.bounds.map(|b| b[1])]);
        let Some(axis) = Axis::new(values.flatten().chain([1.0]), x0, x1) else { return String::new() };
        let label = escape(&self.label);
        let mut svg = format!(
            "<svg class=\"plot forest\" viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"{label}\">\n",
            y0 + 40.0
        );
        for tick in axis.ticks() {
            let at = axis.at(tick);
            let _ = writeln!(
                svg,
                "<line class=\"grid\" x1=\"{at:.1}\" y1=\"{y0:.1}\" x2=\"{at:.1}\" y2=\"{y1}\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{} ×</text>",
                y0 + 16.0,
                tick_text(tick)
            );
        }
        let one = axis.at(1.0);
        let _ = writeln!(svg, "<line class=\"one\" x1=\"{one:.1}\" y1=\"{y0:.1}\" x2=\"{one:.1}\" y2=\"{y1}\"/>");
        for (row, bar) in self.bars.iter().enumerate() {
            let top = y1 + step * row as f64;
            let (middle, at) = (top + 0.7 * step, axis.at(bar.value));
            let _ = write!(svg, "<g class=\"c{}\"><title>{}</title>", bar.number % 8, escape(&bar.title));
            let _ = write!(
                svg,
                "<text class=\"name\" x=\"{x0}\" y=\"{:.1}\">{}</text>",
                top + 0.42 * step,
                escape(&bar.name)
            );
            if let Some([low, high]) = bar.bounds {
                let _ = write!(
                    svg,
                    "<line class=\"bar\" x1=\"{:.1}\" y1=\"{middle:.1}\" x2=\"{:.1}\" y2=\"{middle:.1}\"/>",
                    axis.at(low),
                    axis.at(high)
                );
            }
            let _ = writeln!(svg, "{}</g>", marker(bar.number, at, middle));
        }
        let _ = writeln!(
            svg,
            "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>\n</svg>",
            0.5 * WIDTH,
            y0 + 35.0
        );
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let texts: Vec<String> = [0.5, 1.0, 200.0, 1e-5, 2e-4, 1e6].map(tick_text).to_vec();
        assert_eq!(texts, ["0.5", "1", "200", "10⁻⁵", "2·10⁻⁴", "10⁶"]);
        let axis = Axis::new([0.01, 100.0].into_iter(), 0.0, 1.0).unwrap();
        assert_eq!(axis.ticks().len(), 5);
        assert!((axis.at(1.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn nothing_to_plot() {
        let plot = Plot { label: "", x: "", y: "", curves: Vec::new(), floor: None };
        assert_eq!(plot.svg(), "");
        let svg = Forest { label: String::new(), bars: Vec::new() }.svg();
        assert!(!svg.contains("<title>"), "{svg}");
    }
}
