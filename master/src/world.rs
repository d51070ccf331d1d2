//! WORLD: the sessions of a master and its workers in one process. What they say is packed as on a wire and delivered, what they
//! want done is handed to whoever can do it.
//!
//! How long anything takes, and which way a message goes, is not known here: that is what [`Surroundings`] are. A run in one
//! process ([`embedded`](crate::embedded)) delivers at once and computes on threads; the
//! [virtual clock](crate::simulate::virtual_clock) charges for both; the seeds of the tests lose, delay and break what they like.
//! Between processes [`drive`](crate::drive) has the master's half, the worker's daemon the other.
//!
//! A *host* is a process that may compute: it has a session, and is a *member* of the job under an index of its own since it
//! last joined.

use std::{fmt, sync::Arc};

use mechanics::piece::Piece;
use protocol::{
    frame::Kind,
    message::{ToMaster, ToPeer, ToWorker, Work},
    phase::Report,
    wire::{self, Packed},
};
use worker::session::{self, Session, Task};

use crate::{
    event::{Action, Event, Outcome, WorkerSpec},
    job::Job,
    sort::{Gathered, SortBasis},
};

/// One end of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Master,
    /// A host, from 0.
    Host(usize),
}

/// A message on its way.
pub struct Parcel {
    /// Sender.
    pub from: End,
    /// Receiver.
    pub to: End,
    /// The epoch of the host at one of its ends, of the sender between hosts.
    pub epoch: u32,
    /// Bytes with the frames' headers.
    pub bytes: u64,
    /// The sender computes as soon as it has been sent.
    pub before_task: bool,
    /// Whether it is of a state that a worker sends.
    pub of_state: bool,
    body: Body,
}

impl Parcel {
    /// Whether it is a frame of a cycle; else a control message, which may be long.
    pub fn is_of_cycle(&self) -> bool {
        match &self.body {
            Body::ToMaster(_, packed) | Body::ToWorker(packed) | Body::ToPeer { packed, .. } => {
                packed.kind != Kind::Control
            }
            Body::FromHost(..) | Body::ToHost(_) => false,
        }
    }
}

enum Body {
    /// To the master, from a member.
    ToMaster(usize, Packed),
    ToWorker(Packed),
    /// From a member, which has this position in the workers, under this plan.
    ToPeer {
        position: u32,
        plan: u64,
        packed: Packed,
    },
    /// Handed over as they are: pieces, from a member and to a host.
    FromHost(usize, Box<ToMaster>),
    ToHost(Box<ToWorker>),
}

/// A message that has arrived.
pub enum Letter {
    /// To the master, from a member in an epoch.
    ToMaster(usize, u32, ToMaster),
    /// To a host.
    ToWorker(usize, ToWorker),
    /// To a host, from another one.
    ToPeer(usize, PeerFrame),
}

/// What one worker sends another, with the plan and epoch that it follows.
pub struct PeerFrame {
    /// The sender's epoch.
    pub epoch: u32,
    /// Its position in the workers.
    pub from: u32,
    /// Hash of its plan; none for what the master relayed.
    pub plan: Option<u64>,
    pub message: ToPeer,
}

/// What a world stands in: time, network, processors, disk.
pub trait Surroundings {
    /// Takes a message on its way; [`World::open`] is to be called with it when it arrives, if it does.
    ///
    /// # Errors
    /// What ends the run.
    fn post(&mut self, sessions: &Sessions, parcel: Parcel) -> Result<(), Error>;

    /// Begins a task; exactly one [`session::Event::Done`] answers it, unless the host dies.
    ///
    /// # Errors
    /// What ends the run.
    fn compute(&mut self, sessions: &Sessions, host: usize, task: Task) -> Result<(), Error>;

    /// Begins a sort; exactly one [`Event::Sorted`] answers it.
    ///
    /// # Errors
    /// What ends the run.
    fn sort(&mut self, sessions: &Sessions, basis: Arc<SortBasis>, x: Gathered) -> Result<(), Error>;

    /// [`Event::Timer`] is due in so many seconds.
    fn timer(&mut self, seconds: f64);

    /// Takes a row, a state, a checkpoint, progress.
    ///
    /// # Errors
    /// What ends the run.
    fn take(&mut self, action: Action) -> Result<(), Error>;

    /// The master has no more to do with a host.
    fn dismiss(&mut self, host: usize);

    /// The job has released a host for another job.
    fn freed(&mut self, _host: usize) {}

    /// A host drops what it computes on.
    fn forget(&mut self, host: usize);

    /// Whether a host still hears.
    fn is_alive(&self, host: usize) -> bool;

    /// How long a host has worked so far, where that is counted.
    fn worked(&self, _host: usize) -> Option<Work> {
        None
    }

    /// How the time of a host went, where that is counted. Asked before its last state is sent.
    fn report(&self, _sessions: &Sessions, _host: usize) -> Option<Report> {
        None
    }

    /// Whether a message of so many elements is handed over as it is, since there need not be room for it twice.
    fn hands_over(&self, _elements: usize) -> bool {
        false
    }

    /// Looks at a message before it is packed.
    fn look(&mut self, _message: &ToWorker) {}

    /// A message of a host is about to be packed and posted.
    fn send_begins(&mut self) {}

    /// It has been, in this cycle.
    fn send_ends(&mut self, _host: usize, _cycle: u64) {}

    /// Gives a frame for the neighbour at a position back if the host's link to it does not stand: then the master relays it.
    ///
    /// # Errors
    /// The frame, if the link does not stand.
    fn link(&mut self, _host: usize, _to: u32, message: ToPeer) -> Result<ToPeer, ToPeer> {
        Ok(message)
    }
}

/// A host as the world knows it.
pub struct Host {
    pub session: Session,
    /// Its index in the job; none once the master has given it up, or has not met it.
    pub member: Option<usize>,
}

#[derive(Default)]
pub struct Sessions {
    /// The master's; none while it is away.
    pub job: Option<Job>,
    /// The hosts', by number.
    pub hosts: Vec<Host>,
    /// By index in the job: the host that has or had it.
    members: Vec<usize>,
}

impl Sessions {
    /// A new process; gives its number.
    pub fn add_host(&mut self) -> usize {
        self.hosts.push(Host { session: Session::new(), member: None });
        self.hosts.len() - 1
    }

    /// The host that has or had an index in the job.
    pub fn host_of(&self, member: usize) -> usize {
        self.members[member]
    }

    /// The master gives a host up, or its process ends; gives the index that it had.
    pub fn part(&mut self, host: usize) -> Option<usize> {
        self.hosts[host].member.take()
    }

    /// A host's position in the workers.
    pub fn position(&self, host: usize) -> Option<u32> {
        let (job, member) = (self.job.as_ref()?, self.hosts[host].member?);
        job.at_work().iter().position(|&index| index == member).map(|position| position as u32)
    }

    fn cycle(&self, host: usize) -> u64 {
        self.hosts[host].session.cycle()
    }
}

/// Sessions in their surroundings.
pub struct World<S> {
    pub sessions: Sessions,
    /// What they stand in.
    pub surroundings: S,
    /// How the job ended.
    outcome: Option<Outcome>,
}

impl<S: Surroundings> World<S> {
    /// A world of hosts that nobody has met.
    pub fn new(hosts: usize, surroundings: S) -> Self {
        let mut sessions = Sessions::default();
        for _ in 0..hosts {
            sessions.add_host();
        }
        Self { sessions, surroundings, outcome: None }
    }

    /// A master comes with a job, and `first`, the actions that came with it. These hosts are its first members.
    ///
    /// # Errors
    /// What ends the run.
    pub fn begin(&mut self, job: Job, first: Vec<Action>, members: Vec<usize>) -> Result<(), Error> {
        for (member, &host) in members.iter().enumerate() {
            self.sessions.hosts[host].member = Some(member);
        }
        self.sessions.members = members;
        self.sessions.job = Some(job);
        self.act(first)
    }

    /// A host joins the job.
    ///
    /// # Errors
    /// What ends the run.
    pub fn join(&mut self, host: usize, spec: WorkerSpec) -> Result<(), Error> {
        self.sessions.hosts[host].member = Some(self.sessions.members.len());
        self.sessions.members.push(host);
        self.apply(Event::Joined(spec))
    }

    /// How the job ended, once it has.
    pub fn outcome(&mut self) -> Option<Outcome> {
        self.outcome.take()
    }

    /// Something happens to the job.
    ///
    /// # Errors
    /// What ends the run.
    pub fn apply(&mut self, event: Event) -> Result<(), Error> {
        let Some(job) = &mut self.sessions.job else { return Ok(()) };
        let actions = job.apply(event);
        self.act(actions)
    }

    fn act(&mut self, actions: Vec<Action>) -> Result<(), Error> {
        for action in actions {
            match action {
                Action::Send(member, message) => {
                    let host = self.sessions.members[member];
                    self.surroundings.look(&message);
                    if self.sessions.hosts[host].member == Some(member) {
                        self.post_to_worker(host, message)?;
                    }
                }
                Action::Pieces(member, cutting) => {
                    let host = self.sessions.members[member];
                    let job = self.sessions.job.as_ref();
                    if let Some(job) = job.filter(|_| self.sessions.hosts[host].member == Some(member)) {
                        let message = cutting.cut(&job.model().mesh);
                        self.post_to_worker(host, message)?;
                    }
                }
                Action::Sort(basis, x) => self.surroundings.sort(&self.sessions, basis, x)?,
                Action::Timer(seconds) => self.surroundings.timer(seconds),
                Action::Dismiss(member, _) => {
                    let host = self.sessions.members[member];
                    if self.sessions.hosts[host].member == Some(member) {
                        self.surroundings.dismiss(host);
                    }
                }
                Action::Freed(member) => self.surroundings.freed(self.sessions.members[member]),
                Action::Over(outcome) => self.outcome = Some(*outcome),
                other => self.surroundings.take(other)?,
            }
        }
        Ok(())
    }

    fn post_to_worker(&mut self, host: usize, message: ToWorker) -> Result<(), Error> {
        let elements = match &message {
            ToWorker::Pieces { pieces, .. } => n_elements(pieces.iter().map(|(_, piece)| piece)),
            _ => 0,
        };
        let (bytes, body) = if elements > 0 && self.surroundings.hands_over(elements) {
            (wire::measure_to_worker(&message)?, Body::ToHost(Box::new(message)))
        } else {
            let packed = wire::pack_to_worker(&message)?;
            (packed.wire_bytes(), Body::ToWorker(packed))
        };
        let epoch = self.sessions.hosts[host].session.epoch();
        let parcel = Parcel {
            from: End::Master,
            to: End::Host(host),
            epoch,
            bytes,
            before_task: false,
            of_state: false,
            body,
        };
        self.surroundings.post(&self.sessions, parcel)
    }

    /// Something happens to a host's session, if it still hears.
    ///
    /// # Errors
    /// What ends the run.
    pub fn step(&mut self, host: usize, event: session::Event) -> Result<(), Error> {
        if !self.surroundings.is_alive(host) {
            return Ok(());
        }
        let actions = self.sessions.hosts[host].session.apply(event);
        let computes = actions.iter().any(|action| matches!(action, session::Action::Compute(_)));
        for action in actions {
            match action {
                session::Action::Compute(task) => self.surroundings.compute(&self.sessions, host, task)?,
                session::Action::Forget => self.surroundings.forget(host),
                session::Action::Send(message) => self.timed(host, |world| {
                    if let ToMaster::WorkerState { last: Some(_), .. } = message
                        && let Some(report) = world.surroundings.report(&world.sessions, host)
                    {
                        world.post_to_master(host, ToMaster::Report(Box::new(report)), computes)?;
                    }
                    let message = match world.surroundings.worked(host) {
                        Some(worked) => message.stamped(worked),
                        None => message,
                    };
                    world.post_to_master(host, message, computes)
                })?,
                session::Action::SendPeer(to, message) => {
                    self.timed(host, |world| match world.surroundings.link(host, to, message) {
                        Ok(message) => world.post_to_peer(host, to, &message, computes),
                        Err(message) => world.send(host, ToMaster::Relay { to, message }),
                    })?
                }
            }
        }
        Ok(())
    }

    fn timed(&mut self, host: usize, send: impl FnOnce(&mut Self) -> Result<(), Error>) -> Result<(), Error> {
        let cycle = self.sessions.cycle(host);
        self.surroundings.send_begins();
        let result = send(self);
        self.surroundings.send_ends(host, cycle);
        result
    }

    /// A host says something to the master of its own accord.
    ///
    /// # Errors
    /// What ends the run.
    pub fn send(&mut self, host: usize, message: ToMaster) -> Result<(), Error> {
        self.post_to_master(host, message, false)
    }

    fn post_to_master(&mut self, host: usize, message: ToMaster, before_task: bool) -> Result<(), Error> {
        let Host { session, member } = &self.sessions.hosts[host];
        // Nobody hears a host that the master does not know.
        let Some(member) = *member else { return Ok(()) };
        let epoch = session.epoch();
        let of_state = matches!(message, ToMaster::Pieces { .. } | ToMaster::WorkerState { .. });
        let elements = match &message {
            ToMaster::Pieces { pieces, .. } => n_elements(pieces),
            _ => 0,
        };
        let (bytes, body) = if elements > 0 && self.surroundings.hands_over(elements) {
            (wire::measure_to_master(&message)?, Body::FromHost(member, Box::new(message)))
        } else {
            let packed = wire::pack_to_master(&message)?;
            (packed.wire_bytes(), Body::ToMaster(member, packed))
        };
        let parcel =
            Parcel { from: End::Host(host), to: End::Master, epoch, bytes, before_task, of_state, body };
        self.surroundings.post(&self.sessions, parcel)
    }

    fn post_to_peer(
        &mut self,
        host: usize,
        to: u32,
        message: &ToPeer,
        before_task: bool,
    ) -> Result<(), Error> {
        let Sessions { job, hosts, members } = &self.sessions;
        let (epoch, plan) = (hosts[host].session.epoch(), hosts[host].session.plan_hash());
        // Of an epoch that is over, there is nobody to hear it.
        let Some(job) = job.as_ref().filter(|job| job.epoch() == epoch) else { return Ok(()) };
        let Some(position) = self.sessions.position(host) else { return Ok(()) };
        let n = job.at_work().len();
        let member = job.at_work().get(to as usize).ok_or(Error::NoNeighbour { host, to, n })?;
        let to = End::Host(members[*member]);
        let packed = wire::pack_to_peer(message)?;
        let (bytes, body) = (packed.wire_bytes(), Body::ToPeer { position, plan, packed });
        let parcel = Parcel { from: End::Host(host), to, epoch, bytes, before_task, of_state: false, body };
        self.surroundings.post(&self.sessions, parcel)
    }

    /// A message has arrived: unpacks it.
    ///
    /// # Errors
    /// If it is none.
    pub fn open(&self, parcel: Parcel) -> Result<Letter, Error> {
        let Parcel { to, epoch, body, .. } = parcel;
        let host = match to {
            End::Host(host) => host,
            End::Master => 0,
        };
        Ok(match body {
            Body::ToMaster(member, Packed { kind, bytes, .. }) => {
                Letter::ToMaster(member, epoch, wire::unpack_to_master(kind, &bytes)?)
            }
            Body::ToWorker(Packed { kind, bytes, .. }) => {
                Letter::ToWorker(host, wire::unpack_to_worker(kind, &bytes)?)
            }
            Body::ToPeer { position, plan, packed: Packed { kind, bytes, .. } } => {
                let message = wire::unpack_to_peer(kind, &bytes)?;
                Letter::ToPeer(host, PeerFrame { epoch, from: position, plan: Some(plan), message })
            }
            Body::FromHost(member, message) => Letter::ToMaster(member, epoch, *message),
            Body::ToHost(message) => Letter::ToWorker(host, *message),
        })
    }

    /// Gives a message to the session that it is for. A worker's frame of an epoch that its receiver is not in says nothing.
    ///
    /// # Errors
    /// What ends the run.
    pub fn hear(&mut self, letter: Letter) -> Result<(), Error> {
        match letter {
            Letter::ToMaster(member, epoch, message) => self.apply(Event::Message(member, epoch, message)),
            Letter::ToWorker(host, message) => self.step(host, session::Event::Message(message)),
            Letter::ToPeer(host, PeerFrame { epoch, from, message, .. }) => {
                if self.sessions.hosts[host].session.epoch() != epoch {
                    return Ok(());
                }
                self.step(host, session::Event::Peer(from, message))
            }
        }
    }
}

fn n_elements<'a>(pieces: impl IntoIterator<Item = &'a Piece>) -> usize {
    pieces.into_iter().map(|piece| piece.elements.len()).sum()
}

/// What ends a run beside its job.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// A message that cannot be packed or unpacked.
    Message(protocol::Error),
    /// A host writes to a neighbour that there is not.
    NoNeighbour {
        host: usize,
        /// The neighbour's position.
        to: u32,
        /// How many there are.
        n: usize,
    },
    /// A session asked for a task before the one before was done.
    TwoTasks,
    /// Nothing is under way, and the job is not over.
    Stuck,
    /// In words of the surroundings: the disk, a thread, a tape.
    Surroundings(String),
}

impl From<protocol::Error> for Error {
    fn from(error: protocol::Error) -> Self {
        Self::Message(error)
    }
}

impl From<String> for Error {
    fn from(why: String) -> Self {
        Self::Surroundings(why)
    }
}

impl From<&str> for Error {
    fn from(why: &str) -> Self {
        Self::Surroundings(why.to_owned())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Message(error) => error.fmt(f),
            Self::NoNeighbour { host, to, n } => write!(f, "worker {host} writes to {to}, there are {n}"),
            Self::TwoTasks => f.write_str("a worker asked for two tasks at once"),
            Self::Stuck => f.write_str("nothing to do and the job is not over"),
            Self::Surroundings(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for Error {}

impl From<Error> for String {
    fn from(error: Error) -> Self {
        error.to_string()
    }
}
