//! Who is at the other end: the greeting, its answer, and the reasons to refuse it.
//!
//! The dialling side sends [`Hello`] as its first frame. The listening side checks it and answers with
//! [`Welcome`] or with a reason, which is the last frame it sends. Both sides are values that turn frames
//! into frames: no socket, no clock. What certificates proved comes in through [`Policy`].

use crate::frame::{Frame, HELLO_LIMIT, Header, Kind, REASON_LIMIT, WELCOME_LIMIT};
use crate::memory::{Ends, Offer};
use crate::{Error, Result, codec, tls};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The version of the messages in this module and in the control messages, stated first in [`Hello`].
///
/// 1: the first. 2: links between workers (`peer_port` and `member` in [`Hello`]), introductions and reports.
/// 3: the work of loads by part in votes, elements that erode; proof of arithmetic in [`Hello`], samples of cycles.
/// 4: what is watched in assignments, and in votes what was seen.
/// 5: states of rigid bodies and energies by pair of parts in votes; rigid bodies in assignments.
/// 6: criteria of erosion by stress, volume and principal strains in assignments; pairs of edges in plans.
/// 7: in votes what springs hold on a surface that ends.
/// 8: a submitted job has no route where the master is to choose it; votes have the external work of a cycle before and after
/// its time.
/// 9: trusses, numbers of supports and hourglass control of pieces in assignments; nodes tied to faces in assignments and plans, and what they bear; in
/// votes the work of each wall and support, and what nodes lost at walls,
/// and readings of element gauges with history variables behind them; requests to remove a job;
/// memory of workers in [`Hello`]; the strain at which layers of shells break in assignments; the part of a job that is computed twice; cross-sections in assignments
/// and votes, and the cycles between two rows of the history; tetrahedra in assignments, the ten nodes of their faces in plans;
/// beams in assignments.
/// 11: the most workers that a job takes, and the seconds to its end; plies of shells in assignments.
/// 13: workers that divide their threads.
/// 14: votes foresee strikes on rigid walls, setups have parts that are rigid for a time.
/// 15: relaxation has a rate.
/// 16: shells of four points and membranes, thicknesses by shell, springs, cables, and pressures that move.
/// 17: votes and orders travel by a tree; processes of one machine may go on over memory.
/// 18: workers may sort what they hold of the surface.
/// 19: pieces travel before the assignment or state that they belong to.
/// 20: workers may name the region that they are in.
/// 21: workers that sort make their plans among themselves.
pub const VERSION: u16 = 22;

/// Most characters of a host's name.
pub const NAME_LIMIT: usize = 64;
/// Most characters of the name of a lane set.
pub const LANES_LIMIT: usize = 32;
/// Most characters of a token.
pub const TOKEN_LIMIT: usize = 128;
/// Most characters of a proof of arithmetic.
pub const PROOF_LIMIT: usize = 64;
/// Most threads that a host may claim.
pub const THREADS_LIMIT: u32 = 4096;
/// The least and the largest speed: a host a million times the reference, or a millionth of it, is a slip of the keyboard.
pub const SPEEDS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
/// The heartbeat intervals that a Welcome may set, milliseconds.
pub const HEARTBEAT_MS: std::ops::RangeInclusive<u32> = 10..=60_000;

/// Most characters of a reason as it is sent and shown.
const REASON_CHARS: usize = 500;

/// What the dialling side wants to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// A worker that offers its speed to a master.
    Worker,
    /// A client that submits, watches or cancels jobs.
    Client,
    /// A worker that dials another worker for the direct route.
    Peer,
    /// A host without a certificate, with a token to exchange for one.
    Newcomer,
}

impl Role {
    /// Whether a certificate for `certificate` may be used to call as this role.
    ///
    /// A master's certificate serves for everything: `bolide run` and `simulate` start their own workers.
    pub const fn is_certified_by(self, certificate: tls::Role) -> bool {
        match certificate {
            tls::Role::Master => !matches!(self, Self::Newcomer),
            tls::Role::Worker => matches!(self, Self::Worker | Self::Peer),
            tls::Role::Client => matches!(self, Self::Client),
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Worker => "worker",
            Self::Client => "client",
            Self::Peer => "peer",
            Self::Newcomer => "newcomer",
        })
    }
}

/// Where a peer stands in a job, as the master told it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Membership {
    pub job: u32,
    pub epoch: u32,
    /// The caller's index among the workers of the job.
    pub index: u32,
}

/// The greeting. Sent by the dialling side, once; answered by Welcome or Refuse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// [`VERSION`] of the sender; always the first two bytes of the payload.
    pub version: u16,
    /// What the sender wants to be.
    pub role: Role,
    /// The host's name: 1 to [`NAME_LIMIT`] letters, digits, `-`, `_` or `.`; behind an `@` which of its processes this is.
    pub name: String,
    /// Speed relative to the reference host, within [`SPEEDS`]; 1 for a client.
    pub speed: f64,
    /// Compute threads, 1 to [`THREADS_LIMIT`].
    pub threads: u32,
    /// The lane set in use, for the record only: the bits do not depend on it. Characters as in `name`.
    pub lanes: String,
    /// A number drawn at the start of the process: tells a returned worker from its ghost.
    pub nonce: u64,
    /// The secret that the listening side asks for, as a master gives one to the peers of a job.
    pub token: Option<String>,
    /// Of a worker: the port under which other workers reach it, 0 where it takes none. 0 for other roles.
    pub peer_port: u16,
    /// Of a peer: its place in the job; none for other roles.
    pub member: Option<Membership>,
    /// Of a worker: what the fixed problem of `mechanics::proof` comes to on its processor; none for other roles.
    pub proof: Option<String>,
    /// Of a worker: memory that its process may take (bytes), 0 where its system does not say. 0 for other roles.
    pub memory: u64,
    /// Of a worker: whether it can give some of its threads to another connection. False for other roles.
    pub divides: bool,
    /// Of a worker: the region of the virtual machine that it is in, characters as in `name`; empty where it names none, and for other roles.
    pub region: String,
    /// The connection as the sender sees it, if it would go on over memory of this machine.
    pub near: Option<Ends>,
}

impl Hello {
    /// A greeting of this version without a token.
    pub fn new(
        role: Role,
        name: impl Into<String>,
        speed: f64,
        threads: u32,
        lanes: impl Into<String>,
        nonce: u64,
    ) -> Self {
        let (name, lanes) = (name.into(), lanes.into());
        Self {
            version: VERSION,
            role,
            name,
            speed,
            threads,
            lanes,
            nonce,
            token: None,
            peer_port: 0,
            member: None,
            proof: None,
            memory: 0,
            divides: false,
            region: String::new(),
            near: None,
        }
    }

    /// Whether its token is `secret`; takes a time that does not tell where they differ.
    pub fn holds(&self, secret: &str) -> bool {
        self.token.as_ref().is_some_and(|theirs| same(secret, theirs))
    }

    /// Whether its processor computes the bits of this side's, whose proof is `ours`; a worker's must.
    ///
    /// # Errors
    /// The reason to refuse it, with both proofs.
    pub fn proves(&self, ours: &str) -> std::result::Result<(), String> {
        match self.proof.as_deref() {
            Some(theirs) if theirs == ours => Ok(()),
            theirs => Err(format!(
                "worker {}: its arithmetic gives {}, this fleet's gives {ours}; install the same release on both, and if \
                 it is the same, keep this processor out",
                self.name,
                theirs.unwrap_or("no proof")
            )),
        }
    }

    /// The reason to refuse the greeting whoever sent it, naming what was found and what is expected.
    ///
    /// # Errors
    /// That reason.
    pub fn check(&self) -> std::result::Result<(), String> {
        if self.version != VERSION {
            return Err(version_differs(self.version));
        }
        let parts: Vec<&str> = self.name.splitn(2, '@').collect();
        for part in parts {
            check_name("name", part, NAME_LIMIT)?;
        }
        if self.name.len() > NAME_LIMIT {
            return Err(format!("name of {} bytes, must have at most {NAME_LIMIT}", self.name.len()));
        }
        check_name("lanes", &self.lanes, LANES_LIMIT)?;
        if !SPEEDS.contains(&self.speed) {
            return Err(format!(
                "speed {}, must be from {:e} to {:e}",
                self.speed,
                SPEEDS.start(),
                SPEEDS.end()
            ));
        }
        if !(1..=THREADS_LIMIT).contains(&self.threads) {
            return Err(format!("{} threads, must be 1 to {THREADS_LIMIT}", self.threads));
        }
        if let Some(token) = &self.token
            && token.len() > TOKEN_LIMIT
        {
            return Err(format!("token of {} bytes, must have at most {TOKEN_LIMIT}", token.len()));
        }
        if let Some(proof) = &self.proof {
            check_name("proof", proof, PROOF_LIMIT)?;
        }
        if !self.region.is_empty() {
            check_name("region", &self.region, NAME_LIMIT)?;
        }
        Ok(())
    }
}

fn version_differs(theirs: u16) -> String {
    format!("protocol version {theirs}, this side speaks {VERSION}; install the same release on both")
}

/// The host in a worker's name: without what says which of its processes it is.
pub fn host_of(name: &str) -> &str {
    name.split('@').next().unwrap_or(name)
}

fn check_name(what: &str, name: &str, limit: usize) -> std::result::Result<(), String> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if !name.is_empty() && name.len() <= limit && name.chars().all(allowed) {
        return Ok(());
    }
    let shown: String = name.chars().take(limit).collect();
    Err(format!("{what} {shown:?} of {} bytes, must be 1 to {limit} letters, digits, - _ or .", name.len()))
}

/// The place that the listening side gives. Sent once, in answer to Hello; answered only where it offers memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// What the dialling side writes into its frames from now on; never 0, never given twice.
    pub incarnation: u32,
    /// The number of the host in the virtual machine, from 0.
    pub host: u32,
    /// The interval of heartbeats in both directions, milliseconds, within [`HEARTBEAT_MS`].
    pub heartbeat_ms: u32,
    /// Memory over which the link may go on; the dialling side says whether it does. See [`crate::memory`].
    pub memory: Option<Offer>,
}

impl Welcome {
    /// One without memory.
    pub const fn new(incarnation: u32, host: u32, heartbeat_ms: u32) -> Self {
        Self { incarnation, host, heartbeat_ms, memory: None }
    }
}

/// How far a handshake has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The other side's frame has not come.
    Waiting,
    /// Listening side: the greeting is good, the answer is the owner's to give.
    Deciding,
    /// Both sides know.
    Done,
    /// One side said no.
    Refused,
}

/// What moves a handshake on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    /// A good greeting came.
    Greeted,
    /// A Welcome came or goes out.
    Welcomed,
    /// A refusal came or goes out, or a frame that was no answer.
    Refused,
}

impl Stage {
    fn after(self, event: Event) -> Result<Self> {
        match (self, event) {
            (Self::Waiting, Event::Greeted) => Ok(Self::Deciding),
            (Self::Waiting | Self::Deciding, Event::Welcomed) => Ok(Self::Done),
            (Self::Waiting | Self::Deciding, Event::Refused) => Ok(Self::Refused),
            (state, event) => Err(Error::State { state: state.name(), event: event.name() }),
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Deciding => "deciding",
            Self::Done => "done",
            Self::Refused => "refused",
        }
    }
}

impl Event {
    const fn name(self) -> &'static str {
        match self {
            Self::Greeted => "another greeting",
            Self::Welcomed => "a welcome",
            Self::Refused => "a refusal",
        }
    }
}

/// The dialling side of one handshake.
#[derive(Debug)]
pub struct Client {
    stage: Stage,
}

impl Client {
    /// Starts with `hello`, whose frame is the first to send.
    ///
    /// # Errors
    /// [`Error::Message`] with the reason for which any other side would refuse the greeting.
    pub fn new(hello: &Hello) -> Result<(Self, Frame)> {
        hello.check().map_err(Error::Message)?;
        let frame = Frame::new(Header::new(Kind::Hello), codec::encode(hello)?);
        Ok((Self { stage: Stage::Waiting }, frame))
    }

    /// Takes the answer.
    ///
    /// # Errors
    /// [`Error::Refused`] with the peer's reason, [`Error::Unexpected`] for a frame that is no answer,
    /// [`Error::Message`] for a Welcome that says what it may not, [`Error::State`] after the end.
    pub fn apply(&mut self, frame: &Frame) -> Result<Welcome> {
        let answer = match frame.header.kind {
            Kind::Welcome => decode_welcome(frame),
            Kind::Refuse => reason(frame).and_then(|reason| Err(Error::Refused { reason })),
            found => Err(Error::Unexpected { found, expected: "welcome or refuse" }),
        };
        let event = if answer.is_ok() { Event::Welcomed } else { Event::Refused };
        self.stage = self.stage.after(event)?;
        answer
    }
}

fn decode_welcome(frame: &Frame) -> Result<Welcome> {
    let welcome: Welcome = codec::decode(&frame.payload, WELCOME_LIMIT as usize)?;
    welcome.check()?;
    Ok(welcome)
}

impl Welcome {
    fn check(&self) -> Result<()> {
        if self.incarnation == 0 {
            return Err(Error::Message("welcome with incarnation 0, must be 1 or more".into()));
        }
        if !HEARTBEAT_MS.contains(&self.heartbeat_ms) {
            let (found, range) = (self.heartbeat_ms, HEARTBEAT_MS);
            return Err(Error::Message(format!("heartbeat of {found} ms, must be within {range:?}")));
        }
        Ok(())
    }
}

/// What the listening side asks of a greeting, apart from what every greeting must be.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Policy {
    /// The roles that are taken here; a master takes workers and clients, a worker takes peers.
    pub roles: Vec<Role>,
    /// The role in the caller's certificate; `None` on a loopback address without certificates.
    pub certificate: Option<tls::Role>,
    /// The name in the certificate of a worker, whose greeting has no other; behind an `@` it may say which process of its host it is.
    pub name: Option<String>,
    /// The token that the greeting must hold, if any.
    pub token: Option<String>,
    /// Why nobody is taken on this connection, whatever the greeting says: its certificate was revoked.
    pub refusal: Option<String>,
}

/// What the listening side makes of a greeting.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// The greeting is good; its owner answers with [`Server::welcome`] or [`Server::refuse`].
    Good(Hello),
    /// The greeting is refused; the frame is the last to send.
    Bad {
        /// Carries the reason.
        frame: Frame,
        /// The reason, for the log.
        reason: String,
    },
}

/// The listening side of one handshake.
#[derive(Debug)]
pub struct Server {
    stage: Stage,
    policy: Policy,
}

impl Server {
    /// Waits for a greeting.
    pub const fn new(policy: Policy) -> Self {
        Self { stage: Stage::Waiting, policy }
    }

    /// Takes the caller's first frame.
    ///
    /// # Errors
    /// [`Error::State`] for a second one.
    pub fn apply(&mut self, frame: &Frame) -> Result<Verdict> {
        match self.judge(frame) {
            Ok(hello) => {
                self.stage = self.stage.after(Event::Greeted)?;
                Ok(Verdict::Good(hello))
            }
            Err(reason) => Ok(Verdict::Bad { frame: self.refuse(&reason)?, reason }),
        }
    }

    /// The frame that takes the caller in.
    ///
    /// # Errors
    /// [`Error::Message`] when the caller would not accept it, [`Error::State`] before a good greeting or
    /// after an answer.
    pub fn welcome(&mut self, welcome: Welcome) -> Result<Frame> {
        welcome.check()?;
        if self.stage == Stage::Waiting {
            return Err(Error::State { state: self.stage.name(), event: Event::Welcomed.name() });
        }
        self.stage = self.stage.after(Event::Welcomed)?;
        Ok(Frame::new(Header::new(Kind::Welcome), codec::encode(&welcome)?))
    }

    /// The frame that turns the caller away.
    ///
    /// # Errors
    /// [`Error::State`] after an answer.
    pub fn refuse(&mut self, reason: &str) -> Result<Frame> {
        self.stage = self.stage.after(Event::Refused)?;
        reason_frame(Kind::Refuse, reason)
    }

    fn judge(&self, frame: &Frame) -> std::result::Result<Hello, String> {
        if frame.header.kind != Kind::Hello {
            return Err(format!("first frame is {}, expected hello", frame.header.kind));
        }
        // Another version may say more or less after its number, so that is looked at alone.
        if let Some(theirs) = frame.payload.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
            && theirs != VERSION
        {
            return Err(version_differs(theirs));
        }
        let hello: Hello =
            codec::decode(&frame.payload, HELLO_LIMIT as usize).map_err(|error| format!("hello: {error}"))?;
        hello.check()?;
        if let Some(reason) = &self.policy.refusal {
            return Err(reason.clone());
        }
        let role = hello.role;
        if !self.policy.roles.contains(&role) {
            let taken: Vec<String> = self.policy.roles.iter().map(Role::to_string).collect();
            return Err(format!("role {role}, this side takes {}", taken.join(" and ")));
        }
        if let Some(certificate) = self.policy.certificate
            && !role.is_certified_by(certificate)
        {
            return Err(format!("role {role}, the certificate is for a {certificate}"));
        }
        if let Some(name) = &self.policy.name
            && host_of(&hello.name) != name
        {
            return Err(format!(
                "name {:?}, the certificate is of {name:?}; leave --name out, or give {name} or {name}@ANY",
                hello.name
            ));
        }
        if let Some(token) = &self.policy.token
            && !hello.holds(token)
        {
            return Err("token missing or wrong".into());
        }
        Ok(hello)
    }
}

/// Compares secrets in a time that does not tell where they differ.
fn same(ours: &str, theirs: &str) -> bool {
    let differ = ours.bytes().zip(theirs.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b));
    ours.len() == theirs.len() && differ == 0
}

/// The frame that ends a connection on purpose, with the reason.
///
/// # Errors
/// None that a reason can cause: it is cut to 500 characters.
pub fn bye(reason: &str) -> Result<Frame> {
    reason_frame(Kind::Bye, reason)
}

fn reason_frame(kind: Kind, reason: &str) -> Result<Frame> {
    Ok(Frame::new(Header::new(kind), codec::encode(&printable(reason))?))
}

/// The reason in a Refuse or Bye frame, on one line and without control characters.
///
/// # Errors
/// [`Error::Unexpected`] for another kind, or the codec's errors.
pub fn reason(frame: &Frame) -> Result<String> {
    match frame.header.kind {
        Kind::Refuse | Kind::Bye => {
            let text: String = codec::decode(&frame.payload, REASON_LIMIT as usize)?;
            Ok(printable(&text))
        }
        found => Err(Error::Unexpected { found, expected: "refuse or bye" }),
    }
}

fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(REASON_CHARS).collect()
}
