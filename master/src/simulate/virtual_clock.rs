//! A run under a virtual clock: real sessions, real messages, and the time that they would have taken.
//!
//! A [`World`] in the order of virtual time: a task ends when the emulated host has done its work, a message arrives when
//! the emulated network has carried its bytes. What is computed is computed for real, once, so the digest is that of any other
//! run. No clock of this machine is read, and ties go to what was due first: the same run gives the same figures to the last
//! digit.
//!
//! Host `i` runs worker `i`, and host 0 the master too. A host has one processor ([`Processor`]). Work is charged by
//! [`super::machines::Costs`], messages by [`super::network::Network`].

mod agenda;

use std::{
    collections::{BinaryHeap, VecDeque},
    sync::Arc,
};

use deck::model::Model;
use protocol::message::{self, ToWorker};
use worker::session::{self, Session, Task};

use super::{
    machines::{self, Machines, SILENCE, Scheme},
    network::{Stage, Traffic},
    processor::{Processor, Rank},
    tape::{Player, Tape},
    timeline::{Flight, Kind, Span, Timeline, counts_at, phases_at},
};
use crate::{
    embedded::{WHOLE, timed_sort},
    event::{Action, Event, Outcome, WorkerSpec},
    job::Job,
    options::{CheckpointEvery, SessionOptions},
    sort::{self, Gathered, SortBasis, Sorted},
    world::{End, Error, Letter, Parcel, Sessions, Surroundings, World},
};
use agenda::{Begun, Due, Sent, What, Work};

/// How often the state is kept while hosts come and go, as the master does where nothing else is asked (s).
const KEEP_SECONDS: f64 = 10.0;
/// The part of its speed that a host which stands still has.
const STANDSTILL: f64 = 1e-12;

/// A host's worker beside its session.
struct EmulatedWorker {
    player: Player,
    /// What its tasks took so far, at the speeds that its host had (virtual ns).
    busy: message::Work,
    /// Messages that wait for the end of a task: without overlap.
    held: Vec<Sent>,
    /// Counts how often it died or was given up.
    incarnation: u32,
}

/// Hosts, network and time.
struct Clock<'a> {
    machines: &'a Machines,
    overlap: bool,
    /// Whether states are kept to go back to. Else they are what the run is for, of which cycles are measured.
    keeps_states: bool,
    /// Of the machines' changes: those that have happened, which a run that goes back does not repeat.
    happened: Vec<bool>,
    places: Vec<EmulatedWorker>,
    sorts: VecDeque<Sorted>,
    sorts_kept: Vec<Sorted>,
    sort_ns: Vec<f64>,
    live: bool,
    processors: Vec<Processor<Begun>>,
    traffic: Traffic,
    /// By host: when its last message was handled (s).
    message_ended: Vec<f64>,
    heap: BinaryHeap<Due>,
    messages: u64,
    order: u64,
    now: f64,
    timeline: Timeline,
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
) -> Result<(Timeline, Option<Tape>), Error> {
    let n = machines.speeds.len();
    let first_at_work: Vec<usize> = (0..n).filter(|&host| !machines.comes_later(host)).collect();
    let specs: Vec<WorkerSpec> = first_at_work.iter().map(|&host| spec(machines, host)).collect();
    let come_and_go = machines.come_and_go();
    let options = SessionOptions {
        keep: if come_and_go { CheckpointEvery::Seconds(KEEP_SECONDS) } else { CheckpointEvery::Never },
        waits: come_and_go,
        played: tape.is_some(),
        ..scheme.options(machines.dealt_by)
    };
    let (mut job, first) =
        Job::new(Arc::clone(model), &specs, options, None).map_err(|e| Error::Surroundings(e.to_string()))?;
    if !come_and_go {
        // As in one process, nobody is lost.
        job.keep_no_state();
    }
    let players: Vec<Player> = match tape {
        None => (0..n).map(|_| Player::live()).collect(),
        Some(tape) => tape.workers.iter().map(|kept| Player::Tape(kept.iter().cloned().collect())).collect(),
    };
    if players.len() != n {
        return Err(Error::Surroundings(format!("a tape of {} workers for {n} hosts", players.len())));
    }
    let clock = Clock {
        machines,
        overlap: scheme.overlap,
        keeps_states: come_and_go,
        places: players
            .into_iter()
            .map(|player| EmulatedWorker {
                player,
                busy: Default::default(),
                held: Vec::new(),
                incarnation: 0,
            })
            .collect(),
        happened: vec![false; machines.changes.len()],
        sorts: tape.map(|tape| tape.sorts.iter().cloned().collect()).unwrap_or_default(),
        sorts_kept: Vec::new(),
        sort_ns: Vec::new(),
        live: tape.is_none(),
        processors: machines.speeds.iter().map(|&speed| Processor::new(speed)).collect(),
        traffic: Traffic::new(&machines.network, n),
        message_ended: vec![0.0; n],
        heap: BinaryHeap::new(),
        messages: 0,
        order: 0,
        now: 0.0,
        timeline: Timeline { ends: vec![Vec::new(); n], phases: vec![Vec::new(); n], ..Timeline::default() },
    };
    let mut world = World::new(n, clock);
    world.begin(job, first, first_at_work)?;
    let outcome = world.drive()?;
    if let Some(reason) = outcome.failure {
        return Err(Error::Surroundings(reason));
    }
    let Clock { mut timeline, places, sorts_kept, sort_ns, .. } = world.surroundings;
    timeline.boundaries.dedup();
    timeline.digest = outcome.digest;
    timeline.rebalances = outcome.rebalances;
    timeline.losses = outcome.losses;
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

/// Surface nodes that a task of a worker's sort handles: those that it sends, or those that it looks at.
fn nodes_of_sort(outcome: &session::Outcome) -> usize {
    match outcome {
        session::Outcome::Spread(patches) => patches.iter().map(|(_, patch)| patch.x.len()).sum(),
        session::Outcome::Sorted { sorted, .. } => sorted.nodes[1] as usize,
        _ => 0,
    }
}

/// A host as the job sees it.
fn spec(machines: &Machines, host: usize) -> WorkerSpec {
    let region = machines.network.regions.of_host.get(host).cloned().unwrap_or_default();
    WorkerSpec { region, ..WorkerSpec::new(format!("host-{}", host + 1), machines.believed[host], 1) }
}

/// The machine of an end: the master is on the first.
fn host_of(end: End) -> usize {
    match end {
        End::Master => 0,
        End::Host(host) => host,
    }
}

/// Those at both ends of a message.
fn hosts_of(parcel: &Parcel) -> (usize, usize) {
    (host_of(parcel.from), host_of(parcel.to))
}

impl World<Clock<'_>> {
    fn drive(&mut self) -> Result<Outcome, Error> {
        loop {
            if let Some(outcome) = self.outcome() {
                return Ok(outcome);
            }
            let clock = &mut self.surroundings;
            let Due { time, what, .. } = clock.heap.pop().ok_or(Error::Stuck)?;
            if let What::Processor(host, version) = what {
                if clock.processors[host].version() == version {
                    clock.now = time;
                    if let Some(begun) = clock.processors[host].finish(time) {
                        self.ended(host, begun)?;
                    }
                    self.surroundings.foresee(host);
                }
                continue;
            }
            clock.now = time;
            match what {
                What::Processor(..) => {}
                What::Enters(sent, way) => {
                    let stage = clock.traffic.enter(way, hosts_of(&sent.parcel), sent.parcel.bytes);
                    clock.follow(sent, stage);
                }
                What::Arrives(sent) => clock.take_in(&self.sessions, sent),
                What::Timer => self.apply(Event::Timer)?,
                What::Lost(member, why) => self.lost(member, why)?,
                What::GoesOn(host, speed) => {
                    clock.processors[host].set_speed(time, speed);
                    clock.foresee(host);
                    if self.sessions.hosts[host].member.is_none() {
                        self.join_host(host)?;
                    }
                }
            }
        }
    }

    /// What a host was, it is no more: its process has ended, or its connections have.
    fn end_incarnation(&mut self, host: usize) -> Option<usize> {
        let place = &mut self.surroundings.places[host];
        place.incarnation += 1;
        place.held.clear();
        self.sessions.hosts[host].session = Session::new();
        self.sessions.part(host)
    }

    /// The master gives a worker up.
    fn lost(&mut self, member: usize, why: String) -> Result<(), Error> {
        let host = self.sessions.host_of(member);
        if self.sessions.hosts[host].member == Some(member) {
            self.end_incarnation(host);
        }
        self.apply(Event::Lost(member, why))
    }

    fn join_host(&mut self, host: usize) -> Result<(), Error> {
        let spec = spec(self.surroundings.machines, host);
        self.join(host, spec)
    }

    /// A processor is done with something.
    fn ended(&mut self, host: usize, Begun(from, work): Begun) -> Result<(), Error> {
        let (clock, sessions) = (&mut self.surroundings, &self.sessions);
        // Messages are handled one after the other, from when the one before was done.
        let from = match work {
            Work::Send(_) | Work::Receive(_) => {
                std::mem::replace(&mut clock.message_ended[host], clock.now).max(from)
            }
            _ => from,
        };
        match work {
            Work::Send(sent) | Work::Receive(sent) if !clock.stands(&sent) => Ok(()),
            Work::Task(host, incarnation, ..) if clock.places[host].incarnation != incarnation => Ok(()),
            Work::Send(sent) => {
                clock.span(
                    sessions,
                    (host, sent.parcel.from == End::Master),
                    Kind::Send,
                    from,
                    Some(sent.number),
                );
                clock.carry(sessions, host, sent);
                Ok(())
            }
            Work::Receive(sent) => {
                let master = sent.parcel.to == End::Master;
                clock.span(sessions, (host, master), Kind::Receive, from, Some(sent.number));
                let letter = self.open(sent.parcel)?;
                let epoch = self.sessions.job.as_ref().map(Job::epoch);
                match letter {
                    // Of an epoch that is over: nobody hears it.
                    Letter::ToPeer(_, frame) if Some(frame.epoch) != epoch => Ok(()),
                    letter => self.hear(letter),
                }
            }
            Work::Sort(sorted) => {
                clock.span(sessions, (host, true), Kind::Sort, from, None);
                self.apply(Event::Sorted(sorted))
            }
            Work::Task(host, _, kind, outcome) => {
                clock.span(sessions, (host, false), kind, from, None);
                for sent in std::mem::take(&mut clock.places[host].held) {
                    clock.hand_over(sessions, sent);
                }
                if kind == Kind::Integrate {
                    self.end_cycle(host)?;
                    if self.sessions.hosts[host].member.is_none() {
                        return Ok(());
                    }
                }
                self.step(host, session::Event::Done(outcome))
            }
        }
    }

    fn end_cycle(&mut self, host: usize) -> Result<(), Error> {
        let machines = self.surroundings.machines;
        let cycle = self.sessions.hosts[host].session.cycle();
        let now = self.surroundings.now;
        self.surroundings.timeline.end_cycle(host, cycle, now);
        for (number, change) in machines.changes.iter().enumerate() {
            // The first host says when one is due that is not there.
            let due = change.cycle == cycle + 1
                && (change.host == host || host == 0 && change.what == machines::What::Join);
            if !due || std::mem::replace(&mut self.surroundings.happened[number], true) {
                continue;
            }
            let clock = &mut self.surroundings;
            match change.what {
                machines::What::Speed(speed) => clock.processors[change.host].set_speed(now, speed),
                machines::What::Die => {
                    if let Some(member) = self.end_incarnation(change.host) {
                        let heard = now + machines.network.latency;
                        let why = "its connection was closed".to_owned();
                        self.surroundings.at(heard, What::Lost(member, why));
                    }
                }
                machines::What::Stop(seconds) => {
                    let processor = &mut clock.processors[change.host];
                    let speed = processor.speed();
                    processor.set_speed(now, speed * STANDSTILL);
                    clock.at(now + seconds, What::GoesOn(change.host, speed));
                    let member = self.sessions.hosts[change.host].member;
                    if let Some(member) = member.filter(|_| seconds > SILENCE) {
                        let why = format!("no byte for {SILENCE} s");
                        clock.at(now + SILENCE, What::Lost(member, why));
                    }
                }
                machines::What::Join if self.sessions.hosts[change.host].member.is_none() => {
                    self.join_host(change.host)?;
                }
                machines::What::Join => {}
            }
        }
        Ok(())
    }
}

impl Clock<'_> {
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

    /// The master has one.
    fn incarnation(&self, end: End) -> u32 {
        match end {
            End::Master => 0,
            End::Host(host) => self.places[host].incarnation,
        }
    }

    /// Whether both ends of a message are those that they were when it was sent.
    fn stands(&self, sent: &Sent) -> bool {
        [sent.parcel.from, sent.parcel.to].map(|end| self.incarnation(end)) == sent.incarnations
    }

    /// A message goes to the sender's processor.
    fn hand_over(&mut self, sessions: &Sessions, sent: Sent) {
        let (from, seconds) = (sent.parcel.from, self.handling(&sent));
        self.handle(sessions, from, seconds, Work::Send(sent));
    }

    /// Whether a message takes no time: of states, where they are not kept to go back to. A tape has none of their pieces.
    fn is_free(&self, sent: &Sent) -> bool {
        sent.parcel.of_state && !self.keeps_states
    }

    /// What a message takes of a processor of speed 1 (s).
    fn handling(&self, sent: &Sent) -> f64 {
        if self.is_free(sent) { 0.0 } else { self.machines.network.handling(sent.parcel.bytes) }
    }

    /// A message has been sent: it goes on its way, or to the same host's other end.
    fn carry(&mut self, sessions: &Sessions, host: usize, sent: Sent) {
        if host_of(sent.parcel.to) == host || self.is_free(&sent) {
            return self.take_in(sessions, sent);
        }
        let stage = self.traffic.leave(self.now, hosts_of(&sent.parcel), sent.parcel.bytes);
        self.follow(sent, stage);
    }

    /// A message on its way is somewhere next.
    fn follow(&mut self, sent: Sent, stage: Stage) {
        match stage {
            Stage::Arrives(time) => self.at(time, What::Arrives(sent)),
            Stage::Enters(way) => self.at(way.first, What::Enters(sent, way)),
        }
    }

    /// A message has arrived: it goes to the receiver's processor.
    fn take_in(&mut self, sessions: &Sessions, sent: Sent) {
        if !self.stands(&sent) {
            return;
        }
        let Parcel { to, bytes, .. } = sent.parcel;
        let hosts = hosts_of(&sent.parcel);
        if hosts.0 != hosts.1 {
            let (message, cycle, time) = (sent.number, sent.cycle, (sent.at, self.now));
            self.timeline.flights.push(Flight { message, hosts, cycle, bytes, time });
        }
        let seconds = self.handling(&sent);
        self.handle(sessions, to, seconds, Work::Receive(sent));
    }

    /// Charges the processor of an end of a message for it: so many seconds of one of speed 1.
    fn handle(&mut self, sessions: &Sessions, end: End, seconds: f64, work: Work) {
        if let End::Host(host) = end {
            let speed = self.machines.speeds[host];
            let cycle = sessions.hosts[host].session.cycle();
            phases_at(&mut self.timeline.phases[host], cycle).send += seconds / speed;
        }
        self.charge(host_of(end), Rank::Message, seconds, work);
    }

    /// Gives a processor work.
    fn charge(&mut self, host: usize, rank: Rank, seconds: f64, work: Work) {
        self.processors[host].add(self.now, rank, seconds, Begun(self.now, work));
        self.foresee(host);
    }

    fn span(
        &mut self,
        sessions: &Sessions,
        (host, master): (usize, bool),
        kind: Kind,
        from: f64,
        message: Option<u64>,
    ) {
        let cycle = sessions.hosts[host].session.cycle();
        self.timeline.spans.push(Span { host, master, kind, cycle, time: (from, self.now), message });
    }
}

impl Surroundings for Clock<'_> {
    fn post(&mut self, sessions: &Sessions, parcel: Parcel) -> Result<(), Error> {
        let worker = host_of(if parcel.from == End::Master { parcel.to } else { parcel.from });
        let cycle = sessions.hosts[worker].session.cycle();
        let incarnations = [parcel.from, parcel.to].map(|end| self.incarnation(end));
        self.messages += 1;
        let sent = Sent { number: self.messages, parcel, incarnations, cycle, at: self.now };
        if sent.parcel.before_task && !self.overlap {
            self.places[worker].held.push(sent);
        } else {
            self.hand_over(sessions, sent);
        }
        Ok(())
    }

    fn compute(&mut self, sessions: &Sessions, host: usize, task: Task) -> Result<(), Error> {
        let kind = Kind::of(&task);
        let cycle = sessions.hosts[host].session.cycle();
        let (outcome, load) = self.places[host].player.run(task)?;
        let mut costs = self.machines.costs.of(kind, &load);
        costs.contact += self.machines.costs.sort * nodes_of_sort(&outcome) as f64;
        let speed = self.machines.speeds[host];
        self.timeline.enter((host, cycle), (kind, &load), &costs, speed);
        // Host 0 keeps some of its time for the master's sorts; it is slower by that.
        let kept = if host == 0 { self.machines.believed[0] / self.machines.speeds[0] } else { 1.0 };
        let speed = self.processors[host].speed() * kept;
        let EmulatedWorker { busy, incarnation, .. } = &mut self.places[host];
        busy.compute_ns += (costs.busy() / speed * 1e9) as u64;
        busy.contact_ns += (costs.contact / speed * 1e9) as u64;
        let work = Work::Task(host, *incarnation, kind, outcome);
        self.charge(host, Rank::Compute, costs.busy(), work);
        Ok(())
    }

    fn sort(&mut self, _: &Sessions, basis: Arc<SortBasis>, x: Gathered) -> Result<(), Error> {
        let sorted = if self.live {
            let (sorted, ns) = timed_sort(&basis, &x);
            self.sorts_kept.push((*sorted).clone());
            self.sort_ns.push(ns as f64 / x.n_nodes().max(1) as f64);
            *sorted
        } else {
            let at = self.sorts.iter().position(|sorted| sorted.gathered == x.cycle);
            match at.and_then(|at| self.sorts.remove(at)) {
                Some(sorted) => sorted,
                // The run that was taped ended before it began: its plan would act after the end.
                None => return Ok(()),
            }
        };
        let cycle = self.timeline.counts.len() as u64 - 1;
        counts_at(&mut self.timeline.counts, cycle).sorted += x.n_nodes() as u64;
        let seconds = self.machines.costs.sort * x.n_nodes() as f64;
        // Workers wait for plans of what they have sorted; a sort of all is long, and takes what is idle.
        let rank = if matches!(x.what, sort::What::Patches(_)) { Rank::Message } else { Rank::Idle };
        self.charge(0, rank, seconds, Work::Sort(Box::new(sorted)));
        Ok(())
    }

    fn timer(&mut self, seconds: f64) {
        self.at(self.now + seconds, What::Timer);
    }

    fn take(&mut self, _: Action) -> Result<(), Error> {
        Ok(())
    }

    fn dismiss(&mut self, _: usize) {}

    fn forget(&mut self, _: usize) {}

    fn is_alive(&self, _: usize) -> bool {
        true
    }

    fn hands_over(&self, elements: usize) -> bool {
        elements > WHOLE
    }

    fn worked(&self, host: usize) -> Option<message::Work> {
        Some(self.places[host].busy)
    }

    fn look(&mut self, message: &ToWorker) {
        if let ToWorker::Plan { acts_at, .. } = message {
            self.timeline.boundaries.push(*acts_at);
        }
    }
}
