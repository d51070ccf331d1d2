//! A stream whose bytes leave and arrive when its shape grants it.

use std::{
    collections::VecDeque,
    io::{self, IoSlice},
    pin::Pin,
    task::{Context, Poll, ready},
    time::Duration,
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::Instant,
};

use super::{Shape, TICK, Wait};

/// The most that a stream makes up for when it was woken too late.
const CATCH_UP: Duration = Duration::from_millis(50);
/// Most bytes taken from the stream at a time.
const TAKEN_BYTES: usize = 128 << 10;
/// Pieces that may be taken in before those taken earlier are due: what a network card holds.
const HELD_PIECES: usize = 4;

/// A stream, shaped or not. Cancel safe as the stream underneath.
#[derive(Debug)]
pub struct Shaped<S> {
    inner: S,
    way: Option<Box<Way>>,
}

/// The last piece that was written.
#[derive(Debug)]
struct Left {
    /// When it was to leave.
    due: Instant,
    written: Instant,
    /// Whether more was at hand with it.
    more: bool,
}

#[derive(Debug)]
struct Way {
    shape: Shape,
    /// Bytes that may be written, and from when.
    granted: Option<(Instant, usize)>,
    /// The last piece that was written.
    left: Option<Left>,
    writing: Wait,
    /// Bytes that have come, with the time they are due.
    held: VecDeque<(Instant, Vec<u8>)>,
    held_bytes: usize,
    /// How much of the first of them was given away.
    given: usize,
    /// When the last piece is due, where the stream had more at once.
    backlog: Option<Instant>,
    /// Where bytes are taken in.
    scratch: Box<[u8]>,
    /// What came after them: the end, or a fault.
    last: Option<io::Result<()>>,
    reading: Wait,
}

impl<S> Shaped<S> {
    /// Wraps `stream`; without a shape it passes everything as it is.
    pub fn new(stream: S, shape: Option<&Shape>) -> Self {
        let way = shape.map(|shape| {
            Box::new(Way {
                scratch: vec![0; shape.out.wire.piece.clamp(1, TAKEN_BYTES)].into_boxed_slice(),
                shape: shape.clone(),
                granted: None,
                left: None,
                backlog: None,
                writing: Wait::default(),
                held: VecDeque::new(),
                held_bytes: 0,
                given: 0,
                last: None,
                reading: Wait::default(),
            })
        });
        Self { inner: stream, way }
    }
}

impl<S: AsyncWrite + Unpin> Shaped<S> {
    /// Writes a piece of `buf` when it is granted; `more` follows at once.
    fn poll_piece(&mut self, cx: &mut Context<'_>, buf: &[u8], more: bool) -> Poll<io::Result<usize>> {
        let Some(way) = &mut self.way else { return Pin::new(&mut self.inner).poll_write(cx, buf) };
        if buf.is_empty() {
            return Poll::Ready(Ok(0));
        }
        let (from, bytes) = match way.granted {
            Some(granted) => granted,
            None => {
                let bytes = buf.len().min(way.shape.out.wire.piece);
                let now = Instant::now();
                let ready = match way.left {
                    // It was ready when the piece before was: a timer that was late costs nothing.
                    Some(Left { due, written, more }) if more || now - written < TICK => late(due, now),
                    _ => now,
                };
                let from = way.shape.leave(ready, bytes);
                way.granted = Some((from, bytes));
                (from, bytes)
            }
        };
        ready!(way.writing.poll(from, cx));
        let end = bytes.min(buf.len());
        let Poll::Ready(written) = Pin::new(&mut self.inner).poll_write(cx, &buf[..end])? else {
            // The other side is slower: it is not this one that is late.
            way.granted = Some((Instant::now(), bytes));
            return Poll::Pending;
        };
        way.left = Some(Left { due: from, written: Instant::now(), more: buf.len() > written || more });
        way.granted = (written < bytes).then(|| (from, bytes - written));
        Poll::Ready(Ok(written))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Shaped<S> {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        self.get_mut().poll_piece(cx, buf, false)
    }

    fn poll_flush(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().inner).poll_flush(cx)
    }

    fn poll_shutdown(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().inner).poll_shutdown(cx)
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        if this.way.is_none() {
            return Pin::new(&mut this.inner).poll_write_vectored(cx, bufs);
        }
        let mut full = bufs.iter().filter(|buf| !buf.is_empty());
        let first = full.next().map_or(&[][..], |buf| buf);
        this.poll_piece(cx, first, full.next().is_some())
    }

    fn is_write_vectored(&self) -> bool {
        self.way.is_none() && self.inner.is_write_vectored()
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Shaped<S> {
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let inner = Pin::new(&mut this.inner);
        match &mut this.way {
            Some(way) if way.shape.delays() => way.poll_read(inner, cx, buf),
            _ => inner.poll_read(cx, buf),
        }
    }
}

/// When what follows a piece that was due at `due` was ready, if it waited for its turn.
fn late(due: Instant, now: Instant) -> Instant {
    due.min(now).max(now.checked_sub(CATCH_UP).unwrap_or(now))
}

impl Way {
    /// Takes in what has come, then gives what is due.
    fn poll_read<S: AsyncRead>(
        &mut self,
        mut inner: Pin<&mut S>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let most = HELD_PIECES * self.scratch.len();
        while self.last.is_none() && self.held_bytes < most {
            let mut taken = ReadBuf::new(&mut self.scratch);
            match inner.as_mut().poll_read(cx, &mut taken) {
                Poll::Pending => {
                    self.backlog = None;
                    break;
                }
                Poll::Ready(Err(error)) => self.last = Some(Err(error)),
                Poll::Ready(Ok(())) if taken.filled().is_empty() => self.last = Some(Ok(())),
                Poll::Ready(Ok(())) => {
                    let bytes = taken.filled().to_vec();
                    self.held_bytes += bytes.len();
                    let now = Instant::now();
                    let ready = self.backlog.map_or(now, |due| late(due, now));
                    let due = self.shape.arrive(ready, bytes.len());
                    self.backlog = Some(due);
                    self.held.push_back((due, bytes));
                }
            }
        }
        let Some((due, bytes)) = self.held.front() else {
            return match &mut self.last {
                None => Poll::Pending,
                Some(last) => Poll::Ready(std::mem::replace(last, Ok(()))),
            };
        };
        ready!(self.reading.poll(*due, cx));
        let end = bytes.len().min(self.given + buf.remaining());
        buf.put_slice(&bytes[self.given..end]);
        if end == bytes.len() {
            self.held_bytes -= bytes.len();
            self.held.pop_front();
            self.given = 0;
        } else {
            self.given = end;
        }
        Poll::Ready(Ok(()))
    }
}
