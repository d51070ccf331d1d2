//! The receiving half: one frame at a time, never more memory than has come in bytes.

use super::{Counters, FIRST_ALLOCATION, READ_BUFFER, Shared};
use crate::frame::{Frame, HEADER_LEN, Header, Kind, decode_header};
use crate::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, BufReader};
use tokio::time::Instant;

/// A stream's reading side, whatever it is.
type Stream = Box<dyn AsyncRead + Send + Unpin>;

/// The receiving half of a link. Dropping it ends the link: a sender whose peer is not listened to is of
/// no use.
pub struct Receiver {
    read: BufReader<Stream>,
    shared: Arc<Shared>,
    partial: Partial,
    limit: u32,
}

/// What has come of the frame under way; kept between calls so that a cancelled one loses nothing.
struct Partial {
    head: [u8; HEADER_LEN],
    filled: usize,
    header: Option<Header>,
    payload: Vec<u8>,
}

impl Partial {
    const fn new() -> Self {
        Self { head: [0; HEADER_LEN], filled: 0, header: None, payload: Vec::new() }
    }
}

impl Receiver {
    pub(super) fn new(read: Stream, shared: Arc<Shared>) -> Self {
        let read = BufReader::with_capacity(READ_BUFFER, read);
        Self { read, shared, partial: Partial::new(), limit: u32::MAX }
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
        let header = match self.partial.header {
            Some(header) => header,
            None => self.header().await?,
        };
        let length = header.length as usize;
        while self.partial.payload.len() < length {
            if self.read_some(length).await? == 0 {
                let found = self.partial.payload.len() as u64;
                return Err(Error::Truncated { what: header.kind.name(), found, needed: length as u64 });
            }
        }
        let payload = std::mem::take(&mut self.partial.payload);
        self.partial = Partial::new();
        let frame = Frame::new(header, payload);
        frame.verify()?;
        Ok(frame)
    }

    async fn header(&mut self) -> Result<Header> {
        while self.partial.filled < HEADER_LEN {
            if self.read_some(0).await? == 0 {
                return Err(match self.partial.filled {
                    0 => Error::Closed,
                    found => Error::Truncated {
                        what: "frame header",
                        found: found as u64,
                        needed: HEADER_LEN as u64,
                    },
                });
            }
        }
        let header = decode_header(&self.partial.head)?;
        if header.length > self.limit {
            let (length, limit) = (u64::from(header.length), u64::from(self.limit));
            return Err(Error::TooLong { what: header.kind.name(), length, limit });
        }
        self.partial.header = Some(header);
        if header.length > 0 {
            self.partial.payload = self.shared.buffer();
        }
        Ok(header)
    }

    /// Reads what is there of the header, or of the payload of `length` bytes once the header is known.
    ///
    /// Waits at most until the peer has been silent for too long, or the link ends.
    async fn read_some(&mut self, length: usize) -> Result<usize> {
        let mut end = self.shared.end.subscribe();
        loop {
            let silence = Duration::from_micros(self.shared.silence_us.load(Relaxed));
            let quiet = self.shared.last_seen().elapsed();
            let read = async {
                if self.partial.header.is_none() {
                    return self.read.read(&mut self.partial.head[self.partial.filled..]).await;
                }
                let payload = &mut self.partial.payload;
                let missing = length - payload.len();
                if payload.len() == payload.capacity() {
                    payload.reserve_exact(missing.min(payload.len().max(FIRST_ALLOCATION)));
                }
                (&mut self.read).take(missing as u64).read_buf(payload).await
            };
            let count = tokio::select! {
                biased;
                // Reading comes first: bytes that came while this process was stopped are life.
                count = read => count.map_err(|error| Error::io("reading from the peer", &error))?,
                error = aborted(&mut end) => return Err(error),
                () = tokio::time::sleep(silence.saturating_sub(quiet)) => {
                    let after = self.shared.last_seen().elapsed();
                    let limit = Duration::from_micros(self.shared.silence_us.load(Relaxed));
                    if after < limit {
                        continue;
                    }
                    let (after_ms, limit_ms) = (after.as_millis() as u64, limit.as_millis() as u64);
                    return Err(Error::Silent { after_ms, limit_ms });
                }
            };
            if self.partial.header.is_none() {
                self.partial.filled += count;
            }
            if count > 0 {
                self.shared.see(count);
            }
            return Ok(count);
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
