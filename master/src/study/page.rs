//! `study.html`: a study at a glance, one file without scripts or links.
//!
//! Curves show each measure over the parameter with the most values, a curve for each set of the others; where two parameters form a grid, a
//! map shows the measure over both. Below stand what was found and every run with the command that repeats it.

use std::{collections::BTreeMap, fmt::Write as _};

use super::{
    plan::{Point, Study},
    prepare::command,
    table::{self, Outcome, Outcomes, heading, told},
};
use crate::results::{
    plot::{Curve, Plot, colour, entry, label},
    report::{STYLE, escaped},
};

pub const PAGE: &str = "study.html";
/// A map's width, and the room left of it (px).
const WIDTH: f64 = 720.0;
const MARGIN: f64 = 76.0;
/// Curves of a plot at most; more than this nobody tells apart.
const MOST_CURVES: usize = 14;
/// Rows of the table of runs at most; `table.csv` has all.
const MOST_ROWS: usize = 2_000;
/// Values along each side of a map at most.
const MOST_CELLS: usize = 60;

/// A set of parameters' values as a key: their bits order as they stand in the table.
type Key = Vec<u64>;

/// The page.
pub fn page(study: &Study, outcomes: &Outcomes) -> String {
    let mut body = format!("<h1>{}</h1>\n", escaped(&study.title));
    let failed = outcomes.values().filter(|outcome| !outcome.is_whole()).count();
    let _ = writeln!(
        body,
        "<p>{} runs of <code>{}</code>{}.</p>",
        outcomes.len(),
        escaped(&study.deck.display().to_string()),
        if failed > 0 { format!(", {failed} of which failed or lack a measure") } else { String::new() }
    );
    body.push_str(&goal(study, outcomes));
    body.push_str(&scatter(study, outcomes));
    if let Some(along) = abscissa(study, outcomes) {
        for (index, measure) in study.measures.iter().enumerate() {
            let heading = heading(&measure.name, &measure.unit);
            let _ =
                writeln!(body, "<h2>{} <small>{}</small></h2>", escaped(&heading), escaped(&measure.words));
            body.push_str(&plot(study, outcomes, along, index));
            body.push_str(&map(study, outcomes, along, index));
        }
    }
    body.push_str(&runs(study, outcomes));
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{}</title>\n<style>{STYLE}\ntd code{{white-space:nowrap;font-size:11px;display:block;text-align:left}}</style></head>\n<body>\n{body}</body></html>\n",
        escaped(&study.title)
    )
}

/// The parameter with the most values, if one has several.
fn abscissa(study: &Study, outcomes: &Outcomes) -> Option<usize> {
    let count = |index: usize| {
        let values: std::collections::BTreeSet<u64> =
            outcomes.keys().map(|point| point.values[index].to_bits()).collect();
        values.len()
    };
    let searched = study.goal.search().map(|search| search.parameter);
    let most = searched.or_else(|| (0..study.parameters.len()).rev().max_by_key(|&index| count(index)))?;
    (count(most) > 1).then_some(most)
}

fn row(cells: &[String], tag: &str) -> String {
    let cells: String = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect();
    format!("<tr>{cells}</tr>\n")
}

fn goal(study: &Study, outcomes: &Outcomes) -> String {
    let Some(search) = study.goal.search() else { return String::new() };
    let parameter = &study.parameters[search.parameter];
    let words = escaped(search.name);
    let mut html = format!(
        "<h2>{words} <small>{}</small></h2>\n<div class=\"scroll\"><table>",
        escaped(&heading(&parameter.name, &parameter.unit))
    );
    let others: Vec<usize> = (0..study.parameters.len()).filter(|&index| index != search.parameter).collect();
    let mut header: Vec<String> = others
        .iter()
        .map(|&n| escaped(&heading(&study.parameters[n].name, &study.parameters[n].unit)))
        .collect();
    header.extend(study.scatter.map(|_| "sample".to_owned()));
    header.extend(["low", "high", "at", "value", "result"].map(str::to_owned));
    html.push_str(&row(&header, "th"));
    for (site, found) in table::found(study, outcomes).iter().take(MOST_ROWS) {
        let (_, numbers) = told(found.as_ref());
        let mut cells: Vec<String> = others.iter().map(|&n| label(site.values[n])).collect();
        cells.extend(study.scatter.map(|_| site.sample.to_string()));
        cells.extend(numbers.map(|number| number.map_or_else(String::new, label)));
        cells.push(table::result(study, outcomes, site, found.as_ref()));
        html.push_str(&row(&cells, "td"));
    }
    html.push_str("</table></div>\n");
    html
}

fn scatter(study: &Study, outcomes: &Outcomes) -> String {
    let Some(scatter) = study.scatter else { return String::new() };
    let searched = study.goal.search().map(|search| search.parameter);
    let others: Vec<usize> = (0..study.parameters.len()).filter(|&index| Some(index) != searched).collect();
    let mut html = format!(
        "<h2>Scatter <small>nodes moved by {:e} of the size of the whole</small></h2>\n<div class=\"scroll\"><table>",
        scatter.nodes
    );
    let mut header: Vec<String> = others.iter().map(|&n| escaped(&study.parameters[n].name)).collect();
    header.extend(
        ["of", "unperturbed", "least", "greatest", "mean", "deviation", "samples", "amplification"]
            .map(str::to_owned),
    );
    html.push_str(&row(&header, "th"));
    for (values, name, interval) in table::intervals(study, outcomes).into_iter().take(MOST_ROWS) {
        let mut cells: Vec<String> = others.iter().map(|&n| label(values[n])).collect();
        cells.push(escaped(&name));
        cells.push(interval.plain.map_or_else(String::new, label));
        cells.extend([interval.least, interval.greatest, interval.mean, interval.deviation].map(label));
        cells.extend([interval.count.to_string(), label(interval.amplification(scatter))]);
        html.push_str(&row(&cells, "td"));
    }
    html.push_str("</table></div>\n");
    html
}

/// The values of a measure by the other parameters and along one of them; the mean where there are several.
fn by_others(
    outcomes: &Outcomes,
    along: usize,
    measure: usize,
) -> BTreeMap<Key, BTreeMap<u64, (f64, Vec<f64>)>> {
    let mut curves: BTreeMap<Key, BTreeMap<u64, (f64, Vec<f64>)>> = BTreeMap::new();
    for (point, outcome) in outcomes {
        let Outcome::Done(row) = outcome else { continue };
        let Ok(value) = row.values[measure] else { continue };
        let others = point.values.iter().enumerate().filter(|(n, _)| *n != along);
        let key: Key = others.map(|(_, value)| ordered(*value)).collect();
        let at = point.values[along];
        let values = &mut curves.entry(key).or_default().entry(ordered(at)).or_insert((at, Vec::new())).1;
        values.push(value);
    }
    curves
}

/// Bits that order as the numbers do.
fn ordered(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// The number of [`ordered`] bits.
fn number(bits: u64) -> f64 {
    f64::from_bits(if bits >> 63 == 1 { bits & !(1 << 63) } else { !bits })
}

fn name_of(study: &Study, key: &Key, along: usize) -> String {
    let others = (0..study.parameters.len()).filter(|&n| n != along);
    let words =
        others.zip(key).map(|(n, bits)| format!("{} {}", study.parameters[n].name, label(number(*bits))));
    words.collect::<Vec<_>>().join(", ")
}

fn plot(study: &Study, outcomes: &Outcomes, along: usize, measure: usize) -> String {
    let all = by_others(outcomes, along, measure);
    let n_all = all.len();
    let mut bars = Vec::new();
    let curves: Vec<Curve> = all
        .into_iter()
        .take(MOST_CURVES)
        .enumerate()
        .map(|(index, (key, values))| {
            let mut points = Vec::new();
            for (at, values) in values.into_values() {
                let mean = values.iter().map(|v| v / values.len() as f64).sum();
                let least = values.iter().copied().fold(f64::INFINITY, f64::min);
                let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                points.push([at, mean]);
                if greatest > least {
                    bars.push((index, at, least, greatest));
                }
            }
            Curve { name: name_of(study, &key, along), points }
        })
        .collect();
    let ends = bars.iter().flat_map(|&(_, at, least, greatest)| [[at, least], [at, greatest]]);
    let points: Vec<[f64; 2]> =
        curves.iter().flat_map(|curve| curve.points.iter().copied()).chain(ends).collect();
    let range = |axis: usize| {
        points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p[axis]), b.max(p[axis])])
    };
    if points.is_empty() {
        return String::new();
    }
    let parameter = &study.parameters[along];
    let mut plot = Plot::new([range(0), range(1)], &heading(&parameter.name, &parameter.unit));
    for (index, at, least, greatest) in bars {
        let (x, low, high) = (plot.x(at), plot.y(least), plot.y(greatest));
        let _ = writeln!(
            plot.svg,
            "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{low:.1}\" y2=\"{high:.1}\" stroke=\"{}\" stroke-width=\"1.2\"/>",
            colour(index)
        );
    }
    for (index, curve) in curves.iter().enumerate() {
        plot.line(index, curve);
        for &[at, value] in &curve.points {
            let title = format!("{} {}, {}: {}", parameter.name, label(at), curve.name, label(value));
            let (x, y) = (plot.x(at), plot.y(value));
            let _ = writeln!(
                plot.svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{}\"><title>{}</title></circle>",
                colour(index),
                escaped(&title)
            );
        }
    }
    let named = curves.iter().enumerate().filter(|(_, curve)| !curve.name.is_empty());
    let others = n_all
        .checked_sub(MOST_CURVES)
        .filter(|&others| others > 0)
        .map(|others| format!("and {others} more in {}", table::TABLE));
    plot.end(named.map(|(index, curve)| entry(index, curve)).chain(others))
}

/// The measure over two parameters that form a grid, as coloured cells with their numbers in titles.
fn map(study: &Study, outcomes: &Outcomes, along: usize, measure: usize) -> String {
    let by_others = by_others(outcomes, along, measure);
    let columns: std::collections::BTreeSet<u64> =
        by_others.values().flat_map(|row| row.keys().copied()).collect();
    let whole = by_others.values().all(|row| row.len() == columns.len());
    let fits = |n: usize| (2..=MOST_CELLS).contains(&n);
    if study.parameters.len() != 2 || !whole || !fits(columns.len()) || !fits(by_others.len()) {
        return String::new();
    }
    let mean = |values: &[f64]| values.iter().map(|v| v / values.len() as f64).sum::<f64>();
    let all: Vec<f64> =
        by_others.values().flat_map(|row| row.values().map(|(_, values)| mean(values))).collect();
    let [low, high] = all.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &v| [a.min(v), b.max(v)]);
    if high <= low {
        return String::new();
    }
    let wide = (WIDTH - MARGIN - 14.0) / columns.len() as f64;
    let tall = (wide * 0.5).clamp(14.0, 36.0);
    let height = tall * by_others.len() as f64;
    let mut svg = format!("<svg viewBox=\"0 0 {} {:.0}\" role=\"img\">\n", WIDTH, height + 24.0);
    for (r, (key, row)) in by_others.iter().rev().enumerate() {
        let top = tall * r as f64;
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            MARGIN - 8.0,
            top + tall / 2.0 + 4.0,
            key.iter().map(|bits| label(number(*bits))).collect::<String>()
        );
        for (c, (at, values)) in row.values().enumerate() {
            let value = mean(values);
            let share = (value - low) / (high - low);
            let _ = writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{tall:.1}\" fill=\"var(--c0)\" fill-opacity=\"{:.3}\"><title>{} {}, {}: {}</title></rect>",
                MARGIN + wide * c as f64,
                0.05 + 0.9 * share,
                escaped(&study.parameters[along].name),
                label(*at),
                escaped(&name_of(study, key, along)),
                label(value)
            );
        }
    }
    for (c, bits) in columns.iter().enumerate().step_by(columns.len().div_ceil(12)) {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            MARGIN + wide * (c as f64 + 0.5),
            height + 16.0,
            label(number(*bits))
        );
    }
    svg.push_str("</svg>\n");
    let other = 1 - along;
    let _ = writeln!(
        svg,
        "<p><small>{} across, {} upwards; from {} (light) to {} (dark)</small></p>",
        escaped(&study.parameters[along].name),
        escaped(&study.parameters[other].name),
        label(low),
        label(high)
    );
    svg
}

/// Every run, with the command that repeats it.
fn runs(study: &Study, outcomes: &Outcomes) -> String {
    let mut html = "<h2>Runs</h2>\n<div class=\"scroll\"><table>".to_owned();
    let mut header: Vec<String> = study
        .parameters
        .iter()
        .map(|parameter| escaped(&heading(&parameter.name, &parameter.unit)))
        .collect();
    header.extend(study.scatter.map(|_| "sample".to_owned()));
    header.extend(study.measures.iter().map(|measure| escaped(&heading(&measure.name, &measure.unit))));
    header.push("command that repeats it".to_owned());
    html.push_str(&row(&header, "th"));
    for (number, (point, outcome)) in outcomes.iter().enumerate().take(MOST_ROWS) {
        let mut cells: Vec<String> = point.values.iter().map(|value| label(*value)).collect();
        cells.extend(study.scatter.map(|_| point.sample.to_string()));
        match outcome {
            Outcome::Done(done) => {
                let cell = |value: &Result<f64, String>| match value {
                    Ok(value) => label(*value),
                    Err(why) => escaped(why),
                };
                cells.extend(done.values.iter().map(cell));
            }
            Outcome::Failed(why) => {
                cells.push(format!("failed: {}", escaped(why)));
                cells.extend(study.measures.iter().skip(1).map(|_| String::new()));
            }
        }
        cells.push(format!("<code>{}</code>", escaped(&repeat(study, point, number))));
        html.push_str(&row(&cells, "td"));
    }
    html.push_str("</table></div>\n");
    if outcomes.len() > MOST_ROWS {
        let _ = writeln!(html, "<p>{} more stand in {}.</p>", outcomes.len() - MOST_ROWS, table::TABLE);
    }
    html
}

/// The command that repeats a run, by its number in the table from 0.
pub fn repeat(study: &Study, point: &Point, number: usize) -> String {
    command(study, point, &format!("results/point-{}", number + 1))
}
