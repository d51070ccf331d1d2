//! Where a cluster saturates: one problem by number of hosts, rate of the wires and route.
//!
//! Printed by `--table` where the cluster file's `[tables]` has `rates_bits_per_second`. Each number of hosts and route
//! computes once; the other rates replay its tape. A row names what is busiest beside computing: the processor of host 1
//! with messages or with sorts, or its wire in either direction.

use std::{fmt::Write as _, sync::Arc};

use deck::model::Model;
use protocol::options::Route;
use serde::Serialize;

use super::{
    calibrate,
    cluster::{Cluster, ElementCost, Tables},
    machines::{Costs, Machines, Scheme},
    network::Network,
    timeline::Timeline,
    virtual_clock,
};

/// One cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// 1: the deck without contact, 2: with.
    pub benchmark: usize,
    /// Elements of the problem.
    pub elements: usize,
    pub hosts: usize,
    /// `direct` or `master`.
    pub route: &'static str,
    /// Rate of the wires.
    pub rate_bits_per_second: f64,
    /// Modelled seconds per cycle.
    pub sec_per_cycle: f64,
    /// Against one host in the same model.
    pub speedup: f64,
    /// Speed-up over the sum of speeds.
    pub efficiency: f64,
    /// Bytes between hosts per cycle.
    pub bytes_per_cycle: f64,
    /// What is busy for which share of a cycle.
    pub busy: Busy,
    pub busiest: &'static str,
    /// Digest of the final state.
    pub digest: String,
}

/// Shares of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Busy {
    /// The mean worker with elements, contact and nodes.
    pub computing: f64,
    /// The processor of host 1 with messages to and from other hosts.
    pub messages: f64,
    pub sorts: f64,
    /// The wire out of host 1.
    pub wire_out: f64,
    /// The wire into host 1.
    pub wire_in: f64,
}

impl Busy {
    fn of(timeline: &Timeline, costs: &Costs, network: &Network, speed: f64) -> Self {
        let window = timeline.window();
        let cycle = timeline.seconds_per_cycle().max(f64::MIN_POSITIVE);
        let time = cycle * (window.end - window.start).max(1) as f64;
        let n = timeline.ends.len();
        let computing: f64 = (0..n)
            .map(|worker| {
                let p = timeline.mean_phases(worker);
                p.border + p.contact + p.interior + p.integrate
            })
            .sum();
        let mut busy = Self { computing: computing / n as f64 / cycle, ..Self::default() };
        for flight in timeline.flights.iter().filter(|f| window.contains(&f.cycle)) {
            let (from, to) = flight.hosts;
            if from == 0 {
                busy.wire_out += network.occupation(flight.bytes) / time;
            }
            if to == 0 {
                busy.wire_in += network.occupation(flight.bytes) / time;
            }
            if from == 0 || to == 0 {
                busy.messages += network.handling(flight.bytes) / speed / time;
            }
        }
        let [.., sorted] = timeline.work_per_cycle();
        busy.sorts = sorted * costs.sort / speed / cycle;
        busy
    }

    fn busiest(&self) -> &'static str {
        let named = [
            (self.computing, "computing"),
            (self.messages, "messages of host 1"),
            (self.sorts, "sorts of host 1"),
            (self.wire_out, "wire out of host 1"),
            (self.wire_in, "wire into host 1"),
        ];
        named.into_iter().fold((0.0, "waiting"), |best, it| if it.0 > best.0 { it } else { best }).1
    }
}

/// The routes and their names.
const ROUTES: [(&str, Route); 2] = [("direct", Route::Direct), ("master", Route::Master)];

/// Runs every cell. `told` hears which cell is next.
///
/// # Errors
/// Whatever keeps a run from its end, costs without a figure of their own, and digests that differ.
pub fn run(
    cluster: &Cluster,
    tables: &Tables,
    models: &[Arc<Model>; 2],
    told: &mut dyn FnMut(&str),
) -> Result<Vec<Row>, String> {
    if !matches!(cluster.element, ElementCost::Seconds(_)) {
        return Err("rates_bits_per_second needs element = seconds, not those of two decks".to_owned());
    }
    let costs = calibrate::costs(cluster, &[[0.0; 5]; 2], 1.0);
    let mut rows = Vec::new();
    for (b, model) in models.iter().enumerate() {
        told(&format!("benchmark {}, one host", b + 1));
        let work = calibrate::work(model, cluster)?;
        let (mut one_host, mut digest) = (0.0, String::new());
        for &n in &tables.hosts {
            let part = cluster.first(n);
            for (name, route) in ROUTES {
                if n == 1 && route == Route::Master {
                    continue;
                }
                told(&format!("benchmark {}, {n} hosts, {name}", b + 1));
                let (scheme, dealt_by) = (Scheme::bolide(route), costs.relative(&part.network));
                let by = (&costs, dealt_by);
                let believed = calibrate::believed(model, (&part.speeds, &scheme), by, &work);
                let mut tape = None;
                for &rate in &tables.rates {
                    let machines = Machines {
                        speeds: part.speeds.clone(),
                        believed: believed.clone(),
                        costs,
                        network: Network { rate, ..part.network.clone() },
                        changes: part.changes.clone(),
                        dealt_by,
                    };
                    let (timeline, kept) = virtual_clock::run(model, &machines, scheme, tape.as_ref())?;
                    tape = tape.or(kept);
                    let seconds = timeline.seconds_per_cycle();
                    if digest.is_empty() {
                        one_host = seconds;
                        digest.clone_from(&timeline.digest);
                    }
                    if timeline.digest != digest {
                        return Err(format!(
                            "digest {} on {n} hosts, {name}; {digest} on one: report this as a bug",
                            timeline.digest
                        ));
                    }
                    let busy = Busy::of(&timeline, &costs, &machines.network, part.speeds[0]);
                    let speedup = one_host / seconds;
                    rows.push(Row {
                        benchmark: b + 1,
                        elements: model.mesh.n_elements(),
                        hosts: n,
                        route: name,
                        rate_bits_per_second: rate,
                        sec_per_cycle: seconds,
                        speedup,
                        efficiency: speedup * part.speeds[0] / part.speeds.iter().sum::<f64>(),
                        bytes_per_cycle: timeline.bytes_per_cycle(),
                        busy,
                        busiest: busy.busiest(),
                        digest: timeline.digest.clone(),
                    });
                    if n == 1 {
                        break;
                    }
                }
            }
        }
    }
    Ok(rows)
}

/// The rows as one table for people.
pub fn print(cluster: &Cluster, rows: &[Row]) -> String {
    let mut text = format!("{}: modelled under a virtual clock\n", cluster.title);
    for benchmark in [1, 2] {
        let of: Vec<&Row> = rows.iter().filter(|r| r.benchmark == benchmark).collect();
        let Some(first) = of.first() else { continue };
        let _ = write!(
            text,
            "\nbenchmark {benchmark}, {} elements; one host {:.6} s/cycle; shares of a cycle\n  \
             hosts  route   Gb/s  s/cycle    speed-up  eff       kB/cycle  computing  messages  sorts  \
             out    in     busiest\n",
            first.elements, first.sec_per_cycle
        );
        for r in of.iter().filter(|r| r.hosts > 1) {
            let _ = writeln!(
                text,
                "  {:5}  {:6}  {:4.0}  {:.6}  {:9.2}  {:5.1} %  {:10.0}  {:7.0} %  {:6.0} %  {:3.0} %  {:3.0} %  {:3.0} %  {}",
                r.hosts,
                r.route,
                r.rate_bits_per_second / 1e9,
                r.sec_per_cycle,
                r.speedup,
                100.0 * r.efficiency,
                r.bytes_per_cycle / 1000.0,
                100.0 * r.busy.computing,
                100.0 * r.busy.messages,
                100.0 * r.busy.sorts,
                100.0 * r.busy.wire_out,
                100.0 * r.busy.wire_in,
                r.busiest
            );
        }
        let _ = writeln!(text, "  digest {}", first.digest);
    }
    text
}
