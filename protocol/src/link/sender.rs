//! The sending half: two bounded queues.

use super::writer::{DIRECT_BYTES, Stream, write_at_once, write_out};
use super::{Counters, Shared, lock, micros};
use crate::codec::{Chunker, OPEN_STREAMS};
use crate::frame::{Frame, Header, Kind, checked_length};
use crate::{Error, Result};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;
use tokio::time::Instant;

/// The sending half of a link. Clones feed the same queue; when the last is dropped the link writes
/// what is queued, then closes the stream's sending side.
pub struct Sender {
    shared: Arc<Shared>,
}

/// What waits to be written.
#[derive(Default)]
pub(super) struct Queue {
    urgent: VecDeque<Frame>,
    /// Frames other than bulk that are not wholly written, those under way included.
    urgent_frames: usize,
    /// Bytes of their payloads.
    urgent_bytes: usize,
    bulk: VecDeque<Chunker>,
    bulk_bytes: usize,
    /// Bulk messages that are still to be made, and whether one is being made.
    later: VecDeque<Later>,
    is_making: bool,
    /// Whose turn it is among the first [`OPEN_STREAMS`] of `bulk`.
    turn: usize,
    senders: usize,
    finishing: bool,
}

/// A bulk message that is made when its turn comes.
pub(super) struct Later {
    header: Header,
    stream: u64,
    make: Box<dyn FnOnce() -> Result<Vec<u8>> + Send>,
}

impl Later {
    /// Makes it, which may take long.
    pub(super) fn make(self) -> Result<Chunker> {
        Chunker::new(self.header, self.stream, (self.make)()?)
    }
}

impl Queue {
    /// The next message to be made, if none is being made: one is under way to the peer meanwhile, and no further one takes memory.
    pub(super) fn begin_making(&mut self) -> Option<Later> {
        if self.is_making || self.bulk.len() > 1 {
            return None;
        }
        let later = self.later.pop_front()?;
        self.is_making = true;
        Some(later)
    }

    /// It is made, and queued like others.
    pub(super) fn made(&mut self, message: Chunker) {
        self.is_making = false;
        self.bulk_bytes += message.total();
        self.bulk.push_back(message);
    }

    /// The oldest frame that is no bulk. It counts as queued until [`Queue::written`].
    pub(super) fn pop_urgent(&mut self) -> Option<Frame> {
        self.urgent.pop_front()
    }

    /// Appends a frame that is no bulk.
    pub(super) fn push_urgent(&mut self, frame: Frame) {
        self.urgent_frames += 1;
        self.urgent_bytes += frame.payload.len();
        self.urgent.push_back(frame);
    }

    /// A frame of `bytes` of payload that is no bulk has left.
    pub(super) const fn written(&mut self, bytes: usize) {
        self.urgent_frames -= 1;
        self.urgent_bytes -= bytes;
    }

    /// The next chunk of bulk; `spare` gives it its buffer.
    pub(super) fn pop_bulk(&mut self, spare: impl FnOnce() -> Vec<u8>) -> Option<Frame> {
        if self.bulk.is_empty() {
            return None;
        }
        let at = self.turn % self.bulk.len().min(OPEN_STREAMS);
        let chunk = self.bulk[at].next_into(spare());
        if self.bulk[at].is_done() {
            if let Some(done) = self.bulk.remove(at) {
                self.bulk_bytes -= done.total();
            }
            self.turn = at;
        } else {
            self.turn = at + 1;
        }
        chunk
    }

    /// Whether a bulk message is not wholly cut yet.
    pub(super) fn has_bulk(&self) -> bool {
        !self.bulk.is_empty()
    }

    /// Whether nothing is queued and nothing will be.
    pub(super) fn is_over(&self) -> bool {
        let none_waits = self.urgent.is_empty() && self.bulk.is_empty() && self.later.is_empty();
        (self.finishing || self.senders == 0) && none_waits && !self.is_making
    }
}

impl Sender {
    /// Spawns the writing task.
    pub(super) fn start(shared: Arc<Shared>) -> Self {
        lock(&shared.queue).senders = 1;
        tokio::spawn(write_out(Arc::clone(&shared)));
        Self { shared }
    }

    /// Queues `frame` ahead of all bulk and returns at once; length and checksum are filled in when it
    /// is written. A short frame that nothing is ahead of is written here and now, as far as the stream
    /// takes it without waiting. May be called from any thread.
    ///
    /// # Errors
    /// [`Error::TooLong`] over the limit of its kind, [`Error::QueueFull`] when the peer does not read,
    /// [`Error::Unexpected`] for a bulk frame (see [`send_bulk`](Self::send_bulk)), or the error that
    /// ended the link.
    pub fn send(&self, frame: Frame) -> Result<()> {
        if frame.header.kind == Kind::Bulk {
            return Err(Error::Unexpected { found: Kind::Bulk, expected: "another kind, or send_bulk" });
        }
        checked_length(frame.header.kind, frame.payload.len() as u64)?;
        let settings = &self.shared.settings;
        let mut queue = lock(&self.shared.queue);
        self.open(&queue)?;
        within("frame queue", queue.urgent_frames + 1, settings.queued_frames)?;
        let bytes = queue.urgent_bytes + frame.payload.len();
        within("bytes of the frame queue", bytes, settings.queued_bytes)?;
        let short = frame.payload.len() <= DIRECT_BYTES;
        queue.push_urgent(frame);
        self.shared.unwritten.store(true, Relaxed);
        drop(queue);
        if !(short && write_at_once(&self.shared)) {
            self.shared.work.notify_one();
        }
        Ok(())
    }

    /// Queues `bytes` as a message of `stream`, in chunks that every other frame overtakes, and returns
    /// at once. The receiver's [`Assembler`](crate::codec::Assembler) puts it together; up to
    /// [`OPEN_STREAMS`] messages take turns, chunk by chunk.
    ///
    /// # Errors
    /// [`Error::TooLong`] over [`MESSAGE_LIMIT`](crate::codec::MESSAGE_LIMIT), [`Error::QueueFull`], or
    /// the error that ended the link.
    pub fn send_bulk(&self, header: Header, stream: u64, bytes: impl Into<Arc<Vec<u8>>>) -> Result<()> {
        let message = Chunker::new(header, stream, bytes)?;
        let settings = &self.shared.settings;
        let mut queue = lock(&self.shared.queue);
        self.open(&queue)?;
        within("bulk queue", queue.bulk.len() + 1, settings.bulk_messages)?;
        let bytes = queue.bulk_bytes + message.total();
        within("bytes of the bulk queue", bytes, settings.bulk_bytes)?;
        queue.bulk_bytes = bytes;
        queue.bulk.push_back(message);
        self.shared.unwritten.store(true, Relaxed);
        drop(queue);
        self.shared.work.notify_one();
        Ok(())
    }

    /// Queues a message of `stream` as [`send_bulk`](Self::send_bulk) does, which is made when those queued this way before have been, on a
    /// thread that may take its time: of a long series two take memory at a time. What keeps one from being made ends the link.
    ///
    /// # Errors
    /// [`Error::QueueFull`], or the error that ended the link.
    pub fn send_bulk_later(
        &self,
        header: Header,
        stream: u64,
        make: Box<dyn FnOnce() -> Result<Vec<u8>> + Send>,
    ) -> Result<()> {
        let mut queue = lock(&self.shared.queue);
        self.open(&queue)?;
        within("queue of messages to be made", queue.later.len() + 1, self.shared.settings.later_messages)?;
        queue.later.push_back(Later { header, stream, make });
        drop(queue);
        self.shared.work.notify_one();
        Ok(())
    }

    /// Goes on with another stream: at once, or behind the next frame of kind memory.
    pub(super) fn go_on_with(&self, stream: Stream, at_once: bool) {
        if let Some(writer) = lock(&self.shared.writer).as_mut() {
            writer.go_on_with(stream, at_once);
        }
    }

    /// An empty buffer for a payload, with the capacity of one that has been written if there is any.
    pub fn buffer(&self) -> Vec<u8> {
        self.shared.buffer()
    }

    /// Takes no more frames, writes what is queued, closes the sending side and waits for that.
    ///
    /// Cancel safe: the writing goes on without the waiting.
    ///
    /// # Errors
    /// The error that ended the link before everything was written.
    pub async fn finish(&self) -> Result<()> {
        lock(&self.shared.queue).finishing = true;
        self.shared.work.notify_one();
        let mut written = self.shared.written.subscribe();
        // The sender of this channel lives in `shared`, which `self` holds.
        let _ = written.wait_for(|written| *written).await;
        self.shared.ended().map_or(Ok(()), Err)
    }

    /// Ends the link at once, in both directions, for the reason `error`; what is queued is lost.
    pub fn abort(&self, error: Error) {
        self.shared.fail(error);
    }

    /// Waits until the link has ended, for whatever reason.
    pub async fn ended(&self) {
        let mut end = self.shared.end.subscribe();
        // The sender of this channel lives in `shared`, which `self` holds.
        let _ = end.wait_for(Option::is_some).await;
    }

    /// Sends heartbeats after `interval` without another frame, from now on.
    pub fn set_heartbeat(&self, interval: Duration) {
        self.shared.heartbeat_us.store(micros(interval), Relaxed);
        self.shared.work.notify_one();
    }

    /// What has passed over the link, both ways.
    pub fn counters(&self) -> Counters {
        self.shared.counters()
    }

    /// When the last byte came from the peer; the link's start before the first.
    pub fn last_seen(&self) -> Instant {
        self.shared.last_seen()
    }

    /// Frames that are not wholly written, and bytes of bulk messages that are not wholly cut.
    pub fn queued(&self) -> (usize, usize) {
        let queue = lock(&self.shared.queue);
        (queue.urgent_frames, queue.bulk_bytes)
    }

    fn open(&self, queue: &Queue) -> Result<()> {
        match self.shared.ended() {
            Some(error) => Err(error),
            None if queue.finishing => Err(Error::Closed),
            None => Ok(()),
        }
    }
}

impl Clone for Sender {
    fn clone(&self) -> Self {
        lock(&self.shared.queue).senders += 1;
        Self { shared: Arc::clone(&self.shared) }
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        lock(&self.shared.queue).senders -= 1;
        self.shared.work.notify_one();
    }
}

fn within(queue: &'static str, length: usize, limit: usize) -> Result<()> {
    if length > limit {
        return Err(Error::QueueFull { queue, length: length as u64, limit: limit as u64 });
    }
    Ok(())
}
