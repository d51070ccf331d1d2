//! A stream whose bytes leave and arrive when its shape grants it.

use std::{
    collections::VecDeque,
    io::{self, IoSlice},
    pin::Pin,
    task::{Context, Poll, ready},
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::Instant,
};

use super::{Shape, Wait};

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

#[derive(Debug)]
struct Way {
    shape: Shape,
    /// Bytes that may be written, and from when.
    granted: Option<(Instant, usize)>,
    writing: Wait,
    /// Bytes that have come, with the time they are due.
    held: VecDeque<(Instant, Vec<u8>)>,
    held_bytes: usize,
    /// How much of the first of them was given away.
    given: usize,
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

impl<S: AsyncWrite + Unpin> AsyncWrite for Shaped<S> {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        let Some(way) = &mut this.way else { return Pin::new(&mut this.inner).poll_write(cx, buf) };
        if buf.is_empty() {
            return Poll::Ready(Ok(0));
        }
        let (from, bytes) = match way.granted {
            Some(granted) => granted,
            None => {
                let bytes = buf.len().min(way.shape.out.wire.piece);
                let from = way.shape.leave(Instant::now(), bytes);
                way.granted = Some((from, bytes));
                (from, bytes)
            }
        };
        ready!(way.writing.poll(from, cx));
        let end = bytes.min(buf.len());
        let written = ready!(Pin::new(&mut this.inner).poll_write(cx, &buf[..end]))?;
        way.granted = (written < bytes).then(|| (from, bytes - written));
        Poll::Ready(Ok(written))
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
        let first = bufs.iter().find(|buf| !buf.is_empty()).map_or(&[][..], |buf| buf);
        Pin::new(this).poll_write(cx, first)
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
                Poll::Pending => break,
                Poll::Ready(Err(error)) => self.last = Some(Err(error)),
                Poll::Ready(Ok(())) if taken.filled().is_empty() => self.last = Some(Ok(())),
                Poll::Ready(Ok(())) => {
                    let bytes = taken.filled().to_vec();
                    self.held_bytes += bytes.len();
                    self.held.push_back((self.shape.arrive(Instant::now(), bytes.len()), bytes));
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
