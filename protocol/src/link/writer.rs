//! The writing side of a stream: frames in the order of the queue, as few system calls as they allow.
//!
//! Whoever sends a small frame writes it at once, on its own thread, when the stream takes it; so it leaves without
//! another thread being woken. What the stream does not take, long frames and bulk are the writing task's.

use super::{Shared, WRITE_BUFFER, lock, micros};
use crate::Error;
use crate::frame::{Frame, HEADER_LEN, Header, Kind, encode_header};
use std::collections::VecDeque;
use std::io::{ErrorKind, IoSlice, Result};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::task::{Context, Poll, Waker, ready};
use std::time::Duration;
use tokio::io::AsyncWrite;
use tokio::task::{JoinError, JoinHandle};

/// Bytes of payload that a sender writes by itself; sums and copies of more are left to the writing task.
pub(super) const DIRECT_BYTES: usize = 256 << 10;
/// Frames handed to the stream at a time.
const BATCH: usize = 16;

/// A stream's writing side, whatever it is.
pub(super) type Stream = Box<dyn AsyncWrite + Send + Unpin>;

/// The stream and what is being written to it.
pub(super) struct Writer {
    stream: Stream,
    /// Sealed frames under way with their headers: several short ones, or one chunk of bulk.
    batch: VecDeque<([u8; HEADER_LEN], Frame)>,
    /// Bytes of the first of them that the stream has taken.
    taken: usize,
    /// The stream may still hold what it took.
    unflushed: bool,
    /// The stream took no more, and wakes the writing task when it does.
    blocked: bool,
    /// Where the link goes on, and whether it is time to.
    next: Option<Stream>,
    moves: bool,
}

impl Writer {
    pub(super) fn new(stream: Stream) -> Self {
        let batch = VecDeque::with_capacity(BATCH);
        Self { stream, batch, taken: 0, unflushed: false, blocked: false, next: None, moves: false }
    }

    /// Goes on with another stream: at once, but for a frame under way, or behind the next frame of kind memory.
    pub(super) fn go_on_with(&mut self, stream: Stream, at_once: bool) {
        (self.next, self.moves) = (Some(stream), at_once);
    }

    /// Writes until nothing is left that `bulk` allows, or the stream takes no more.
    fn poll(&mut self, shared: &Shared, bulk: bool, cx: &mut Context<'_>) -> Poll<Result<()>> {
        loop {
            while !self.batch.is_empty() {
                let count = ready!(self.poll_batch(cx))?;
                if count == 0 {
                    return Poll::Ready(Err(ErrorKind::WriteZero.into()));
                }
                self.unflushed = true;
                self.took(count, shared);
            }
            if self.moves {
                ready!(self.poll_flush(cx))?;
                self.moves = false;
                if let Some(next) = self.next.take() {
                    self.stream = next;
                }
            }
            self.refill(shared, bulk)?;
            if self.batch.is_empty() {
                return self.poll_flush(cx);
            }
        }
    }

    fn poll_flush(&mut self, cx: &mut Context<'_>) -> Poll<Result<()>> {
        if self.unflushed {
            ready!(Pin::new(&mut self.stream).poll_flush(cx))?;
            self.unflushed = false;
        }
        Poll::Ready(Ok(()))
    }

    fn poll_batch(&mut self, cx: &mut Context<'_>) -> Poll<Result<usize>> {
        let mut slices = [IoSlice::new(&[]); 2 * BATCH];
        let mut skip = self.taken;
        let mut count = 0;
        for (head, frame) in &self.batch {
            for bytes in [&head[..], &frame.payload] {
                let left = &bytes[skip.min(bytes.len())..];
                skip -= bytes.len() - left.len();
                if !left.is_empty() {
                    slices[count] = IoSlice::new(left);
                    count += 1;
                }
            }
        }
        Pin::new(&mut self.stream).poll_write_vectored(cx, &slices[..count])
    }

    /// Counts `count` more bytes as taken, and lets go of the frames that are through.
    fn took(&mut self, count: usize, shared: &Shared) {
        self.taken += count;
        while let Some((_, frame)) = self.batch.front() {
            let bytes = HEADER_LEN + frame.payload.len();
            if self.taken < bytes {
                break;
            }
            self.taken -= bytes;
            if let Some((_, frame)) = self.batch.pop_front() {
                self.moves |= frame.header.kind == Kind::Memory && self.next.is_some();
                shared.sent(frame, bytes);
            }
        }
    }

    /// Takes the next frames from the queue: short ones up to [`WRITE_BUFFER`], or one chunk of bulk.
    fn refill(&mut self, shared: &Shared, bulk: bool) -> Result<()> {
        let mut queue = lock(&shared.queue);
        let mut bytes = 0;
        while self.batch.len() < BATCH && bytes < WRITE_BUFFER {
            let Some(frame) = queue.pop_urgent() else { break };
            bytes += HEADER_LEN + frame.payload.len();
            let is_last = frame.header.kind == Kind::Memory;
            self.batch.push_back(([0; HEADER_LEN], frame));
            if is_last {
                break;
            }
        }
        if self.batch.is_empty()
            && bulk
            && let Some(frame) = queue.pop_bulk(|| shared.buffer())
        {
            self.batch.push_back(([0; HEADER_LEN], frame));
        }
        if self.batch.is_empty() {
            shared.unwritten.store(queue.has_bulk(), Relaxed);
        }
        drop(queue);
        for (head, frame) in &mut self.batch {
            frame.seal().map_err(std::io::Error::other)?;
            *head = encode_header(&frame.header);
        }
        Ok(())
    }
}

/// Writes what is urgent now, if nobody else is writing and the stream takes it; whether all of it went.
pub(super) fn write_at_once(shared: &Shared) -> bool {
    let Ok(mut guard) = shared.writer.try_lock() else { return false };
    let Some(writer) = guard.as_mut() else { return false };
    if writer.blocked {
        return false;
    }
    let _inside = shared.runtime.enter();
    match writer.poll(shared, false, &mut Context::from_waker(Waker::noop())) {
        Poll::Ready(Ok(())) => !shared.unwritten.load(Relaxed),
        Poll::Ready(Err(error)) => {
            shared.fail(Error::io("writing to the peer", &error));
            false
        }
        Poll::Pending => false,
    }
}

/// The writing task: until the link ends, or everything is written and no sender is left.
pub(super) async fn write_out(shared: Arc<Shared>) {
    let mut end = shared.end.subscribe();
    let result = tokio::select! {
        biased;
        // Being cancelled in the middle of a frame does no harm: nothing is written after it.
        _ = end.wait_for(Option::is_some) => Ok(()),
        result = write_queue(&shared) => result,
    };
    if let Err(error) = result {
        // The receiving half goes on: what the peer said before it closed is still to be read.
        shared.fail(Error::io("writing to the peer", &error));
    }
    drop(lock(&shared.writer).take());
    shared.written.send_replace(true);
}

async fn write_queue(shared: &Shared) -> Result<()> {
    let mut making = None;
    loop {
        if making.is_none() {
            // While one message is on its way the next is made.
            let later = lock(&shared.queue).begin_making();
            making = later.map(|later| tokio::task::spawn_blocking(|| later.make()));
        }
        std::future::poll_fn(|cx| poll_writer(shared, cx, |writer, cx| writer.poll(shared, true, cx)))
            .await?;
        if lock(&shared.queue).is_over() {
            // A sender that was the last may have left a frame half written.
            let close = |writer: &mut Writer, cx: &mut Context<'_>| {
                ready!(writer.poll(shared, true, cx))?;
                Pin::new(&mut writer.stream).poll_shutdown(cx)
            };
            return std::future::poll_fn(|cx| poll_writer(shared, cx, close)).await;
        }
        let interval = Duration::from_micros(shared.heartbeat_us.load(Relaxed));
        let quiet = Duration::from_micros(
            micros(shared.start.elapsed()).saturating_sub(shared.last_sent.load(Relaxed)),
        );
        if quiet >= interval {
            lock(&shared.queue).push_urgent(Frame::new(Header::new(Kind::Heartbeat), Vec::new()));
            continue;
        }
        tokio::select! {
            () = shared.work.notified() => {}
            () = tokio::time::sleep(interval - quiet) => {}
            made = next_made(&mut making) => {
                making = None;
                match made {
                    Ok(Ok(message)) => lock(&shared.queue).made(message),
                    Ok(Err(error)) => shared.fail(error),
                    Err(panic) => shared.fail(Error::Message(format!("a bug in a message: {panic}"))),
                }
                shared.unwritten.store(true, Relaxed);
            }
        }
    }
}

/// What is being made, once it is; never, where nothing is. Cancel safe.
async fn next_made<T>(making: &mut Option<JoinHandle<T>>) -> std::result::Result<T, JoinError> {
    match making {
        Some(making) => making.await,
        None => std::future::pending().await,
    }
}

/// Polls `with` under the writer's lock and notes whether the stream blocks.
fn poll_writer(
    shared: &Shared,
    cx: &mut Context<'_>,
    mut with: impl FnMut(&mut Writer, &mut Context<'_>) -> Poll<Result<()>>,
) -> Poll<Result<()>> {
    match lock(&shared.writer).as_mut() {
        Some(writer) => {
            let result = with(writer, cx);
            writer.blocked = result.is_pending();
            result
        }
        // Only this task takes it away, at its end.
        None => Poll::Ready(Ok(())),
    }
}
