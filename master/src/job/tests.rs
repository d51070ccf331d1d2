//! A job without workers, sockets or clocks.

use std::{collections::VecDeque, sync::Arc};

use mechanics::{contact::PartBox, piece, vote::Vote};
use protocol::{
    message::{SortedPatch, ToMaster, ToWorker, WORKER_STATE_VERSION, Work},
    options::{Balance, JobOptions, Route, SortBy},
};

use super::{Job, workers::Goes};
use crate::{
    event::{Action, Event, WorkerSpec},
    options::{SessionOptions, VoteTree},
    sort::{Gathered, What},
};

pub(super) const DECK: &str = r#"
    title = "two cubes"
    units = "SI"
    [control]
    end_cycle = 3
    [[part]]
    name = "low"
    material = "LEAD"
    box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [2, 2, 2] }
    [[part]]
    name = "high"
    material = "LEAD"
    velocity = [0, 0, -10]
    box = { origin = [0, 0, 1.1], size = [1, 1, 1], cells = [2, 2, 2] }
    [contact]
    gap_fraction = 0.1
"#;

fn specs(n: usize) -> Vec<WorkerSpec> {
    (0..n).map(|i| WorkerSpec::new(format!("worker-{i}"), 1.0, 1)).collect()
}

pub(super) fn job(n: usize) -> (Job, Vec<Action>) {
    job_of(DECK, n)
}

fn job_of(deck: &str, n: usize) -> (Job, Vec<Action>) {
    let model = deck::read(deck, "two cubes").expect("a good deck");
    Job::new(Arc::new(model), &specs(n), SessionOptions::default(), None).expect("a good problem")
}

/// All that a worker holds, as at the start, sent for a cycle.
fn pieces(job: &Job, worker: usize, cycle: u64) -> ToMaster {
    let held = job.epoch.shares.layout.iter().filter(|place| place.worker == worker);
    let cut = |place: &crate::decompose::Subdomain| {
        piece::cut(&job.problem.model.mesh, job.start_state(), place.part, &place.region)
    };
    ToMaster::Pieces { cycle, version: WORKER_STATE_VERSION, pieces: held.map(cut).collect() }
}

/// A job whose workers are ready and have their first orders, and the number of exchange nodes of each.
fn started(n: usize) -> (Job, Vec<usize>) {
    started_of(DECK, n)
}

fn started_of(deck: &str, n: usize) -> (Job, Vec<usize>) {
    let (mut job, actions) = job_of(deck, n);
    let exchange: Vec<usize> = actions
        .iter()
        .filter_map(|action| match action {
            Action::Send(_, ToWorker::Assign(assign)) => Some(assign.plan.exchange.len()),
            _ => None,
        })
        .collect();
    for worker in 0..n {
        let mut vote = Vote::empty(2);
        vote.courant = 1e-4;
        let actions = job.apply(Event::Message(
            worker,
            0,
            ToMaster::Ready { vote: Some(Box::new(vote)), lanes: "scalar".into() },
        ));
        let starts = actions.iter().filter(|a| matches!(a, Action::Send(_, ToWorker::Start { .. }))).count();
        assert_eq!(starts, if worker + 1 == n { n } else { 0 }, "all start when the last is ready");
    }
    (job, exchange)
}

fn cycle(cycle: u64, n_exchange: usize) -> ToMaster {
    let vote = (cycle > 0).then(|| Box::new(Vote { courant: 1e-4, ..Vote::empty(2) }));
    ToMaster::Cycle {
        cycle,
        vote,
        partials: vec![1.0; 3 * n_exchange],
        gathered: Vec::new(),
        busy: Work::default(),
    }
}

fn failure(actions: &[Action]) -> &str {
    actions
        .iter()
        .find_map(|action| match action {
            Action::Over(outcome) => outcome.failure.as_deref(),
            _ => None,
        })
        .expect("the job ends with a reason")
}

#[test]
fn totals_are_the_sums_of_both_workers_and_come_when_both_have_sent() {
    let (mut job, exchange) = started(2);
    assert!(exchange[0] > 0 && exchange[0] == exchange[1]);
    assert!(job.apply(Event::Message(0, 0, cycle(0, exchange[0]))).is_empty());
    let actions = job.apply(Event::Message(1, 0, cycle(0, exchange[1])));
    let totals: Vec<&Vec<f64>> = actions
        .iter()
        .filter_map(|a| match a {
            Action::Send(_, ToWorker::Totals { totals, .. }) => Some(totals),
            _ => None,
        })
        .collect();
    assert_eq!(totals.len(), 2);
    assert!(totals.iter().all(|t| t.len() == 3 * exchange[0] && t.iter().all(|x| *x == 2.0)));
}

#[test]
fn cycles_go_no_further_than_their_states_and_their_totals_come_in_order() {
    let often = DECK.replace("end_cycle = 3", "end_cycle = 30") + "[output]\nperiod = 1e-9\n";
    let (mut job, exchange) = started_of(&often, 1);
    let totals_of = |actions: &[Action]| -> Vec<u64> {
        let cycle = |action: &Action| match action {
            Action::Send(0, ToWorker::Totals { cycle, .. }) => Some(*cycle),
            _ => None,
        };
        actions.iter().filter_map(cycle).collect()
    };
    let hear = |job: &mut Job, message| totals_of(&job.apply(Event::Message(0, 0, message)));
    for at in 0..2 {
        assert_eq!(hear(&mut job, cycle(at, exchange[0])), [at]);
    }
    // Forces between workers may run ahead of the totals.
    for at in [2, 3] {
        assert_eq!(hear(&mut job, cycle(at, exchange[0])), [0; 0], "states 1 and 2 are on their way");
    }
    for at in [1, 2] {
        let state = pieces(&job, 0, at);
        assert_eq!(hear(&mut job, state), [0; 0], "not all of it");
        let end = ToMaster::WorkerState { cycle: at, last: None, work: Work::default() };
        assert_eq!(hear(&mut job, end), [at + 1]);
    }
}

#[test]
fn a_frame_of_the_wrong_length_ends_the_job_with_both_lengths() {
    let (mut job, exchange) = started(2);
    let actions = job.apply(Event::Message(1, 0, cycle(0, exchange[1] + 1)));
    let reason = failure(&actions);
    assert!(
        reason.contains(&format!("{}", 3 * exchange[1]))
            && reason.contains(&format!("{}", 3 * exchange[1] + 3)),
        "{reason}"
    );
    assert!(job.is_over() && job.apply(Event::Stop).is_empty());
}

#[test]
fn the_same_cycle_twice_from_one_worker_ends_the_job() {
    let (mut job, exchange) = started(2);
    job.apply(Event::Message(0, 0, cycle(0, exchange[0])));
    let actions = job.apply(Event::Message(0, 0, cycle(0, exchange[0])));
    assert!(failure(&actions).contains("twice"));
}

fn assigned(actions: &[Action]) -> Vec<(usize, u32, u64)> {
    let of = |action: &Action| match action {
        Action::Send(to, ToWorker::Assign(assign)) => Some((*to, assign.epoch, assign.cycle)),
        _ => None,
    };
    actions.iter().filter_map(of).collect()
}

#[test]
fn the_work_of_a_lost_worker_is_dealt_to_the_others_in_a_new_epoch() {
    let (mut job, exchange) = started(3);
    job.apply(Event::Message(0, 0, cycle(0, exchange[0])));
    let actions = job.apply(Event::Lost(1, "closed by peer".into()));
    assert_eq!(assigned(&actions), [(0, 1, 0), (2, 1, 0)]);
    assert!(actions.iter().any(|a| matches!(a, Action::Rewind { rows: 0, cycle: 0 })));
    assert_eq!((job.epoch(), job.at_work()), (1, &[0, 2][..]));
    assert!(job.apply(Event::Lost(1, "a second time".into())).is_empty());
    assert!(job.apply(Event::Message(2, 0, cycle(0, exchange[2]))).is_empty(), "of the epoch before");
    assert!(job.apply(Event::Message(1, 0, cycle(0, exchange[1]))).is_empty(), "of the lost one");
    let actions = job.apply(Event::Message(1, 1, cycle(0, exchange[1])));
    assert!(failure(&actions).contains("worker 1 sends a message of epoch 1, which it was not dealt"));
}

/// Its word crosses the deal of work for another one that goes: without it the worker would stay to the end of the job.
#[test]
fn a_worker_that_says_it_leaves_while_work_is_dealt_anew_is_let_go() {
    let (mut job, _) = started(3);
    job.apply(Event::Lost(0, "connection refused".into()));
    job.apply(Event::Message(1, 0, ToMaster::Leaving));
    assert!(job.workers.has_leavers(job.at_work(), Goes::Ends));
    assert!(!job.workers.has_leavers(&[2], Goes::Ends), "the other one stays");
}

#[test]
fn a_frame_of_an_epoch_to_come_ends_the_job() {
    let (mut job, exchange) = started(2);
    let actions = job.apply(Event::Message(0, 4, cycle(0, exchange[0])));
    assert!(failure(&actions).contains("epoch 4, which it was not dealt; this is epoch 0"));
}

#[test]
fn the_last_worker_lost_ends_a_job_that_does_not_wait() {
    let (mut job, _) = started(2);
    job.apply(Event::Lost(0, "cable".into()));
    let actions = job.apply(Event::Lost(1, "closed by peer".into()));
    assert_eq!(failure(&actions), "worker worker-1 is lost: closed by peer; no other is left");
}

fn waiting(n: usize) -> Job {
    let model = Arc::new(deck::read(DECK, "two cubes").expect("a good deck"));
    let options = SessionOptions { waits: true, ..SessionOptions::default() };
    let (mut job, _) = Job::new(model, &specs(n), options, None).expect("a good problem");
    for worker in 0..n {
        job.apply(Event::Lost(worker, "power cut".into()));
    }
    job
}

#[test]
fn a_job_without_workers_deals_itself_out_to_the_first_that_comes() {
    let mut job = waiting(2);
    assert!(!job.is_over() && job.at_work().is_empty());
    let actions = job.apply(Event::Joined(WorkerSpec::new("new", 1.0, 1)));
    assert_eq!(assigned(&actions), [(2, 3, 0)]);
}

#[test]
fn a_job_without_workers_that_is_stopped_ends_with_the_state_it_went_back_to() {
    let actions = waiting(1).apply(Event::Stop);
    let ends = |a: &Action| matches!(a, Action::Over(o) if o.stopped && o.failure.is_none() && o.state.as_ref().is_some_and(|s| s.cycle == 0));
    assert!(actions.iter().any(ends));
}

#[test]
fn a_job_that_keeps_no_state_sorts_all_the_same_and_says_so_when_a_worker_is_lost() {
    let (mut job, _) = job(2);
    let bench = job.epoch.sorts.basis().cloned().expect("the cubes may meet");
    let what = What::Positions(bench.sorter.positions_of(job.start_state()));
    let x = Gathered { cycle: 0, what };
    let interactions = bench.sort(&x).interactions;
    drop(bench);
    job.keep_no_state();
    let bench = job.epoch.sorts.basis().cloned().expect("as before");
    assert!(bench.state.is_static() && bench.sort(&x).interactions == interactions);
    let actions = job.apply(Event::Lost(0, "cable".into()));
    let says = |a: &Action| matches!(a, Action::Over(o) if o.failure.as_deref() == Some("no state of cycle 0 is kept to go back to"));
    assert!(actions.iter().any(says));
}

#[test]
fn a_sort_of_a_worker_that_nobody_asked_for_or_that_cannot_be_ends_the_job_with_its_name() {
    let model = Arc::new(deck::read(DECK, "two cubes").expect("a good deck"));
    let asked = JobOptions {
        route: Some(Route::Direct),
        sort_by: SortBy::Workers,
        sort_every: Some(1),
        ..JobOptions::default()
    };
    let options = || SessionOptions {
        asked: asked.clone(),
        tree: VoteTree { from: 2, neighbours: 12 },
        ..Default::default()
    };
    let told = |sorted: SortedPatch, gathered_at: u64, times: usize| {
        let (mut job, actions) =
            Job::new(Arc::clone(&model), &specs(2), options(), None).expect("a good problem");
        let sorts = |action: &Action| {
            matches!(action, Action::Send(_, ToWorker::Assign(assign))
                if assign.sorting.as_ref().is_some_and(|sorting| !sorting.patch.faces.is_empty()))
        };
        assert_eq!(actions.iter().filter(|action| sorts(action)).count(), 2);
        for worker in 0..2 {
            let vote = Some(Box::new(Vote { courant: 1e-4, ..Vote::empty(2) }));
            let ready = ToMaster::Ready { vote, lanes: "scalar".into() };
            job.apply(Event::Message(worker, 0, ready));
        }
        let mut last = Vec::new();
        for _ in 0..times {
            let sorted = Box::new(sorted.clone());
            last = job.apply(Event::Message(1, 0, ToMaster::Sorted { gathered_at, sorted }));
        }
        last.into_iter().find_map(|action| match action {
            Action::Over(outcome) => outcome.failure,
            _ => None,
        })
    };
    let none = SortedPatch::default;
    assert_eq!(told(none(), 1, 1), None);
    let says = |told: Option<String>, what: &str| told.is_some_and(|told| told.contains(what));
    assert!(says(told(none(), 1, 2), "worker 1 sends its sort of cycle 1 twice"));
    assert!(says(told(none(), 3, 1), "worker 1 sends a sort of cycle 3, which nobody asked for"));
    let everywhere = PartBox { part: 2, low: [0.0; 3], high: [1.0; 3] };
    for bad in [
        SortedPatch { boxes: vec![everywhere], ..none() },
        SortedPatch { boxes: vec![PartBox { part: 0, low: [f64::NAN; 3], ..everywhere }], ..none() },
    ] {
        assert!(says(told(bad, 1, 1), "parts or boxes that there are not"));
    }
}

#[test]
fn a_sort_of_an_epoch_that_is_over_is_of_no_use() {
    let (mut job, _) = job(2);
    let bench = job.epoch.sorts.basis().cloned().expect("the cubes may meet");
    let what = What::Positions(bench.sorter.positions_of(job.start_state()));
    let x = Gathered { cycle: 0, what };
    let sorted = Box::new(bench.sort(&x));
    job.apply(Event::Lost(0, "cable".into()));
    assert!(job.apply(Event::Sorted(sorted)).is_empty() && !job.is_over());
}

#[test]
fn a_contact_deeper_than_nine_tenths_of_the_gap_stops_the_run_with_its_node() {
    let (mut job, exchange) = started(1);
    job.apply(Event::Message(0, 0, cycle(0, exchange[0])));
    let vote = Vote { courant: 1e-4, worst_depth: 0.95, worst_pair: (3, 1), ..Vote::empty(2) };
    let partials = Vec::new();
    let frame = ToMaster::Cycle {
        cycle: 1,
        vote: Some(Box::new(vote)),
        partials,
        gathered: Vec::new(),
        busy: Work::default(),
    };
    let actions = job.apply(Event::Message(0, 0, frame));
    let stops = |a: &Action| matches!(a, Action::Send(_, ToWorker::Totals { orders, .. }) if orders.stop && orders.collect);
    assert!(actions.iter().any(stops), "the state up to there is still gathered");
    let last = Some(Box::new(Vote { courant: 1e-4, ..Vote::empty(2) }));
    assert!(job.apply(Event::Message(0, 0, pieces(&job, 0, 3))).is_empty(), "more is to come");
    let worker_state = ToMaster::WorkerState { cycle: 3, last, work: Work::default() };
    let actions = job.apply(Event::Message(0, 0, worker_state));
    let reason = failure(&actions);
    assert!(
        reason.contains("node 4") && reason.contains("0.95") && reason.contains("contact.stiffness"),
        "{reason}"
    );
}

/// Plays an epoch that was dealt to two workers, up to a force of cycle 0 that no exact sum holds; gives what comes of it.
fn blown_up(job: &mut Job, dealt: &[Action]) -> Vec<Action> {
    let of = |action: &Action| match action {
        Action::Send(to, ToWorker::Assign(assign)) => Some((*to, assign.plan.exchange.len())),
        _ => None,
    };
    let workers: Vec<(usize, usize)> = dealt.iter().filter_map(of).collect();
    assert_eq!(workers.len(), 2, "both are at work");
    let vote = |force_bound| Some(Box::new(Vote { courant: 1e-4, force_bound, ..Vote::empty(2) }));
    let mut last = Vec::new();
    for turn in 0..3 {
        for &(worker, n_exchange) in &workers {
            let message = match turn {
                0 => ToMaster::Ready { vote: vote(1.0), lanes: "scalar".into() },
                1 => cycle(0, n_exchange),
                _ => match cycle(1, n_exchange) {
                    ToMaster::Cycle { cycle, partials, gathered, busy, .. } => {
                        ToMaster::Cycle { cycle, vote: vote(1e300), partials, gathered, busy }
                    }
                    other => other,
                },
            };
            last = job.apply(Event::Message(worker, job.epoch(), message));
        }
    }
    last
}

#[test]
fn a_force_beyond_exact_sums_is_computed_again_by_others_and_ends_the_job_if_they_come_to_it_too() {
    let model = Arc::new(deck::read(DECK, "two cubes").expect("a good deck"));
    for verify in [0.0, 1.0] {
        let asked = JobOptions { verify, ..JobOptions::default() };
        let options = SessionOptions { asked, ..SessionOptions::default() };
        let (mut job, dealt) =
            Job::new(Arc::clone(&model), &specs(2), options, None).expect("a good problem");
        let mut actions = blown_up(&mut job, &dealt);
        if verify > 0.0 {
            assert!(!job.is_over() && job.at_work() == [1, 0], "each sub-domain is another worker's");
            assert!(actions.iter().any(|a| matches!(a, Action::Rewind { rows: 0, cycle: 0 })));
            actions = blown_up(&mut job, &actions);
        }
        assert!(failure(&actions).starts_with("a force of up to 1e300, exact sums hold"), "{verify}");
    }
}

#[test]
fn states_of_another_version_are_refused_with_both_versions() {
    let (mut job, _) = started(1);
    let version = WORKER_STATE_VERSION + 1;
    let actions = job.apply(Event::Message(0, 0, ToMaster::Pieces { cycle: 1, version, pieces: Vec::new() }));
    let reason = failure(&actions).to_owned();
    assert!(
        reason.contains(&WORKER_STATE_VERSION.to_string())
            && reason.contains(&(WORKER_STATE_VERSION + 1).to_string())
    );
}

#[test]
fn a_node_inside_a_foreign_gap_is_refused_with_its_number() {
    let text = DECK.replace("1.1]", "1.02]");
    let faults = deck::read(&text, "two cubes").map(|_| ()).expect_err("zones overlap");
    assert!(faults[0].to_string().contains("low"), "{}", faults[0]);
}

/// Four workers without contact whose elements take what `nanoseconds` says of worker and cycle; gives the cycles at which
/// work was dealt out anew.
fn dealt_anew(cycles: u64, mut nanoseconds: impl FnMut(usize, u64) -> f64) -> Vec<u64> {
    let text = format!(
        "title = \"bar\"\nunits = \"SI\"\n[control]\nend_cycle = {cycles}\nplan_interval = 20\n[[part]]\nname = \"bar\"\nmaterial = \"LEAD\"\nbox = {{ origin = [0, 0, 0], size = [4, 1, 1], cells = [40, 10, 10] }}\n"
    );
    let model = Arc::new(deck::read(&text, "bar").expect("a good deck"));
    let asked = JobOptions { balance: Balance::Measured, ..JobOptions::default() };
    let options = SessionOptions { asked, ..SessionOptions::default() };
    let (mut job, first) = Job::new(model, &specs(4), options, None).expect("a good problem");
    let vote = || Some(Box::new(Vote { courant: 1e-9, ..Vote::empty(1) }));
    let mut busy = [0.0; 4];
    let mut actions: VecDeque<Action> = first.into();
    let (mut elements, mut exchange) = ([0.0; 4], [0; 4]);
    while let Some(action) = actions.pop_front() {
        let (worker, message) = match action {
            Action::Send(worker, ToWorker::Assign(assign)) => {
                elements[worker] = job.epoch.shares.held[worker] as f64;
                exchange[worker] = assign.plan.exchange.len();
                let vote = if assign.cycle == 0 { vote() } else { None };
                (worker, ToMaster::Ready { vote, lanes: "scalar".into() })
            }
            Action::Send(worker, ToWorker::Start { orders: [before, _] }) => {
                (worker, frame(before.next.wrapping_add(1), true, exchange[worker], busy[worker]))
            }
            Action::Send(worker, ToWorker::Totals { cycle, orders, .. }) => {
                busy[worker] += elements[worker] * nanoseconds(worker, cycle);
                // Orders of the cycle before say whether this is the last one.
                if orders.next != cycle + 1 {
                    panic!("orders for {} after cycle {cycle}", orders.next);
                }
                let stops = job.epoch.schedule.stops_at(cycle + 1);
                if stops {
                    let pieces = pieces(&job, worker, cycle + 1);
                    assert!(job.apply(Event::Message(worker, job.epoch(), pieces)).is_empty());
                    let (last, work) = (vote(), Work::default());
                    (worker, ToMaster::WorkerState { cycle: cycle + 1, last, work })
                } else {
                    (worker, frame(cycle + 1, false, exchange[worker], busy[worker]))
                }
            }
            Action::Over(outcome) => {
                assert_eq!(outcome.failure, None);
                return outcome.rebalances.iter().map(|r| r.cycle).collect();
            }
            _ => continue,
        };
        actions.extend(job.apply(Event::Message(worker, job.epoch(), message)));
    }
    panic!("the job never ends");
}

fn frame(cycle: u64, first: bool, n_exchange: usize, busy: f64) -> ToMaster {
    let vote = (!first).then(|| Box::new(Vote { courant: 1e-9, ..Vote::empty(1) }));
    let busy = Work { compute_ns: busy as u64, contact_ns: 0 };
    ToMaster::Cycle { cycle, vote, partials: vec![0.0; 3 * n_exchange], gathered: Vec::new(), busy }
}

/// Uniform between 1 - `by` and 1 + `by`.
fn noise(state: &mut u64, by: f64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    1.0 + by * ((*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
}

#[test]
fn noise_of_five_per_cent_does_not_make_elements_wander() {
    let mut state = 7;
    let dealt = dealt_anew(2000, |_, _| 100.0 * noise(&mut state, 0.05));
    assert!(dealt.len() <= 1, "dealt out anew at {dealt:?}");
}

#[test]
fn a_worker_that_turns_slow_under_noise_is_relieved_once_within_two_boundaries() {
    let mut state = 3;
    let slow = |worker, cycle| if worker == 2 && cycle >= 110 { 200.0 } else { 100.0 };
    let dealt = dealt_anew(400, |worker, cycle| slow(worker, cycle) * noise(&mut state, 0.05));
    assert!(dealt.first().is_some_and(|first| (118..=140).contains(first)), "{dealt:?}");
    assert!(dealt.len() <= 2, "{dealt:?}");
}
