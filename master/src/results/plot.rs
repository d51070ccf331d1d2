//! Curves in an SVG picture, for pages without scripts.

#![expect(clippy::disallowed_methods, reason = "ticks of a plot")]

use std::fmt::Write as _;

use super::{report::escaped, summary::significant};

/// A plot's width and height, the room left of and below its area, and that above and right of it (px).
const SIZE: [f64; 2] = [720.0, 270.0];
const MARGIN: [f64; 2] = [76.0, 36.0];
const EDGE: [f64; 2] = [8.0, 12.0];
/// Colours of the page's style; beyond them curves are told apart by dashes.
const COLOURS: usize = 7;

/// A curve: what it is called, and its points.
pub struct Curve {
    pub name: String,
    pub points: Vec<[f64; 2]>,
}

/// A picture that grows line by line.
pub struct Plot {
    /// Least and greatest along either axis.
    ranges: [[f64; 2]; 2],
    /// What it is so far.
    pub svg: String,
}

impl Plot {
    /// Axes of all values within `ranges`, and the words below.
    pub fn new(ranges: [[f64; 2]; 2], words: &str) -> Self {
        let mut plot = Self { ranges, svg: String::new() };
        let (right, bottom) = (SIZE[0] - EDGE[1], SIZE[1] - MARGIN[1]);
        let [horizontal, vertical] = ranges.map(|[low, high]| ticks(low, high));
        let _ = writeln!(plot.svg, "<svg viewBox=\"0 0 {} {}\" role=\"img\">", SIZE[0], SIZE[1]);
        for tick in vertical {
            let (left, y) = (MARGIN[0], plot.y(tick));
            let _ = writeln!(
                plot.svg,
                "<line x1=\"{left}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"var(--line)\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 7.0,
                y + 4.0,
                label(tick)
            );
        }
        for tick in horizontal {
            let _ = writeln!(
                plot.svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                plot.x(tick),
                bottom + 17.0,
                label(tick)
            );
        }
        let _ = writeln!(
            plot.svg,
            "<text x=\"{right:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            SIZE[1] - 3.0,
            escaped(words)
        );
        plot
    }

    /// Where a value is along the horizontal axis (px).
    pub fn x(&self, value: f64) -> f64 {
        MARGIN[0] + part(value, self.ranges[0]) * (SIZE[0] - MARGIN[0] - EDGE[1])
    }

    /// Where a value is along the vertical axis (px).
    pub fn y(&self, value: f64) -> f64 {
        EDGE[0] + (1.0 - part(value, self.ranges[1])) * (SIZE[1] - MARGIN[1] - EDGE[0])
    }

    /// Adds a curve.
    pub fn line(&mut self, index: usize, curve: &Curve) {
        let mut path = String::new();
        for p in &curve.points {
            let _ = write!(path, "{:.1},{:.1} ", self.x(p[0]), self.y(p[1]));
        }
        let _ = writeln!(
            self.svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{}><title>{}</title></polyline>",
            path.trim_end(),
            colour(index),
            dash(index),
            escaped(&curve.name)
        );
    }

    /// The picture, and below it these entries.
    pub fn end(self, entries: impl Iterator<Item = String>) -> String {
        let entries: Vec<String> = entries.map(|entry| format!("{entry}&ensp; ")).collect();
        format!("{}</svg>\n<p>{}</p>\n", self.svg, entries.concat())
    }
}

/// How far a value is from the least to the greatest.
fn part(value: f64, [low, high]: [f64; 2]) -> f64 {
    (value - low) / if high > low { high - low } else { 1.0 }
}

/// Of the curve of this index.
pub fn colour(index: usize) -> String {
    format!("var(--c{})", index % COLOURS)
}

/// Of curves of one colour, the first is solid and the others are dashed, each in its own way.
fn dash(index: usize) -> &'static str {
    match index / COLOURS % 4 {
        0 => "",
        1 => " stroke-dasharray=\"5 3\"",
        2 => " stroke-dasharray=\"1.5 3\"",
        _ => " stroke-dasharray=\"9 3 2 3\"",
    }
}

/// Look and name of a curve.
pub fn entry(index: usize, curve: &Curve) -> String {
    format!(
        "<svg style=\"width:22px;height:8px\" viewBox=\"0 0 22 8\" aria-hidden=\"true\"><line x2=\"22\" y1=\"4\" y2=\"4\" stroke=\"{}\" \
         stroke-width=\"2\"{}/></svg> {}",
        colour(index),
        dash(index),
        escaped(&curve.name)
    )
}

/// Round numbers that lie between two, about five of them.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let raw = (high - low) / 5.0;
    if !raw.is_finite() || raw <= 0.0 {
        return vec![low];
    }
    let power = 10_f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|step| *step >= raw).unwrap_or(raw);
    let first = (low / step).ceil() as i64;
    (first..)
        .map(|i| i as f64 * step)
        .take_while(|tick| *tick <= high * (1.0 + 1e-12) || *tick == 0.0)
        .take(12)
        .collect()
}

/// A tick's number without the zeros that say nothing.
pub fn label(tick: f64) -> String {
    let text = significant(tick);
    let (number, exponent) = text.split_once('e').map_or((text.as_str(), None), |(n, e)| (n, Some(e)));
    let number =
        if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    exponent.map_or_else(|| number.to_owned(), |exponent| format!("{number}e{exponent}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_lie_between() {
        assert_eq!(ticks(0.0, 10.0), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks(-1.0, 1.0), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(ticks(3.0, 3.0), [3.0]);
        assert!(ticks(0.0, 7.3e-9).len() >= 3);
        assert!(ticks(f64::NEG_INFINITY, f64::INFINITY).len() <= 12);
    }

    #[test]
    fn labels_keep_what_zeros_say() {
        assert_eq!([0.0, 50.0, 0.25, 4e-4, 2e9].map(label), ["0", "50", "0.25", "4e-4", "2e9"]);
    }

    #[test]
    fn the_least_and_the_greatest_are_at_the_ends_of_the_axes() {
        let plot = Plot::new([[2.0, 4.0], [-1.0, 3.0]], "time [<s>]");
        assert_eq!([plot.x(2.0), plot.x(4.0), plot.y(3.0), plot.y(-1.0)], [76.0, 708.0, 8.0, 234.0]);
        assert!(plot.svg.contains("time [&lt;s&gt;]"));
        assert_eq!(Plot::new([[1.0, 1.0]; 2], "").x(1.0), 76.0);
    }
}
