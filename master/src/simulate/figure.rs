//! Pictures: the speed-up as the paper's figure 4 draws it, the space-time diagram of the hosts, and the same as a trace
//! that Perfetto and chrome://tracing open.

use std::{collections::HashMap, fmt::Write as _};

use super::{
    table::Row,
    timeline::{Kind, Span, Timeline},
};

/// Cycles that the space-time diagram shows.
const SHOWN: u64 = 8;

fn colour(kind: Kind) -> &'static str {
    match kind {
        Kind::Border | Kind::Elements => "#2a6f97",
        Kind::Install => "#e07a1f",
        Kind::Interior => "#89c2d9",
        Kind::Integrate => "#52796f",
        Kind::Sort => "#b5179e",
        Kind::Send => "#c1121f",
        Kind::Receive => "#f28482",
        Kind::Load | Kind::Transfer | Kind::WorkerState => "#adb5bd",
    }
}

fn name(kind: Kind) -> &'static str {
    match kind {
        Kind::Load => "load",
        Kind::Transfer => "transfer",
        Kind::Elements => "all elements",
        Kind::Install => "plan and contact",
        Kind::Border => "contact and border",
        Kind::Interior => "interior",
        Kind::Integrate => "integrate",
        Kind::WorkerState => "state",
        Kind::Sort => "sort",
        Kind::Send => "send",
        Kind::Receive => "receive",
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Speed-up by hosts for both benchmarks on route direct, the paper's points, and perfect speed-up dashed.
pub fn speed_up(title: &str, rows: &[Row]) -> String {
    let most = rows.iter().map(|r| r.hosts).max().unwrap_or(1) as f64;
    let (width, height, margin) = (640.0, 520.0, 60.0);
    let x = |n: f64| margin + n / most * (width - 2.0 * margin);
    let y = |s: f64| height - margin - s / most * (height - 2.0 * margin);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<text x=\"{margin}\" y=\"24\">{}: speed-up, modelled</text>\n",
        escaped(title)
    );
    let mut line = |words: String| {
        svg.push_str(&words);
        svg.push('\n');
    };
    line(format!(
        "<path d=\"M{} {} V{} H{}\" fill=\"none\" stroke=\"black\"/>",
        x(0.0),
        y(most),
        y(0.0),
        x(most)
    ));
    line(format!(
        "<path d=\"M{} {} L{} {}\" stroke=\"gray\" stroke-dasharray=\"6 4\"/>",
        x(0.0),
        y(0.0),
        x(most),
        y(most)
    ));
    let mut hosts: Vec<usize> = rows.iter().map(|r| r.hosts).collect();
    hosts.sort_unstable();
    hosts.dedup();
    for n in hosts {
        let n = n as f64;
        line(format!("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{n}</text>", x(n), y(0.0) + 18.0));
        line(format!("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{n}</text>", x(0.0) - 6.0, y(n) + 4.0));
    }
    line(format!("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">hosts</text>", width / 2.0, height - 14.0));
    line(format!(
        "<text transform=\"translate(20 {}) rotate(-90)\" text-anchor=\"middle\">speed-up</text>",
        height / 2.0
    ));
    line(format!(
        "<text x=\"{}\" y=\"{}\" fill=\"gray\" text-anchor=\"end\">dashed: perfect speed-up; circles: the paper's</text>",
        x(most),
        y(0.0) - 10.0
    ));
    let mut series: Vec<(usize, u32)> = rows.iter().map(|r| (r.benchmark, r.k)).collect();
    series.sort_unstable();
    series.dedup();
    for (i, (benchmark, k)) in series.into_iter().enumerate() {
        let colour = ["#1d3557", "#457b9d", "#d62828", "#f77f00"][i % 4];
        let of_series: Vec<&Row> = rows
            .iter()
            .filter(|r| {
                r.benchmark == benchmark && r.k == k && r.route == "direct" && r.network_factor == 1.0
            })
            .collect();
        let path: Vec<String> =
            of_series.iter().map(|r| format!("{:.1} {:.1}", x(r.hosts as f64), y(r.speedup))).collect();
        line(format!(
            "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            path.join(" L")
        ));
        for r in &of_series {
            if let Some(paper) = r.paper_efficiency {
                let (cx, cy) = (x(r.hosts as f64), y(paper * r.hosts as f64));
                line(format!(
                    "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"4\" fill=\"none\" stroke=\"{colour}\"/>"
                ));
            }
        }
        line(format!(
            "<text x=\"{}\" y=\"{}\" fill=\"{colour}\">benchmark {benchmark}, k = {k}</text>",
            margin + 16.0,
            56.0 + 18.0 * i as f64
        ));
    }
    svg.push_str("</svg>\n");
    svg
}

/// Steps of the scale of time.
const TICKS: u32 = 8;

/// A time in four digits.
fn seconds(time: f64) -> String {
    if time >= 0.1 || time == 0.0 { format!("{time:.2}") } else { format!("{time:.2e}") }
}

/// Spans of the cycles that are drawn, and their times.
fn shown(timeline: &Timeline) -> (Vec<&Span>, f64, f64) {
    let first = timeline.window().start;
    let last = (first + SHOWN).min(timeline.counts.len() as u64);
    let (from, to) = (timeline.reached(first), timeline.reached(last));
    (timeline.spans.iter().filter(|s| s.time.1 > from && s.time.0 < to).collect(), from, to)
}

/// Hosts downward, time to the right: computing, sending, receiving, waiting (white), with messages as lines.
pub fn space_time(title: &str, timeline: &Timeline) -> String {
    let (spans, from, to) = shown(timeline);
    let n = timeline.ends.len();
    let (left, top, row, width) = (70.0, 60.0, 26.0, 1400.0);
    let height = top + row * (n as f64 + 1.0) + 40.0;
    let x = |t: f64| {
        left + (t.clamp(from, to) - from) / (to - from).max(f64::MIN_POSITIVE) * (width - left - 20.0)
    };
    // The master's own row comes first.
    let y = |host: usize, master: bool| if master { top } else { top + row * (host as f64 + 1.0) };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<text x=\"{left}\" y=\"20\">{}: {} cycles, modelled; white is waiting, lines are messages</text>\n",
        escaped(title),
        SHOWN.min(timeline.counts.len() as u64 - timeline.window().start)
    );
    let kinds =
        [Kind::Border, Kind::Interior, Kind::Integrate, Kind::Install, Kind::Sort, Kind::Send, Kind::Receive];
    for (i, kind) in kinds.into_iter().enumerate() {
        let at = left + 150.0 * i as f64;
        let _ = writeln!(
            svg,
            "<rect x=\"{at}\" y=\"30\" width=\"12\" height=\"12\" fill=\"{}\"/><text x=\"{}\" y=\"41\">{}</text>",
            colour(kind),
            at + 17.0,
            name(kind)
        );
    }
    for host in 0..n {
        let _ = writeln!(svg, "<text x=\"6\" y=\"{}\">host {}</text>", y(host, false) + 15.0, host + 1);
    }
    let _ = writeln!(svg, "<text x=\"6\" y=\"{}\">master</text>", top + 15.0);
    // A scale of time below the last host.
    let below = top + row * (n as f64 + 1.0);
    let _ = writeln!(svg, "<path d=\"M{left} {below} H{}\" stroke=\"black\"/>", x(to));
    for tick in 0..=TICKS {
        let at = x(from + (to - from) * f64::from(tick) / f64::from(TICKS));
        let time = (to - from) * f64::from(tick) / f64::from(TICKS);
        let unit = if tick == TICKS { " s" } else { "" };
        let _ = writeln!(
            svg,
            "<path d=\"M{at:.1} {below} v5\" stroke=\"black\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"{}\">{}{unit}</text>",
            below + 19.0,
            if tick == TICKS { "end" } else { "middle" },
            seconds(time)
        );
    }
    // Messages last, so that they stand on what they interrupt.
    let messages = |s: &Span| matches!(s.kind, Kind::Send | Kind::Receive);
    for above in [false, true] {
        for s in spans.iter().filter(|s| messages(s) == above) {
            let (a, b) = (x(s.time.0), x(s.time.1));
            let _ = writeln!(
                svg,
                "<rect x=\"{a:.2}\" y=\"{}\" width=\"{:.2}\" height=\"{}\" fill=\"{}\"/>",
                y(s.host, s.master),
                (b - a).max(0.2),
                row - 8.0,
                colour(s.kind)
            );
        }
    }
    for flight in timeline.flights.iter().filter(|f| f.time.0 >= from && f.time.1 <= to) {
        let _ = writeln!(
            svg,
            "<path d=\"M{:.2} {} L{:.2} {}\" stroke=\"#333333\" stroke-width=\"0.3\" opacity=\"0.25\"/>",
            x(flight.time.0),
            y(flight.hosts.0, false) + 9.0,
            x(flight.time.1),
            y(flight.hosts.1, false) + 9.0
        );
    }
    svg.push_str("</svg>\n");
    svg
}

/// The trace event format: complete events by host, messages as flow arrows (times in microseconds).
pub fn trace(timeline: &Timeline) -> String {
    let mut events = Vec::with_capacity(timeline.spans.len() + 2 * timeline.flights.len());
    for host in 0..timeline.ends.len() {
        events.push(serde_json::json!({
            "ph": "M", "name": "process_name", "pid": host + 1, "args": { "name": format!("host {}", host + 1) }
        }));
        for (tid, lane) in LANES.into_iter().enumerate() {
            events.push(serde_json::json!({
                "ph": "M", "name": "thread_name", "pid": host + 1, "tid": tid, "args": { "name": lane }
            }));
        }
    }
    for span in &timeline.spans {
        events.push(serde_json::json!({
            "ph": "X", "name": name(span.kind), "cat": if span.master { "master" } else { "worker" },
            "pid": span.host + 1, "tid": lane(span),
            "ts": span.time.0 * 1e6, "dur": (span.time.1 - span.time.0) * 1e6, "args": { "cycle": span.cycle }
        }));
    }
    // An arrow binds to the slices that enclose its ends, so it starts and ends in the middle of theirs.
    let bytes: HashMap<u64, u64> = timeline.flights.iter().map(|f| (f.message, f.bytes)).collect();
    for span in &timeline.spans {
        let Some((id, bytes)) = span.message.and_then(|id| Some((id, bytes.get(&id)?))) else { continue };
        let phase = if span.kind == Kind::Send { "s" } else { "f" };
        events.push(serde_json::json!({
            "ph": phase, "bp": "e", "name": "message", "cat": "message", "id": id, "pid": span.host + 1,
            "tid": lane(span), "ts": 0.5 * (span.time.0 + span.time.1) * 1e6, "args": { "bytes": bytes }
        }));
    }
    serde_json::json!({ "displayTimeUnit": "ms", "traceEvents": events }).to_string()
}

/// Lanes of a host in the trace: spans of one lane never overlap by half.
const LANES: [&str; 3] = ["compute", "messages", "sort"];

fn lane(span: &Span) -> usize {
    match span.kind {
        Kind::Send | Kind::Receive => 1,
        Kind::Sort => 2,
        _ => 0,
    }
}
