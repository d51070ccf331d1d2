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
    options::Route,
};
use serde::Serialize;
use worker::compute::ThreadClock;

use super::{
    machines::{Costs, Machines, Scheme},
    network::{Network, Wires},
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
    /// A node-face pair in a cycle, in elements.
    pub pair: f64,
    /// A pair of a new plan, in pairs.
    pub search: f64,
    /// A surface node in a sort, in pairs.
    pub sort: f64,
    /// A short message over loopback TCP, at each end (ns).
    pub message_ns: f64,
    /// A byte of a long one, at each end (ns).
    pub byte_ns: f64,
}

/// Cycles between sorts: lists of contact may last longer than the whole run, which would then have no sort to measure.
const SORTS_EVERY: u64 = 8;

/// Bytes of the short and the long message that are timed.
const MESSAGES: [usize; 2] = [64, 256 * 1024];
/// How often each is sent.
const SENT: [u32; 2] = [4000, 400];

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Measures once.
///
/// # Errors
/// Whatever keeps the runs from their end, a problem without sorts, sockets.
pub fn once(model: &Arc<Model>, hosts: usize, lanes: Option<Width>) -> Result<Measured, String> {
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
        },
        changes: Vec::new(),
        dealt_by: crate::balance::Costs::NONE,
    };
    let run = |hosts: usize| {
        let scheme = Scheme { lanes, sort_every: Some(SORTS_EVERY), ..Scheme::bolide(Route::Direct) };
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
    if element <= 0.0 || pair <= 0.0 || install <= 0.0 || sort <= 0.0 {
        return Err("no plan of contact began to act in the run: take a deck with contact, or more --cycles"
            .to_owned());
    }
    let [message, byte] = messages().map_err(|e| format!("loopback: {e}"))?;
    Ok(Measured {
        element_ns: element,
        node: node / element,
        pair: pair / element,
        search: (install - pair) / pair,
        sort: sort / pair,
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
    let medians = Measured {
        element_ns: of(|m| m.element_ns),
        node: of(|m| m.node),
        pair: of(|m| m.pair),
        search: of(|m| m.search),
        sort: of(|m| m.sort),
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
    for (name, m) in named.chain([("median".to_owned(), medians)]) {
        let _ = writeln!(
            text,
            "{name:>10}  {:10.1}  {:9.3}  {:8.3}  {:12.2}  {:10.2}  {:10.0}  {:7.3}",
            m.element_ns, m.node, m.pair, m.search, m.sort, m.message_ns, m.byte_ns
        );
    }
    text
}
