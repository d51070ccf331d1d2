//! A ring of bytes between two processes: one writes, the other reads.
//!
//! Two numbers that only grow say how many bytes were written and how many were taken; their difference is what the ring
//! holds. Each side keeps its own number to itself and only publishes it, and checks the other's against it: a process that
//! writes nonsense there ends the link, and no copy leaves the ring.
//!
//! Whoever finds nothing to do says in a word that it waits, looks once more, and sleeps; whoever has changed a number looks
//! at that word. A fence stands between the two on both sides, so one of them sees the other: no change is slept through.

use std::{
    io::{Error, ErrorKind, Result},
    sync::{
        Arc,
        atomic::{
            AtomicU32, AtomicU64,
            Ordering::{Acquire, Relaxed, Release, SeqCst},
            fence,
        },
    },
};

use system::shared::Shared;

/// Bytes of a ring; a power of two. With half of it frames of a megabyte and more took a tenth to a third longer.
pub const BYTES: usize = 1 << 20;
/// Where the rings begin: on a page of their own.
pub const START: usize = 4096;

/// The indices of a direction, far enough from each other that no two share a cache line.
const WRITTEN: usize = 0;
const TAKEN: usize = 256;
const READER_WAITS: usize = 512;
const WRITER_WAITS: usize = 768;
const CLOSED: usize = 1024;

/// One of the two rings of a memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the dialling to the listening side.
    There,
    Back,
}

struct Ring {
    memory: Arc<Shared>,
    indices: usize,
    bytes: usize,
}

impl Ring {
    /// # Panics
    /// If the memory is shorter than [`super::BYTES`].
    fn new(memory: Arc<Shared>, direction: Direction) -> Self {
        assert!(memory.bytes() >= START + 2 * BYTES, "{} bytes of memory", memory.bytes());
        let (indices, bytes) = match direction {
            Direction::There => (256, START),
            Direction::Back => (256 + 1280, START + BYTES),
        };
        Self { memory, indices, bytes }
    }

    fn number(&self, which: usize) -> &AtomicU64 {
        self.memory.number(self.indices + which)
    }

    fn word(&self, which: usize) -> &AtomicU32 {
        self.memory.word(self.indices + which)
    }

    /// The two stretches of memory that `bytes` from `index` on lie in.
    const fn stretches(&self, index: u64, bytes: usize) -> [(usize, usize); 2] {
        let from = (index % BYTES as u64) as usize;
        let first = if bytes < BYTES - from { bytes } else { BYTES - from };
        [(self.bytes + from, first), (self.bytes, bytes - first)]
    }

    /// Says that this side waits; what it looks at afterwards is as new as what the other side does before it looks here.
    fn wait(&self, which: usize) {
        self.word(which).store(1, Relaxed);
        fence(SeqCst);
    }

    /// Whether the other side waits for what was published before, and is now to be woken.
    fn is_awaited(&self, which: usize) -> bool {
        fence(SeqCst);
        let word = self.word(which);
        word.load(Relaxed) != 0 && word.swap(0, Relaxed) != 0
    }
}

fn nonsense(what: &str, found: u64, bounds: [u64; 2]) -> Error {
    let [least, most] = bounds;
    let why = format!("shared memory: {found} bytes {what}, expected {least} to {most}");
    Error::new(ErrorKind::InvalidData, why)
}

/// The side that writes.
pub struct Producer {
    ring: Ring,
    /// Bytes put in, and how many of them are published.
    written: u64,
    published: u64,
    /// The other side's number when it was last looked at.
    taken: u64,
}

impl Producer {
    /// Of an empty ring that nobody else writes to.
    pub fn new(memory: Arc<Shared>, direction: Direction) -> Self {
        Self { ring: Ring::new(memory, direction), written: 0, published: 0, taken: 0 }
    }

    /// How much fits in, as far as `wanted` matters.
    ///
    /// # Errors
    /// If the other side says what cannot be.
    pub fn room(&mut self, wanted: usize) -> Result<usize> {
        let room = BYTES - (self.written - self.taken) as usize;
        if room >= wanted {
            return Ok(room);
        }
        let taken = self.ring.number(TAKEN).load(Acquire);
        if !(self.taken..=self.published).contains(&taken) {
            return Err(nonsense("taken", taken, [self.taken, self.published]));
        }
        self.taken = taken;
        Ok(BYTES - (self.written - taken) as usize)
    }

    /// Puts in as much as fits; the other side sees it once it is published.
    ///
    /// # Errors
    /// As for [`Producer::room`].
    pub fn put(&mut self, from: &[u8]) -> Result<usize> {
        let count = self.room(from.len())?.min(from.len());
        let [(at, first), (again, _)] = self.ring.stretches(self.written, count);
        // SAFETY: this is the only producer of the ring in this process, and the consumer, were it here too, takes what is
        // published: these bytes are beyond it, and it has said that it is through with what they held.
        unsafe {
            self.ring.memory.put(at, &from[..first]);
            self.ring.memory.put(again, &from[first..count]);
        }
        self.written += count as u64;
        Ok(count)
    }

    /// Bytes that the other side cannot see yet.
    pub const fn unpublished(&self) -> u64 {
        self.written - self.published
    }

    /// Shows the other side what was put in; whether it sleeps and is to be woken.
    pub fn publish(&mut self) -> bool {
        self.published = self.written;
        self.ring.number(WRITTEN).store(self.written, Release);
        self.ring.is_awaited(READER_WAITS)
    }

    /// Nothing comes after what was put in; whether the other side sleeps and is to be woken.
    pub fn close(&mut self) -> bool {
        self.published = self.written;
        self.ring.number(WRITTEN).store(self.written, Release);
        self.ring.word(CLOSED).store(1, Release);
        self.ring.is_awaited(READER_WAITS)
    }

    /// Asks to be woken when there is room; look once more before sleeping.
    pub fn wait(&self) {
        self.ring.wait(WRITER_WAITS);
    }

    /// There was room at that look.
    pub fn wait_no_more(&self) {
        self.ring.word(WRITER_WAITS).store(0, Relaxed);
    }
}

/// The side that reads.
pub struct Consumer {
    ring: Ring,
    taken: u64,
    /// The other side's number when it was last looked at.
    written: u64,
}

impl Consumer {
    /// Of an empty ring that nobody else reads from.
    pub fn new(memory: Arc<Shared>, direction: Direction) -> Self {
        Self { ring: Ring::new(memory, direction), taken: 0, written: 0 }
    }

    /// How much there is.
    ///
    /// # Errors
    /// If the other side says what cannot be.
    pub fn filled(&mut self) -> Result<usize> {
        let (written, most) = (self.ring.number(WRITTEN).load(Acquire), self.taken + BYTES as u64);
        if !(self.written..=most).contains(&written) {
            return Err(nonsense("written", written, [self.written, most]));
        }
        self.written = written;
        Ok((written - self.taken) as usize)
    }

    /// Whether nothing comes after what there is; look at that afterwards.
    pub fn is_closed(&self) -> bool {
        self.ring.word(CLOSED).load(Acquire) != 0
    }

    /// Takes what there is of `into`.
    ///
    /// # Errors
    /// As for [`Consumer::filled`].
    pub fn take(&mut self, into: &mut [u8]) -> Result<usize> {
        let count = self.filled()?.min(into.len());
        let [(at, first), (again, _)] = self.ring.stretches(self.taken, count);
        // SAFETY: this is the only consumer of the ring in this process, and the producer, were it here too, puts nothing
        // where bytes are that are published and not taken.
        unsafe {
            self.ring.memory.take(at, &mut into[..first]);
            self.ring.memory.take(again, &mut into[first..count]);
        }
        self.taken += count as u64;
        self.ring.number(TAKEN).store(self.taken, Release);
        Ok(count)
    }

    /// Whether the other side sleeps until there is room and is now to be woken: not before half of the ring is free.
    pub fn has_made_room(&self) -> bool {
        (self.written - self.taken) as usize <= BYTES / 2 && self.ring.is_awaited(WRITER_WAITS)
    }

    /// Asks to be woken when something comes; look once more before sleeping.
    pub fn wait(&self) {
        self.ring.wait(READER_WAITS);
    }

    /// There was something at that look.
    pub fn wait_no_more(&self) {
        self.ring.word(READER_WAITS).store(0, Relaxed);
    }
}

#[cfg(test)]
mod tests;
