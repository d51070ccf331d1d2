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
    wire::{self, Packed},
};
use worker::session::{self, Session, Task};

use super::{
    machines::{Machines, Scheme},
    network::{Stage, Traffic},
    processor::{Processor, Rank},
    tape::{Player, Tape},
    timeline::{Flight, Kind, Span, Timeline, counts_at, phases_at},
};
use crate::{
    embedded::timed_sort,
    event::{Action, Event, Hand, Options},
    job::Job,
    sort::Sorted,
};
use agenda::{Begun, Due, End, Parcel, What, Work};

struct Place {
    session: Session,
    player: Player,
    /// What its tasks took so far, at the speeds that its host had (virtual ns).
    busy: protocol::message::Work,
    /// Messages that wait for the end of a task: without overlap.
    held: Vec<Parcel>,
}

struct Clock<'a> {
    machines: &'a Machines,
    overlap: bool,
    job: Job,
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
    let hands: Vec<Hand> = machines
        .believed
        .iter()
        .enumerate()
        .map(|(i, &speed)| Hand { name: format!("host-{}", i + 1), speed, threads: 1 })
        .collect();
    let options = Options {
        route: scheme.route,
        dealing: scheme.dealing,
        balance: scheme.balance,
        lanes: scheme.lanes.map(|width| width.to_string()),
        ..Options::default()
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
            })
            .collect(),
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
        let session = &self.places[worker].session;
        let (epoch, cycle) = (session.epoch(), session.cycle());
        self.parcels += 1;
        Parcel { number: self.parcels, from, to, packed, bytes, epoch, cycle, sent: self.now }
    }

    fn hand_over(&mut self, parcel: Parcel) {
        let host = parcel.from.host();
        let seconds = self.machines.network.handling(parcel.bytes);
        self.charge_message(parcel.from, seconds);
        self.processors[host].add(self.now, Rank::Message, seconds, Begun(self.now, Work::Send(parcel)));
        self.foresee(host);
    }

    fn take_in(&mut self, parcel: Parcel) {
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
            Work::Task(worker, kind, outcome) => {
                self.span(host, false, kind, from, None);
                for parcel in std::mem::take(&mut self.places[worker].held) {
                    self.hand_over(parcel);
                }
                if kind == Kind::Integrate {
                    self.end_cycle(worker);
                }
                self.step(worker, session::Event::Done(outcome))
            }
        }
    }

    fn end_cycle(&mut self, worker: usize) {
        let cycle = self.places[worker].session.cycle();
        self.timeline.end_cycle(worker, cycle, self.now);
        for change in self.machines.changes.iter().filter(|c| c.host == worker && c.cycle == cycle + 1) {
            self.processors[worker].set_speed(self.now, change.speed);
        }
    }

    fn deliver(&mut self, parcel: Parcel) -> Result<(), String> {
        let Parcel { from, to, packed, epoch, .. } = parcel;
        let fault = |e: protocol::Error| e.to_string();
        match (from, to) {
            (End::Worker(from), End::Master) => {
                let message = wire::unpack_to_master(packed.kind, &packed.bytes).map_err(fault)?;
                let actions = self.job.apply(Event::Message(from, epoch, message));
                self.master_acts(actions)
            }
            // Of an epoch that is over: nobody hears it.
            (End::Worker(_), End::Worker(to)) if self.places[to].session.epoch() != epoch => Ok(()),
            (End::Worker(from), End::Worker(to)) => {
                let message = wire::unpack_to_peer(packed.kind, &packed.bytes).map_err(fault)?;
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
                    (End::Worker(to as usize), wire::pack_to_peer(&message))
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
        let work = Begun(self.now, Work::Task(worker, kind, outcome));
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
                    let packed = wire::pack_to_worker(&message).map_err(|e| e.to_string())?;
                    self.post(End::Master, End::Worker(worker), packed);
                }
                Action::Sort(bench, x) => {
                    let sorted = if self.live {
                        let (sorted, ns) = timed_sort(&bench, &x);
                        self.sorts_kept.push((*sorted).clone());
                        self.sort_ns.push(ns as f64 / x.len().max(1) as f64);
                        *sorted
                    } else {
                        self.sorts.pop_front().ok_or("the tape of a run has fewer sorts than the run")?
                    };
                    let cycle = self.timeline.counts.len() as u64 - 1;
                    counts_at(&mut self.timeline.counts, cycle).sorted += x.len() as u64;
                    let seconds = self.machines.costs.sort * x.len() as f64;
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
                    self.over = true;
                }
                Action::Row(_)
                | Action::State(_)
                | Action::Snapshot(_)
                | Action::Progress(_)
                | Action::Dealt(_)
                | Action::Rewind { .. }
                | Action::Timer(_) => {}
            }
        }
        Ok(())
    }
}
