//! RUNNER: the compute thread of a worker, which owns session and machine and takes one input after another.
//!
//! What it sends goes into the queues of links without waiting. Nothing is decided here except whether what comes
//! belongs to the job in hand.

use std::{
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind},
    time::{Duration, Instant},
};

use protocol::{
    Error, Result,
    frame::Header,
    message::{ToMaster, ToPeer, ToWorker, Work},
    order::{Outbox, Place},
    phase::Phase,
    wire,
};
use tokio::sync::mpsc;

use crate::{
    compute::Machine,
    input::{Input, Key},
    owner::Share,
    peers::links::{Links, Step},
    session::{Action, Event, Outcome, Session, Task},
    slots::Slot,
    stopwatch::{Lap, Stopwatch},
    team::{Team, awake},
};

/// How often the master hears between cycles how the time goes.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// Computes a task of a cycle: [`Machine::run`], or in tests of real processes one that a fault befalls.
pub type Compute = fn(&mut Machine, Task, u64) -> Outcome;

/// The compute thread's own.
pub struct Runner {
    compute: Compute,
    outbox: Outbox,
    session: Session,
    machine: Machine,
    watch: Watch,
    stopwatch: Stopwatch,
    links: Links,
    /// Wall-clock time of tasks so far, and what of it contact took by the threads' own clocks. The wall clock tells that others
    /// want the host's cores too; the clocks of threads do not.
    busy: Work,
    /// The answer to an assignment, while links are being made.
    ready: Option<ToMaster>,
    /// When the last report left.
    reported: Instant,
    /// Why it is to leave, if it is.
    leaving: Option<String>,
    /// The part of its time that it may work.
    share: Share,
    /// Its threads.
    slot: Slot,
}

impl Runner {
    /// Without a job.
    pub fn new(compute: Compute, share: Share, slot: Slot, outbox: Outbox, links: Links) -> Self {
        Self {
            compute,
            outbox,
            session: Session::new(),
            machine: Machine::alone(Team::default()),
            watch: Watch::default(),
            stopwatch: Stopwatch::new(),
            links,
            busy: Work::default(),
            ready: None,
            reported: Instant::now(),
            leaving: None,
            share,
            slot,
        }
    }

    /// Takes one input after another until there can be no more, or until its slot has other threads than the pool that it runs on; gives how many.
    ///
    /// # Errors
    /// Why the connection to the master must end: [`Error::Left`] if it was asked to leave and holds nothing any more.
    pub fn run(&mut self, inputs: &mut mpsc::Receiver<Input>) -> Result<Option<u32>> {
        self.machine.change_team(Team::default());
        while let Some(input) = awake(|| inputs.try_recv().ok()).or_else(|| inputs.blocking_recv()) {
            match input {
                Input::Master(header, message) => self.master(&header, message)?,
                Input::Peer(news) => {
                    let step = self.links.hear(news, &self.session);
                    self.step(step)?;
                }
                Input::Leave(why) => {
                    self.leaving = Some(why);
                    if !self.session.is_idle() {
                        self.send(&ToMaster::Leaving)?;
                    }
                }
            }
            if let Some(reason) = self.leaving.take_if(|_| self.session.is_idle()) {
                return Err(Error::Left { reason });
            }
            if !self.links.are_dialling()
                && let Some(ready) = self.ready.take()
            {
                self.send(&ready)?;
            }
            let threads = self.slot.threads();
            if threads as usize != rayon::current_num_threads() {
                return Ok(Some(threads));
            }
        }
        Ok(None)
    }

    fn master(&mut self, header: &Header, message: ToWorker) -> Result<()> {
        let key = Key { job: header.job, epoch: header.epoch };
        if let ToWorker::Peers(introduction) = message {
            self.links.introduce(key, *introduction);
            return Ok(());
        }
        if let ToWorker::Threads { computes, apart } = message {
            return self.divide(computes, apart);
        }
        let job_before = self.watch.place.job;
        self.watch.heard(header, &message)?;
        match message {
            ToWorker::Assign(assign) => {
                if self.links.key() != Some(key) {
                    self.links.leave("another job begins");
                }
                self.ready = None;
                if header.job != job_before {
                    self.stopwatch = Stopwatch::new();
                }
                let mut wanted: Vec<u32> = assign.plan.neighbours.iter().map(|n| n.worker).collect();
                if let Some(tree) = &assign.tree {
                    wanted.extend(tree.parent.iter().chain(tree.children.iter().map(|(child, _)| child)));
                }
                if let Some(sorting) = &assign.sorting {
                    wanted.extend(
                        sorting.around.iter().map(|a| a.worker).chain(sorting.beside.iter().copied()),
                    );
                }
                self.links.want(wanted);
                self.apply(Event::Message(ToWorker::Assign(assign)))
            }
            ToWorker::Plan { gathered_at, ref around, .. } => {
                self.links.want(around.iter().map(|a| a.worker));
                self.links.settle(gathered_at);
                self.apply(Event::Message(message))?;
                self.links.want(self.session.neighbours_to_come());
                for step in self.links.release(&self.session) {
                    self.step(step)?;
                }
                Ok(())
            }
            ToWorker::Relayed { from, message } => match self.links.relayed(from, message) {
                Some(message) => self.apply(Event::Peer(from, message)),
                None => Ok(()),
            },
            ToWorker::Release => {
                self.links.leave("the job is over");
                self.ready = None;
                self.apply(Event::Message(ToWorker::Release))
            }
            message => self.apply(Event::Message(message)),
        }
    }

    /// Goes on with other threads; ends where another slot has them all.
    fn divide(&mut self, computes: u32, apart: u32) -> Result<()> {
        if computes == 0 && !self.session.is_idle() {
            return Err(Error::Message("asked to give all threads back in the middle of a job".to_owned()));
        }
        self.slot.divide(computes, apart)?;
        match computes {
            0 => Err(Error::Left { reason: "another slot of its process has its threads".to_owned() }),
            _ => Ok(()),
        }
    }

    fn step(&mut self, Step { heard, relay }: Step) -> Result<()> {
        if let Some((to, messages)) = relay {
            for message in messages {
                self.send(&ToMaster::Relay { to, message })?;
            }
        }
        match heard {
            Some((from, message)) => self.apply(Event::Peer(from, message)),
            None => Ok(()),
        }
    }

    fn send(&mut self, message: &ToMaster) -> Result<()> {
        let place = self.place_of(message);
        self.outbox.send(place, wire::pack_to_master(message)?)
    }

    fn place_of(&mut self, message: &ToMaster) -> Place {
        self.watch.said(message, self.session.plan_hash())
    }

    /// Over the link of the pair, or relayed by the master.
    fn send_peer(&mut self, to: u32, message: ToPeer) -> Result<()> {
        for message in self.links.send(to, message, self.session.plan_hash()) {
            self.send(&ToMaster::Relay { to, message })?;
        }
        Ok(())
    }

    fn apply(&mut self, event: Event) -> Result<()> {
        let mut events = VecDeque::from([event]);
        while let Some(event) = events.pop_front() {
            for action in self.session.apply(event) {
                match action {
                    Action::Send(ready @ ToMaster::Ready { .. }) => self.ready = Some(ready),
                    Action::Send(message) => self.timed(|runner| {
                        let last = matches!(message, ToMaster::WorkerState { last: Some(_), .. });
                        let of_cycle = matches!(message, ToMaster::Cycle { .. } | ToMaster::Votes { .. });
                        if last || (of_cycle && runner.is_report_due()) {
                            runner.report()?;
                        }
                        if matches!(message, ToMaster::Pieces { .. }) {
                            // Packed one after another, so that there need not be room for all of them twice.
                            let place = runner.place_of(&message);
                            return runner.outbox.send_later(place, move || wire::pack_to_master(&message));
                        }
                        runner.send(&message.stamped(runner.busy))
                    })?,
                    Action::SendPeer(to, message) => self.timed(|runner| {
                        if runner.is_report_due() {
                            runner.report()?;
                        }
                        runner.send_peer(to, message)
                    })?,
                    Action::Compute(task) => {
                        let (machine, compute, started) = (&mut self.machine, self.compute, Instant::now());
                        let (cycle, before) = (self.session.cycle(), machine.work());
                        let outcome = catch_unwind(AssertUnwindSafe(|| compute(machine, task, cycle)));
                        // Others see the pause as slowness, and take over.
                        std::thread::sleep(self.share.pause(started.elapsed()));
                        book(&mut self.busy, started.elapsed(), (before, self.machine.work()));
                        for lap in self.machine.take_laps() {
                            self.stopwatch.book(self.session.cycle(), lap);
                        }
                        let outcome = outcome.unwrap_or_else(|panic| {
                            self.machine = Machine::alone(Team::default());
                            Outcome::Failed(format!("a bug in the worker: {}", words(panic.as_ref())))
                        });
                        events.push_back(Event::Done(outcome));
                    }
                    Action::Forget => self.machine.forget(),
                }
            }
        }
        Ok(())
    }

    fn is_report_due(&self) -> bool {
        self.reported.elapsed() > REPORT_EVERY
    }

    /// Tells the master how the time went.
    fn report(&mut self) -> Result<()> {
        self.reported = Instant::now();
        let mut report = self.stopwatch.report();
        self.links.report(&mut report);
        report.slow = self.share.words();
        report.cycle = self.session.cycle();
        report.busy_ns = self.busy.compute_ns;
        self.send(&ToMaster::Report(Box::new(report)))
    }

    fn timed(&mut self, work: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        let (cycle, from) = (self.session.cycle(), Instant::now());
        let result = work(self);
        self.stopwatch.book(cycle, Lap { phase: Phase::Send, from, to: Instant::now() });
        result
    }
}

/// Books a task that took so long by the wall clock; the clocks of threads before and after it say what part of it was contact.
fn book(busy: &mut Work, took: Duration, (before, after): (Work, Work)) {
    let took = took.as_nanos() as u64;
    let computed = after.compute_ns.saturating_sub(before.compute_ns);
    let contact = after.contact_ns.saturating_sub(before.contact_ns);
    busy.compute_ns += took;
    busy.contact_ns += (took as f64 * contact as f64 / computed.max(1) as f64) as u64;
}

/// What a panic said.
fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no words").to_owned()
}

/// Compares what frames say of themselves with the job in hand.
#[derive(Debug, Default)]
struct Watch {
    place: Place,
    /// Plan hashes of the cycles whose totals are still to come.
    plans: VecDeque<(u64, u64)>,
}

impl Watch {
    /// A message came: of the job in hand, of the cycle its frame names, following the plan its cycle was sent by.
    fn heard(&mut self, header: &Header, message: &ToWorker) -> Result<()> {
        if let ToWorker::Assign(assign) = message {
            self.place = Place { job: header.job, epoch: header.epoch, plan: assign.plan_hash };
            self.plans.clear();
            return Ok(());
        }
        if matches!(message, ToWorker::Pieces { .. }) {
            // Of the assignment to come.
            return Ok(());
        }
        let (theirs, ours) = ((header.job, header.epoch), (self.place.job, self.place.epoch));
        // The others may be in their next epoch when one that asked to leave is released.
        let released = matches!(message, ToWorker::Release) && theirs.0 == ours.0 && theirs.1 > ours.1;
        if theirs != ours && !released {
            return Err(Error::Message(format!(
                "{} frame of job {} epoch {}, this worker has job {} epoch {}",
                header.kind, theirs.0, theirs.1, ours.0, ours.1
            )));
        }
        if let ToWorker::Totals { cycle, .. } = message {
            let plan = match self.plans.pop_front() {
                Some((sent, plan)) if sent == *cycle && header.cycle == *cycle => plan,
                sent => {
                    return Err(Error::Message(format!(
                        "totals of cycle {cycle} in a frame of cycle {}, those of {:?} are next",
                        header.cycle,
                        sent.map(|(cycle, _)| cycle)
                    )));
                }
            };
            if plan != header.plan {
                return Err(Error::Message(format!(
                    "totals of cycle {cycle} follow plan {:016x}, sent was plan {plan:016x}",
                    header.plan
                )));
            }
        }
        Ok(())
    }

    /// A message goes out under the plan in force.
    fn said(&mut self, message: &ToMaster, plan: u64) -> Place {
        self.place.plan = plan;
        if let ToMaster::Cycle { cycle, .. } | ToMaster::Votes { cycle, .. } = message {
            self.plans.push_back((*cycle, plan));
        }
        self.place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::frame::Kind;

    fn header(job: u32, cycle: u64, plan: u64) -> Header {
        Header { job, cycle, plan, ..Header::new(Kind::Totals) }
    }

    fn totals(cycle: u64) -> ToWorker {
        let quantum = mechanics::exact::Quantum::for_reference(1.0, 42);
        let orders = protocol::message::Orders {
            next: cycle + 1,
            dt: 1.0,
            time: 0.0,
            walls: Vec::new(),
            quanta: mechanics::exact::Quanta { force: quantum, energy: quantum, momentum: quantum, arm: 1.0 },
            gather: false,
            blocking: false,
            collect: false,
            stop: false,
            sample: false,
        };
        ToWorker::Totals { cycle, orders, totals: Vec::new() }
    }

    #[test]
    fn contact_is_booked_by_the_clocks_of_the_task_alone() {
        // An hour of a job without contact, then a cycle of 12 ms, a sixth of it contact.
        let work = |compute_ns, contact_ns| Work { compute_ns, contact_ns };
        let mut busy = work(3_600_000_000_000, 0);
        book(&mut busy, Duration::from_millis(12), (work(5_000, 4_000), work(65_000, 14_000)));
        assert_eq!(busy, work(3_600_012_000_000, 2_000_000));
        // A task that counts nothing, and one whose machine was made anew.
        book(&mut busy, Duration::from_millis(1), (work(7, 3), work(7, 3)));
        book(&mut busy, Duration::from_millis(1), (work(7, 3), work(0, 0)));
        assert_eq!(busy, work(3_600_014_000_000, 2_000_000));
    }

    #[test]
    fn frames_of_another_job_cycle_or_plan_are_named() {
        let place = Place { job: 3, epoch: 0, plan: 8 };
        let sent = ToMaster::Cycle {
            cycle: 5,
            vote: None,
            partials: Vec::new(),
            gathered: Vec::new(),
            busy: Work::default(),
        };
        let fresh = || {
            let mut watch = Watch { place, plans: VecDeque::new() };
            assert_eq!(watch.said(&sent, 8), place);
            watch
        };
        assert_eq!(fresh().heard(&header(3, 5, 8), &totals(5)), Ok(()));
        for (header, message, words) in [
            (header(2, 5, 8), totals(5), "of job 2 epoch 0, this worker has job 3 epoch 0"),
            (
                header(3, 6, 8),
                totals(6),
                "totals of cycle 6 in a frame of cycle 6, those of Some(5) are next",
            ),
            (header(3, 6, 8), totals(5), "totals of cycle 5 in a frame of cycle 6"),
            (header(3, 5, 9), totals(5), "follow plan 0000000000000009, sent was plan 0000000000000008"),
        ] {
            let error = fresh().heard(&header, &message).expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
