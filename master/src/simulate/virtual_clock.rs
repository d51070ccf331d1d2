//! A run under a virtual clock: real sessions, real messages, and the time that they would have taken.
//!
//! The sessions of master and workers are driven as in [`crate::embedded`], but in the order of virtual time: a task ends
//! when the emulated host has done its work, a message arrives when the emulated network has carried its bytes. What
//! is computed is computed for real, once, so the digest is that of any other run. No clock of this machine is read,
//! and ties go to what was due first: the same run gives the same figures to the last digit.
//!
//! Host `i` runs worker `i`, and host 0 the master too. A host has one processor ([`Processor`]). Work is charged by
//! [`super::machines::Costs`], messages by [`super::network::Network`].

mod agenda;

use std::{
    collections::{BinaryHeap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use protocol::{
    message::ToWorker,
    options::JobOptions,
    wire::{self, Packed},
};
use worker::session::{self, Session, Task};

use super::{
    machines::{self, Machines, SILENCE, Scheme},
    network::{Stage, Traffic},
    processor::{Processor, Rank},
    tape::{Player, Tape},
    timeline::{Flight, Kind, Span, Timeline, counts_at, phases_at},
};
use crate::{
    embedded::timed_sort,
    event::{Action, Event, Hand},
    job::Job,
    options::{Keep, SessionOptions},
    sort::Sorted,
};
use agenda::{Begun, Due, End, Parcel, What, Work};

/// How often the state is kept while hosts come and go, as the master does where nothing else is asked (s).
const KEEP_SECONDS: f64 = 10.0;
/// The part of its speed that a host which stands still has.
const STANDSTILL: f64 = 1e-12;

struct Place {
    session: Session,
    player: Player,
    /// What its tasks took so far, at the speeds that its host had (virtual ns).
    busy: protocol::message::Work,
    /// Messages that wait for the end of a task: without overlap.
    held: Vec<Parcel>,
    /// Its index in the job, since it last joined.
    member: Option<usize>,
    /// Counts how often it died or was given up.
    incarnation: u32,
}

struct Clock<'a> {
    machines: &'a Machines,
    overlap: bool,
    job: Job,
    /// By index in the job: host, and its incarnation then.
    members: Vec<(usize, u32)>,
    /// Of the machines' changes: those that have happened, which a run that goes back does not repeat.
    happened: Vec<bool>,
    places: Vec<Place>,
    sorts: VecDeque<Sorted>,
    sorts_kept: Vec<Sorted>,
    sort_ns: Vec<f64>,
    live: bool,
    processors: Vec<Processor<Begun>>,
    traffic: Traffic,
    /// By host: when its last message was handled (s).
    message_ended: Vec<f64>,
    heap: BinaryHeap<Due>,
    /// Messages so far.
    parcels: u64,
    order: u64,
    now: f64,
    timeline: Timeline,
    over: bool,
}

/// Runs a problem on emulated machines: computing, or by the tape of another run of the same problem, hosts and scheme.
///
/// # Errors
/// Whatever keeps the run from its end.
pub fn run(
    model: &Arc<Model>,
    machines: &Machines,
    scheme: Scheme,
    tape: Option<&Tape>,
) -> Result<(Timeline, Option<Tape>), String> {
    let n = machines.speeds.len();
    let first_crew: Vec<usize> = (0..n).filter(|&host| !machines.comes_later(host)).collect();
    let hands: Vec<Hand> = first_crew.iter().map(|&host| hand(machines, host)).collect();
    let come_and_go = machines.come_and_go();
    let options = SessionOptions {
        asked: JobOptions {
            route: Some(scheme.route),
            balance: scheme.balance,
            lanes: scheme.lanes.map(|width| width.to_string()),
            sort_every: scheme.sort_every,
            no_output: true,
            ..JobOptions::default()
        },
        keep: if come_and_go { Keep::Seconds(KEEP_SECONDS) } else { Keep::Never },
        waits: come_and_go,
        dealing: scheme.dealing,
        costs: machines.costs.relative(),
        ..SessionOptions::default()
    };
    let (job, first) = Job::new(Arc::clone(model), &hands, options, None)?;
    let players: Vec<Player> = match tape {
        None => (0..n).map(|_| Player::live()).collect(),
        Some(tape) => tape.workers.iter().map(|kept| Player::Tape(kept.iter().cloned().collect())).collect(),
    };
    if players.len() != n {
        return Err(format!("a tape of {} workers for {n} hosts", players.len()));
    }
    let mut clock = Clock {
        machines,
        overlap: scheme.overlap,
        job,
        places: players
            .into_iter()
            .map(|player| Place {
                session: Session::new(),
                player,
                busy: Default::default(),
                held: Vec::new(),
                member: None,
                incarnation: 0,
            })
            .collect(),
        members: first_crew.iter().map(|&host| (host, 0)).collect(),
        happened: vec![false; machines.changes.len()],
        sorts: tape.map(|tape| tape.sorts.iter().cloned().collect()).unwrap_or_default(),
        sorts_kept: Vec::new(),
        sort_ns: Vec::new(),
        live: tape.is_none(),
        processors: machines.speeds.iter().map(|&speed| Processor::new(speed)).collect(),
        traffic: Traffic::new(&machines.network, n),
        message_ended: vec![0.0; n],
        heap: BinaryHeap::new(),
        parcels: 0,
        order: 0,
        now: 0.0,
        timeline: Timeline { ends: vec![Vec::new(); n], phases: vec![Vec::new(); n], ..Timeline::default() },
        over: false,
    };
    for (member, host) in first_crew.into_iter().enumerate() {
        clock.places[host].member = Some(member);
    }
    clock.master_acts(first)?;
    clock.drive()?;
    let Clock { mut timeline, places, sorts_kept, sort_ns, .. } = clock;
    timeline.boundaries.dedup();
    if let Some(tape) = tape {
        timeline.digest.clone_from(&tape.digest);
        return Ok((timeline, None));
    }
    let workers = places
        .into_iter()
        .map(|place| match place.player {
            Player::Live { kept, .. } => kept,
            Player::Tape(_) => Vec::new(),
        })
        .collect();
    let digest = timeline.digest.clone();
    Ok((timeline, Some(Tape { workers, sorts: sorts_kept, sort_ns, digest })))
}

/// A host as the job sees it.
fn hand(machines: &Machines, host: usize) -> Hand {
    Hand { name: format!("host-{}", host + 1), speed: machines.believed[host], threads: 1 }
}

impl Clock<'_> {
    fn drive(&mut self) -> Result<(), String> {
        while !self.over {
            let Due { time, what, .. } = self.heap.pop().ok_or("nothing to do and the job is not over")?;
            match what {
                What::Processor(host, version) => {
                    if self.processors[host].version() == version {
                        self.now = time;
                        if let Some(begun) = self.processors[host].finish(time) {
                            self.ended(host, begun)?;
                        }
                        self.foresee(host);
                    }
                }
                What::Enters(parcel) => {
                    self.now = time;
                    let arrival = self.traffic.enter(time, parcel.to.host(), parcel.bytes);
                    self.at(arrival, What::Arrives(parcel));
                }
                What::Arrives(parcel) => {
                    self.now = time;
                    self.take_in(parcel);
                }
                What::Timer => {
                    self.now = time;
                    let actions = self.job.apply(Event::Timer);
                    self.master_acts(actions)?;
                }
                What::Lost(member, why) => {
                    self.now = time;
                    self.lost(member, why)?;
                }
                What::GoesOn(host, speed) => {
                    self.now = time;
                    self.processors[host].set_speed(time, speed);
                    self.foresee(host);
                    if self.places[host].member.is_none() {
                        self.join(host)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn at(&mut self, time: f64, what: What) {
        self.order += 1;
        self.heap.push(Due { time, order: self.order, what });
    }

    fn foresee(&mut self, host: usize) {
        if let Some(time) = self.processors[host].next_end() {
            let version = self.processors[host].version();
            self.at(time, What::Processor(host, version));
        }
    }

    /// A message goes to the sender's processor.
    fn post(&mut self, from: End, to: End, packed: Packed) {
        let parcel = self.parcel(from, to, packed);
        self.hand_over(parcel);
    }

    fn parcel(&mut self, from: End, to: End, packed: Packed) -> Parcel {
        let bytes = packed.wire_bytes();
        let worker = if from == End::Master { to.host() } else { from.host() };
        let place = &self.places[worker];
        let (epoch, cycle) = (place.session.epoch(), place.session.cycle());
        let member = place.member.unwrap_or(usize::MAX);
        let incarnations = [from, to].map(|end| self.incarnation(end));
        self.parcels += 1;
        let (number, sent) = (self.parcels, self.now);
        Parcel { number, from, to, packed, bytes, incarnations, member, epoch, cycle, sent }
    }

    /// The master has one.
    fn incarnation(&self, end: End) -> u32 {
        match end {
            End::Master => 0,
            End::Worker(host) => self.places[host].incarnation,
        }
    }

    /// Whether both ends of a message are those that they were when it was sent.
    fn stands(&self, parcel: &Parcel) -> bool {
        [parcel.from, parcel.to].map(|end| self.incarnation(end)) == parcel.incarnations
    }

    /// What a host was, it is no more: its process has ended, or its connections have.
    fn end_incarnation(&mut self, host: usize) -> Option<usize> {
        let place = &mut self.places[host];
        place.incarnation += 1;
        place.session = Session::new();
        place.held.clear();
        place.member.take()
    }

    /// The master gives a worker up.
    fn lost(&mut self, member: usize, why: String) -> Result<(), String> {
        let (host, incarnation) = self.members[member];
        if self.places[host].incarnation == incarnation && self.places[host].member == Some(member) {
            self.end_incarnation(host);
        }
        let actions = self.job.apply(Event::Lost(member, why));
        self.master_acts(actions)
    }

    fn join(&mut self, host: usize) -> Result<(), String> {
        self.places[host].member = Some(self.members.len());
        self.members.push((host, self.places[host].incarnation));
        let actions = self.job.apply(Event::Joined(hand(self.machines, host)));
        self.master_acts(actions)
    }

    fn hand_over(&mut self, parcel: Parcel) {
        let host = parcel.from.host();
        let seconds = self.machines.network.handling(parcel.bytes);
        self.charge_message(parcel.from, seconds);
        self.processors[host].add(self.now, Rank::Message, seconds, Begun(self.now, Work::Send(parcel)));
        self.foresee(host);
    }

    fn take_in(&mut self, parcel: Parcel) {
        if !self.stands(&parcel) {
            return;
        }
        let host = parcel.to.host();
        if parcel.from.host() != host {
            let hosts = (parcel.from.host(), host);
            let time = (parcel.sent, self.now);
            self.timeline.flights.push(Flight {
                message: parcel.number,
                hosts,
                cycle: parcel.cycle,
                bytes: parcel.bytes,
                time,
            });
        }
        let seconds = self.machines.network.handling(parcel.bytes);
        self.charge_message(parcel.to, seconds);
        self.processors[host].add(self.now, Rank::Message, seconds, Begun(self.now, Work::Receive(parcel)));
        self.foresee(host);
    }

    fn charge_message(&mut self, end: End, seconds: f64) {
        if let End::Worker(worker) = end {
            let speed = self.machines.speeds[worker];
            let cycle = self.places[worker].session.cycle();
            phases_at(&mut self.timeline.phases[worker], cycle).send += seconds / speed;
        }
    }

    fn span(&mut self, host: usize, master: bool, kind: Kind, from: f64, message: Option<u64>) {
        let cycle = self.places[host].session.cycle();
        self.timeline.spans.push(Span { host, master, kind, cycle, time: (from, self.now), message });
    }

    fn ended(&mut self, host: usize, Begun(from, work): Begun) -> Result<(), String> {
        // Messages are handled one after the other, from when the one before was done.
        let from = match work {
            Work::Send(_) | Work::Receive(_) => {
                std::mem::replace(&mut self.message_ended[host], self.now).max(from)
            }
            _ => from,
        };
        match work {
            Work::Send(parcel) | Work::Receive(parcel) if !self.stands(&parcel) => Ok(()),
            Work::Task(worker, incarnation, ..) if self.places[worker].incarnation != incarnation => Ok(()),
            Work::Send(parcel) => {
                self.span(host, parcel.from == End::Master, Kind::Send, from, Some(parcel.number));
                if parcel.to.host() == host {
                    self.take_in(parcel);
                } else {
                    match self.traffic.leave(self.now, host, parcel.bytes) {
                        Stage::Arrives(time) => self.at(time, What::Arrives(parcel)),
                        Stage::Enters(time) => self.at(time, What::Enters(parcel)),
                    }
                }
                Ok(())
            }
            Work::Receive(parcel) => {
                self.span(host, parcel.to == End::Master, Kind::Receive, from, Some(parcel.number));
                self.deliver(parcel)
            }
            Work::Sort(sorted) => {
                self.span(host, true, Kind::Sort, from, None);
                let actions = self.job.apply(Event::Sorted(sorted));
                self.master_acts(actions)
            }
            Work::Task(worker, _, kind, outcome) => {
                self.span(host, false, kind, from, None);
                for parcel in std::mem::take(&mut self.places[worker].held) {
                    self.hand_over(parcel);
                }
                if kind == Kind::Integrate {
                    self.end_cycle(worker)?;
                    if self.places[worker].member.is_none() {
                        return Ok(());
                    }
                }
                self.step(worker, session::Event::Done(outcome))
            }
        }
    }

    fn end_cycle(&mut self, worker: usize) -> Result<(), String> {
        let cycle = self.places[worker].session.cycle();
        self.timeline.end_cycle(worker, cycle, self.now);
        for (number, change) in self.machines.changes.iter().enumerate() {
            // The first host says when one is due that is not there.
            let due = change.cycle == cycle + 1
                && (change.host == worker || worker == 0 && change.what == machines::What::Join);
            if !due || std::mem::replace(&mut self.happened[number], true) {
                continue;
            }
            match change.what {
                machines::What::Speed(speed) => self.processors[change.host].set_speed(self.now, speed),
                machines::What::Die => {
                    if let Some(member) = self.end_incarnation(change.host) {
                        let heard = self.now + self.machines.network.latency;
                        self.at(heard, What::Lost(member, "its connection was closed".to_owned()));
                    }
                }
                machines::What::Stop(seconds) => {
                    let processor = &mut self.processors[change.host];
                    let speed = processor.speed();
                    processor.set_speed(self.now, speed * STANDSTILL);
                    self.at(self.now + seconds, What::GoesOn(change.host, speed));
                    if let Some(member) = self.places[change.host].member.filter(|_| seconds > SILENCE) {
                        let why = format!("no byte for {SILENCE} s");
                        self.at(self.now + SILENCE, What::Lost(member, why));
                    }
                }
                machines::What::Join if self.places[change.host].member.is_none() => {
                    self.join(change.host)?
                }
                machines::What::Join => {}
            }
        }
        Ok(())
    }

    fn deliver(&mut self, parcel: Parcel) -> Result<(), String> {
        let Parcel { from, to, packed, epoch, member, .. } = parcel;
        let fault = |e: protocol::Error| e.to_string();
        match (from, to) {
            (End::Worker(_), End::Master) => {
                let message = wire::unpack_to_master(packed.kind, &packed.bytes).map_err(fault)?;
                let actions = self.job.apply(Event::Message(member, epoch, message));
                self.master_acts(actions)
            }
            // Of an epoch that is over: nobody hears it.
            (End::Worker(_), End::Worker(to)) if self.places[to].session.epoch() != epoch => Ok(()),
            (End::Worker(_), End::Worker(to)) => {
                let message = wire::unpack_to_peer(packed.kind, &packed.bytes).map_err(fault)?;
                let from = self.job.crew().iter().position(|&other| other == member);
                // Of an epoch that is over, as above.
                let Some(from) = from.filter(|_| epoch == self.job.epoch()) else { return Ok(()) };
                self.step(to, session::Event::Peer(from as u32, message))
            }
            (End::Master, End::Worker(to)) => {
                let message = wire::unpack_to_worker(packed.kind, &packed.bytes).map_err(fault)?;
                self.step(to, session::Event::Message(message))
            }
            (End::Master, End::Master) => Err("the master wrote to itself".to_owned()),
        }
    }

    fn step(&mut self, worker: usize, event: session::Event) -> Result<(), String> {
        let actions = self.places[worker].session.apply(event);
        let computes = actions.iter().any(|action| matches!(action, session::Action::Compute(_)));
        for action in actions {
            let (to, packed) = match action {
                session::Action::Compute(task) => {
                    self.compute(worker, task)?;
                    continue;
                }
                session::Action::Forget => continue,
                session::Action::Send(message) => {
                    let message = message.stamped(self.places[worker].busy);
                    (End::Master, wire::pack_to_master(&message).map_err(|e| e.to_string())?)
                }
                session::Action::SendPeer(to, message) => {
                    let member = self.job.crew().get(to as usize).copied();
                    let epoch = self.places[worker].session.epoch();
                    // Of an epoch that is over, there is nobody to hear it.
                    let Some(member) = member.filter(|_| epoch == self.job.epoch()) else { continue };
                    (End::Worker(self.members[member].0), wire::pack_to_peer(&message))
                }
            };
            let from = End::Worker(worker);
            if computes && !self.overlap {
                let parcel = self.parcel(from, to, packed);
                self.places[worker].held.push(parcel);
            } else {
                self.post(from, to, packed);
            }
        }
        Ok(())
    }

    fn compute(&mut self, worker: usize, task: Task) -> Result<(), String> {
        let kind = Kind::of(&task);
        let cycle = self.places[worker].session.cycle();
        let (outcome, load) = self.places[worker].player.run(task)?;
        let costs = self.machines.costs.of(kind, &load);
        let speed = self.machines.speeds[worker];
        self.timeline.enter((worker, cycle), (kind, &load), &costs, speed);
        // Host 0 keeps some of its time for the master's sorts; it is slower by that.
        let kept = if worker == 0 { self.machines.believed[0] / self.machines.speeds[0] } else { 1.0 };
        let speed = self.processors[worker].speed() * kept;
        let busy = &mut self.places[worker].busy;
        busy.compute_ns += (costs.busy() / speed * 1e9) as u64;
        busy.contact_ns += (costs.contact / speed * 1e9) as u64;
        let incarnation = self.places[worker].incarnation;
        let work = Begun(self.now, Work::Task(worker, incarnation, kind, outcome));
        self.processors[worker].add(self.now, Rank::Compute, costs.busy(), work);
        self.foresee(worker);
        Ok(())
    }

    fn master_acts(&mut self, actions: Vec<Action>) -> Result<(), String> {
        for action in actions {
            match action {
                Action::Send(worker, message) => {
                    if let ToWorker::Plan { acts_at, .. } = &message {
                        self.timeline.boundaries.push(*acts_at);
                    }
                    let (host, incarnation) = self.members[worker];
                    if self.places[host].incarnation == incarnation {
                        let packed = wire::pack_to_worker(&message).map_err(|e| e.to_string())?;
                        self.post(End::Master, End::Worker(host), packed);
                    }
                }
                Action::Sort(bench, x) => {
                    let sorted = if self.live {
                        let (sorted, ns) = timed_sort(&bench, &x);
                        self.sorts_kept.push((*sorted).clone());
                        self.sort_ns.push(ns as f64 / x.n_nodes().max(1) as f64);
                        *sorted
                    } else {
                        self.sorts.pop_front().ok_or("the tape of a run has fewer sorts than the run")?
                    };
                    let cycle = self.timeline.counts.len() as u64 - 1;
                    counts_at(&mut self.timeline.counts, cycle).sorted += x.n_nodes() as u64;
                    let seconds = self.machines.costs.sort * x.n_nodes() as f64;
                    let work = Begun(self.now, Work::Sort(Box::new(sorted)));
                    self.processors[0].add(self.now, Rank::Idle, seconds, work);
                    self.foresee(0);
                }
                Action::Over(outcome) => {
                    if let Some(reason) = outcome.failure {
                        return Err(reason);
                    }
                    self.timeline.digest = outcome.digest;
                    self.timeline.rebalances = outcome.rebalances;
                    self.timeline.losses = outcome.losses;
                    self.over = true;
                }
                Action::Row(_)
                | Action::State(_)
                | Action::Snapshot(_)
                | Action::Checkpoint { .. }
                | Action::Dismiss(..)
                | Action::Progress(_)
                | Action::Dealt(_)
                | Action::Owners(_)
                | Action::Rewind { .. } => {}
                Action::Timer(seconds) => self.at(self.now + seconds, What::Timer),
            }
        }
        Ok(())
    }
}
