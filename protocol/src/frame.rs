//! The frame: the header that every message starts with, and the bounds checked before allocation.
//!
//! A frame is [`HEADER_LEN`] bytes of header, all integers little-endian, and `length` bytes of payload:
//!
//! | offset | field | |
//! |---|---|---|
//! | 0 | magic | `BLDE` |
//! | 4 | version u16 | of this layout |
//! | 6 | kind u8 | who reads the payload, and its limit |
//! | 7 | flags u8 | meaning belongs to the kind |
//! | 8 | length u32 | bytes of payload |
//! | 12 | job u32 | |
//! | 16 | epoch u32 | grows when a worker is lost |
//! | 20 | incarnation u32 | of the sender, given by the master |
//! | 24 | cycle u64 | |
//! | 32 | plan u64 | hash of the exchange plan |
//! | 40 | sequence u32 | number within a stream |
//! | 44 | crc u32 | CRC-32C of the payload |
//! | 48 | header crc u32 | CRC-32C of the 48 bytes before |
//!
//! The header has a checksum of its own, so that a damaged length is refused at once instead of being
//! waited for. As the header's checksum covers the payload's, the two bind header and payload together.
//! What a payload means is not known here.

use crate::{Error, Result};
use crc_fast::{CrcAlgorithm, Digest};
use std::fmt;

/// The first four bytes of every frame.
pub const MAGIC: [u8; 4] = *b"BLDE";

/// The version of the layout above. 1: the first.
pub const VERSION: u16 = 1;

/// Bytes of a header.
pub const HEADER_LEN: usize = 52;

/// Most bytes of a greeting: a name, a list of lanes and a token fit many times.
pub const HELLO_LIMIT: u32 = 4 << 10;
/// Most bytes of a Welcome.
pub const WELCOME_LIMIT: u32 = 1 << 10;
/// Most bytes of a reason, in Refuse and Bye.
pub const REASON_LIMIT: u32 = 4 << 10;
/// Most bytes of a control message; what is larger travels in bulk.
pub const CONTROL_LIMIT: u32 = 1 << 20;
/// Most bytes of a cycle or totals frame: 2.8 million shared nodes with three components each.
pub const CYCLE_LIMIT: u32 = 64 << 20;
/// Bytes of message in one bulk chunk; only the last chunk of a message is shorter.
pub const CHUNK: usize = 64 << 10;
/// Bytes before the message in a bulk payload: stream u64, total length u64.
pub const CHUNK_PREFIX: usize = 16;
/// Most bytes of a bulk payload.
pub const BULK_LIMIT: u32 = (CHUNK + CHUNK_PREFIX) as u32;

/// What a frame carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Kind {
    /// Dialling side, first frame: who is calling. Answered by Welcome or Refuse.
    Hello = 1,
    /// Listening side: the caller is taken, and this is its place.
    Welcome = 2,
    /// Listening side: the caller is not taken, with the reason; the connection then ends.
    Refuse = 3,
    /// Either side, any time after Welcome: a control message.
    Control = 4,
    /// Worker, once a cycle: partial forces of shared nodes and the votes, as packed arrays.
    Cycle = 5,
    /// Master, once a cycle: total forces and what was decided, as packed arrays.
    Totals = 6,
    /// Either side: one chunk of a large message; every other kind may overtake it.
    Bulk = 7,
    /// Either side, when it has had nothing to say for an interval. Not answered.
    Heartbeat = 8,
    /// Either side, last frame: the connection ends on purpose, with the reason.
    Bye = 9,
    /// Dialling side, after a Welcome that offers memory: whether the link goes on over it. The listening side repeats it.
    Memory = 10,
}

impl Kind {
    /// Every kind, in the order of its number, which starts at 1.
    pub const ALL: [Self; 10] = [
        Self::Hello,
        Self::Welcome,
        Self::Refuse,
        Self::Control,
        Self::Cycle,
        Self::Totals,
        Self::Bulk,
        Self::Heartbeat,
        Self::Bye,
        Self::Memory,
    ];

    /// The kind with the number `byte`.
    ///
    /// # Errors
    /// [`Error::Kind`] for a number that no kind has.
    pub fn from_byte(byte: u8) -> Result<Self> {
        let index = usize::from(byte).wrapping_sub(1);
        Self::ALL.get(index).copied().ok_or(Error::Kind { found: byte })
    }

    /// The most bytes a payload of this kind may have.
    pub const fn limit(self) -> u32 {
        match self {
            Self::Hello => HELLO_LIMIT,
            Self::Welcome => WELCOME_LIMIT,
            Self::Refuse | Self::Bye => REASON_LIMIT,
            Self::Control => CONTROL_LIMIT,
            Self::Cycle | Self::Totals => CYCLE_LIMIT,
            Self::Bulk => BULK_LIMIT,
            Self::Heartbeat => 0,
            Self::Memory => 1,
        }
    }

    /// The name of the kind, as errors and logs print it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hello => "hello",
            Self::Welcome => "welcome",
            Self::Refuse => "refuse",
            Self::Control => "control",
            Self::Cycle => "cycle",
            Self::Totals => "totals",
            Self::Bulk => "bulk",
            Self::Heartbeat => "heartbeat",
            Self::Bye => "bye",
            Self::Memory => "memory",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The head of a frame, without magic, version and its own checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// What the payload is.
    pub kind: Kind,
    /// Bits whose meaning belongs to the kind; zero where the kind gives none.
    pub flags: u8,
    /// Bytes of payload; set by [`Frame::seal`].
    pub length: u32,
    /// The job the frame belongs to; 0 where it belongs to none.
    pub job: u32,
    /// The epoch of the job: the number of times it went back to a snapshot.
    pub epoch: u32,
    /// The incarnation of the sender, as Welcome gave it; 0 before.
    pub incarnation: u32,
    /// The cycle the frame speaks of.
    pub cycle: u64,
    /// The hash of the exchange plan that gives packed arrays their meaning; 0 for other kinds.
    pub plan: u64,
    /// The number of the frame within its stream; of a bulk frame, the chunk's number from 0.
    pub sequence: u32,
    /// CRC-32C of the payload; set by [`Frame::seal`].
    pub crc: u32,
}

impl Header {
    /// A header of `kind` with every other field zero.
    pub const fn new(kind: Kind) -> Self {
        Self {
            kind,
            flags: 0,
            length: 0,
            job: 0,
            epoch: 0,
            incarnation: 0,
            cycle: 0,
            plan: 0,
            sequence: 0,
            crc: 0,
        }
    }
}

/// One message as a link carries it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Who, when, what.
    pub header: Header,
    /// At most [`Kind::limit`] bytes.
    pub payload: Vec<u8>,
}

impl Frame {
    /// A frame of `payload` under `header`; length and checksum are the link's to fill in.
    pub const fn new(header: Header, payload: Vec<u8>) -> Self {
        Self { header, payload }
    }

    /// Fills in length and checksum from the payload.
    ///
    /// # Errors
    /// [`Error::TooLong`] when the payload is over the limit of its kind.
    pub fn seal(&mut self) -> Result<()> {
        self.header.length = checked_length(self.header.kind, self.payload.len() as u64)?;
        self.header.crc = crc_fast::crc32_iscsi(&self.payload);
        Ok(())
    }

    /// Compares the payload with the length and the checksum in the header.
    ///
    /// # Errors
    /// [`Error::Truncated`] or [`Error::Trailing`] for a payload of another length,
    /// [`Error::PayloadChecksum`] for other bytes.
    pub fn verify(&self) -> Result<()> {
        self.verify_as(crc_fast::crc32_iscsi(&self.payload))
    }

    /// The same, where the checksum of the payload has been computed while it came.
    pub(crate) fn verify_as(&self, computed: u32) -> Result<()> {
        let (found, needed) = (self.payload.len() as u64, u64::from(self.header.length));
        if found < needed {
            return Err(Error::Truncated { what: self.header.kind.name(), found, needed });
        }
        if found > needed {
            return Err(Error::Trailing { used: needed, found });
        }
        if computed != self.header.crc {
            return Err(Error::PayloadChecksum { kind: self.header.kind, stated: self.header.crc, computed });
        }
        Ok(())
    }
}

/// The CRC-32C of a payload that comes in pieces, each looked at while it is still in the cache.
pub(crate) struct Checksum {
    /// The register, before its last inversion.
    state: u64,
}

impl Checksum {
    /// Of no bytes.
    pub(crate) const fn new() -> Self {
        Self { state: 0xffff_ffff }
    }

    /// Goes on with `bytes`.
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        let mut digest = Digest::new_with_init_state(CrcAlgorithm::Crc32Iscsi, self.state);
        digest.update(bytes);
        self.state = digest.get_state();
    }

    /// The checksum of all bytes so far.
    pub(crate) const fn value(&self) -> u32 {
        !(self.state as u32)
    }
}

/// `length` as a header holds it, if `kind` allows that many bytes.
///
/// # Errors
/// [`Error::TooLong`] over the limit.
pub fn checked_length(kind: Kind, length: u64) -> Result<u32> {
    match u32::try_from(length) {
        Ok(short) if short <= kind.limit() => Ok(short),
        _ => Err(Error::TooLong { what: kind.name(), length, limit: u64::from(kind.limit()) }),
    }
}

/// The bytes of `header`, with magic, version and the header's checksum.
pub fn encode_header(header: &Header) -> [u8; HEADER_LEN] {
    let mut bytes = [0; HEADER_LEN];
    bytes[0..4].copy_from_slice(&MAGIC);
    bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
    bytes[6] = header.kind as u8;
    bytes[7] = header.flags;
    bytes[8..12].copy_from_slice(&header.length.to_le_bytes());
    bytes[12..16].copy_from_slice(&header.job.to_le_bytes());
    bytes[16..20].copy_from_slice(&header.epoch.to_le_bytes());
    bytes[20..24].copy_from_slice(&header.incarnation.to_le_bytes());
    bytes[24..32].copy_from_slice(&header.cycle.to_le_bytes());
    bytes[32..40].copy_from_slice(&header.plan.to_le_bytes());
    bytes[40..44].copy_from_slice(&header.sequence.to_le_bytes());
    bytes[44..48].copy_from_slice(&header.crc.to_le_bytes());
    let crc = crc_fast::crc32_iscsi(&bytes[..48]);
    bytes[48..52].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Reads a header and bounds its length by the limit of its kind; allocates nothing.
///
/// Magic and version come first, because another version may lay out the rest in another way.
///
/// # Errors
/// [`Error::Magic`], [`Error::FrameVersion`], [`Error::HeaderChecksum`], [`Error::Kind`] or
/// [`Error::TooLong`].
pub fn decode_header(bytes: &[u8; HEADER_LEN]) -> Result<Header> {
    let found = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if found != MAGIC {
        return Err(Error::Magic { found });
    }
    let theirs = u16::from_le_bytes([bytes[4], bytes[5]]);
    if theirs != VERSION {
        return Err(Error::FrameVersion { theirs, ours: VERSION });
    }
    let (stated, computed) = (u32_at(bytes, 48), crc_fast::crc32_iscsi(&bytes[..48]));
    if stated != computed {
        return Err(Error::HeaderChecksum { stated, computed });
    }
    let kind = Kind::from_byte(bytes[6])?;
    Ok(Header {
        kind,
        flags: bytes[7],
        length: checked_length(kind, u64::from(u32_at(bytes, 8)))?,
        job: u32_at(bytes, 12),
        epoch: u32_at(bytes, 16),
        incarnation: u32_at(bytes, 20),
        cycle: u64_at(bytes, 24),
        plan: u64_at(bytes, 32),
        sequence: u32_at(bytes, 40),
        crc: u32_at(bytes, 44),
    })
}

fn u32_at(bytes: &[u8; HEADER_LEN], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn u64_at(bytes: &[u8; HEADER_LEN], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}
