//! The sending half: two bounded queues, and the task that writes them out.

use super::{Counters, Shared, WRITE_BUFFER, lock, micros};
use crate::codec::{Chunker, OPEN_STREAMS};
use crate::frame::{Frame, HEADER_LEN, Header, Kind, checked_length, encode_header};
use crate::{Error, Result};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;
use tokio::io::{AsyncWrite, AsyncWriteExt, BufWriter};
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
    urgent_bytes: usize,
    bulk: VecDeque<Chunker>,
    bulk_bytes: usize,
    /// Whose turn it is among the first [`OPEN_STREAMS`] of `bulk`.
    turn: usize,
    senders: usize,
    finishing: bool,
}

impl Queue {
    /// The next frame to write, bulk only when nothing else waits; `spare` gives a chunk its buffer.
    fn pop(&mut self, spare: impl FnOnce() -> Vec<u8>) -> Option<Frame> {
        if let Some(frame) = self.urgent.pop_front() {
            self.urgent_bytes -= frame.payload.len();
            return Some(frame);
        }
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

    fn over(&self) -> bool {
        self.finishing || self.senders == 0
    }
}

impl Sender {
    /// Spawns the task that writes to `write`.
    pub(super) fn start<W: AsyncWrite + Send + 'static>(write: W, shared: Arc<Shared>) -> Self {
        lock(&shared.queue).senders = 1;
        tokio::spawn(write_out(write, Arc::clone(&shared)));
        Self { shared }
    }

    /// Queues `frame` ahead of all bulk and returns at once; length and checksum are filled in when it
    /// is written. May be called from any thread.
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
        within("frame queue", queue.urgent.len() + 1, settings.queued_frames)?;
        let bytes = queue.urgent_bytes + frame.payload.len();
        within("bytes of the frame queue", bytes, settings.queued_bytes)?;
        queue.urgent_bytes = bytes;
        queue.urgent.push_back(frame);
        drop(queue);
        self.shared.work.notify_one();
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
        drop(queue);
        self.shared.work.notify_one();
        Ok(())
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

    /// Frames and bulk bytes that are queued and not yet being written.
    pub fn queued(&self) -> (usize, usize) {
        let queue = lock(&self.shared.queue);
        (queue.urgent.len(), queue.bulk_bytes)
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

/// The writing task: until the link ends, or everything is written and no sender is left.
async fn write_out<W: AsyncWrite + Send + 'static>(write: W, shared: Arc<Shared>) {
    let mut end = shared.end.subscribe();
    let mut write = Box::pin(BufWriter::with_capacity(WRITE_BUFFER, write));
    let result = tokio::select! {
        biased;
        // Being cancelled in the middle of a frame does no harm: nothing is written after it.
        _ = end.wait_for(Option::is_some) => Ok(()),
        result = write_queue(&mut write, &shared) => result,
    };
    if let Err(error) = result {
        // The receiving half goes on: what the peer said before it closed is still to be read.
        shared.fail(Error::io("writing to the peer", &error));
    }
    drop(write);
    shared.written.send_replace(true);
}

async fn write_queue<W: AsyncWrite + Unpin>(write: &mut W, shared: &Shared) -> std::io::Result<()> {
    let mut last = Instant::now();
    loop {
        while let Some(frame) = next(shared) {
            write_frame(write, frame, shared).await?;
            last = Instant::now();
        }
        write.flush().await?;
        if lock(&shared.queue).over() {
            // A frame may have been queued between the last look and this one.
            match next(shared) {
                Some(frame) => write_frame(write, frame, shared).await?,
                None => return write.shutdown().await,
            }
            continue;
        }
        let interval = Duration::from_micros(shared.heartbeat_us.load(Relaxed));
        tokio::select! {
            () = shared.work.notified() => {}
            () = tokio::time::sleep(interval.saturating_sub(last.elapsed())) => {
                write_frame(write, Frame::new(Header::new(Kind::Heartbeat), Vec::new()), shared).await?;
                last = Instant::now();
            }
        }
    }
}

fn next(shared: &Shared) -> Option<Frame> {
    lock(&shared.queue).pop(|| shared.buffer())
}

async fn write_frame<W: AsyncWrite + Unpin>(
    write: &mut W,
    mut frame: Frame,
    shared: &Shared,
) -> std::io::Result<()> {
    frame.seal().map_err(std::io::Error::other)?;
    write.write_all(&encode_header(&frame.header)).await?;
    write.write_all(&frame.payload).await?;
    let bytes = HEADER_LEN + frame.payload.len();
    shared.sent(frame, bytes);
    Ok(())
}
