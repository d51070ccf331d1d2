//! LINKS: the compute thread's side of the links of one job: which way a frame goes, and what is taken of what comes.
//!
//! Frames of a link are checked here against the plan in force at their cycle. A frame of a cycle whose plan has not
//! come from the master yet waits for it. A frame that says what it may not ends its link, with one line in the log;
//! from then on the master relays for that pair, and the run goes on.

use std::sync::Arc;

use protocol::{
    Error,
    frame::{Frame, Header, Kind},
    handshake,
    link::Sender,
    message::{Introduction, SaidKind, ToPeer},
    phase::Report,
    wire,
};
use tokio::sync::mpsc;
use tracing::{debug, info, warn};

use super::{Circle, Peers, Shared, connect, pairs::Heard, pairs::Pairs};
use crate::{
    input::{Input, Key, News, What},
    session::Session,
};

/// What comes of news.
#[derive(Debug, Default, PartialEq)]
pub struct Step {
    /// A message for the session, from this worker.
    pub heard: Option<(u32, ToPeer)>,
    /// Messages that the master is to relay to this worker.
    pub relay: Option<(u32, Vec<ToPeer>)>,
}

/// The links of the job in hand. Lives on the compute thread.
pub struct Links {
    shared: Option<Arc<Shared>>,
    news: mpsc::WeakSender<Input>,
    circle: Option<Arc<Circle>>,
    pairs: Pairs<Sender>,
    /// Frames whose plan has not come, with the plan they follow.
    early: Vec<(u32, u64, ToPeer)>,
    /// Bytes of links that have ended.
    bytes: u64,
}

impl Links {
    /// Without a job. Without `peers` every pair is relayed.
    pub fn new(peers: Option<&Peers>, news: mpsc::WeakSender<Input>) -> Self {
        Self {
            shared: peers.map(|peers| Arc::clone(&peers.shared)),
            news,
            circle: None,
            pairs: Pairs::default(),
            early: Vec::new(),
            bytes: 0,
        }
    }

    /// The master says who computes a job. Links of another job or epoch end.
    pub fn introduce(&mut self, key: Key, who: Introduction) {
        self.leave("another job begins");
        let circle = Circle { key, who, taken: std::sync::Mutex::default(), news: self.news.clone() };
        let circle = Arc::new(circle);
        if let Some(shared) = &self.shared {
            shared.circle.send_replace(Some(Arc::clone(&circle)));
        }
        self.circle = Some(circle);
    }

    /// Ends all links, for a reason that the others see.
    pub fn leave(&mut self, reason: &str) {
        for link in self.pairs.links() {
            // One that has just ended needs no words.
            let _ = handshake::bye(reason).and_then(|bye| link.send(bye));
        }
        if let Some(shared) = &self.shared
            && self.circle.take().is_some()
        {
            shared.circle.send_replace(None);
        }
        self.circle = None;
        self.pairs = Pairs::default();
        self.early.clear();
        self.bytes = 0;
    }

    /// The job and epoch of the links.
    pub fn key(&self) -> Option<Key> {
        self.circle.as_ref().map(|circle| circle.key)
    }

    /// A plan names these workers neighbours: those below this one are dialled, the others dial.
    pub fn want(&mut self, neighbours: impl IntoIterator<Item = u32>) {
        for other in neighbours {
            if !self.pairs.want(other) {
                continue;
            }
            if let (Some(circle), Some(shared)) = (&self.circle, &self.shared)
                && other < circle.who.me
                && circle.take(other)
            {
                self.pairs.dial(other);
                shared.runtime.spawn(connect::dial(Arc::clone(shared), Arc::clone(circle), other));
            }
        }
    }

    /// The plan of a gathering has come: what was said of its sort has arrived.
    pub fn settle(&mut self, gathered_at: u64) {
        self.pairs.settle(gathered_at);
    }

    /// Whether a link is still being made that this worker waits for.
    pub fn are_dialling(&self) -> bool {
        self.pairs.are_dialling()
    }

    /// Sends to another worker; gives what the master is to relay.
    pub fn send(&mut self, to: u32, message: ToPeer, plan: u64) -> Vec<ToPeer> {
        let sent = match self.pairs.send(to, message) {
            Err(message) => return vec![message],
            Ok((link, message)) => {
                let header = self.circle.as_ref().ok_or(Error::Closed).map(|circle| Header {
                    job: circle.key.job,
                    epoch: circle.key.epoch,
                    incarnation: circle
                        .who
                        .peer_workers
                        .get(circle.who.me as usize)
                        .map_or(0, |member| member.incarnation),
                    cycle: message.cycle,
                    plan,
                    ..Header::new(Kind::Cycle)
                });
                let packed = wire::pack_to_peer(message);
                header.and_then(|header| link.send(Frame::new(header, packed?.bytes)))
            }
        };
        match sent {
            Ok(()) => Vec::new(),
            Err(error) => self.lose(to, &error),
        }
    }

    /// The link of a pair has ended; gives what the master is to relay.
    fn lose(&mut self, other: u32, error: &Error) -> Vec<ToPeer> {
        let Some((messages, link)) = self.pairs.lose(other) else { return Vec::new() };
        let circle = self.circle.as_ref();
        let member = circle.and_then(|circle| circle.who.peer_workers.get(other as usize));
        let name = member.map_or("unknown", |member| &member.name);
        let address = member.and_then(|member| member.address).map(|address| format!(" at {address}"));
        let address = address.unwrap_or_default();
        match (&link, error) {
            (Some(_), Error::Left { reason }) => {
                debug!("link to worker {other} ({name}{address}) ended: {reason}")
            }
            (Some(_), error) => {
                warn!("link to worker {other} ({name}{address}) ended: {error}; relayed by the master");
            }
            (None, error) => {
                info!("no link to worker {other} ({name}{address}): {error}; relayed by the master")
            }
        }
        if let Some(link) = link {
            self.bytes += link.counters().bytes_sent;
            link.abort(error.clone());
        }
        messages
    }

    /// Something happened to a pair. `session` says which plan is in force.
    pub fn hear(&mut self, News { key, from, what }: News, session: &Session) -> Step {
        if self.key() != Some(key) {
            return Step::default();
        }
        let mut step = Step::default();
        match what {
            What::Stands(link) => {
                debug!("link to worker {from} stands");
                if let Err(link) = self.pairs.stands(from, link) {
                    link.abort(Error::Message("this pair is relayed".into()));
                }
            }
            What::Failed(error) | What::Ended(error) => step.relay = Some((from, self.lose(from, &error))),
            What::Frame(header, message) => match self.take(from, &header, message, session) {
                Ok(heard) => step.heard = heard.map(|message| (from, message)),
                Err(error) => step.relay = Some((from, self.lose(from, &error))),
            },
        }
        step
    }

    /// A frame of a link: of a cycle that a neighbour can be in, following the plan of that cycle, for the first time.
    fn take(
        &mut self,
        from: u32,
        header: &Header,
        message: ToPeer,
        session: &Session,
    ) -> Result<Option<ToPeer>, Error> {
        let (cycle, now) = (message.cycle, session.cycle());
        let which = (message.what.kind(), cycle);
        match self.pairs.hear(from, which, header.crc) {
            Heard::Fresh if !message.what.is_near(cycle, now) => {
                self.pairs.forget(from, which);
                return Err(Error::Message(format!("cycle {cycle}, this worker is in cycle {now}")));
            }
            Heard::Fresh => {}
            Heard::Double => return Ok(None),
            Heard::Differs => {
                return Err(Error::Message(format!("cycle {cycle} a second time, with other numbers")));
            }
        }
        // The others follow no plan.
        let plan = match which.0 {
            SaidKind::Partials => session.plan_at(cycle),
            _ => Some(header.plan),
        };
        match plan {
            Some(plan) if plan == header.plan => Ok(Some(message)),
            Some(plan) => {
                // It comes again from where plans agree.
                self.pairs.forget(from, which);
                Err(differs(cycle, header.plan, plan))
            }
            None => {
                self.early.push((from, header.plan, message));
                Ok(None)
            }
        }
    }

    /// A message that the master relayed; none if it came over the link already. What was said twice and differently
    /// is for the session to refuse.
    pub fn relayed(&mut self, from: u32, message: ToPeer) -> Option<ToPeer> {
        let which = (message.what.kind(), message.cycle);
        let checksum = wire::pack_to_peer(&message).and_then(|packed| {
            let mut frame = Frame::new(Header::new(Kind::Cycle), packed.bytes);
            frame.seal().map(|()| frame.header.crc)
        });
        let heard = checksum.map(|checksum| self.pairs.hear(from, which, checksum));
        (heard != Ok(Heard::Double)).then_some(message)
    }

    /// Frames that waited for a plan which has come; a wrong one ends its link.
    pub fn release(&mut self, session: &Session) -> Vec<Step> {
        let mut steps = Vec::new();
        for (from, theirs, message) in std::mem::take(&mut self.early) {
            match session.plan_at(message.cycle) {
                None => self.early.push((from, theirs, message)),
                Some(plan) if plan == theirs => {
                    steps.push(Step { heard: Some((from, message)), relay: None });
                }
                Some(plan) => {
                    self.pairs.forget(from, (message.what.kind(), message.cycle));
                    let relay = self.lose(from, &differs(message.cycle, theirs, plan));
                    steps.push(Step { heard: None, relay: Some((from, relay)) });
                }
            }
        }
        steps
    }

    /// Fills in what concerns links.
    pub fn report(&self, report: &mut Report) {
        (report.linked, report.relayed) = self.pairs.neighbours();
        report.peer_bytes =
            self.bytes + self.pairs.links().map(|link| link.counters().bytes_sent).sum::<u64>();
    }
}

fn differs(cycle: u64, theirs: u64, ours: u64) -> Error {
    Error::Message(format!("cycle {cycle} follows plan {theirs:016x}, in force is {ours:016x}"))
}

impl Drop for Links {
    fn drop(&mut self) {
        self.leave("the master is gone");
    }
}
