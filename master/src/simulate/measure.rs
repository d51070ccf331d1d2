//! `--measure-costs`: what an element, a node, a pair, a search, a sort and a message cost on this machine.
//!
//! A problem runs on one emulated host, its tasks one after the other on one thread, and the thread-CPU time of each is
//! taken: an element-cycle out of tasks that compute elements alone, and so on. Sorts are taken from a second run, on as many
//! hosts as the cluster has, for lists of what they share are part of a sort. Of every task the median over the run counts, and of repetitions the median again. These are the constants of cluster files; nothing else sets them.

use std::{
    fmt::Write as _,
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    sync::Arc,
};

use deck::model::Model;
use mechanics::{cycle::Meter, lanes::Width};
use protocol::{
    frame::{self, Frame, Header},
    options::{Route, SortBy},
};
use serde::Serialize;
use worker::compute::ThreadClock;

use super::{
    machines::{Costs, Machines, Scheme},
    network::{Network, Regions, Wires},
    timeline::Kind,
    virtual_clock,
};

/// Costs on one thread of this machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Measured {
    /// An element in a cycle (ns).
    pub element_ns: f64,
    /// Integrating a node, in elements.
    pub node: f64,
    /// A node-face pair in a cycle, in elements; none where the run had no pairs.
    pub pair: Option<f64>,
    /// A pair of a new plan, in pairs; none where no plan with pairs began to act.
    pub search: Option<f64>,
    /// A surface node in a sort, in pairs; none where there was no sort, or no pair.
    pub sort: Option<f64>,
    /// A short message over loopback TCP, at each end (ns).
    pub message_ns: f64,
    /// A byte of a long one, at each end (ns).
    pub byte_ns: f64,
}

/// Cycles between sorts: lists of contact may last longer than the whole run, which would then have no sort to measure.
const SORTS_EVERY: u64 = 8;

/// Cycles that a run is given at least beyond that in which the first plan of a forced sort acts.
const CYCLES_OF_A_PLAN: u64 = 2;

/// Bytes of the short and the long message that are timed.
const MESSAGES: [usize; 2] = [64, 256 * 1024];
/// How often each is sent.
const SENT: [u32; 2] = [4000, 400];

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The problem with as many cycles as a sort and its plan take, if it would end before.
fn long_enough(model: &Arc<Model>) -> Arc<Model> {
    let control = &model.setup.control;
    let least = SORTS_EVERY + u64::from(control.sort_lag) + CYCLES_OF_A_PLAN;
    if model.setup.contact.is_none() || control.end_cycle >= least {
        return Arc::clone(model);
    }
    let mut longer = Model::clone(model);
    longer.setup.control.end_cycle = least;
    Arc::new(longer)
}

/// Measures once. What a problem without contact, or one whose end time comes before the plan of a sort acts, does not show is none.
///
/// # Errors
/// Whatever keeps the runs from their end, a run without elements, sockets.
pub fn once(model: &Arc<Model>, hosts: usize, lanes: Option<Width>) -> Result<Measured, String> {
    let model = &long_enough(model);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| e.to_string())?;
    let machines = |hosts: usize| Machines {
        speeds: vec![1.0; hosts],
        believed: vec![1.0; hosts],
        costs: Costs { element: 1.0, ..Costs::default() },
        network: Network {
            wires: Wires::Switch,
            rate: 1e12,
            latency: 0.0,
            payload: 1448,
            overhead: 0,
            message: 0.0,
            byte: 0.0,
            regions: Regions::default(),
        },
        changes: Vec::new(),
        dealt_by: crate::balance::Costs::NONE,
    };
    let run = |hosts: usize| {
        let (sort_every, sort_by) = (Some(SORTS_EVERY), SortBy::Master);
        let scheme = Scheme { lanes, sort_every, sort_by, ..Scheme::bolide(Route::Direct) };
        let (_, tape) = pool.install(|| virtual_clock::run(model, &machines(hosts), scheme, None))?;
        tape.ok_or_else(|| "a run that computes keeps a tape".to_owned())
    };
    let tape = run(1)?;
    let per = |kind: Kind, count: fn(&mechanics::cycle::Load) -> u64| -> Vec<f64> {
        let tasks = tape.workers.iter().flatten().filter(|taped| taped.kind() == kind);
        tasks
            .filter(|taped| count(&taped.load()) > 0)
            .map(|taped| taped.used_ns() as f64 / count(&taped.load()) as f64)
            .collect()
    };
    let element = median(per(Kind::Interior, |load| load.interior));
    let node = median(per(Kind::Integrate, |load| load.nodes));
    let pair = median(per(Kind::Border, |load| load.pairs));
    let install = median(per(Kind::Install, |load| load.pairs));
    let sort = median(run(hosts)?.sort_ns);
    if element <= 0.0 {
        return Err("the run computed no element: take a deck with elements, and more --cycles".to_owned());
    }
    let [message, byte] = messages().map_err(|e| format!("loopback: {e}"))?;
    let pair = (pair > 0.0).then_some(pair);
    let in_pairs = |ns: f64| pair.filter(|_| ns > 0.0).map(|pair| ns / pair);
    Ok(Measured {
        element_ns: element,
        node: node / element,
        pair: pair.map(|pair| pair / element),
        search: in_pairs(install).map(|all| all - 1.0),
        sort: in_pairs(sort),
        message_ns: message,
        byte_ns: byte,
    })
}

/// Thread-CPU time (ns) of `work` on this thread.
fn used(work: impl FnOnce() -> std::io::Result<()>) -> std::io::Result<f64> {
    let clock = ThreadClock::default();
    let mark = clock.start();
    work()?;
    clock.stop(mark, false);
    Ok(clock.work().compute_ns as f64)
}

/// A frame of so many bytes.
fn sealed(bytes: usize) -> std::io::Result<Frame> {
    let mut frame = Frame::new(Header::new(frame::Kind::Cycle), vec![1; bytes]);
    frame.seal().map_err(std::io::Error::other)?;
    Ok(frame)
}

/// A message and a byte at each end (ns): half of what both ends use for writing, check sum, reading, check sum. On
/// loopback the kernel does the receiver's protocol work in the sender's name, so only the sum of both is known.
fn messages() -> std::io::Result<[f64; 2]> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let mut far = TcpStream::connect(listener.local_addr()?)?;
    let (mut near, _) = listener.accept()?;
    far.set_nodelay(true)?;
    near.set_nodelay(true)?;
    let mut cost = [0.0; 2];
    for (cost, (&bytes, &times)) in cost.iter_mut().zip(MESSAGES.iter().zip(&SENT)) {
        let ends = std::thread::scope(|scope| {
            let reader = scope.spawn(|| {
                used(|| {
                    let mut frame = sealed(bytes)?;
                    for _ in 0..times {
                        near.read_exact(&mut frame.payload)?;
                        frame.verify().map_err(std::io::Error::other)?;
                        near.write_all(&[0])?;
                    }
                    Ok(())
                })
            });
            let written = used(|| {
                let mut frame = sealed(bytes)?;
                let mut answer = [0];
                for _ in 0..times {
                    frame.seal().map_err(std::io::Error::other)?;
                    far.write_all(&frame.payload)?;
                    far.read_exact(&mut answer)?;
                }
                Ok(())
            })?;
            let read = reader.join().map_err(|_| std::io::Error::other("the reading thread panicked"))??;
            Ok::<f64, std::io::Error>(written + read)
        })?;
        *cost = ends / f64::from(times);
    }
    // A message and its answer are two messages with two ends each; a byte has two ends.
    let byte = (cost[1] - cost[0]).max(0.0) / (MESSAGES[1] - MESSAGES[0]) as f64 / 2.0;
    Ok([cost[0] / 4.0, byte])
}

/// Measures several times; all repetitions, and their medians.
///
/// # Errors
/// As [`once`].
pub fn run(
    model: &Arc<Model>,
    hosts: usize,
    lanes: Option<Width>,
    repetitions: u32,
) -> Result<(Vec<Measured>, Measured), String> {
    let all: Vec<Measured> = (0..repetitions).map(|_| once(model, hosts, lanes)).collect::<Result<_, _>>()?;
    let of = |get: fn(&Measured) -> f64| median(all.iter().map(get).collect());
    let known = |get: fn(&Measured) -> Option<f64>| {
        let values: Vec<f64> = all.iter().filter_map(get).collect();
        (!values.is_empty()).then(|| median(values))
    };
    let medians = Measured {
        element_ns: of(|m| m.element_ns),
        node: of(|m| m.node),
        pair: known(|m| m.pair),
        search: known(|m| m.search),
        sort: known(|m| m.sort),
        message_ns: of(|m| m.message_ns),
        byte_ns: of(|m| m.byte_ns),
    };
    Ok((all, medians))
}

/// Repetitions and medians as a table.
pub fn print(all: &[Measured], medians: &Measured) -> String {
    let mut text =
        "            element ns   node el.  pair el.  search pairs  sort pairs  message ns  byte ns\n"
            .to_owned();
    let named = all.iter().enumerate().map(|(i, m)| (format!("{}", i + 1), m));
    let or_none = |value: Option<f64>, digits: usize| match value {
        Some(value) => format!("{value:.digits$}"),
        None => "-".to_owned(),
    };
    for (name, m) in named.chain([("median".to_owned(), medians)]) {
        let _ = writeln!(
            text,
            "{name:>10}  {:10.1}  {:9.3}  {:>8}  {:>12}  {:>10}  {:10.0}  {:7.3}",
            m.element_ns,
            m.node,
            or_none(m.pair, 3),
            or_none(m.search, 2),
            or_none(m.sort, 2),
            m.message_ns,
            m.byte_ns
        );
    }
    let missing: Vec<&str> = [("pair", medians.pair), ("search", medians.search), ("sort", medians.sort)]
        .into_iter()
        .filter_map(|(name, value)| value.is_none().then_some(name))
        .collect();
    if !missing.is_empty() {
        let _ = writeln!(
            text,
            "not measured: {}; the run had no such work: take a deck with contact whose end time leaves room for a sort and its plan",
            missing.join(", ")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two plates of a few elements, which touch or are joined, that end in the second cycle if nobody lets them run on.
    fn plates(between: &str) -> Arc<Model> {
        let part = |name: &str, base: f64, speed: i32| {
            format!(
                "[[part]]\nname = \"{name}\"\nmaterial = \"STEEL_1006\"\nvelocity = [0, 0, {speed}]\n\
                 box = {{ origin = [0, 0, {base}], size = [4, 4, 2], cells = [4, 4, 2] }}\n"
            )
        };
        let gap = if between.contains("contact") { 0.1 } else { 0.0 };
        let text = format!(
            "title = \"plates\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n{}{}{between}",
            part("target", 0.0, 0),
            part("projectile", 2.0 + gap, -100)
        );
        let mut model = deck::read(&text, "plates").expect("a sound deck");
        model.setup.control.end_cycle = 2;
        Arc::new(model)
    }

    #[test]
    fn a_short_run_goes_on_until_a_plan_of_contact_has_begun_to_act() {
        let model = plates("[contact]\ngap_length = 0.1\n");
        let measured = once(&model, 2, Some(Width::Scalar)).expect("a run to its end");
        for (name, value) in [("pair", measured.pair), ("search", measured.search), ("sort", measured.sort)] {
            assert!(value.is_some_and(f64::is_finite), "{name}: {value:?}");
        }
        assert!(!print(&[], &measured).contains("not measured"));
    }

    #[test]
    fn what_a_deck_without_contact_does_not_show_is_named() {
        let model = plates("[[join]]\nparts = [\"target\", \"projectile\"]\n");
        let (_, measured) = run(&model, 2, Some(Width::Scalar), 1).expect("a run to its end");
        assert!(measured.element_ns > 0.0 && measured.node > 0.0 && measured.message_ns > 0.0);
        assert_eq!([measured.pair, measured.search, measured.sort], [None; 3]);
        assert!(print(&[], &measured).contains("not measured: pair, search, sort;"));
    }
}
