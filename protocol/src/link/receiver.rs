//! The receiving half: one frame at a time, never more memory than has come in bytes.

use super::{Counters, EAGER, FIRST_ALLOCATION, READ_AT_ONCE, READ_BUFFER, Shared};
use crate::frame::{Checksum, Frame, HEADER_LEN, Header, Kind, decode_header};
use crate::tls;
use crate::{Error, Result};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::task::{Context, Poll, Waker, ready};
use std::time::Duration;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::task::coop;
use tokio::time::Instant;

/// A stream's reading side, whatever it is.
type Stream = Box<dyn AsyncRead + Send + Unpin>;

/// The receiving half of a link. Dropping it ends the link: a sender whose peer is not listened to is of
/// no use.
pub struct Receiver {
    incoming: Incoming,
    shared: Arc<Shared>,
    limit: u32,
    habit: Habit,
}

/// Whether looking for bytes is worth more than sleeping, as the last waits had it.
#[derive(Default)]
struct Habit {
    /// The last wait was shorter than [`EAGER`].
    short: bool,
    /// Waits to sleep through before the next look: twice as many after each look in vain, as when the peer's
    /// task needs this very thread.
    asleep: u32,
    vain: u32,
    /// Looks in a row that found something.
    found: u32,
}

impl Habit {
    /// Most doublings of `asleep`.
    const LONGEST: u32 = 10;

    const fn looks(&self) -> bool {
        self.short && self.asleep == 0
    }

    /// Looks in a row that make good for one in vain: that one may have cost a time slice, they save microseconds.
    const STREAK: u32 = 64;

    const fn found(&mut self) {
        self.found += 1;
        if self.found == Self::STREAK {
            (self.found, self.vain) = (0, self.vain.saturating_sub(1));
        }
    }

    fn in_vain(&mut self) {
        self.found = 0;
        self.vain = (self.vain + 1).min(Self::LONGEST);
        self.asleep = 1 << self.vain;
    }

    fn slept(&mut self, wait: Duration) {
        self.short = wait < EAGER;
        self.asleep = self.asleep.saturating_sub(1);
    }
}

/// The stream, and what has come of the frame under way; kept between calls so that a cancelled one loses nothing.
struct Incoming {
    stream: Stream,
    /// Bytes read and not yet taken: `from..to`.
    ahead: Box<[u8]>,
    from: usize,
    to: usize,
    head: [u8; HEADER_LEN],
    /// Bytes of the head that have come.
    head_bytes: usize,
    header: Option<Header>,
    /// At least as long as what has come of it.
    payload: Vec<u8>,
    /// Bytes of the payload that have come, and their checksum.
    payload_bytes: usize,
    checksum: Checksum,
}

impl Incoming {
    fn new(stream: Stream) -> Self {
        Self {
            stream,
            ahead: vec![0; READ_BUFFER].into(),
            from: 0,
            to: 0,
            head: [0; HEADER_LEN],
            head_bytes: 0,
            header: None,
            payload: Vec::new(),
            payload_bytes: 0,
            checksum: Checksum::new(),
        }
    }

    /// Takes what is there of the head, or of the payload once the header is known; gives the number of bytes taken,
    /// of which `read` came from the stream. Zero bytes are the stream's end.
    fn poll_some(&mut self, read: &mut usize, cx: &mut Context<'_>) -> Poll<std::io::Result<usize>> {
        let Some(header) = self.header else {
            let count = ready!(self.poll_ahead(HEADER_LEN - self.head_bytes, read, cx))?;
            let bytes = &self.ahead[self.from..self.from + count];
            self.head[self.head_bytes..self.head_bytes + count].copy_from_slice(bytes);
            self.from += count;
            self.head_bytes += count;
            return Poll::Ready(Ok(count));
        };
        let missing = header.length as usize - self.payload_bytes;
        let start = self.payload_bytes;
        let count = if self.from < self.to || missing < READ_BUFFER / 2 {
            let count = ready!(self.poll_ahead(missing, read, cx))?;
            self.make_room(start + count, header.length as usize);
            self.payload[start..start + count].copy_from_slice(&self.ahead[self.from..self.from + count]);
            self.from += count;
            count
        } else {
            self.make_room(start + missing.min(FIRST_ALLOCATION), header.length as usize);
            let end = self.payload.len().min(start + missing).min(start + READ_AT_ONCE);
            let count = ready!(poll_read(&mut self.stream, &mut self.payload[start..end], cx))?;
            *read = count;
            count
        };
        self.payload_bytes += count;
        self.checksum.update(&self.payload[start..start + count]);
        Poll::Ready(Ok(count))
    }

    /// Makes at most `wanted` bytes stand ahead if none do; gives their number.
    fn poll_ahead(
        &mut self,
        wanted: usize,
        read: &mut usize,
        cx: &mut Context<'_>,
    ) -> Poll<std::io::Result<usize>> {
        if self.from == self.to {
            let count = ready!(poll_read(&mut self.stream, &mut self.ahead, cx))?;
            (self.from, self.to, *read) = (0, count, count);
        }
        Poll::Ready(Ok(wanted.min(self.to - self.from)))
    }

    /// Lengthens the payload's buffer to at least `bytes`: to twice as much as has come, never above `length`.
    fn make_room(&mut self, bytes: usize, length: usize) {
        if self.payload.len() < bytes {
            let target = bytes.max(2 * self.payload_bytes).min(length);
            self.payload.reserve_exact(target - self.payload.len());
            self.payload.resize(target, 0);
        }
    }
}

fn poll_read(stream: &mut Stream, into: &mut [u8], cx: &mut Context<'_>) -> Poll<std::io::Result<usize>> {
    let mut buffer = ReadBuf::new(into);
    ready!(Pin::new(stream).poll_read(cx, &mut buffer))?;
    Poll::Ready(Ok(buffer.filled().len()))
}

impl Receiver {
    pub(super) fn new(stream: Stream, shared: Arc<Shared>) -> Self {
        Self { incoming: Incoming::new(stream), shared, limit: u32::MAX, habit: Habit::default() }
    }

    /// The next frame, verified; heartbeats are counted and swallowed.
    ///
    /// Cancel safe: bytes already read stay in the receiver and the next call goes on with them. Bytes
    /// count as life only while this is called, so a task should always be waiting in it.
    ///
    /// # Errors
    /// [`Error::Closed`] when the peer ended the stream between two frames, [`Error::Truncated`] within
    /// one; any error of [`decode_header`] and [`Frame::verify`]; [`Error::Silent`]; [`Error::Io`]; or
    /// the reason given to [`Sender::abort`](super::Sender::abort). Every error ends the link, except that
    /// after `Closed` and [`Error::FrameVersion`] this side may still send.
    pub async fn receive(&mut self) -> Result<Frame> {
        // What follows a bad frame is never looked at; a failure to write does not hide what was said.
        if let Some(error) = self.shared.ended()
            && !matches!(error, Error::Io { .. })
        {
            return Err(error);
        }
        // Bytes that are always there already must not keep other tasks from this thread.
        coop::consume_budget().await;
        let result = self.next_frame().await;
        match &result {
            // A peer that has said all it had to say may still listen, and one of another version is owed
            // an answer that shows ours.
            Ok(_) | Err(Error::Closed | Error::FrameVersion { .. }) => {}
            Err(error) => self.shared.fail(error.clone()),
        }
        result
    }

    /// Allows payloads of at most `bytes`, besides the limit of their kind; the next header is the first
    /// that is measured by it. Keep it small until the handshake is done.
    pub const fn set_limit(&mut self, bytes: u32) {
        self.limit = bytes;
    }

    /// Gives [`Error::Silent`] after `limit` without a byte, from now on.
    pub fn set_silence(&mut self, limit: Duration) {
        self.shared.silence_us.store(super::micros(limit), Relaxed);
    }

    /// Goes on with another stream behind the last frame; what has come of the one before means nothing.
    pub(super) fn go_on_with(&mut self, stream: Stream) {
        let incoming = &mut self.incoming;
        (incoming.stream, incoming.from, incoming.to) = (stream, 0, 0);
        (incoming.header, incoming.head_bytes) = (None, 0);
    }

    /// Gives a payload back, for a later frame to use its memory.
    pub fn recycle(&self, payload: Vec<u8>) {
        self.shared.recycle(payload);
    }

    /// When the last byte came from the peer; the link's start before the first.
    pub fn last_seen(&self) -> Instant {
        self.shared.last_seen()
    }

    /// What has passed over the link, both ways.
    pub fn counters(&self) -> Counters {
        self.shared.counters()
    }

    async fn next_frame(&mut self) -> Result<Frame> {
        loop {
            let frame = self.any_frame().await?;
            self.shared.frames_received.fetch_add(1, Relaxed);
            if frame.header.kind != Kind::Heartbeat {
                return Ok(frame);
            }
        }
    }

    async fn any_frame(&mut self) -> Result<Frame> {
        let header = match self.incoming.header {
            Some(header) => header,
            None => self.header().await?,
        };
        let length = header.length as usize;
        while self.incoming.payload_bytes < length {
            if self.read_some().await? == 0 {
                let found = self.incoming.payload_bytes as u64;
                return Err(Error::Truncated { what: header.kind.name(), found, needed: length as u64 });
            }
        }
        let incoming = &mut self.incoming;
        let mut payload = std::mem::take(&mut incoming.payload);
        payload.truncate(length);
        let computed = incoming.checksum.value();
        (incoming.header, incoming.head_bytes) = (None, 0);
        (incoming.payload_bytes, incoming.checksum) = (0, Checksum::new());
        let frame = Frame::new(header, payload);
        frame.verify_as(computed)?;
        Ok(frame)
    }

    async fn header(&mut self) -> Result<Header> {
        while self.incoming.head_bytes < HEADER_LEN {
            if self.read_some().await? == 0 {
                let head = &self.incoming.head;
                return Err(match self.incoming.head_bytes {
                    0 => Error::Closed,
                    // An alert of TLS is shorter than a header.
                    7.. if tls::begins([head[0], head[1]]) => {
                        Error::Magic { found: [head[0], head[1], head[2], head[3]] }
                    }
                    found => Error::Truncated {
                        what: "frame header",
                        found: found as u64,
                        needed: HEADER_LEN as u64,
                    },
                });
            }
        }
        let header = decode_header(&self.incoming.head)?;
        if header.length > self.limit {
            let (length, limit) = (u64::from(header.length), u64::from(self.limit));
            return Err(Error::TooLong { what: header.kind.name(), length, limit });
        }
        self.incoming.header = Some(header);
        if header.length > 0 {
            self.incoming.payload = self.shared.used_buffer();
        }
        Ok(header)
    }

    /// Takes what is there of the frame under way; zero bytes are the stream's end.
    ///
    /// Waits at most until the peer has been silent for too long, or the link ends.
    async fn read_some(&mut self) -> Result<usize> {
        let mut read = 0;
        let result = match self.look(&mut read) {
            Some(result) => result.map_err(|error| Error::io("reading from the peer", &error)),
            None => {
                let start = std::time::Instant::now();
                let result = self.wait(&mut read).await;
                self.habit.slept(start.elapsed());
                result
            }
        };
        if read > 0 {
            self.shared.see(read);
        }
        result
    }

    /// What is there already, or comes within [`EAGER`] where that is likely.
    fn look(&mut self, read: &mut usize) -> Option<std::io::Result<usize>> {
        let mut start = None;
        loop {
            if let Poll::Ready(result) =
                self.incoming.poll_some(read, &mut Context::from_waker(Waker::noop()))
            {
                match start.map(|start: std::time::Instant| start.elapsed()) {
                    None => {}
                    Some(wait) if wait <= EAGER => self.habit.found(),
                    // Another process took the processor meanwhile; a sleeper would have been given it back sooner.
                    Some(_) => self.habit.in_vain(),
                }
                return Some(result);
            }
            // What this side has still to write may need this thread.
            if !self.habit.looks() || self.shared.unwritten.load(Relaxed) {
                return None;
            }
            if start.get_or_insert_with(std::time::Instant::now).elapsed() > EAGER {
                self.habit.in_vain();
                return None;
            }
            std::thread::yield_now();
        }
    }

    async fn wait(&mut self, read: &mut usize) -> Result<usize> {
        let mut end = self.shared.end.subscribe();
        loop {
            let silence = Duration::from_micros(self.shared.silence_us.load(Relaxed));
            let quiet = self.shared.last_seen().elapsed();
            tokio::select! {
                biased;
                // Reading comes first: bytes that came while this process was stopped are life.
                count = std::future::poll_fn(|cx| self.incoming.poll_some(read, cx)) => {
                    return count.map_err(|error| Error::io("reading from the peer", &error));
                }
                error = aborted(&mut end) => return Err(error),
                () = tokio::time::sleep(silence.saturating_sub(quiet)) => {
                    let after = self.shared.last_seen().elapsed();
                    let limit = Duration::from_micros(self.shared.silence_us.load(Relaxed));
                    if after >= limit {
                        let (after_ms, limit_ms) = (after.as_millis() as u64, limit.as_millis() as u64);
                        return Err(Error::Silent { after_ms, limit_ms });
                    }
                }
            }
        }
    }
}

impl Drop for Receiver {
    fn drop(&mut self) {
        self.shared.fail(Error::Closed);
    }
}

/// Waits for the end of the link, except by a failure to write: then the peer may still have said why.
async fn aborted(end: &mut tokio::sync::watch::Receiver<Option<Error>>) -> Error {
    let error = end.wait_for(|end| !matches!(end, None | Some(Error::Io { .. }))).await;
    match error.map(|error| error.clone()) {
        Ok(Some(error)) => error,
        // Only when the link itself is gone, which the caller is a part of.
        Ok(None) | Err(_) => Error::Closed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looking_in_vain_becomes_rare_and_a_streak_makes_good_for_it() {
        let mut habit = Habit::default();
        assert!(!habit.looks(), "nothing is known of this peer");
        habit.slept(EAGER);
        assert!(!habit.looks(), "its last answer took too long");
        let mut slept = Vec::new();
        habit.slept(Duration::ZERO);
        for _ in 0..12 {
            assert!(habit.looks());
            habit.in_vain();
            let mut waits = 0;
            while !habit.looks() {
                habit.slept(Duration::ZERO);
                waits += 1;
            }
            slept.push(waits);
        }
        assert_eq!(slept, [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 1024, 1024]);
        for _ in 0..Habit::LONGEST * Habit::STREAK {
            habit.found();
        }
        habit.in_vain();
        assert_eq!(habit.asleep, 2);
    }
}
