//! `report.html`: a run at a glance, one file without scripts or links, for a browser.
//!
//! Curves are drawn from `history.csv` as it stands on disk, tables from the summary; so a report says nothing that the
//! other files do not.

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};

use super::{
    Error, Folder, HISTORY, REPORT, Summary, Units,
    history::{HistoryRow, Table},
    plot::{Curve, Plot, entry},
    summary::significant,
    write_whole,
};

/// Points of a curve at most: more than a screen has columns.
const MOST_POINTS: usize = 800;

/// A picture of the report: what is on it, and the PNG.
pub struct Picture {
    pub caption: String,
    pub png: Vec<u8>,
}

/// Writes the report of a finished run. `units` is the deck's name of them.
///
/// # Errors
/// [`Error::Io`]; [`Error::Malformed`] if the history is no longer what the run wrote.
pub fn write(folder: &Folder, summary: &Summary, units: &str, pictures: &[Picture]) -> Result<(), Error> {
    let history = Table::read(&folder.file(HISTORY))?;
    let page = page(&history, summary, units, pictures);
    write_whole(&folder.file(REPORT), |out| std::io::Write::write_all(out, page.as_bytes()))
}

fn page(history: &Table, summary: &Summary, units: &str, pictures: &[Picture]) -> String {
    let Units { time, energy, length, stress, force, .. } = Units::named(units);
    let title = escaped(&summary.title);
    let mut body = format!("<h1>{title}</h1>\n<pre>{}</pre>\n", lines(&summary.table(units, true)));
    for Picture { caption, png } in pictures {
        let caption = escaped(caption);
        let _ = writeln!(
            body,
            "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{}\"><figcaption>{caption}</figcaption></figure>",
            STANDARD.encode(png)
        );
    }
    let at = history.column("time").unwrap_or_default();
    let curve = |name: &str| -> Option<Curve> {
        let values = history.column(name)?;
        let all: Vec<[f64; 2]> = at.iter().zip(&values).map(|(&t, &v)| [t, v]).collect();
        values.iter().any(|&v| v != 0.0).then(|| Curve { name: name.to_owned(), points: thinned(all) })
    };
    let mut energies: Vec<Curve> = HistoryRow::SHARES.iter().filter_map(|name| curve(name)).collect();
    energies.extend(curve("total"));
    // It is what the total may change by, no share of it.
    energies.extend(curve("external").map(|curve| Curve { name: "external work".to_owned(), ..curve }));
    let mut plots = vec![
        ("Energies".to_owned(), energy.to_owned(), energies),
        ("Energy error".to_owned(), "relative".to_owned(), curve("error").into_iter().collect::<Vec<_>>()),
        ("Time step".to_owned(), time.to_owned(), curve("dt").into_iter().collect()),
    ];
    // Columns of parts and gauges are called `name:quantity [unit]`.
    let quantity = |column: &str| {
        let bare = column.rsplit_once(" [").map_or(column, |(bare, _)| bare);
        bare.rsplit_once(':').map(|(owner, what)| (owner.to_owned(), what.to_owned()))
    };
    for (what, heading, unit) in [
        ("kinetic", "Kinetic energy of parts", energy.to_owned()),
        ("internal", "Internal energy of parts", energy.to_owned()),
        ("vx", "Velocity of gauges, x", format!("{length}/{time}")),
        ("vy", "Velocity of gauges, y", format!("{length}/{time}")),
        ("vz", "Velocity of gauges, z", format!("{length}/{time}")),
        ("pressure", "Pressure at gauges", stress.to_owned()),
        ("fx", "Force of contact, walls and supports, x", force.to_owned()),
        ("fy", "Force of contact, walls and supports, y", force.to_owned()),
        ("fz", "Force of contact, walls and supports, z", force.to_owned()),
    ] {
        let of_owner = |column: &String| {
            let (owner, found) = quantity(column)?;
            let mut curve = curve(&format!("{owner}:{found}")).filter(|_| found == what)?;
            curve.name = owner;
            Some(curve)
        };
        plots.push((heading.to_owned(), unit, history.columns.iter().filter_map(of_owner).collect()));
    }
    for (heading, unit, curves) in plots.iter().filter(|(_, _, curves)| !curves.is_empty()) {
        let _ = write!(body, "<h2>{heading} <small>{}</small></h2>\n{}", escaped(unit), plot(curves, time));
    }
    body.push_str(&balance(summary));
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{title}</title>\n<style>{STYLE}</style></head>\n<body>\n{body}</body></html>\n"
    )
}

/// A table of lines, each of which goes on below where its label ends if the page is narrower.
fn lines(table: &str) -> String {
    table.lines().map(|line| format!("<span>{}</span>", escaped(line))).collect()
}

pub(crate) const STYLE: &str = "
:root{color-scheme:light dark;--ink:#1b1f24;--paper:#fff;--line:#d5d9de;--c0:#0b62c4;--c1:#b8450f;--c2:#0a7a4b;--c3:#8a3fb0;--c4:#8c6d00;--c5:#b0214f;--c6:#4b5563}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8eb;--paper:#14171a;--line:#3a4047;--c0:#6cb0ff;--c1:#ff9d66;--c2:#5fd3a0;--c3:#d09bf0;--c4:#e2c04c;--c5:#ff86a8;--c6:#aab3bd}}
body{font:15px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:760px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.25rem}h2{font-size:1rem;margin:1.6rem 0 .3rem}small{font-weight:normal;opacity:.75}
pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:13px;border:1px solid var(--line);border-radius:4px;padding:.7rem}
pre span{display:block;padding-left:13ch;text-indent:-13ch;min-height:1lh}
figure{margin:1rem 0}img{width:100%;height:auto;border-radius:4px}figcaption{font-size:13px;opacity:.75}
svg{width:100%;height:auto;font:12px system-ui,sans-serif}svg text{fill:var(--ink)}
table{border-collapse:collapse;width:100%;font-size:13px}td,th{text-align:right;padding:.15rem .4rem;border-bottom:1px solid var(--line)}td:first-child,th:first-child{text-align:left}
.scroll{overflow-x:auto}";

/// One of so many points that a screen can tell apart; the last stays.
fn thinned(all: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let step = all.len().div_ceil(MOST_POINTS).max(1);
    let last = all.last().copied();
    let mut points: Vec<[f64; 2]> = all.iter().copied().step_by(step).collect();
    if points.last() != last.as_ref() {
        points.extend(last);
    }
    points
}

fn plot(curves: &[Curve], time: &str) -> String {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let range = |axis: usize, start: [f64; 2]| {
        points().fold(start, |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
    };
    // Zero belongs to a scale of energies and speeds: without it small changes look large.
    let ranges = [range(0, [f64::INFINITY, f64::NEG_INFINITY]), range(1, [0.0, 0.0])];
    let mut plot = Plot::new(ranges, &format!("time [{time}]"));
    for (index, curve) in curves.iter().enumerate() {
        plot.line(index, curve);
    }
    plot.end(curves.iter().enumerate().map(|(index, curve)| {
        let last = curve.points.last().map_or(0.0, |p| p[1]);
        format!("{} <small>{}</small>", entry(index, curve), significant(last))
    }))
}

/// How the time of the workers went, and what was dealt out anew or lost.
fn balance(summary: &Summary) -> String {
    let columns = ["border", "contact", "interior", "send", "wait", "integrate", "other"];
    let mut html = format!(
        "<h2>Workers <small>imbalance {:.3}, share of the time since the first cycle</small></h2>\n<div class=\"scroll\"><table><tr><th>worker</th>",
        summary.imbalance
    );
    for column in columns {
        let _ = write!(html, "<th>{column}</th>");
    }
    html.push_str("</tr>\n");
    for w in &summary.worker_times {
        let times = [w.border_s, w.contact_s, w.interior_s, w.send_s, w.wait_s, w.integrate_s, w.other_s];
        let all: f64 = times.iter().sum();
        let _ = write!(html, "<tr><td>{}</td>", escaped(&w.name));
        for t in times {
            let _ = write!(html, "<td>{:.1} %</td>", if all > 0.0 { 100.0 * t / all } else { 0.0 });
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</table></div>\n");
    if !summary.rebalances.is_empty() || !summary.losses.is_empty() {
        let _ = writeln!(
            html,
            "<p>Work was dealt out anew {} times; {} workers were lost.</p>",
            summary.rebalances.len(),
            summary.losses.len()
        );
    }
    html
}

pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_keeps_its_ends() {
        let all: Vec<[f64; 2]> = (0..10_007).map(|i| [f64::from(i), 1.0]).collect();
        let points = thinned(all.clone());
        assert!(points.len() <= MOST_POINTS + 1);
        assert_eq!((points[0], points.last()), (all[0], all.last()));
    }

    #[test]
    fn names_of_a_deck_are_text_and_never_markup() {
        let columns = ["cycle", "time [s]", "dt [s]", "kinetic [J]", "<b>&\":kinetic [J]"].map(str::to_owned);
        let rows = (0..3).map(|i| vec![f64::from(i), f64::from(i), 0.1, 2.0, 1.0]).collect();
        let summary = Summary { title: "<script>".to_owned(), ..Summary::default() };
        let pictures = [Picture { caption: "<b>\"".to_owned(), png: b"any".to_vec() }];
        let page = page(&Table { columns: columns.to_vec(), rows }, &summary, "SI", &pictures);
        assert!(!page.contains("<script") && !page.contains("<b>"), "{page}");
        assert!(page.contains("alt=\"&lt;b&gt;&quot;\" src=\"data:image/png;base64,YW55\""), "{page}");
        assert!(page.contains("&lt;b&gt;&amp;&quot;") && page.contains("Kinetic energy of parts"));
        assert_eq!(page.matches("<polyline").count(), 3, "energies, time step, the part");
    }
}
