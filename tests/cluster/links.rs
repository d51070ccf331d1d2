//! Links between workers, and what becomes of a run where they cannot be made or break.

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
};

use protocol::{
    codec,
    frame::{Frame, Header, Kind, encode_header},
    handshake::{Hello, Membership, Role},
};
use serde_json::Value;
use tests::{cluster::Cluster, proxy::Proxy};

use crate::{BOLIDE, digest_of, reference, run, small};

/// Cycles of a job in whose middle something happens: some seconds.
const CYCLES: &str = "6000";

fn submit(cluster: &Cluster, workers: &str, flags: &[&str]) -> Value {
    let deck = small();
    let mut arguments = vec!["submit", &deck, "--no-output", "--wait", "--min-workers", workers];
    arguments.extend(flags);
    cluster.json(&arguments)
}

fn number(summary: &Value, name: &str) -> f64 {
    summary[name].as_f64().unwrap_or_else(|| panic!("no {name} in {summary}"))
}

fn pairs(summary: &Value) -> (u64, u64) {
    (number(summary, "linked_pairs") as u64, number(summary, "relayed_pairs") as u64)
}

/// All of it over links: the same digest, and the master carries what it carries in one process, where nothing is
/// relayed.
fn links_relieve_the_master(tls: bool) {
    let mut cluster = Cluster::start(BOLIDE, tls);
    for (name, speed) in [("a", "1"), ("b", "2"), ("c", "0.5")] {
        cluster.worker(name, speed);
    }
    let flags = |route| ["--cycles", "200", "--route", route];
    let master = submit(&cluster, "3", &flags("master"));
    let direct = submit(&cluster, "3", &flags("direct"));
    let auto = submit(&cluster, "3", &["--cycles", "200"]);
    assert_eq!(digest_of(&direct), digest_of(&master));
    assert_eq!(digest_of(&auto), digest_of(&master));
    assert_eq!((&master["route"], pairs(&master)), (&"master".into(), (0, 0)));
    assert_eq!((&auto["route"], pairs(&auto)), (&"direct".into(), pairs(&direct)));
    let (linked, relayed) = pairs(&direct);
    assert!(linked >= 2 && relayed == 0, "{direct}");

    let here = run(&["--cycles", "200", "--route", "direct", "--workers", "3", "--speeds", "1,2,0.5"]);
    // The plan of a sort that would act after the last cycle is sent or is not, as the sort is done in time or not.
    for name in ["master_bytes_per_cycle", "bytes_per_cycle"] {
        let ratio = number(&direct, name) / number(&here, name);
        assert!((0.95..1.05).contains(&ratio), "{name}: {ratio}");
    }
    let sums = number(&master, "master_bytes_per_cycle") - number(&direct, "master_bytes_per_cycle");
    let peers = number(&direct, "bytes_per_cycle") - number(&direct, "master_bytes_per_cycle");
    assert!(sums > 20_000.0 && peers > 10_000.0, "{sums} bytes off the master, {peers} between workers");
    let times = direct["worker_times"].as_array().expect("a list");
    assert_eq!(times.len(), 3);
    let wall = number(&direct, "wall_s");
    for worker in times {
        let phases = ["border_s", "contact_s", "interior_s", "send_s", "wait_s", "integrate_s", "other_s"];
        assert!(phases[..6].iter().all(|phase| number(worker, phase) > 0.0), "{worker}");
        let sum: f64 = phases.iter().map(|phase| number(worker, phase)).sum();
        assert!(sum > 0.5 * wall && sum < 1.01 * wall, "{sum} s of {wall} s: {worker}");
    }
}

#[test]
fn links_between_workers_give_the_same_digest_and_relieve_the_master() {
    links_relieve_the_master(false);
}

#[test]
fn links_between_workers_under_tls_do_the_same() {
    links_relieve_the_master(true);
}

/// Six workers on two floors, in turn: hosts say where they are, and the bits are those of one.
#[test]
fn workers_of_two_regions_give_the_same_digest() {
    let mut cluster = Cluster::start(BOLIDE, false);
    for (i, name) in ["a", "b", "c", "d", "e", "f"].into_iter().enumerate() {
        cluster.worker_with(name, "1", &["--region", ["ground-floor", "first-floor"][i % 2]]);
    }
    let hosts = cluster.json(&["hosts"]);
    let notes: Vec<&str> =
        hosts.as_array().expect("a list").iter().filter_map(|host| host["note"].as_str()).collect();
    assert_eq!(notes[..2], ["region ground-floor", "region first-floor"]);
    let summary = submit(&cluster, "6", &["--cycles", "40", "--route", "direct"]);
    assert_eq!(digest_of(&summary), reference());
    // What is cut between floors is one plane, so that two or three of each face some of the other.
    let (linked, relayed) = pairs(&summary);
    assert!(linked >= 5 && relayed == 0, "{summary}");
}

#[test]
fn workers_that_cannot_reach_each_other_are_relayed() {
    let mut cluster = Cluster::start(BOLIDE, false);
    // The port of b is closed: its frames go by way of the master, as do those of c, which takes no peers.
    let closed = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port");
    let closed = closed.port().to_string();
    cluster.worker("a", "1");
    cluster.worker_with("b", "1", &["--peer-announce", &closed]);
    cluster.worker_with("c", "1", &["--no-peers"]);
    cluster.worker("d", "1");
    let summary = submit(&cluster, "4", &["--cycles", "40", "--route", "direct"]);
    assert_eq!(digest_of(&summary), reference());
    // b dials a, and a takes it. d cannot dial b.
    let (linked, relayed) = pairs(&summary);
    assert!(linked >= 1 && relayed >= 2, "{summary}");
    assert_eq!(cluster.process("a").count("no link to worker"), 0, "{}", cluster.process("a").text());
    let line = cluster.process("d").wait_for("no link to worker 2 (c): control message: it takes no peers");
    assert!(line.contains("relayed by the master"), "{line}");
    assert_eq!(cluster.process("b").count("WARN"), 0);
    // A worker that takes no peers makes the master choose its own route.
    let auto = submit(&cluster, "4", &["--cycles", "40"]);
    assert_eq!((&auto["route"], digest_of(&auto).as_str()), (&"master".into(), reference()));
}

#[test]
fn a_link_that_is_cut_in_mid_run_is_relayed_and_no_frame_is_lost() {
    links_that_break_are_relayed(false, Proxy::cut, "ended: ");
    links_that_break_are_relayed(true, Proxy::cut, "ended: ");
}

#[test]
fn a_link_that_falls_silent_in_mid_run_is_relayed_and_no_frame_is_lost() {
    links_that_break_are_relayed(false, Proxy::freeze, "ended: no byte from the peer for ");
}

/// `happen` breaks the links of worker a, and says how many; the log has `words` for it.
fn links_that_break_are_relayed(tls: bool, happen: fn(&Proxy) -> usize, words: &str) {
    let expected = digest_of(&run(&["--cycles", CYCLES]));
    let mut cluster = Cluster::start(BOLIDE, tls);
    let proxy = Proxy::start();
    cluster.worker_with("a", "1", &["--peer-announce", &proxy.port.to_string()]);
    proxy.forward(&cluster.peer_address("a"));
    cluster.worker("b", "1");
    cluster.worker("c", "1");
    let deck = small();
    let arguments =
        ["submit", &deck, "--cycles", CYCLES, "--no-output", "--min-workers", "3", "--route", "direct"];
    cluster.json(&arguments);
    cluster.wait_until_running(1);
    assert!(proxy.bytes() > 0, "b and c have dialled a");
    assert_eq!(cluster.job(1)["state"], "running");
    let stood = happen(&proxy);
    assert!(stood >= 1);
    assert_eq!(cluster.job(1)["state"], "running", "the job ended before its links did");
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!(digest_of(&summary), expected);
    let (linked, relayed) = pairs(&summary);
    assert_eq!((linked + relayed, relayed), (linked + stood as u64, stood as u64), "{summary}");
    let relayed_by = "; relayed by the master";
    assert_eq!(cluster.process("a").count(relayed_by), stood, "{}", cluster.process("a").text());
    assert_eq!(cluster.process("b").count(relayed_by) + cluster.process("c").count(relayed_by), stood);
    assert!(cluster.process("a").count(words) >= 1, "{}", cluster.process("a").text());
    // The next job makes its links anew, as far as it can.
    let next = submit(&cluster, "3", &["--cycles", "40", "--route", "direct"]);
    assert_eq!((digest_of(&next).as_str(), pairs(&next)), (reference(), (linked, relayed)));
}

fn frame(header: Header, payload: Vec<u8>) -> Vec<u8> {
    let mut frame = Frame::new(header, payload);
    frame.seal().expect("within its limit");
    let mut bytes = encode_header(&frame.header).to_vec();
    bytes.extend(frame.payload);
    bytes
}

#[test]
fn strangers_at_the_peer_port_are_one_line_each_and_the_job_goes_on() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    let deck = small();
    let arguments = ["submit", &deck, "--cycles", CYCLES, "--no-output", "--min-workers", "2"];
    cluster.json(&arguments);
    cluster.wait_until_running(1);

    let greeting = |job, token: &str| {
        let mut hello = Hello::new(Role::Peer, "stranger", 1.0, 1, "none", 1);
        hello.token = Some(token.to_owned());
        hello.member = Some(Membership { job, epoch: 0, index: 1 });
        frame(Header::new(Kind::Hello), codec::encode(&hello).expect("plain"))
    };
    let worker = Hello::new(Role::Worker, "stranger", 1.0, 1, "none", 1);
    let worker = frame(Header::new(Kind::Hello), codec::encode(&worker).expect("plain"));
    let oversize = encode_header(&Header { length: u32::MAX, ..Header::new(Kind::Hello) });
    for (bytes, words) in [
        (vec![0x55; 400], "frame starts with [55, 55, 55, 55]"),
        (oversize.to_vec(), "hello: length 4294967295, limit 4096"),
        (frame(Header::new(Kind::Cycle), vec![0; 64]), "first frame is cycle, expected hello"),
        (worker, "role worker, this side takes peer"),
        (greeting(0, "guess"), "job 0 epoch 0, this worker has job 1 epoch 0"),
        (greeting(1, "guess"), "token missing or wrong"),
    ] {
        assert_eq!(cluster.job(1)["state"], "running", "the job ended before {words:?}");
        let mut stream = TcpStream::connect(cluster.peer_address("a")).expect("it listens");
        let address = stream.local_addr().expect("connected");
        // A worker that has closed already refuses the rest, or resets.
        let _ = stream.write_all(&bytes);
        let _ = stream.shutdown(Shutdown::Write);
        let _ = stream.read_to_end(&mut Vec::new());
        let line = cluster.process("a").wait_for(&format!("peer's connection from {address}: "));
        assert!(line.contains(words) && line.contains("WARN"), "{line}, expected {words:?}");
        assert_eq!(cluster.process("a").count(&address.to_string()), 1);
    }
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!(digest_of(&summary), digest_of(&run(&["--cycles", CYCLES])));
    assert_eq!(pairs(&summary), (1, 0));
}

#[test]
fn a_run_writes_a_trace_of_its_last_cycles() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("trace.json");
    let path = path.to_str().expect("plain");
    run(&["--cycles", "40", "--processes", "--workers", "2", "--trace", path]);
    let text = std::fs::read_to_string(path).expect("written");
    let trace: Value = serde_json::from_str(&text).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events");
    for worker in [1, 2] {
        let of_worker = || events.iter().filter(|event| event["pid"] == worker && event["ph"] == "X");
        for phase in ["border", "contact", "interior", "integrate"] {
            let cycles: Vec<u64> = of_worker()
                .filter(|e| e["name"] == phase)
                .filter_map(|e| e["args"]["cycle"].as_u64())
                .collect();
            assert!(cycles.iter().all(|cycle| (24..=40).contains(cycle)), "{phase}: {cycles:?}");
            assert!(cycles.len() >= 12, "{phase} of worker {worker}: {cycles:?}");
        }
        let ends =
            of_worker().map(|e| (e["ts"].as_f64().expect("a time"), e["dur"].as_f64().expect("a time")));
        let ends: Vec<(f64, f64)> = ends.collect();
        assert!(ends.windows(2).all(|w| w[0].0 + w[0].1 <= w[1].0 + 0.01), "phases follow each other");
    }
}
