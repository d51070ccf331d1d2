//! A job without workers, sockets or clocks.

use std::sync::Arc;

use mechanics::vote::Vote;
use protocol::message::{IMAGE_VERSION, ToMaster, ToWorker, Work};

use super::Job;
use crate::event::{Action, Event, Hand, Options};

const DECK: &str = r#"
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

fn hands(n: usize) -> Vec<Hand> {
    (0..n).map(|i| Hand { name: format!("worker-{i}"), speed: 1.0, threads: 1 }).collect()
}

fn job(n: usize) -> (Job, Vec<Action>) {
    let model = deck::read(DECK, "two cubes").expect("a good deck");
    Job::new(Arc::new(model), &hands(n), Options::default(), None).expect("a good problem")
}

/// A job whose workers are ready and have their first orders, and the number of exchange nodes of each.
fn started(n: usize) -> (Job, Vec<usize>) {
    let (mut job, actions) = job(n);
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
    assert_eq!((job.epoch(), job.crew()), (1, &[0, 2][..]));
    assert!(job.apply(Event::Lost(1, "a second time".into())).is_empty());
    assert!(job.apply(Event::Message(2, 0, cycle(0, exchange[2]))).is_empty(), "of the epoch before");
    assert!(job.apply(Event::Message(1, 0, cycle(0, exchange[1]))).is_empty(), "of the lost one");
    let actions = job.apply(Event::Message(1, 1, cycle(0, exchange[1])));
    assert!(failure(&actions).contains("worker 1 sends a message of epoch 1, which it was not dealt"));
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
    let options = Options { waits: true, ..Options::default() };
    let (mut job, _) = Job::new(model, &hands(n), options, None).expect("a good problem");
    for worker in 0..n {
        job.apply(Event::Lost(worker, "power cut".into()));
    }
    job
}

#[test]
fn a_job_without_workers_deals_itself_out_to_the_first_that_comes() {
    let mut job = waiting(2);
    assert!(!job.is_over() && job.crew().is_empty());
    let actions = job.apply(Event::Joined(Hand { name: "new".into(), speed: 1.0, threads: 1 }));
    assert_eq!(assigned(&actions), [(2, 3, 0)]);
}

#[test]
fn a_job_without_workers_that_is_stopped_ends_with_the_state_it_went_back_to() {
    let actions = waiting(1).apply(Event::Stop);
    let ends = |a: &Action| matches!(a, Action::Over(o) if o.stopped && o.failure.is_none() && o.state.as_ref().is_some_and(|s| s.cycle == 0));
    assert!(actions.iter().any(ends));
}

#[test]
fn a_sort_of_an_epoch_that_is_over_is_of_no_use() {
    let (mut job, _) = job(2);
    let bench = job.epoch.bench.clone().expect("the cubes may meet");
    let x = bench.sorter.positions_of(job.start_state());
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
    let image =
        ToMaster::Image { cycle: 3, version: IMAGE_VERSION, pieces: Vec::new(), last, work: Work::default() };
    let actions = job.apply(Event::Message(0, 0, image));
    let reason = failure(&actions);
    assert!(
        reason.contains("node 4") && reason.contains("0.95") && reason.contains("contact.stiffness"),
        "{reason}"
    );
}

#[test]
fn images_of_another_version_are_refused_with_both_versions() {
    let (mut job, _) = started(1);
    let image = ToMaster::Image {
        cycle: 1,
        version: IMAGE_VERSION + 1,
        pieces: Vec::new(),
        last: None,
        work: Work::default(),
    };
    let actions = job.apply(Event::Message(0, 0, image));
    let reason = failure(&actions).to_owned();
    assert!(reason.contains(&IMAGE_VERSION.to_string()) && reason.contains(&(IMAGE_VERSION + 1).to_string()));
}

#[test]
fn a_node_inside_a_foreign_gap_is_refused_with_its_number() {
    let text = DECK.replace("1.1]", "1.02]");
    let faults = deck::read(&text, "two cubes").map(|_| ()).expect_err("zones overlap");
    assert!(faults[0].to_string().contains("low"), "{}", faults[0]);
}
