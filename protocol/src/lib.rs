//! What is said between master, workers, clients and peers, and how bytes carry it.
//!
//! From the wire upward: [`frame`] is the header that every message starts with and the bounds that
//! are checked before anything is allocated; [`codec`] turns values and arrays into payloads and cuts
//! large messages into chunks; [`link`] carries frames both ways over any byte stream without one
//! direction waiting for the other; [`order`] keeps control messages in order over it; [`memory`] carries it within one machine; [`handshake`] says who is at the other end; [`tls`] proves it, and a [`token`] brings a newcomer there. [`message`] and
//! [`wire`] are what master and workers say in a run, [`phase`] how workers report on their time, [`request`] what clients
//! ask and [`options`] what they ask of a run, [`dial`] how to call; [`shape`] makes a stream as slow as an emulated wire.
//!
//! Nothing here knows what a cycle computes: a link moves frames and ends with one [`Error`] value when
//! the peer breaks a rule. No input from a peer reaches a panic.

pub mod codec;
pub mod dial;
pub mod frame;
pub mod handshake;
pub mod link;
pub mod memory;
pub mod message;
pub mod options;
pub mod order;
pub mod phase;
pub mod request;
pub mod shape;
pub mod tls;
pub mod token;
pub mod wire;

use frame::Kind;
use std::fmt;

/// The result of everything in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Why bytes, a message, a connection or a certificate were refused.
///
/// Every variant ends the connection it concerns and nothing else. The text is one lower-case line that
/// names both values and, where there is something to do, what to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// The first four bytes of a frame are not [`frame::MAGIC`].
    Magic {
        /// The bytes found.
        found: [u8; 4],
    },
    /// The frame was laid out by another version of this crate.
    FrameVersion {
        /// The version in the frame.
        theirs: u16,
        /// [`frame::VERSION`].
        ours: u16,
    },
    /// A header's bytes do not give the checksum it carries.
    HeaderChecksum {
        /// The CRC-32C in the header.
        stated: u32,
        /// The CRC-32C of the header's bytes.
        computed: u32,
    },
    /// A payload's bytes do not give the checksum in its header.
    PayloadChecksum {
        /// The frame's kind.
        kind: Kind,
        /// The CRC-32C in the header.
        stated: u32,
        /// The CRC-32C of the payload.
        computed: u32,
    },
    /// A kind byte that this version does not know.
    Kind {
        /// The byte found.
        found: u8,
    },
    /// A frame of a kind that may not come now.
    Unexpected {
        /// The kind that came.
        found: Kind,
        /// What was awaited, in words.
        expected: &'static str,
    },
    /// A length beyond its limit; nothing was allocated for it.
    TooLong {
        /// What is too long.
        what: &'static str,
        /// Its length, bytes or items.
        length: u64,
        /// The limit, in the same unit.
        limit: u64,
    },
    /// Fewer bytes than the message needs.
    Truncated {
        /// What was being read.
        what: &'static str,
        /// Bytes at hand.
        found: u64,
        /// Bytes needed.
        needed: u64,
    },
    /// Bytes after the end of a message.
    Trailing {
        /// Bytes the message took.
        used: u64,
        /// Bytes there were.
        found: u64,
    },
    /// An array whose bytes are no whole number of elements, or not the agreed number.
    ArrayLength {
        /// Bytes found.
        found: u64,
        /// Bytes expected; the size of one element where the count is free.
        expected: u64,
    },
    /// A control message that does not decode, or that says what it may not say.
    Message(String),
    /// A floating-point number in a control message that is infinite or not a number.
    NotFinite {
        /// The name of the number.
        what: String,
        value: f64,
    },
    /// A chunk that does not continue its stream.
    Chunk {
        stream: u64,
        /// What is wrong with it, naming both values.
        why: String,
    },
    /// A queue toward a peer is full: the peer does not read, or is sent more than it was promised.
    QueueFull {
        queue: &'static str,
        /// What it would have held, frames or bytes.
        length: u64,
        /// Its limit, in the same unit.
        limit: u64,
    },
    /// The peer sent no byte for too long.
    Silent {
        /// Milliseconds since the last byte.
        after_ms: u64,
        /// Milliseconds allowed.
        limit_ms: u64,
    },
    /// The connection is closed: the peer ended it between two frames, or this side did.
    Closed,
    /// The peer refused the handshake.
    Refused {
        /// The peer's reason.
        reason: String,
    },
    /// The peer ended the connection on purpose.
    Left {
        /// The peer's reason.
        reason: String,
    },
    /// A handshake event that the state does not allow.
    State {
        /// The state of the handshake.
        state: &'static str,
        /// What was asked of it.
        event: &'static str,
    },
    /// The operating system or the network failed.
    Io {
        /// What was being done.
        doing: String,
        /// The class of failure.
        kind: std::io::ErrorKind,
        /// The system's words.
        why: String,
    },
    /// A certificate or key that cannot be used, or a peer's that is not accepted.
    Certificate(String),
    /// An address that may not be used without certificates.
    Address { address: std::net::SocketAddr },
}

impl Error {
    /// Wraps a failure of the operating system, with what was being done.
    ///
    /// A TLS fault inside `error` is put into the words of [`tls::explain`].
    pub fn io(doing: impl Into<String>, error: &std::io::Error) -> Self {
        Self::Io { doing: doing.into(), kind: error.kind(), why: tls::explain(error) }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic { found: [first, second, ..] } if tls::begins([*first, *second]) => f.write_str(
                "the peer speaks TLS, and this side has no certificates: give --certs FOLDER, as `bolide certs host` makes it",
            ),
            Self::Magic { found } => write!(
                f,
                "frame starts with {found:02x?}, expected {:02x?}; the peer is not a bolide",
                frame::MAGIC
            ),
            Self::FrameVersion { theirs, ours } => {
                write!(f, "frame version {theirs}, this side speaks {ours}; install the same release on both")
            }
            Self::HeaderChecksum { stated, computed } => {
                write!(f, "frame header: checksum {stated:08x} stated, {computed:08x} computed")
            }
            Self::PayloadChecksum { kind, stated, computed } => {
                write!(f, "{kind} frame: payload checksum {stated:08x} stated, {computed:08x} computed")
            }
            Self::Kind { found } => {
                write!(f, "frame kind {found}, this side knows 1 to {}", Kind::ALL.len())
            }
            Self::Unexpected { found, expected } => write!(f, "{found} frame, expected {expected}"),
            Self::TooLong { what, length, limit } => write!(f, "{what}: length {length}, limit {limit}"),
            Self::Truncated { what, found, needed } => {
                write!(f, "{what}: ended after {found} bytes, needs {needed}")
            }
            Self::Trailing { used, found } => write!(f, "message of {used} bytes in a payload of {found}"),
            Self::ArrayLength { found, expected } => {
                write!(f, "array of {found} bytes, expected {expected} or a multiple")
            }
            Self::Message(why) => write!(f, "control message: {why}"),
            Self::NotFinite { what, value } => write!(f, "{what} is {value}, must be a finite number"),
            Self::Chunk { stream, why } => write!(f, "bulk stream {stream}: {why}"),
            Self::QueueFull { queue, length, limit } => {
                write!(
                    f,
                    "{queue} toward the peer would hold {length}, limit {limit}; the peer does not read"
                )
            }
            Self::Silent { after_ms, limit_ms } => {
                write!(f, "no byte from the peer for {after_ms} ms, limit {limit_ms} ms")
            }
            Self::Closed => f.write_str("connection closed"),
            Self::Refused { reason } => write!(f, "refused by the peer: {reason}"),
            Self::Left { reason } => write!(f, "the peer left: {reason}"),
            Self::State { state, event } => write!(f, "handshake is {state}, which does not allow {event}"),
            Self::Io { doing, why, .. } => write!(f, "{doing}: {why}"),
            Self::Certificate(why) => f.write_str(why),
            Self::Address { address } => write!(
                f,
                "address {address} is not a loopback address (127.0.0.0/8 or ::1) and there are no \
                 certificates; make some with `bolide certs` and name their folder, or listen on 127.0.0.1"
            ),
        }
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_in_tls_is_told_as_such() {
        for found in [[0x15, 3, 3, 0], [0x16, 3, 1, 2]] {
            assert!(Error::Magic { found }.to_string().contains("speaks TLS"), "{found:?}");
        }
        assert!(Error::Magic { found: *b"HTTP" }.to_string().ends_with("is not a bolide"));
    }
}
