//! The real clock against the virtual one. Nothing here fails because this machine is slow: digests, bytes and charges
//! are equal, and times have lower bounds.

use std::{
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
};

use deck::model::Model;
use master::{
    deck_file::read_deck,
    simulate::{
        machines::{Change, Costs, Machines, Scheme, What},
        network::{Network, Wires},
        real_clock::{self, Strain},
        timeline::{Phases, Timeline},
        virtual_clock,
    },
};
use protocol::{options::Route, shape::TICK};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deck/examples").join(name)
}

fn model(name: &str, cycles: u64) -> Arc<Model> {
    let mut model = read_deck(&example(name)).expect("an example deck");
    model.setup.control.end_cycle = cycles;
    Arc::new(model)
}

/// A cycle of the plates takes three hosts 0.1 s.
fn machines(n: usize, wires: Wires, rate: f64) -> Machines {
    Machines {
        speeds: vec![1.0; n],
        believed: vec![1.0; n],
        costs: Costs { element: 1.1e-5, node: 2e-7, pair: 2e-6, search: 2e-5, sort: 5e-6 },
        network: Network {
            wires,
            rate,
            latency: 1e-4,
            payload: 1460,
            overhead: 120,
            message: 1e-4,
            byte: 1e-8,
        },
        changes: Vec::new(),
    }
}

fn both(model: &Arc<Model>, machines: &Machines, route: Route, dilation: f64) -> [Timeline; 2] {
    let (modelled, _) =
        virtual_clock::run(model, machines, Scheme::bolide(route), None).expect("the deck runs");
    let (real, strain) = real_clock::run(model, machines, route, dilation).expect("the deck runs");
    println!("{strain:?}");
    [modelled, real]
}

fn bytes(timeline: &Timeline) -> u64 {
    timeline.flights.iter().map(|flight| flight.bytes).sum()
}

/// Charges of a worker's cycles (s).
fn charges(timeline: &Timeline, worker: usize) -> Vec<[u64; 4]> {
    let of = |p: &Phases| [p.border, p.contact, p.interior, p.integrate].map(f64::to_bits);
    timeline.phases[worker].iter().map(of).collect()
}

#[test]
fn the_real_clock_charges_the_same_work_and_carries_the_same_bytes_to_the_same_digest() {
    let model = model("plates-free-slip.toml", 14);
    for (wires, route) in [(Wires::Hub, Route::Master), (Wires::Switch, Route::Direct)] {
        let [modelled, real] = both(&model, &machines(3, wires, 1e8), route, 0.5);
        assert_eq!(real.digest, modelled.digest);
        assert_eq!(real.boundaries, modelled.boundaries);
        assert_eq!(real.flights.len(), modelled.flights.len());
        assert_eq!(bytes(&real), bytes(&modelled));
        for worker in 0..3 {
            assert_eq!(charges(&real, worker), charges(&modelled, worker), "worker {worker}");
            assert_eq!(real.ends[worker].len(), 14);
        }
    }
}

#[test]
fn no_cycle_ends_before_its_charges_and_a_host_that_slows_down_takes_longer_from_then_on() {
    let model = model("plates-joined.toml", 9);
    let mut two = machines(2, Wires::Switch, 1e9);
    two.changes.push(Change { host: 1, cycle: 5, what: What::Speed(0.25) });
    let (real, _) = real_clock::run(&model, &two, Route::Direct, 0.5).expect("the deck runs");
    let charge = |cycle: usize| {
        let p = real.phases[1][cycle];
        p.border + p.interior + p.integrate
    };
    for cycle in 1..9 {
        let took = real.ends[1][cycle] - real.ends[1][cycle - 1];
        let least = if cycle >= 5 { 4.0 } else { 1.0 } * charge(cycle);
        assert!(took >= least * (1.0 - 1e-9), "cycle {cycle}: {took} s, charged {least} s");
    }
}

#[test]
fn a_hub_carries_no_more_than_its_rate_under_the_real_clock() {
    let model = model("plates-joined.toml", 6);
    let (rate, dilation) = (2e7, 0.5);
    let mut three = machines(3, Wires::Hub, rate);
    three.costs = Costs { element: 1e-7, ..Costs::default() };
    let (real, _) = real_clock::run(&model, &three, Route::Direct, dilation).expect("the deck runs");
    let last = real.flights.iter().map(|flight| flight.time.1).fold(0.0, f64::max);
    let least = bytes(&real) as f64 * 8.0 / rate - TICK.as_secs_f64() / dilation;
    assert!(last >= least, "{} bytes within {last} s, at least {least} s", bytes(&real));
}

#[test]
fn tasks_that_need_longer_than_they_are_charged_are_counted_and_refused() {
    let model = model("plates-joined.toml", 6);
    let mut two = machines(2, Wires::Switch, 1e9);
    two.costs = Costs { element: 1e-9, node: 1e-10, ..Costs::default() };
    let (real, strain) = real_clock::run(&model, &two, Route::Direct, 1.0).expect("the deck runs");
    assert!(strain.refused() && strain.share() > 0.5, "{strain:?}");
    assert_eq!(real.digest.len(), 32);
    // Border, interior and integration, six cycles, two workers.
    assert_eq!(strain.tasks, 36);
    assert!(!Strain { tasks: 300, overruns: 3, ..strain }.refused());
    assert!(Strain { tasks: 300, overruns: 4, ..strain }.refused());
}

#[test]
fn the_chosen_dilation_leaves_room_for_ticks_for_the_wire_and_for_computing() {
    let hosts = |rate| machines(4, Wires::Hub, rate);
    // A cycle of 14.25 s in 0.2 s.
    assert_eq!(real_clock::choose_dilation(&hosts(1e7), 14.25, 1e-6, 57.0), 0.015);
    // 100 Mb/s at 1 Gb/s.
    assert_eq!(real_clock::choose_dilation(&hosts(1e8), 14.25, 1e-6, 57.0), 0.1);
    // 0.01 s of computing in 0.05 s: stretched at least four-fold, more with more workers than threads.
    let busy = real_clock::choose_dilation(&hosts(1e4), 1.0, 0.01, 0.05);
    assert!(busy >= 0.8 * (1.0 + 4.0 / real_clock::threads() as f64), "{busy}");
}

#[test]
fn a_refused_figure_is_printed_with_the_reason_and_a_failing_exit_code() {
    let folder = tempfile::tempdir().expect("a folder");
    let cluster = folder.path().join("cluster.toml");
    let text = "title = \"two hosts\"\n[[host]]\ncount = 2\n[cost]\nelement = 1e-5\nnode = 0.02\npair = 0.1\nsearch = 9\nsort = 2\n[network]\nwires = \"hub\"\nrate_bits_per_second = 1e7\nlatency_seconds = 1e-4\nmessage_seconds = 1e-4\nbyte_seconds = 1e-8\n";
    std::fs::write(&cluster, text).expect("a file");
    let simulate = |more: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_bolide"))
            .arg("simulate")
            .arg(example("plates-joined.toml"))
            .arg("--cluster")
            .arg(&cluster)
            .args(["--cycles", "5", "--json"])
            .args(more)
            .output()
            .expect("it starts")
    };
    let run = simulate(&["--clock", "real", "--dilation", "1e-3"]);
    let (out, err) = (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    assert_eq!(run.status.code(), Some(1), "{out}{err}");
    assert!(err.contains("refused: ") && err.contains("Raise --dilation above 0.001"), "{err}");
    let row: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(row["refused"], true);
    assert_eq!(row["clock"], "real");
    assert!(row["sec_per_cycle"].as_f64().is_some_and(|s| s >= 0.135), "{row}");
    for (flags, words) in [
        (&["--dilation", "2"][..], "--dilation is for --clock real"),
        (&["--clock", "real", "--dilation", "0"], "a dilation of 0, must be above 0"),
        (&["--hosts", "3"], "2 hosts, --hosts asks for 3"),
    ] {
        let run = simulate(flags);
        assert_eq!(run.status.code(), Some(1));
        let err = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(err.contains(words), "{err}");
    }
}
