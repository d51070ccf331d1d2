//! SEEDS: the pure sessions of master and workers in a world that goes wrong, all of it drawn from one seed.
//!
//! Real sessions, real computation, packed messages; time, links, crashes and the disk are of this file. Frames of cycles
//! overtake long control messages, links delay each message by what they like, hosts are slow, crash and come back, pairs
//! of workers lose their links, masters restart from the last snapshot or leave and are followed by another, processors err
//! by one unit in the last place.
//! Whatever happens, the run must come to its end with the rows, energies and digest of the undisturbed one. A seed that
//! does not is a bug, and the seed is all it takes to see it again.

mod plot;

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
    sync::Arc,
};

use deck::Model;
use master::{
    event::{Action, Event, Hand, Outcome},
    job::Job,
    options::SessionOptions,
    results::history::HistoryRow,
    snapshot::Snapshot,
};
use mechanics::state::GlobalState;
use protocol::{
    message::{ToMaster, ToPeer, ToWorker},
    wire::{self, Packed},
};
use worker::{
    compute::Machine,
    peers::pairs::{Heard, Pairs},
    session::{self, Session},
};

pub use plot::{Fault, Plot, Stage};

use crate::{bits::Fingerprint, solve::Solved};

/// A small generator.
pub struct Draws {
    state: u64,
    /// Drawn by somebody else, last first: used up before the generator is.
    given: Vec<u8>,
}

impl Draws {
    /// Of a seed.
    pub fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1, given: Vec::new() }
    }

    /// Of bytes that a fuzzer has drawn: every choice is one of them, as long as there are any.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let seed = bytes.iter().fold(0, |sum: u64, &byte| sum.rotate_left(5) ^ u64::from(byte));
        Self { given: bytes.iter().rev().copied().collect(), ..Self::new(seed) }
    }

    /// A number below `below`, which is not zero.
    pub fn below(&mut self, below: u64) -> u64 {
        if !self.given.is_empty() {
            let wide = match below {
                0..=0x100 => 1,
                0x101..=0x1_0000 => 2,
                _ => 8,
            };
            let bytes = (0..wide).filter_map(|_| self.given.pop());
            return bytes.fold(0, |number: u64, byte| number << 8 | u64::from(byte)) % below;
        }
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 11) % below
    }

    /// A delay (us): mostly short, one in thirty a hundred times as long.
    fn delay(&mut self) -> u64 {
        let usual = 20 + self.below(200);
        if self.below(30) == 0 { 100 * usual } else { usual }
    }
}

/// What happens at some instant. Hosts are named by the number at which they came to this world.
enum What {
    ToMaster(usize, u32, Packed),
    ToWorker(usize, Packed),
    /// Receiver, its epoch, place of the sender in the crew, plan.
    ToPeer(usize, u32, u32, u64, Packed),
    Done(usize, session::Outcome),
    Sorted(u64, Box<master::sort::Sorted>),
    Timer(u64),
    /// The master notices that a host is gone.
    Missed(usize, &'static str),
    /// A process starts.
    Comes,
    MasterReturns,
}

/// One direction of a link: when the last of what must stay in order arrives (us).
#[derive(Clone, Copy, Default)]
struct Lane {
    control: u64,
    cycle: u64,
    /// Nothing arrives before.
    cut_until: u64,
}

impl Lane {
    /// When a message sent now arrives. A control message may be so long that it travels in bulk, which cycles overtake.
    fn arrival(&mut self, at: u64, cycle: bool, bulk: bool) -> u64 {
        let at = at.max(self.cut_until);
        if cycle {
            self.cycle = at.max(self.cycle);
            return self.cycle;
        }
        let waits = self.control > at;
        self.control = at.max(self.control).max(self.cycle);
        if !bulk && !waits {
            self.cycle = self.control;
        }
        self.control
    }
}

/// A worker's process, from its start to its end.
struct Host {
    /// Its index in the job; none once the master has given it up, or has not met it.
    member: Option<usize>,
    session: Session,
    machine: Machine,
    alive: bool,
    /// How many times as long as usual its tasks take.
    slow: u64,
    spoilt: bool,
    up: Lane,
    down: Lane,
    pairs: (u32, Pairs<()>),
    /// Frames of neighbours that follow a plan, or an epoch, which has not come: epoch, sender, plan, message.
    held: Vec<(u32, u32, Option<u64>, ToPeer)>,
}

impl Host {
    fn new(member: usize) -> Self {
        Self {
            member: Some(member),
            session: Session::new(),
            machine: Machine::new(),
            alive: true,
            slow: 1,
            spoilt: false,
            up: Lane::default(),
            down: Lane::default(),
            pairs: (0, Pairs::default()),
            held: Vec::new(),
        }
    }
}

/// What was written to the disk.
#[derive(Default)]
struct Disk {
    rows: Vec<HistoryRow>,
    states: Vec<GlobalState>,
    snapshot: Option<Snapshot>,
}

/// The world of one seed.
struct World {
    model: Arc<Model>,
    options: SessionOptions,
    draws: Draws,
    now: u64,
    /// Time, number: so that what is due at once happens in the order it was put there.
    agenda: BinaryHeap<Reverse<(u64, u64)>>,
    happenings: BTreeMap<u64, What>,
    next: u64,
    job: Option<Job>,
    /// Grows when the master starts anew: sorts and timers of the one before say nothing.
    life: u64,
    hosts: Vec<Host>,
    disk: Disk,
    plot: Plot,
    count: u64,
    outcome: Option<Outcome>,
}

/// How a seed went.
pub struct Played {
    /// The run, as its user sees it.
    pub solved: Solved,
    /// Things that happened, all messages and tasks included.
    pub count: u64,
}

/// Plays a problem to its end through a plot; `seed` draws all delays.
///
/// # Errors
/// What kept it from its end.
pub fn play(model: &Arc<Model>, options: &SessionOptions, seed: u64, plot: Plot) -> Result<Played, String> {
    let mut world = World {
        model: Arc::clone(model),
        options: options.clone(),
        draws: Draws::new(seed ^ 0x5eed),
        now: 0,
        agenda: BinaryHeap::new(),
        happenings: BTreeMap::new(),
        next: 0,
        job: None,
        life: 0,
        hosts: Vec::new(),
        disk: Disk::default(),
        plot,
        count: 0,
        outcome: None,
    };
    world.begin(world.plot.workers)?;
    world.run()
}

fn hand(number: usize) -> Hand {
    Hand { name: format!("host-{number}"), speed: 1.0 + (number % 3) as f64, threads: 1 }
}

impl World {
    fn put(&mut self, at: u64, what: What) {
        self.agenda.push(Reverse((at, self.next)));
        self.happenings.insert(self.next, what);
        self.next += 1;
    }

    /// The master starts, with so many workers that have called; the disk tells it where to go on.
    fn begin(&mut self, workers: usize) -> Result<(), String> {
        let first = self.hosts.len();
        let hands: Vec<Hand> = (first..first + workers).map(hand).collect();
        self.hosts.extend((0..workers).map(Host::new));
        let resume = self.disk.snapshot.clone();
        let cycle = resume.as_ref().map_or(0, |snapshot| snapshot.state.cycle);
        let mut options = self.options.clone();
        options.asked.snapshot_at = self.plot.snapshot_at.filter(|at| *at > cycle);
        let (mut job, actions) = Job::new(Arc::clone(&self.model), &hands, options, resume)?;
        if self.plot.unfenced {
            job.plant_unfenced();
        }
        self.disk.rows = job.rows_before().iter().map(|row| HistoryRow::clone(row)).collect();
        self.disk.states.retain(|state| state.cycle <= cycle);
        self.life += 1;
        self.job = Some(job);
        self.act(actions)
    }

    fn run(mut self) -> Result<Played, String> {
        while self.outcome.is_none() {
            while let Some(fault) = self.plot.due(self.count) {
                self.befall(fault)?;
            }
            self.count += 1;
            if self.count > 3_000_000 {
                return Err(format!("no end after {} happenings", self.count));
            }
            let Some(Reverse((at, number))) = self.agenda.pop() else {
                self.nothing_left()?;
                continue;
            };
            self.now = at;
            if let Some(what) = self.happenings.remove(&number) {
                self.happen(what)?;
            }
        }
        let mut outcome = self.outcome.take().ok_or("no outcome")?;
        if let Some(failure) = outcome.failure.take() {
            return Err(failure);
        }
        let state = outcome.state.clone().ok_or("a run without a final state")?;
        let Disk { rows, states, snapshot } = self.disk;
        let solved = Solved { model: self.model, state, rows, states, snapshot, outcome };
        Ok(Played { solved, count: self.count })
    }

    /// Nothing is on its way: a job that waits for a worker gets one, anything else is stuck.
    fn nothing_left(&mut self) -> Result<(), String> {
        match &self.job {
            Some(job) if job.crew().is_empty() => self.happen(What::Comes),
            Some(job) => Err(format!("stuck in epoch {} with {} workers", job.epoch(), job.crew().len())),
            None => self.happen(What::MasterReturns),
        }
    }

    fn happen(&mut self, what: What) -> Result<(), String> {
        match what {
            What::ToMaster(host, epoch, packed) => match self.hosts[host].member {
                Some(member) => {
                    let message =
                        wire::unpack_to_master(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                    self.apply(Event::Message(member, epoch, message))
                }
                None => Ok(()),
            },
            What::ToWorker(host, packed) if self.hosts[host].member.is_some() => {
                let message =
                    wire::unpack_to_worker(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                self.hear(host, message)
            }
            What::ToPeer(host, epoch, from, plan, packed) => {
                let message = wire::unpack_to_peer(packed.kind, &packed.bytes).map_err(|e| e.to_string())?;
                self.hear_peer(host, (epoch, from, Some(plan), message))
            }
            What::Done(host, outcome) => self.step(host, session::Event::Done(outcome)),
            What::Sorted(life, sorted) if life == self.life => self.apply(Event::Sorted(sorted)),
            What::Timer(life) if life == self.life => self.apply(Event::Timer),
            What::Missed(host, why) => self.miss(host, why),
            What::Comes => {
                let Some(job) = &self.job else { return Ok(()) };
                if job.is_over() {
                    return Ok(());
                }
                let member =
                    self.hosts.iter().filter_map(|host| host.member).max().map_or(0, |last| last + 1);
                let member = member.max(self.plot.members);
                self.plot.members = member + 1;
                let number = self.hosts.len();
                self.hosts.push(Host::new(member));
                self.apply(Event::Joined(hand(number)))
            }
            What::MasterReturns => {
                if self.job.is_some() {
                    return Ok(());
                }
                let workers = 1 + self.draws.below(3) as usize;
                self.plot.members = workers;
                self.begin(workers)
            }
            What::ToWorker(..) | What::Sorted(..) | What::Timer(_) => Ok(()),
        }
    }

    /// The master gives a host up: its connection is closed, and what it says is not heard any more.
    fn miss(&mut self, host: usize, why: &str) -> Result<(), String> {
        let Some(member) = self.hosts[host].member.take() else { return Ok(()) };
        self.hosts[host].alive = false;
        if self.job.is_some() { self.apply(Event::Lost(member, why.to_owned())) } else { Ok(()) }
    }

    fn befall(&mut self, fault: Fault) -> Result<(), String> {
        let alive: Vec<usize> = (0..self.hosts.len())
            .filter(|&host| self.hosts[host].alive && self.hosts[host].member.is_some())
            .collect();
        let pick = |number: u64| (!alive.is_empty()).then(|| alive[(number % alive.len() as u64) as usize]);
        match fault {
            Fault::Crash { host, returns } => {
                let Some(host) = pick(host) else { return Ok(()) };
                self.hosts[host].alive = false;
                let noticed = self.now + 10 * self.draws.delay();
                self.put(noticed, What::Missed(host, "it crashed"));
                if returns {
                    // Before or after its ghost is noticed.
                    let back = self.now + 20 * self.draws.delay();
                    self.put(back, What::Comes);
                }
            }
            Fault::Cut { host, long } => {
                let Some(host) = pick(host) else { return Ok(()) };
                let until = self.now + 50 * self.draws.delay();
                let Host { up, down, .. } = &mut self.hosts[host];
                (up.cut_until, down.cut_until) = (until, until);
                if long {
                    self.put(until - (until - self.now) / 2, What::Missed(host, "it was silent"));
                    self.put(until + 10, What::Comes);
                }
            }
            Fault::PairCut { host, other } => {
                let (Some(host), Some(other)) = (pick(host), pick(other)) else { return Ok(()) };
                // What was under way between them is gone; each finds out by itself.
                for (one, two) in [(host, other), (other, host)] {
                    self.happenings.retain(|_, what| {
                        !matches!(what, What::ToPeer(to, _, from, ..)
                        if *to == one && Some(*from) == self.job.as_ref().and_then(|job| {
                            let member = self.hosts[two].member;
                            job.crew().iter().position(|m| Some(*m) == member).map(|p| p as u32)
                        }))
                    });
                }
                self.cut_pair(host, other)?;
                self.cut_pair(other, host)?;
            }
            Fault::Slow { host, factor } => {
                if let Some(host) = pick(host) {
                    self.hosts[host].slow = factor;
                }
            }
            Fault::Spoil { host } => {
                // One errs at a time: where all do, the master suspects itself and ends the job.
                let one_errs = alive.iter().any(|&host| self.hosts[host].spoilt);
                if let Some(host) = pick(host).filter(|_| alive.len() > 1 && !one_errs) {
                    self.hosts[host].spoilt = true;
                }
            }
            Fault::Join => self.put(self.now, What::Comes),
            Fault::Master => self.without_master(),
            Fault::Leave => self.apply(Event::Suspend)?,
        }
        Ok(())
    }

    /// The master is gone; its workers give it up, and others call the next one.
    fn without_master(&mut self) {
        self.job = None;
        for host in &mut self.hosts {
            (host.alive, host.member) = (false, None);
        }
        let back = self.now + 10 * self.draws.delay();
        self.put(back, What::MasterReturns);
    }

    /// A worker finds its link to another ended: what may be lost goes again, relayed.
    fn cut_pair(&mut self, host: usize, other: usize) -> Result<(), String> {
        let Some(job) = &self.job else { return Ok(()) };
        let member = self.hosts[other].member;
        let Some(place) = job.crew().iter().position(|m| Some(*m) == member) else { return Ok(()) };
        let epoch = self.hosts[host].session.epoch();
        if epoch != job.epoch() || self.hosts[host].pairs.0 != epoch {
            return Ok(());
        }
        if let Some((kept, _)) = self.hosts[host].pairs.1.lose(place as u32) {
            for message in kept {
                self.send(host, epoch, &ToMaster::Relay { to: place as u32, message })?;
            }
        }
        Ok(())
    }

    fn apply(&mut self, event: Event) -> Result<(), String> {
        let Some(job) = &mut self.job else { return Ok(()) };
        let actions = job.apply(event);
        self.act(actions)
    }

    fn act(&mut self, actions: Vec<Action>) -> Result<(), String> {
        for action in actions {
            match action {
                Action::Send(member, message) => {
                    let Some(host) = self.hosts.iter().position(|host| host.member == Some(member)) else {
                        continue;
                    };
                    let packed = wire::pack_to_worker(&message).map_err(|e| e.to_string())?;
                    let cycle = matches!(message, ToWorker::Totals { .. });
                    let (delay, bulk) = (self.draws.delay(), self.draws.below(2) == 0);
                    let at = self.hosts[host].down.arrival(self.now + delay, cycle, bulk);
                    self.put(at, What::ToWorker(host, packed));
                }
                Action::Sort(bench, x) => {
                    let sorted = Box::new(bench.sort(&x));
                    let at = self.now + 5 * self.draws.delay();
                    self.put(at, What::Sorted(self.life, sorted));
                }
                Action::Timer(seconds) => {
                    let at = self.now + (seconds * 1e6) as u64;
                    self.put(at, What::Timer(self.life));
                }
                Action::Dismiss(member, _) => {
                    if let Some(host) = self.hosts.iter_mut().find(|host| host.member == Some(member)) {
                        (host.alive, host.member) = (false, None);
                    }
                }
                Action::Row(row) => self.disk.rows.push(*row),
                Action::State(state) => self.disk.states.push(*state),
                Action::Snapshot(snapshot) | Action::Checkpoint { snapshot, .. } => {
                    self.disk.snapshot = Some(*snapshot);
                }
                Action::Rewind { rows, cycle } => {
                    self.disk.rows.truncate(rows);
                    self.disk.states.retain(|state| state.cycle <= cycle);
                }
                Action::Over(outcome) if outcome.suspended => self.without_master(),
                Action::Over(outcome) => self.outcome = Some(*outcome),
                Action::Dealt(_) | Action::Progress(_) | Action::Owners(_) => {}
            }
        }
        Ok(())
    }

    fn hear(&mut self, host: usize, message: ToWorker) -> Result<(), String> {
        if !self.hosts[host].alive {
            return Ok(());
        }
        match message {
            ToWorker::Relayed { from, message } => {
                let epoch = self.hosts[host].session.epoch();
                self.hear_peer(host, (epoch, from, None, message))
            }
            ToWorker::Assign(assign) => {
                let mut pairs = Pairs::default();
                for neighbour in 0..16 {
                    // Some links cannot be made.
                    if self.draws.below(4) > 0 {
                        let _ = pairs.stands(neighbour, ());
                    }
                }
                self.hosts[host].pairs = (assign.epoch, pairs);
                self.step(host, session::Event::Message(ToWorker::Assign(assign)))?;
                self.release(host)
            }
            message @ ToWorker::Plan { .. } => {
                self.step(host, session::Event::Message(message))?;
                self.release(host)
            }
            message => self.step(host, session::Event::Message(message)),
        }
    }

    /// Frames that waited for a plan or an epoch.
    fn release(&mut self, host: usize) -> Result<(), String> {
        for frame in std::mem::take(&mut self.hosts[host].held) {
            self.hear_peer(host, frame)?;
        }
        Ok(())
    }

    fn hear_peer(&mut self, host: usize, frame: (u32, u32, Option<u64>, ToPeer)) -> Result<(), String> {
        let Host { alive, session, pairs, held, .. } = &mut self.hosts[host];
        let (epoch, from, plan, message) = &frame;
        if !*alive || *epoch < session.epoch() || *epoch < pairs.0 {
            return Ok(());
        }
        let known = session.plan_at(message.cycle);
        if *epoch > session.epoch() || *epoch > pairs.0 || known.is_none() {
            held.push(frame);
            return Ok(());
        }
        if plan.is_some() && *plan != known {
            return Err(format!("host {host}: cycle {} under another plan", message.cycle));
        }
        let checksum = message.partials.iter().fold(7_u64, |sum, x| sum.rotate_left(5) ^ x.to_bits());
        match pairs.1.hear(*from, message.cycle, (checksum ^ (checksum >> 32)) as u32) {
            Heard::Fresh => self.step(host, session::Event::Peer(*from, frame.3)),
            Heard::Double => Ok(()),
            Heard::Differs => Err(format!("host {host}: two different frames of cycle {}", message.cycle)),
        }
    }

    fn send(&mut self, host: usize, epoch: u32, message: &ToMaster) -> Result<(), String> {
        let packed = wire::pack_to_master(message).map_err(|e| e.to_string())?;
        let cycle = matches!(message, ToMaster::Cycle { .. });
        let (delay, bulk) = (self.draws.delay(), self.draws.below(2) == 0);
        let at = self.hosts[host].up.arrival(self.now + delay, cycle, bulk);
        self.put(at, What::ToMaster(host, epoch, packed));
        Ok(())
    }

    fn step(&mut self, host: usize, event: session::Event) -> Result<(), String> {
        if !self.hosts[host].alive {
            return Ok(());
        }
        let actions = self.hosts[host].session.apply(event);
        let epoch = self.hosts[host].session.epoch();
        for action in actions {
            match action {
                session::Action::Send(message) => self.send(host, epoch, &message)?,
                session::Action::SendPeer(to, message) => self.send_peer(host, epoch, to, message)?,
                session::Action::Compute(task) => {
                    let Host { machine, spoilt, slow, .. } = &mut self.hosts[host];
                    let outcome = machine.run(task);
                    if *spoilt && matches!(outcome, session::Outcome::Computed) {
                        machine.plant_fault();
                    }
                    let at = self.now + *slow * (20 + self.draws.below(100));
                    self.put(at, What::Done(host, outcome));
                }
                session::Action::Forget => self.hosts[host].machine.forget(),
            }
        }
        Ok(())
    }

    fn send_peer(&mut self, host: usize, epoch: u32, to: u32, message: ToPeer) -> Result<(), String> {
        let plan = self.hosts[host].session.plan_hash();
        let packed = match self.hosts[host].pairs.1.send(to, message) {
            Ok(((), message)) => wire::pack_to_peer(message),
            Err(message) => return self.send(host, epoch, &ToMaster::Relay { to, message }),
        };
        // The crew of an epoch that is over has nobody to hear it.
        let Some(job) = self.job.as_ref().filter(|job| job.epoch() == epoch) else { return Ok(()) };
        let member = self.hosts[host].member;
        let place = job.crew().iter().position(|m| Some(*m) == member);
        let other = job.crew().get(to as usize);
        let other = other.and_then(|m| self.hosts.iter().position(|host| host.member == Some(*m)));
        if let (Some(place), Some(other)) = (place, other) {
            // In the order it was sent, as a stream is: by the sender's own lane, which frames of cycles keep.
            let delay = self.draws.delay();
            let at = self.hosts[host].up.arrival(self.now + delay, true, false);
            self.put(at, What::ToPeer(other, epoch, place as u32, plan, packed));
        }
        Ok(())
    }
}

/// What must be equal to the bit whatever happens: fingerprint, and cycles and times of the states that were written.
pub fn seen(solved: &Solved) -> (Fingerprint, Vec<(u64, u64)>) {
    let states = solved.states.iter().map(|state| (state.cycle, state.time.to_bits())).collect();
    (Fingerprint::of(solved), states)
}
