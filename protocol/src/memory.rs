//! MEMORY: what a link between two processes of one machine may use in place of TCP.
//!
//! Two processes that have greeted each other over TCP (with TLS where there are certificates) may go on over memory that
//! both have mapped: two [rings](ring) of bytes, one in each direction, which carry the same frames. The TCP connection
//! stays: a byte on it wakes whoever sleeps, and its end is the end of the link ([`stream`]).
//!
//! The dialling side says in its [`Hello`](crate::handshake::Hello) between which addresses it sees the connection. If the listening side sees the same
//! ([`Near`]) nothing stands between them, and both are on one machine. It then makes the memory and offers it in its Welcome: by
//! the number of its process, that of the file, and a secret that stands in the memory. The caller opens it and says in a
//! frame of kind *memory* whether it could; that is its last frame over TCP, if so. The listening side repeats the answer, over
//! the new way. Whatever fails on either side is an answer of no, and the link stays on TCP.

pub mod ring;
mod stream;

pub use stream::{Reading, Writing};

use std::{
    io,
    net::SocketAddr,
    sync::{Arc, atomic::Ordering::Relaxed},
};

use serde::{Deserialize, Serialize};
use system::shared::{self, Made, Shared};

use crate::{Error, Result, link::Socket, tls};
use ring::{Consumer, Direction, Producer};
use stream::Bell;

/// Bytes of such memory: two rings behind their indices.
pub const BYTES: usize = ring::START + 2 * ring::BYTES;

/// The secret's place.
const SECRET: [usize; 2] = [0, 8];

/// A connection as one side sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ends {
    ours: SocketAddr,
    theirs: SocketAddr,
}

impl Ends {
    fn new(ours: SocketAddr, theirs: SocketAddr) -> Self {
        let plain = |address: SocketAddr| SocketAddr::new(address.ip().to_canonical(), address.port());
        Self { ours: plain(ours), theirs: plain(theirs) }
    }

    /// Whether both are on one machine, as far as addresses tell: a tunnel may begin here.
    fn are_near(self) -> bool {
        self.theirs.ip().is_loopback() || self.theirs.ip() == self.ours.ip()
    }

    /// The same connection from its other end.
    const fn turned(self) -> Self {
        Self { ours: self.theirs, theirs: self.ours }
    }
}

/// Where memory is, and what stands in it. Part of a Welcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Offer {
    /// The id of the process that has made it.
    pub process: u32,
    /// Its number in that process.
    pub number: u32,
    pub secret: [u64; 2],
}

/// A connection within this machine, besides the link that it carries.
pub struct Near {
    socket: socket2::Socket,
    ends: Ends,
}

/// The two halves of a stream over memory.
pub type Halves = (Reading, Writing);

impl Near {
    /// None for a connection to another machine, or where the system has no memory to share.
    pub fn of(socket: &Socket) -> Option<Self> {
        if !shared::IS_THERE {
            return None;
        }
        let ends = Ends::new(socket.local_addr().ok()?, socket.peer_addr().ok()?);
        let another = || Some(Self { socket: socket.another().ok()?, ends });
        ends.are_near().then(another).flatten()
    }

    /// What the greeting says of it.
    pub const fn ends(&self) -> Ends {
        self.ends
    }

    /// Whether a caller that sees this connection so has nothing between it and this side.
    pub fn is_from(&self, theirs: Option<Ends>) -> bool {
        theirs == Some(self.ends.turned())
    }

    /// Listening side: makes memory.
    ///
    /// # Errors
    /// [`Error::Io`] if the system gives none.
    pub fn make(self) -> Result<Offered> {
        let fault = |error: io::Error| Error::io("making memory to share", &error);
        let made = shared::make(BYTES).map_err(fault)?;
        let secret = u128::from_le_bytes(tls::secret()?);
        let secret = [secret as u64, (secret >> 64) as u64];
        for (at, word) in SECRET.into_iter().zip(secret) {
            made.shared.number(at).store(word, Relaxed);
        }
        let offer = Offer { process: std::process::id(), number: made.number(), secret };
        Ok(Offered { made, offer, near: self })
    }

    /// Dialling side: opens what was offered.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be opened, [`Error::Message`] if it is not the memory that was meant.
    pub fn open(self, offer: &Offer) -> Result<Halves> {
        let fault = |error: io::Error| Error::io("opening memory to share", &error);
        let memory = shared::open(offer.process, offer.number, BYTES).map_err(fault)?;
        let differ = SECRET.into_iter().zip(offer.secret);
        let differ = differ.fold(0, |differ, (at, word)| differ | (memory.number(at).load(Relaxed) ^ word));
        if differ != 0 {
            return Err(Error::Message("the memory that opens is not the one that was offered".into()));
        }
        self.halves(memory, [Direction::Back, Direction::There]).map_err(fault)
    }

    /// Reads from the first and writes to the second.
    fn halves(self, memory: Shared, [read, write]: [Direction; 2]) -> io::Result<Halves> {
        let memory = Arc::new(memory);
        let bell = Arc::new(Bell::new(self.socket)?);
        let reading = Reading::new(Consumer::new(Arc::clone(&memory), read), Arc::clone(&bell));
        Ok((reading, Writing::new(Producer::new(memory, write), bell)))
    }
}

/// Memory that the other side has not opened yet.
pub struct Offered {
    made: Made,
    offer: Offer,
    near: Near,
}

impl Offered {
    pub const fn offer(&self) -> Offer {
        self.offer
    }

    /// The other side has opened it.
    ///
    /// # Errors
    /// [`Error::Io`] if the runtime does not take the connection.
    pub fn halves(self) -> Result<Halves> {
        let halves = self.near.halves(self.made.shared, [Direction::There, Direction::Back]);
        halves.map_err(|error| Error::io("waiting on a connection", &error))
    }
}
