//! ORDER: control messages are taken in the order they were sent, whichever way they went.
//!
//! A short control message travels in a frame of its own, a long one in bulk, which every other frame overtakes. So
//! each is numbered by its sender ([`Outbox`]), and its receiver ([`Inbox`]) hands them out by number. Frames of
//! cycles have no such number: they keep their own order, and overtake bulk on purpose.

use std::collections::{BTreeMap, VecDeque};

use crate::{
    Error, Result,
    codec::{Assembler, MESSAGE_LIMIT, OPEN_STREAMS},
    frame::{Frame, Header, Kind},
    handshake,
    link::Sender,
    wire::Packed,
};

/// Most bytes of bulk messages that are on their way to one side at a time.
pub const BULK_ON_THE_WAY: u64 = 2 * MESSAGE_LIMIT as u64;
/// Most control messages that may wait for one sent before them.
pub const WAITING_LIMIT: usize = 1024;
/// Most bytes of those messages.
pub const WAITING_BYTES: usize = MESSAGE_LIMIT;
/// The same from a client, which sends one request and waits for its answer.
pub const WAITING_BYTES_OF_A_CLIENT: usize = 64 << 10;

/// What the frames of a message say about the run it belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The job; 0 outside of one.
    pub job: u32,
    /// How often the job went back to a snapshot.
    pub epoch: u32,
    /// Hash of the exchange plan in force; 0 where none is.
    pub plan: u64,
}

/// The sending side of one connection after its greeting.
pub struct Outbox {
    sender: Sender,
    incarnation: u32,
    next: u32,
}

impl Outbox {
    /// Sends through `sender`, in the name of `incarnation` (0 for the side that listens).
    pub const fn new(sender: Sender, incarnation: u32) -> Self {
        Self { sender, incarnation, next: 0 }
    }

    /// Queues a message and returns at once.
    ///
    /// # Errors
    /// What [`Sender::send`] and [`Sender::send_bulk`] give.
    pub fn send(&mut self, place: Place, packed: Packed) -> Result<()> {
        let header = Header {
            job: place.job,
            epoch: place.epoch,
            plan: place.plan,
            incarnation: self.incarnation,
            cycle: packed.cycle,
            ..Header::new(packed.kind)
        };
        if packed.kind != Kind::Control {
            return self.sender.send(Frame::new(header, packed.bytes));
        }
        let number = self.number()?;
        if packed.goes_in_bulk() {
            self.sender.send_bulk(header, u64::from(number), packed.bytes)
        } else {
            self.sender.send(Frame::new(Header { sequence: number, ..header }, packed.bytes))
        }
    }

    /// Queues a control message that is made when its turn comes ([`Sender::send_bulk_later`]), and returns at once. It keeps its place
    /// among the others.
    ///
    /// # Errors
    /// What [`Sender::send_bulk_later`] gives.
    pub fn send_later(
        &mut self,
        place: Place,
        make: impl FnOnce() -> Result<Packed> + Send + 'static,
    ) -> Result<()> {
        let Place { job, epoch, plan } = place;
        let incarnation = self.incarnation;
        let header = Header { job, epoch, plan, incarnation, ..Header::new(Kind::Control) };
        let number = self.number()?;
        self.sender.send_bulk_later(header, u64::from(number), Box::new(|| make().map(|packed| packed.bytes)))
    }

    fn number(&mut self) -> Result<u32> {
        let number = self.next;
        self.next = number
            .checked_add(1)
            .ok_or_else(|| Error::Message("2^32 control messages on one link".into()))?;
        Ok(number)
    }

    /// The link underneath.
    pub const fn sender(&self) -> &Sender {
        &self.sender
    }
}

/// A message that has come whole.
#[derive(Debug, PartialEq, Eq)]
pub struct Letter {
    /// Of its only or first frame; a long control message has [`Kind::Control`] here as well.
    pub header: Header,
    /// The payload.
    pub bytes: Vec<u8>,
}

/// The receiving side of one connection after its greeting.
///
/// Invariant: every control message numbered below `next` has been handed out or stands in `ready`.
pub struct Inbox {
    incarnation: u32,
    assembler: Assembler,
    next: u32,
    waiting: BTreeMap<u32, Letter>,
    waiting_bytes: usize,
    waiting_limit: usize,
    ready: VecDeque<Letter>,
}

impl Inbox {
    /// Takes frames of `incarnation` (0 of the side that listens), and bulk of at most `bulk_bytes` at a time.
    pub const fn new(incarnation: u32, bulk_bytes: u64) -> Self {
        Self {
            incarnation,
            assembler: Assembler::new(bulk_bytes, OPEN_STREAMS),
            next: 0,
            waiting: BTreeMap::new(),
            waiting_bytes: 0,
            waiting_limit: WAITING_BYTES,
            ready: VecDeque::new(),
        }
    }

    /// Has control messages that wait for others take no more bytes.
    #[must_use]
    pub const fn with_waiting_limit(mut self, bytes: usize) -> Self {
        self.waiting_limit = bytes;
        self
    }

    /// Takes the next frame of the link; [`Inbox::take`] gives what is whole with it.
    ///
    /// # Errors
    /// [`Error::Left`] with the peer's reason when it ends the connection; [`Error::Message`] for a frame of another
    /// incarnation or a number that was used before; [`Error::TooLong`] where too much waits; what
    /// [`Assembler::accept`] gives; [`Error::Unexpected`] for a frame of a greeting. The connection should then end.
    pub fn accept(&mut self, frame: Frame) -> Result<()> {
        let header = frame.header;
        if header.kind == Kind::Bye {
            return Err(Error::Left { reason: handshake::reason(&frame)? });
        }
        if header.incarnation != self.incarnation {
            return Err(Error::Message(format!(
                "{} frame of incarnation {}, this connection is {}",
                header.kind, header.incarnation, self.incarnation
            )));
        }
        match header.kind {
            Kind::Cycle | Kind::Totals => {
                self.ready.push_back(Letter { header, bytes: frame.payload });
                Ok(())
            }
            Kind::Control => self.control(header.sequence, Letter { header, bytes: frame.payload }),
            Kind::Bulk => {
                let Some(message) = self.assembler.accept(&frame)? else { return Ok(()) };
                let number = u32::try_from(message.stream).map_err(|_| Error::Chunk {
                    stream: message.stream,
                    why: "its number is over 2^32".into(),
                })?;
                let header = Header { kind: Kind::Control, ..message.header };
                self.control(number, Letter { header, bytes: message.bytes })
            }
            found => Err(Error::Unexpected { found, expected: "control, cycle, totals, bulk or bye" }),
        }
    }

    /// The next message, oldest first.
    pub fn take(&mut self) -> Option<Letter> {
        self.ready.pop_front()
    }

    fn control(&mut self, number: u32, letter: Letter) -> Result<()> {
        if number < self.next || self.waiting.contains_key(&number) {
            return Err(Error::Message(format!("number {number} a second time, next is {}", self.next)));
        }
        self.waiting_bytes += letter.bytes.len();
        self.waiting.insert(number, letter);
        while let Some(letter) = self.waiting.remove(&self.next) {
            self.waiting_bytes -= letter.bytes.len();
            self.ready.push_back(letter);
            self.next += 1;
        }
        let (letters, bytes) = (self.waiting.len(), self.waiting_bytes);
        if letters > WAITING_LIMIT || bytes > self.waiting_limit {
            let (what, length, limit) = if letters > WAITING_LIMIT {
                ("control messages out of order", letters as u64, WAITING_LIMIT as u64)
            } else {
                ("bytes of control messages out of order", bytes as u64, self.waiting_limit as u64)
            };
            return Err(Error::TooLong { what, length, limit });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::CONTROL_LIMIT;
    use crate::link::{Settings, split};

    fn control(bytes: Vec<u8>) -> Packed {
        Packed { kind: Kind::Control, cycle: 0, bytes }
    }

    #[tokio::test]
    async fn a_short_message_waits_for_a_long_one_sent_before_it_and_cycles_do_not() {
        let (near, far) = tokio::io::duplex(4096);
        let (sender, _kept) = split(near, Settings::default());
        let (_answer, mut receiver) = split(far, Settings::default());
        let mut outbox = Outbox::new(sender, 7);
        let long = vec![3; CONTROL_LIMIT as usize + 1];
        let place = Place { job: 4, epoch: 0, plan: 9 };
        outbox.send(place, control(long.clone())).expect("room");
        outbox.send(place, control(vec![1])).expect("room");
        outbox.send(place, Packed { kind: Kind::Cycle, cycle: 5, bytes: vec![2] }).expect("room");
        let mut inbox = Inbox::new(7, BULK_ON_THE_WAY);
        let mut letters = Vec::new();
        while letters.len() < 3 {
            inbox.accept(receiver.receive().await.expect("a frame")).expect("in order");
            while let Some(letter) = inbox.take() {
                letters.push(letter);
            }
        }
        assert_eq!((letters[0].header.kind, letters[0].header.cycle), (Kind::Cycle, 5));
        assert!(letters.iter().all(|l| (l.header.job, l.header.plan) == (4, 9)));
        assert_eq!((letters[1].header.kind, &letters[1].bytes), (Kind::Control, &long));
        assert_eq!(letters[2].bytes, [1]);
    }

    #[tokio::test]
    async fn messages_made_later_keep_their_place_and_are_made_as_their_turn_comes() {
        use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
        let (near, far) = tokio::io::duplex(4096);
        let (sender, _kept) = split(near, Settings::default());
        let (_answer, mut receiver) = split(far, Settings::default());
        let mut outbox = Outbox::new(sender, 7);
        let made = std::sync::Arc::new(AtomicUsize::new(0));
        let length = 10 * CONTROL_LIMIT as usize;
        outbox.send(Place::default(), control(vec![100])).expect("room");
        for number in 0..10 {
            let made = std::sync::Arc::clone(&made);
            let make = move || {
                assert_eq!(made.fetch_add(1, SeqCst), usize::from(number), "one after another");
                Ok(control(vec![number; length]))
            };
            outbox.send_later(Place::default(), make).expect("room");
        }
        outbox.send(Place::default(), control(vec![101])).expect("room");
        let mut inbox = Inbox::new(7, BULK_ON_THE_WAY);
        let mut firsts = Vec::new();
        while firsts.len() < 12 {
            inbox.accept(receiver.receive().await.expect("a frame")).expect("in order");
            while let Some(letter) = inbox.take() {
                assert!(letter.bytes.len() == 1 || letter.bytes.len() == length);
                firsts.push(letter.bytes[0]);
                // At most one is on its way and one more is made.
                let made = made.load(SeqCst);
                assert!(made < firsts.len() + 2, "{made} are made before {} have come", firsts.len());
            }
        }
        assert_eq!(firsts, [100, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 101]);
    }

    #[tokio::test]
    async fn what_cannot_be_made_ends_the_link_with_its_reason() {
        let (near, _far) = tokio::io::duplex(4096);
        let (sender, _kept) = split(near, Settings::default());
        let mut outbox = Outbox::new(sender.clone(), 7);
        let too_long = Error::TooLong { what: "message", length: 9, limit: 8 };
        let make = move || Err(too_long);
        outbox.send_later(Place::default(), make).expect("room");
        sender.ended().await;
        let ended = sender.send(Frame::new(Header::new(Kind::Control), Vec::new())).expect_err("over");
        assert_eq!(ended.to_string(), "message: length 9, limit 8");
    }

    #[test]
    fn what_a_client_sends_out_of_order_is_bounded() {
        let mut inbox = Inbox::new(2, 100).with_waiting_limit(WAITING_BYTES_OF_A_CLIENT);
        let frame = |sequence| {
            let header = Header { incarnation: 2, sequence, ..Header::new(Kind::Control) };
            Frame::new(header, vec![0; CONTROL_LIMIT as usize])
        };
        let taken = (1..100).take_while(|&number| inbox.accept(frame(number)).is_ok()).count();
        assert_eq!(taken, WAITING_BYTES_OF_A_CLIENT / CONTROL_LIMIT as usize);
    }

    #[test]
    fn a_number_is_taken_once_and_from_its_own_incarnation() {
        let mut inbox = Inbox::new(2, 100);
        let frame = |incarnation, sequence| {
            Frame::new(Header { incarnation, sequence, ..Header::new(Kind::Control) }, vec![0])
        };
        assert!(inbox.accept(frame(2, 1)).is_ok());
        assert_eq!(inbox.take(), None, "number 0 is still to come");
        assert!(inbox.accept(frame(2, 1)).is_err());
        assert!(inbox.accept(frame(2, 0)).is_ok());
        assert_eq!((inbox.take().is_some(), inbox.take().is_some(), inbox.take()), (true, true, None));
        assert!(inbox.accept(frame(2, 0)).is_err());
        let error = inbox.accept(frame(1, 2)).expect_err("another incarnation").to_string();
        assert!(error.contains("incarnation 1, this connection is 2"), "{error}");
    }
}
