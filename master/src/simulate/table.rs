//! The paper's tables beside modelled ones: sec/cycle, speed-up and efficiency by benchmark, hosts, route and reading.
//!
//! The paper's seconds are read in two ways, as one cycle (k = 1) and as ten (k = 10). A control column runs the same
//! model with a star, without overlap, and with units dealt without regard to ownership.

use std::{fmt::Write as _, sync::Arc};

use deck::model::Model;
use protocol::options::Route;
use serde::Serialize;

use super::{
    calibrate::{self, Work},
    cluster::{Cluster, ElementCost, Tables},
    machines::{Machines, Scheme},
    paper::{self, Verdict},
    timeline::Timeline,
    virtual_clock,
};

/// One cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// 1: joined, 2: free slip.
    pub benchmark: usize,
    /// Elements of the problem.
    pub elements: usize,
    pub hosts: usize,
    /// `direct`, `master` or `control`.
    pub route: &'static str,
    /// Cycles that the paper's seconds are taken for.
    pub k: u32,
    /// Factor on latency and on costs of messages and bytes.
    pub network_factor: f64,
    /// Modelled seconds per cycle.
    pub sec_per_cycle: f64,
    /// Against one host in the same model.
    pub speedup: f64,
    /// Speed-up over hosts.
    pub efficiency: f64,
    /// The paper's seconds over k.
    pub paper_sec_per_cycle: Option<f64>,
    /// The paper's efficiency (1 is perfect).
    pub paper_efficiency: Option<f64>,
    /// Against it.
    pub verdict: Option<Verdict>,
    /// Bytes between hosts per cycle.
    pub bytes_per_cycle: f64,
    /// Digest of the final state.
    pub digest: String,
}

/// All rows, and the timeline of the last cell for pictures.
pub struct Report {
    /// Rows in the order they were run.
    pub rows: Vec<Row>,
    /// Benchmark 2 on all hosts, route direct, k = 10.
    pub last: Timeline,
}

/// The schemes and what their columns are called.
const SCHEMES: [&str; 3] = ["direct", "master", "control"];
/// Factors of the sensitivity rows.
const FACTORS: [f64; 2] = [1.0 / 3.0, 3.0];

fn scheme(name: &str) -> Scheme {
    match name {
        "direct" => Scheme::bolide(Route::Direct),
        "master" => Scheme::bolide(Route::Master),
        _ => Scheme::control(),
    }
}

/// Runs every cell. `told` hears which cell is next.
///
/// # Errors
/// Whatever keeps a run from its end, and digests that differ.
pub fn run(
    cluster: &Cluster,
    tables: &Tables,
    models: &[Arc<Model>; 2],
    told: &mut dyn FnMut(&str),
) -> Result<Report, String> {
    told("one host");
    let works = [calibrate::work(&models[0], cluster)?, calibrate::work(&models[1], cluster)?];
    let readings: &[u32] =
        if matches!(cluster.element, ElementCost::Calibrated(_)) { &[1, 10] } else { &[1] };
    let mut report = Report { rows: Vec::new(), last: Timeline::default() };
    for (b, model) in models.iter().enumerate() {
        let mut one_host: Vec<f64> = Vec::new();
        let mut digest = String::new();
        for &n in &tables.hosts {
            for name in SCHEMES {
                told(&format!("benchmark {}, {n} hosts, {name}", b + 1));
                let cells = cells(cluster, model, &works, b, n, name, readings)?;
                for (k, factor, timeline) in cells {
                    let seconds = timeline.seconds_per_cycle();
                    if n == 1 && name == "direct" && factor == 1.0 {
                        one_host.push(seconds);
                    }
                    if digest.is_empty() {
                        digest.clone_from(&timeline.digest);
                    }
                    if timeline.digest != digest {
                        return Err(format!(
                            "digest {} on {n} hosts, {name}; {digest} on one: report this as a bug",
                            timeline.digest
                        ));
                    }
                    let reading = readings.iter().position(|r| *r == k).unwrap_or(0);
                    let printed = paper::table(tables.paper).and_then(|t| t.cell(b, n));
                    let speedup = one_host[reading] / seconds;
                    let efficiency = speedup / cluster.speeds[..n].iter().sum::<f64>() * cluster.speeds[0];
                    report.rows.push(Row {
                        benchmark: b + 1,
                        elements: model.mesh.n_elements(),
                        hosts: n,
                        route: name,
                        k,
                        network_factor: factor,
                        sec_per_cycle: seconds,
                        speedup,
                        efficiency,
                        paper_sec_per_cycle: printed.map(|(s, _)| s / f64::from(k)),
                        paper_efficiency: printed.map(|(_, e)| e / 100.0),
                        verdict: printed.map(|(_, e)| Verdict::of(efficiency, e)),
                        bytes_per_cycle: timeline.bytes_per_cycle(),
                        digest: timeline.digest.clone(),
                    });
                    if b == 1 && name == "direct" && factor == 1.0 {
                        report.last = timeline;
                    }
                }
            }
        }
    }
    Ok(report)
}

/// One run that computes, then its replays: (k, network factor, what came of it).
fn cells(
    cluster: &Cluster,
    model: &Arc<Model>,
    works: &[Work; 2],
    benchmark: usize,
    n: usize,
    name: &str,
    readings: &[u32],
) -> Result<Vec<(u32, f64, Timeline)>, String> {
    let part = cluster.first(n);
    let scheme = scheme(name);
    // The share of sorts is the same for every k, and one tape serves them all.
    let believed = match name {
        "control" => part.speeds.clone(),
        _ => {
            let costs = calibrate::costs(cluster, works, 1.0);
            let by = (&costs, costs.relative(&part.network));
            calibrate::believed(model, (&part.speeds, &scheme), by, &works[benchmark])
        }
    };
    let mut tape = None;
    let mut out = Vec::new();
    // One tape serves all readings, so work is dealt out alike.
    let first = readings.first().copied().unwrap_or(1);
    let dealt_by = calibrate::costs(cluster, works, f64::from(first)).relative(&part.network);
    for &k in readings {
        let factors: &[f64] = if name == "direct" && n > 1 { &[1.0, FACTORS[0], FACTORS[1]] } else { &[1.0] };
        for &factor in factors {
            let costs = calibrate::costs(cluster, works, f64::from(k));
            let machines = Machines {
                speeds: part.speeds.clone(),
                believed: believed.clone(),
                costs,
                network: part.network.scaled(factor),
                changes: part.changes.clone(),
                dealt_by,
            };
            let (timeline, kept) = virtual_clock::run(model, &machines, scheme, tape.as_ref())?;
            tape = tape.or(kept);
            out.push((k, factor, timeline));
        }
    }
    Ok(out)
}

/// The rows as tables for people.
pub fn print(cluster: &Cluster, report: &Report) -> String {
    let mut text = String::new();
    let mut line = |words: String| {
        text.push_str(&words);
        text.push('\n');
    };
    line(format!("{}: modelled under a virtual clock", cluster.title));
    let mut groups: Vec<(usize, u32)> = report.rows.iter().map(|r| (r.benchmark, r.k)).collect();
    groups.dedup();
    groups.sort_unstable();
    groups.dedup();
    for (benchmark, k) in groups {
        let of_group: Vec<&Row> =
            report.rows.iter().filter(|r| r.benchmark == benchmark && r.k == k).collect();
        line(String::new());
        line(format!("benchmark {benchmark}, {} elements, k = {k}", of_group[0].elements));
        line("         paper            | direct, modelled                     | master, modelled                     | control, modelled                    | direct, network costs".into());
        line("  hosts  s/cycle  eff     | s/cycle  speed-up  eff              | s/cycle  speed-up  eff              | s/cycle  speed-up  eff              | x 1/3   x 3".into());
        let mut hosts: Vec<usize> = of_group.iter().map(|r| r.hosts).collect();
        hosts.dedup();
        for n in hosts {
            let row = |route: &str, factor: f64| {
                of_group
                    .iter()
                    .find(|r| r.hosts == n && r.route == route && r.network_factor == factor)
                    .copied()
            };
            let mut words = match row("direct", 1.0) {
                Some(Row { paper_sec_per_cycle: Some(s), paper_efficiency: Some(e), .. }) => {
                    format!("  {n:5}  {s:7.3}  {:4.0} %  ", 100.0 * e)
                }
                _ => format!("  {n:5}        -     -    "),
            };
            for route in SCHEMES {
                if let Some(r) = row(route, 1.0) {
                    let verdict = r.verdict.map_or("", Verdict::word);
                    let (s, up, e) = (r.sec_per_cycle, r.speedup, 100.0 * r.efficiency);
                    let _ = write!(words, "| {s:8.4} {up:7.2}  {e:6.2} %  {verdict:8} ");
                }
            }
            if let (Some(low), Some(high)) = (row("direct", FACTORS[0]), row("direct", FACTORS[1])) {
                let _ = write!(words, "| {:5.1} % {:5.1} %", 100.0 * low.efficiency, 100.0 * high.efficiency);
            }
            line(words);
        }
        let bytes: Vec<String> = of_group
            .iter()
            .filter(|r| r.network_factor == 1.0 && r.hosts > 1)
            .map(|r| format!("{} {} {:.0}", r.hosts, r.route, r.bytes_per_cycle / 1000.0))
            .collect();
        line(format!("  kB per cycle by hosts and route: {}", bytes.join(", ")));
        line(format!("  digest {}", of_group[0].digest));
    }
    text
}
