//! What master and workers say to each other in a short run: the corpus of what attacks their messages.

use std::{collections::VecDeque, sync::Arc};

use master::{
    event::{Action, Event, WorkerSpec},
    job::Job,
    options::{CheckpointEvery, SessionOptions},
};
use protocol::{
    options::{JobOptions, Route},
    wire::{self, Packed},
};
use worker::{
    compute::Machine,
    session::{self, Session},
};

use crate::solve::{model, without_states};

/// What was said in a short run: each message with its receiver or sender.
pub(super) struct Said {
    pub(super) model: Arc<deck::Model>,
    pub(super) to_worker: Vec<(usize, Packed)>,
    pub(super) to_master: Vec<(usize, Packed)>,
}

pub(super) const DECK: &str = r#"
    title = "two small blocks"
    units = "cm-g-us"
    [control]
    end_cycle = 14
    end_time = 1e3
    plan_interval = 5
    sort_lag = 4
    [[part]]
    name = "target"
    material = "AL_2024_T351"
    box = { origin = [0, 0, 0], size = [3, 2, 1], cells = [3, 2, 1] }
    [[part]]
    name = "projectile"
    material = "STEEL_1006"
    velocity = [0.03, 0.01, -0.08]
    box = { origin = [0.7, 0.3, 1.2], size = [1, 1, 1], cells = [1, 1, 1] }
    [contact]
    gap_length = 0.15
"#;

const WORKERS: usize = 2;

pub(super) fn job(model: &Arc<deck::Model>) -> (Job, Vec<Action>) {
    let spec = |i: usize| WorkerSpec::new(format!("host-{i}"), 1.0, 1);
    let specs: Vec<WorkerSpec> = (0..WORKERS).map(spec).collect();
    let keep = CheckpointEvery::Cycles(3);
    let options = without_states(JobOptions { route: Some(Route::Master), ..JobOptions::default() });
    let options = SessionOptions { replay: true, keep, ..options };
    Job::new(Arc::clone(model), &specs, options, None).unwrap_or_else(|e| panic!("the corpus: {e}"))
}

impl Said {
    pub(super) fn record() -> Self {
        let model = Arc::new(model(DECK));
        let mut said = Self { model: Arc::clone(&model), to_worker: Vec::new(), to_master: Vec::new() };
        let (mut job, first) = job(&model);
        let mut workers: Vec<(Session, Machine)> =
            (0..WORKERS).map(|_| (Session::new(), Machine::new())).collect();
        let mut actions: VecDeque<Action> = first.into();
        while let Some(action) = actions.pop_front() {
            let action = match action {
                Action::Pieces(worker, cutting) => Action::Send(worker, cutting.cut(&model.mesh)),
                action => action,
            };
            match action {
                Action::Send(worker, message) => {
                    let packed = wire::pack_to_worker(&message).unwrap_or_else(|e| panic!("the corpus: {e}"));
                    said.to_worker.push((worker, packed));
                    let (session, machine) = &mut workers[worker];
                    let mut steps: VecDeque<_> = session.apply(session::Event::Message(message)).into();
                    while let Some(step) = steps.pop_front() {
                        match step {
                            session::Action::Compute(task) => {
                                let done = session::Event::Done(machine.run(task));
                                steps.extend(session.apply(done));
                            }
                            session::Action::Send(message) => {
                                let packed = wire::pack_to_master(&message)
                                    .unwrap_or_else(|e| panic!("the corpus: {e}"));
                                said.to_master.push((worker, packed));
                                actions.extend(job.apply(Event::Message(worker, 0, message)));
                            }
                            session::Action::SendPeer(..) | session::Action::Forget => {}
                        }
                    }
                }
                Action::Sort(bench, x) => {
                    actions.extend(job.apply(Event::Sorted(Box::new(bench.sort(&x)))));
                }
                _ => {}
            }
        }
        assert!(job.is_over() && said.to_master.len() > 20, "{} messages", said.to_master.len());
        said
    }
}
