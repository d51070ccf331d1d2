//! Runs that are to have the same bits: on any workers and routes, over a loss, and from a snapshot.

use deck::Model;
use master::{
    embedded::Fate,
    options::{CheckpointEvery, SessionOptions, VoteTree},
    snapshot::file,
};
use mechanics::lanes::Width;
use protocol::options::{JobOptions, Route, SortBy};
use tests::{
    bits::{Fingerprint, forced_sorts},
    solve::{Workers, solve, solve_through, without_states},
};

pub(crate) fn fingerprint(model: &Model, at_work: Workers) -> Fingerprint {
    Fingerprint::of(&solve(model.clone(), at_work).unwrap_or_else(|e| panic!("{e}")))
}

/// A set of workers with these options.
pub(crate) fn asked(workers: usize, options: SessionOptions) -> Workers {
    Workers { options, ..Workers::of(workers) }
}

/// The workers whose bits are compared with those of one worker of one thread; the program `bits` has more of them.
fn worker_sets() -> Vec<(String, Workers)> {
    let mut worker_sets = Vec::new();
    for workers in [3, 7] {
        worker_sets.push((format!("{workers} workers"), Workers::of(workers)));
    }
    worker_sets.push(("2 workers of 2 threads".to_owned(), Workers { threads: 2, ..Workers::of(2) }));
    worker_sets
        .push(("speeds 1, 2, 0.5".to_owned(), Workers { speeds: vec![1.0, 2.0, 0.5], ..Workers::default() }));
    for width in Width::ALL.into_iter().filter(|width| width.available()) {
        let options = without_states(JobOptions { lanes: Some(width.to_string()), ..JobOptions::default() });
        worker_sets.push((format!("{width}, 2 workers"), asked(2, options)));
    }
    worker_sets
}

/// Compares runs of a problem on all sets of workers, with sorts forced, and over a snapshot.
pub(crate) fn same_bits(model: &Model) {
    let cycles = model.setup.control.end_cycle;
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let one = Fingerprint::of(&alone);
    assert_eq!(alone.state.cycle, cycles);
    let met = alone.outcome.run_totals.worst_penetration > 0.0;
    assert_eq!(met, model.setup.contact.is_some(), "contact without a hit compares nothing");
    for (name, at_work) in worker_sets() {
        one.assert_equal(&fingerprint(model, at_work), &name);
    }
    if model.setup.contact.is_some() {
        for (sorts, workers) in forced_sorts().into_iter().zip([3, 1, 3]) {
            let name = format!("{workers} workers, sorts {:?} {:?}", sorts.sort_every, sorts.sort_seed);
            one.assert_equal(&fingerprint(model, asked(workers, without_states(sorts))), &name);
        }
        let mut slack = model.clone();
        slack.setup.contact.as_mut().expect("just asked").slack *= 2.0;
        one.assert_equal(&fingerprint(&slack, Workers::of(2)), "doubled slack");
    }
    let options = without_states(JobOptions { snapshot_at: Some(cycles / 2), ..JobOptions::default() });
    let whole = solve(model.clone(), asked(2, options)).unwrap_or_else(|e| panic!("{e}"));
    one.assert_equal(&Fingerprint::of(&whole), "a snapshot taken on the way");
    let snapshot = whole.snapshot.expect("a snapshot was asked for");
    assert_eq!(snapshot.state.cycle, cycles / 2);
    for workers in [1, 3] {
        let options = without_states(JobOptions { sort_seed: Some(5), ..JobOptions::default() });
        let at_work = Workers { resume: Some(snapshot.clone()), ..asked(workers, options) };
        one.assert_equal(&fingerprint(model, at_work), &format!("restored on {workers} workers"));
    }
}

/// Goes on with a run from snapshots of these cycles, each written to a file and read from it.
pub(crate) fn same_bits_from_files(model: &Model, cycles: &[u64]) {
    let one = fingerprint(model, Workers::default());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("snapshot.bolide");
    for &cycle in cycles {
        let options = without_states(JobOptions { snapshot_at: Some(cycle), ..JobOptions::default() });
        let taken = solve(model.clone(), asked(2, options)).unwrap_or_else(|e| panic!("{e}"));
        file::write(&path, &taken.snapshot.expect("a snapshot was asked for")).expect("a disk with room");
        for workers in [1, 3, 5] {
            let resume = Some(file::read(&path).expect("a whole file"));
            let found = fingerprint(model, Workers { resume, ..Workers::of(workers) });
            one.assert_equal(&found, &format!("from cycle {cycle} on {workers} workers"));
        }
    }
}

/// Compares `one`, a run on one worker, with runs on route direct.
pub(crate) fn same_bits_on_route_direct(model: &Model, one: &Fingerprint) {
    let deep = VoteTree { from: 2, neighbours: 0 };
    for (workers, tree, sort_by, sort_seed) in [
        (2, VoteTree::default(), SortBy::Master, None),
        (3, deep, SortBy::Workers, None),
        (5, VoteTree::default(), SortBy::Workers, Some(5)),
    ] {
        let route = Some(Route::Direct);
        let options = without_states(JobOptions { route, sort_by, sort_seed, ..JobOptions::default() });
        let options = SessionOptions { tree, ..options };
        one.assert_equal(&fingerprint(model, asked(workers, options)), &format!("{workers} workers, direct"));
    }
}

/// Loses each of three workers at several moments of a run, on either route.
pub(crate) fn losing_a_worker_changes_no_bit(model: &Model) {
    let one = fingerprint(model, Workers::default());
    let mut arrivals = 0;
    let mut count = |number: u64| {
        arrivals = number;
        None
    };
    solve_through(model.clone(), Workers::of(3), &mut count).unwrap_or_else(|e| panic!("{e}"));
    let mut midway = 0;
    for (seed, route) in [Route::Master, Route::Direct].into_iter().cycle().take(8).enumerate() {
        // With votes by a tree the workers may sort.
        let sort_by = [SortBy::Master, SortBy::Workers][seed / 4];
        let options = without_states(JobOptions { route: Some(route), sort_by, ..JobOptions::default() });
        // On route direct also of a hub and its children, and of a chain of hubs.
        let tree = VoteTree { from: [9, 2, 2, 2][seed / 2], neighbours: [12, 12, 0, 0][seed / 2] };
        let options = SessionOptions { keep: CheckpointEvery::Cycles(10), tree, ..options };
        let at = arrivals * (seed as u64 + 4) / 12;
        let mut fate = |number: u64| (number == at).then_some(Fate::Lose(seed % 3));
        let solved = solve_through(model.clone(), asked(3, options), &mut fate)
            .unwrap_or_else(|e| panic!("{seed}: {e}"));
        one.assert_equal(&Fingerprint::of(&solved), &format!("loss {seed}, {route:?}"));
        assert_eq!(solved.outcome.losses.len(), 1, "{seed}");
        midway += usize::from(solved.outcome.losses[0].back_to > 0);
    }
    assert!(midway >= 4, "{midway} of 8 went back to a state on the way");
}
