//! Messages of a run as payloads, and back.
//!
//! Large arrays (partial forces, totals, positions, states of ghosts) follow a small bincode head as raw little-endian
//! `f64`; everything else is bincode throughout.

use mechanics::{contact::PlacedPatch, vote::Vote};
use serde::{Deserialize, Serialize};

use crate::{
    Error, Result,
    codec::{self, MESSAGE_LIMIT},
    frame::{CHUNK, CHUNK_PREFIX, CONTROL_LIMIT, HEADER_LEN, Kind},
    message::{Aboard, BranchVote, Orders, Said, Shares, ToMaster, ToPeer, ToWorker, Work},
};

/// A message ready to be framed.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// [`Kind::Cycle`], [`Kind::Totals`] or [`Kind::Control`]; a control message too long for one frame goes in bulk.
    pub kind: Kind,
    /// The cycle it belongs to, for the header; 0 outside cycles.
    pub cycle: u64,
    /// The payload.
    pub bytes: Vec<u8>,
}

/// Bytes on the wire of a control message of `n` bytes, headers included.
fn control_bytes(n: u64) -> u64 {
    if n > u64::from(CONTROL_LIMIT) {
        n + n.div_ceil(CHUNK as u64) * (HEADER_LEN + CHUNK_PREFIX) as u64
    } else {
        n + HEADER_LEN as u64
    }
}

/// Bytes on the wire of a message to a worker that is no totals, without packing it.
///
/// # Errors
/// If it cannot be packed.
pub fn measure_to_worker(message: &ToWorker) -> Result<u64> {
    codec::measure(message).map(control_bytes)
}

/// Bytes on the wire of a message to the master that is no cycle, without packing it.
///
/// # Errors
/// If it cannot be packed.
pub fn measure_to_master(message: &ToMaster) -> Result<u64> {
    codec::measure(message).map(control_bytes)
}

impl Packed {
    /// Bytes on the wire, headers included.
    pub fn wire_bytes(&self) -> u64 {
        let n = self.bytes.len() as u64;
        if self.kind == Kind::Control { control_bytes(n) } else { n + HEADER_LEN as u64 }
    }

    /// Whether it is cut into bulk chunks.
    pub fn goes_in_bulk(&self) -> bool {
        self.kind == Kind::Control && self.bytes.len() > CONTROL_LIMIT as usize
    }
}

#[derive(Serialize, Deserialize)]
enum CycleHead {
    Cycle { cycle: u64, vote: Option<Box<Vote>>, partials: u64, gathered: u64, busy: Work },
    Votes { cycle: u64, votes: BranchVote },
    Gathered { cycle: u64 },
}

#[derive(Serialize, Deserialize)]
struct PeerHead {
    cycle: u64,
    what: SaidHead,
}

#[derive(Serialize, Deserialize)]
enum SaidHead {
    Partials(Option<Box<Aboard>>),
    Votes(BranchVote),
    Orders(Orders),
    Patch(PlacedPatch),
    Wants(Vec<u32>),
    Asked(Vec<(u32, u32)>),
    Shares(Shares),
    Transfer,
}

#[derive(Serialize, Deserialize)]
struct TotalsHead {
    cycle: u64,
    orders: Orders,
}

/// Packs a message to a worker.
///
/// # Errors
/// If it is longer than a message may be.
pub fn pack_to_worker(message: &ToWorker) -> Result<Packed> {
    match message {
        ToWorker::Totals { cycle, orders, totals } => {
            let head = codec::encode(&TotalsHead { cycle: *cycle, orders: orders.clone() })?;
            Ok(Packed { kind: Kind::Totals, cycle: *cycle, bytes: with_arrays(&head, &[totals]) })
        }
        other => Ok(Packed { kind: Kind::Control, cycle: 0, bytes: codec::encode(other)? }),
    }
}

/// Reads a message to a worker.
///
/// # Errors
/// If the bytes are not one.
pub fn unpack_to_worker(kind: Kind, bytes: &[u8]) -> Result<ToWorker> {
    match kind {
        Kind::Totals => {
            let (head, arrays) = split_head(bytes)?;
            let head: TotalsHead = codec::decode(head, MESSAGE_LIMIT)?;
            Ok(ToWorker::Totals { cycle: head.cycle, orders: head.orders, totals: codec::f64s(arrays)? })
        }
        Kind::Control => match codec::decode(bytes, MESSAGE_LIMIT)? {
            ToWorker::Totals { .. } => {
                Err(Error::Unexpected { found: kind, expected: "totals in a totals frame" })
            }
            message => Ok(message),
        },
        found => Err(Error::Unexpected { found, expected: "a control or totals frame" }),
    }
}

/// Packs a message to the master.
///
/// # Errors
/// If it is longer than a message may be.
pub fn pack_to_master(message: &ToMaster) -> Result<Packed> {
    match message {
        ToMaster::Cycle { cycle, vote, partials, gathered, busy } => {
            let head = codec::encode(&CycleHead::Cycle {
                cycle: *cycle,
                vote: vote.clone(),
                partials: partials.len() as u64,
                gathered: gathered.len() as u64,
                busy: *busy,
            })?;
            Ok(Packed { kind: Kind::Cycle, cycle: *cycle, bytes: with_arrays(&head, &[partials, gathered]) })
        }
        ToMaster::Votes { cycle, votes } => {
            let head = codec::encode(&CycleHead::Votes { cycle: *cycle, votes: votes.clone() })?;
            Ok(Packed { kind: Kind::Cycle, cycle: *cycle, bytes: with_arrays(&head, &[]) })
        }
        ToMaster::Gathered { cycle, positions } => {
            let head = codec::encode(&CycleHead::Gathered { cycle: *cycle })?;
            Ok(Packed { kind: Kind::Cycle, cycle: *cycle, bytes: with_arrays(&head, &[positions]) })
        }
        other => Ok(Packed { kind: Kind::Control, cycle: 0, bytes: codec::encode(other)? }),
    }
}

/// Reads a message to the master.
///
/// # Errors
/// If the bytes are not one.
pub fn unpack_to_master(kind: Kind, bytes: &[u8]) -> Result<ToMaster> {
    match kind {
        Kind::Cycle => {
            let (head, arrays) = split_head(bytes)?;
            let numbers = codec::f64s(arrays)?;
            match codec::decode(head, MESSAGE_LIMIT)? {
                CycleHead::Cycle { cycle, vote, partials, gathered, busy } => {
                    require_numbers(&numbers, partials.saturating_add(gathered))?;
                    let mut partials_first = numbers;
                    let gathered = partials_first.split_off(partials as usize);
                    Ok(ToMaster::Cycle { cycle, vote, partials: partials_first, gathered, busy })
                }
                CycleHead::Votes { cycle, votes } => {
                    require_numbers(&numbers, 0)?;
                    Ok(ToMaster::Votes { cycle, votes })
                }
                CycleHead::Gathered { cycle } => Ok(ToMaster::Gathered { cycle, positions: numbers }),
            }
        }
        Kind::Control => match codec::decode(bytes, MESSAGE_LIMIT)? {
            ToMaster::Cycle { .. } | ToMaster::Votes { .. } | ToMaster::Gathered { .. } => {
                Err(Error::Unexpected { found: kind, expected: "a cycle in a cycle frame" })
            }
            message => Ok(message),
        },
        found => Err(Error::Unexpected { found, expected: "a control or cycle frame" }),
    }
}

/// Passes an array of as many numbers as its head states.
fn require_numbers(numbers: &[f64], stated: u64) -> Result<()> {
    let found = numbers.len() as u64;
    if found < stated {
        return Err(Error::Truncated {
            what: "arrays of a cycle",
            found: 8 * found,
            needed: stated.saturating_mul(8),
        });
    }
    if found > stated {
        return Err(Error::Message(format!("{found} numbers in a cycle frame, its head says {stated}")));
    }
    Ok(())
}

/// Packs a message to another worker.
///
/// # Errors
/// If it is longer than a message may be.
pub fn pack_to_peer(message: &ToPeer) -> Result<Packed> {
    let cycle = message.cycle;
    let (what, numbers): (_, &[f64]) = match &message.what {
        Said::Partials { partials, aboard } => (SaidHead::Partials(aboard.clone()), partials),
        Said::Votes(votes) => (SaidHead::Votes(votes.clone()), &[]),
        Said::Orders(orders) => (SaidHead::Orders(orders.clone()), &[]),
        Said::Patch(patch) => (SaidHead::Patch(patch.clone()), &[]),
        Said::Wants(nodes) => (SaidHead::Wants(nodes.clone()), &[]),
        Said::Asked(nodes) => (SaidHead::Asked(nodes.clone()), &[]),
        Said::Shares(shares) => (SaidHead::Shares(shares.clone()), &[]),
        Said::Transfer(state) => (SaidHead::Transfer, state),
    };
    let head = codec::encode(&PeerHead { cycle, what })?;
    Ok(Packed { kind: Kind::Cycle, cycle, bytes: with_arrays(&head, &[numbers]) })
}

/// Reads a message of another worker.
///
/// # Errors
/// If the bytes are not one.
pub fn unpack_to_peer(kind: Kind, bytes: &[u8]) -> Result<ToPeer> {
    if kind != Kind::Cycle {
        return Err(Error::Unexpected { found: kind, expected: "a cycle frame" });
    }
    let (head, arrays) = split_head(bytes)?;
    let PeerHead { cycle, what } = codec::decode(head, MESSAGE_LIMIT)?;
    let numbers = codec::f64s(arrays)?;
    let what = match what {
        SaidHead::Partials(aboard) => {
            return Ok(ToPeer { cycle, what: Said::Partials { partials: numbers, aboard } });
        }
        SaidHead::Transfer => return Ok(ToPeer { cycle, what: Said::Transfer(numbers) }),
        SaidHead::Votes(votes) => Said::Votes(votes),
        SaidHead::Orders(orders) => Said::Orders(orders),
        SaidHead::Patch(patch) => Said::Patch(patch),
        SaidHead::Wants(nodes) => Said::Wants(nodes),
        SaidHead::Asked(nodes) => Said::Asked(nodes),
        SaidHead::Shares(shares) => Said::Shares(shares),
    };
    require_numbers(&numbers, 0)?;
    Ok(ToPeer { cycle, what })
}

fn with_arrays(head: &[u8], arrays: &[&[f64]]) -> Vec<u8> {
    let n: usize = arrays.iter().map(|a| 8 * a.len()).sum();
    let mut bytes = Vec::with_capacity(4 + head.len() + n);
    bytes.extend_from_slice(&(head.len() as u32).to_le_bytes());
    bytes.extend_from_slice(head);
    for array in arrays {
        codec::put_f64s(&mut bytes, array);
    }
    bytes
}

fn split_head(bytes: &[u8]) -> Result<(&[u8], &[u8])> {
    let needed =
        |n: usize| Error::Truncated { what: "head of arrays", found: bytes.len() as u64, needed: n as u64 };
    let (length, rest) = bytes.split_first_chunk::<4>().ok_or_else(|| needed(4))?;
    let length = u32::from_le_bytes(*length) as usize;
    rest.split_at_checked(length).ok_or_else(|| needed(4 + length))
}
