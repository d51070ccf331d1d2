//! SEEDS: the pure sessions of master and workers in a world that goes wrong, all of it drawn from one seed.
//!
//! Real sessions, real computation, packed messages, in a [`World`]; time, links, crashes and the disk are of this file. Frames of cycles
//! overtake long control messages, links delay each message by what they like, hosts are slow, crash and come back, pairs
//! of workers lose their links, other jobs borrow workers, masters restart from the last snapshot or leave and are followed by another, processors err
//! by one unit in the last place, bits flip in memory ([`flips`]), in stored files and in frames, tasks never end, clocks jump, the
//! [`disk`] is full or loses power, descriptors run out, and machines have no [`memory`] for what is dealt to them.
//! Whatever happens, the run must come to its end with the rows, energies and digest of the undisturbed one. A seed that
//! does not is a bug, and the seed is all it takes to see it again.

mod befall;
mod disk;
pub mod flips;
mod memory;
mod plot;
mod seen;

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
    sync::Arc,
};

use deck::Model;
use master::{
    event::{Action, Event, Outcome, WorkerSpec},
    job::Job,
    options::SessionOptions,
    results::history::HistoryRow,
    sort::{Gathered, SortBasis, Sorted},
    world::{End, Error, Letter, Parcel, PeerFrame, Sessions, Surroundings, World},
};
use mechanics::flip::Target;
use protocol::{
    message::{SaidKind, ToMaster, ToPeer, ToWorker},
    wire,
};
use worker::{
    compute::Machine,
    peers::pairs::{Heard, Pairs},
    session::{self, Task},
};

use disk::Disk;
pub use flips::Flip;
use memory::Small;
pub use plot::{Bug, Fault, Plot, Stage};
pub use seen::Seen;

use crate::solve::Solved;

/// A small generator.
pub struct Draws {
    state: u64,
    /// Drawn by somebody else, last first: used up before the generator is.
    given: Vec<u8>,
}

impl Draws {
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
    Arrives(Parcel),
    Done(usize, session::Outcome),
    Sorted(u64, Box<Sorted>),
    Timer(u64),
    /// The master notices that a host is gone.
    Missed(usize, &'static str),
    /// A process starts.
    Comes,
    /// A host that the job released for another one is given to it again.
    Returns(usize),
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

/// A worker's process beside its session, from its start to its end.
struct Process {
    machine: Machine,
    alive: bool,
    /// How many times as long as usual its tasks take.
    slow: u64,
    spoilt: bool,
    /// What befalls its memory after its next task.
    flip: Option<Flip>,
    /// Elements of the share that it was dealt last.
    load: u64,
    /// Its memory, where others have taken most of it.
    small: Option<Small>,
    /// Its tasks never end.
    stuck: bool,
    /// The bit that flips in the next frame of a cycle that it sends to the master.
    garbled: Option<u32>,
    up: Lane,
    down: Lane,
    /// Its links to others, in an epoch.
    pairs: (u32, Pairs<()>),
    /// Frames of neighbours that follow a plan, or an epoch, which has not come.
    held: Vec<PeerFrame>,
}

impl Process {
    fn new() -> Self {
        Self {
            machine: Machine::new(),
            alive: true,
            slow: 1,
            spoilt: false,
            flip: None,
            load: 0,
            small: None,
            stuck: false,
            garbled: None,
            up: Lane::default(),
            down: Lane::default(),
            pairs: (0, Pairs::default()),
            held: Vec::new(),
        }
    }
}

/// What the sessions of one seed stand in.
struct Weather {
    draws: Draws,
    now: u64,
    /// Time, number: so that what is due at once happens in the order it was put there.
    agenda: BinaryHeap<Reverse<(u64, u64)>>,
    happenings: BTreeMap<u64, What>,
    next: u64,
    /// Grows when the master starts anew: sorts and timers of the one before say nothing.
    life: u64,
    hosts: Vec<Process>,
    disk: Disk,
    /// The memory of the machine on which a process starts next.
    small: Option<Small>,
    /// Processes that their systems have ended for what they were dealt.
    starved: u64,
    /// Bits that have flipped, by host.
    flipped: Vec<(usize, Target)>,
    /// Workers that went to other jobs.
    lent: u64,
}

impl Weather {
    fn put(&mut self, at: u64, what: What) {
        self.agenda.push(Reverse((at, self.next)));
        self.happenings.insert(self.next, what);
        self.next += 1;
    }

    /// What is due next, with time set to it.
    fn next(&mut self) -> Option<Option<What>> {
        let Reverse((at, number)) = self.agenda.pop()?;
        self.now = at;
        Some(self.happenings.remove(&number))
    }
}

impl Surroundings for Weather {
    fn post(&mut self, sessions: &Sessions, parcel: Parcel) -> Result<(), Error> {
        let cycle = parcel.is_of_cycle();
        let at = match (parcel.from, parcel.to) {
            // In the order it was sent, as a stream is: by the sender's own lane, which frames of cycles keep.
            (End::Host(from), End::Host(to)) => {
                if sessions.hosts[to].member.is_none() {
                    return Ok(());
                }
                let delay = self.draws.delay();
                self.hosts[from].up.arrival(self.now + delay, true, false)
            }
            (from, to) => {
                let (delay, bulk) = (self.draws.delay(), self.draws.below(2) == 0);
                let lane = match (from, to) {
                    (End::Host(host), _) => &mut self.hosts[host].up,
                    (_, End::Host(host)) => &mut self.hosts[host].down,
                    (End::Master, End::Master) => return Err("the master wrote to itself".into()),
                };
                lane.arrival(self.now + delay, cycle, bulk)
            }
        };
        self.put(at, What::Arrives(parcel));
        Ok(())
    }

    fn compute(&mut self, _: &Sessions, host: usize, task: Task) -> Result<(), Error> {
        if let Task::Load { assign, .. } = &task {
            let pieces = assign.subdomains.iter().flat_map(|subdomain| &subdomain.pieces);
            if self.starves(host, pieces.map(|piece| piece.elements.len() as u64).sum()) {
                return Ok(());
            }
        }
        let Process { machine, spoilt, slow, flip, .. } = &mut self.hosts[host];
        let outcome = machine.run(task);
        if *spoilt && matches!(outcome, session::Outcome::Computed) {
            machine.plant_fault();
        }
        if let Some(target) = flip.and_then(|flip| flip.befall(machine)) {
            *flip = None;
            self.flipped.push((host, target));
        }
        let at = self.now + *slow * (20 + self.draws.below(100));
        if !self.hosts[host].stuck {
            self.put(at, What::Done(host, outcome));
        }
        Ok(())
    }

    fn sort(&mut self, _: &Sessions, basis: Arc<SortBasis>, x: Gathered) -> Result<(), Error> {
        let sorted = Box::new(basis.sort(&x));
        let at = self.now + 5 * self.draws.delay();
        self.put(at, What::Sorted(self.life, sorted));
        Ok(())
    }

    fn timer(&mut self, seconds: f64) {
        let at = self.now + (seconds * 1e6) as u64;
        self.put(at, What::Timer(self.life));
    }

    fn take(&mut self, action: Action) -> Result<(), Error> {
        Ok(self.disk.take(action)?)
    }

    fn dismiss(&mut self, host: usize) {
        self.hosts[host].alive = false;
    }

    fn freed(&mut self, host: usize) {
        self.lent += 1;
        let back = self.now + 20 * self.draws.delay();
        self.put(back, What::Returns(host));
    }

    fn forget(&mut self, host: usize) {
        self.hosts[host].machine.forget();
    }

    fn is_alive(&self, host: usize) -> bool {
        self.hosts[host].alive
    }

    fn link(&mut self, host: usize, to: u32, message: ToPeer) -> Result<ToPeer, ToPeer> {
        self.hosts[host].pairs.1.send(to, message).map(|((), message)| message.clone())
    }
}

struct Play {
    world: World<Weather>,
    model: Arc<Model>,
    options: SessionOptions,
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
    /// Bits that flipped: in whose memory, and what.
    pub flipped: Vec<(usize, Target)>,
    /// How often the job released a worker for another one.
    pub lent: u64,
}

/// Plays a problem to its end through a plot; `seed` draws all delays.
///
/// # Errors
/// What kept it from its end.
pub fn play(model: &Arc<Model>, options: &SessionOptions, seed: u64, plot: Plot) -> Result<Played, String> {
    let weather = Weather {
        draws: Draws::new(seed ^ 0x5eed),
        now: 0,
        agenda: BinaryHeap::new(),
        happenings: BTreeMap::new(),
        next: 0,
        life: 0,
        hosts: Vec::new(),
        disk: Disk::new(plot.bug),
        small: None,
        starved: 0,
        flipped: Vec::new(),
        lent: 0,
    };
    let mut play = Play {
        world: World::new(0, weather),
        model: Arc::clone(model),
        options: options.clone(),
        plot,
        count: 0,
        outcome: None,
    };
    play.begin(play.plot.workers)?;
    play.run()
}

fn spec(number: usize) -> WorkerSpec {
    WorkerSpec::new(format!("host-{number}"), 1.0 + (number % 3) as f64, 1)
}

impl Play {
    /// The master starts, with so many workers that have called; the disk tells it where to go on.
    fn begin(&mut self, workers: usize) -> Result<(), String> {
        let members: Vec<usize> = (0..workers).map(|_| self.come()).collect();
        let specs: Vec<WorkerSpec> = members.iter().map(|&host| spec(host)).collect();
        let weather = &mut self.world.surroundings;
        let resume = weather.disk.newest()?;
        let cycle = resume.as_ref().map_or(0, |snapshot| snapshot.state.cycle);
        let mut options = self.options.clone();
        options.asked.snapshot_at = self.plot.snapshot_at.filter(|at| *at > cycle);
        let (mut job, actions) = Job::new(Arc::clone(&self.model), &specs, options, resume)?;
        if self.plot.bug == Some(Bug::Narrow) {
            job.plant_narrow_sum();
        }
        weather.disk.rows = job.rows_before().iter().map(|row| HistoryRow::clone(row)).collect();
        weather.disk.states.retain(|state| state.cycle <= cycle);
        weather.life += 1;
        self.world.begin(job, actions, members)?;
        self.settle();
        Ok(())
    }

    /// A process starts; gives its number.
    fn come(&mut self) -> usize {
        self.world.surroundings.hosts.push(Process::new());
        self.world.sessions.add_host()
    }

    fn run(mut self) -> Result<Played, String> {
        while self.outcome.is_none() {
            while let Some(fault) = self.plot.due(self.count) {
                self.befall(fault)?;
                self.settle();
            }
            self.count += 1;
            if self.count > 3_000_000 {
                return Err(format!("no end after {} happenings", self.count));
            }
            match self.world.surroundings.next() {
                Some(Some(what)) => self.happen(what)?,
                // Lost on a link that broke.
                Some(None) => {}
                None => self.nothing_left()?,
            }
            self.settle();
            let failure = self.world.surroundings.disk.failure.take();
            if let Some(why) = failure.or_else(|| self.starvation()) {
                return Err(format!("the job failed: {why}"));
            }
        }
        let mut outcome = self.outcome.take().ok_or("no outcome")?;
        if let Some(failure) = outcome.failure.take() {
            return Err(failure);
        }
        let state = outcome.state.clone().ok_or("a run without a final state")?;
        let Weather { disk: Disk { rows, states, .. }, flipped, lent, .. } = self.world.surroundings;
        let solved = Solved { model: self.model, state, rows, states, snapshot: None, outcome };
        Ok(Played { solved, count: self.count, flipped, lent })
    }

    /// A job that has ended ends the play, unless its process only leaves.
    fn settle(&mut self) {
        if self.world.surroundings.disk.is_short && self.world.sessions.job.is_some() {
            // The queue pauses, and the job goes on where it was stored, even if it had just come to its end.
            self.world.outcome();
            return self.without_master();
        }
        match self.world.outcome() {
            Some(outcome) if outcome.suspended => self.without_master(),
            Some(outcome) => self.outcome = Some(outcome),
            None => {}
        }
    }

    /// Nothing is on its way: a job that waits for a worker gets one, anything else is stuck.
    fn nothing_left(&mut self) -> Result<(), String> {
        match &self.world.sessions.job {
            Some(job) if job.at_work().is_empty() => self.happen(What::Comes),
            Some(job) => Err(format!("stuck in epoch {} with {} workers", job.epoch(), job.at_work().len())),
            None => self.happen(What::MasterReturns),
        }
    }

    fn happen(&mut self, what: What) -> Result<(), String> {
        let life = self.world.surroundings.life;
        match what {
            What::Arrives(parcel) => self.arrive(parcel)?,
            What::Done(host, outcome) => self.world.step(host, session::Event::Done(outcome))?,
            What::Sorted(of, sorted) if of == life => self.world.apply(Event::Sorted(sorted))?,
            What::Timer(of) if of == life => self.world.apply(Event::Timer)?,
            What::Sorted(..) | What::Timer(_) => {}
            What::Missed(host, why) => self.miss(host, why)?,
            What::Comes => {
                let Weather { disk, draws, now, small, .. } = &mut self.world.surroundings;
                if disk.files > 0 {
                    // Nobody takes the call; it calls again.
                    disk.files -= 1;
                    let again = *now + 10 * draws.delay();
                    self.world.surroundings.put(again, What::Comes);
                } else if self.world.sessions.job.as_ref().is_some_and(|job| !job.is_over()) {
                    let small = small.take();
                    let host = self.come();
                    self.world.surroundings.hosts[host].small = small;
                    if !self.lacks_memory(None, Some(host)) {
                        self.world.join(host, spec(host))?;
                    }
                }
            }
            What::Returns(host) => {
                let goes_on = self.world.sessions.job.as_ref().is_some_and(|job| !job.is_over());
                if goes_on && self.world.surroundings.is_alive(host) {
                    self.world.join(host, spec(host))?;
                }
            }
            What::MasterReturns if self.world.sessions.job.is_none() => {
                let workers = 1 + self.world.surroundings.draws.below(3) as usize;
                self.begin(workers)?;
            }
            What::MasterReturns => {}
        }
        Ok(())
    }

    /// A message arrives. What one of whom the other end knows nothing says or is told is lost.
    fn arrive(&mut self, parcel: Parcel) -> Result<(), String> {
        if let (End::Host(host), End::Master) | (End::Master, End::Host(host)) = (parcel.from, parcel.to)
            && self.world.sessions.hosts[host].member.is_none()
        {
            return Ok(());
        }
        match self.world.open(parcel)? {
            Letter::ToWorker(host, message) => self.hear(host, message),
            Letter::ToPeer(host, frame) => self.hear_peer(host, frame),
            Letter::ToMaster(member, epoch, message) => {
                let host = self.world.sessions.host_of(member);
                let Some(message) = self.garble(host, message) else {
                    return self.miss(host, "the checksum of a frame does not match");
                };
                let now = self.world.sessions.job.as_ref().map_or(epoch, Job::epoch);
                let epoch = if self.plot.bug == Some(Bug::Unfenced) { epoch.max(now) } else { epoch };
                Ok(self.world.hear(Letter::ToMaster(member, epoch, message))?)
            }
        }
    }

    /// What arrives of a message in which a bit flips on its way: nothing, for frames have checksums.
    fn garble(&mut self, host: usize, mut message: ToMaster) -> Option<ToMaster> {
        let garbled = &mut self.world.surroundings.hosts[host].garbled;
        match (&mut message, *garbled) {
            (ToMaster::Cycle { partials, .. }, Some(bit)) if !partials.is_empty() => {
                *garbled = None;
                let at = bit as usize % partials.len();
                partials[at] = f64::from_bits(partials[at].to_bits() ^ (1 << (bit % 52)));
                (self.plot.bug == Some(Bug::Deaf)).then_some(message)
            }
            _ => Some(message),
        }
    }

    /// The master gives a host up: its connection is closed, and what it says is not heard any more.
    fn miss(&mut self, host: usize, why: &str) -> Result<(), String> {
        let Some(member) = self.world.sessions.part(host) else { return Ok(()) };
        self.world.surroundings.hosts[host].alive = false;
        if self.lacks_memory(Some(host), None) {
            // The job goes back into the queue, until there are workers that can take it.
            self.without_master();
            return Ok(());
        }
        Ok(self.world.apply(Event::Lost(member, why.to_owned()))?)
    }

    fn hear(&mut self, host: usize, message: ToWorker) -> Result<(), String> {
        if !self.world.surroundings.is_alive(host) {
            return Ok(());
        }
        if let ToWorker::Relayed { from, message } = message {
            let epoch = self.world.sessions.hosts[host].session.epoch();
            return self.hear_peer(host, PeerFrame { epoch, from, plan: None, message });
        }
        if let ToWorker::Assign(assign) = &message {
            let Weather { draws, hosts, .. } = &mut self.world.surroundings;
            let mut pairs = Pairs::default();
            for neighbour in 0..16 {
                // Some links cannot be made.
                if draws.below(4) > 0 {
                    let _ = pairs.stands(neighbour, ());
                }
            }
            hosts[host].pairs = (assign.epoch, pairs);
        }
        let releases = matches!(message, ToWorker::Assign(_) | ToWorker::Plan { .. });
        self.world.hear(Letter::ToWorker(host, message))?;
        if releases {
            // Frames that waited for a plan or an epoch.
            for frame in std::mem::take(&mut self.world.surroundings.hosts[host].held) {
                self.hear_peer(host, frame)?;
            }
        }
        Ok(())
    }

    fn hear_peer(&mut self, host: usize, frame: PeerFrame) -> Result<(), String> {
        let session = &self.world.sessions.hosts[host].session;
        let Process { alive, pairs, held, .. } = &mut self.world.surroundings.hosts[host];
        let PeerFrame { epoch, from, plan, message } = &frame;
        if !*alive || *epoch < session.epoch() || *epoch < pairs.0 {
            return Ok(());
        }
        let which = (message.what.kind(), message.cycle);
        // The others follow no plan.
        let known = match which.0 {
            SaidKind::Partials => session.plan_at(message.cycle),
            _ => *plan,
        };
        let is_early = which.0 == SaidKind::Partials && known.is_none();
        if *epoch > session.epoch() || *epoch > pairs.0 || is_early {
            held.push(frame);
            return Ok(());
        }
        if plan.is_some() && *plan != known {
            return Err(format!("host {host}: cycle {} under another plan", message.cycle));
        }
        let packed = wire::pack_to_peer(message).map_err(|error| error.to_string())?;
        let checksum = packed.bytes.iter().fold(7_u64, |sum, byte| sum.rotate_left(5) ^ u64::from(*byte));
        match pairs.1.hear(*from, which, (checksum ^ (checksum >> 32)) as u32) {
            Heard::Fresh => Ok(self.world.hear(Letter::ToPeer(host, frame))?),
            Heard::Double => Ok(()),
            Heard::Differs => Err(format!("host {host}: two different frames of cycle {}", message.cycle)),
        }
    }
}
