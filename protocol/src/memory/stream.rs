//! Both halves of a stream over memory, and the TCP connection that wakes them.
//!
//! Bytes on the connection say only that there is something to look at, so how many come, and what they are, does not matter.
//! Its end is that of the other process, or of its link: what stands in the ring is still read.

use std::{
    io::{Error, ErrorKind, IoSlice, Read, Result},
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll, Wake, Waker, ready},
};

use tokio::{
    io::{AsyncRead, AsyncWrite, Interest, ReadBuf},
    net::TcpStream,
};

use super::ring::{Consumer, Producer};

/// Bytes after which the other side is shown what has been put in, though more follows: it copies meanwhile.
const PIECE: usize = 32 << 10;

/// Whoever sleeps for this connection: the reader and the writer of this side.
#[derive(Default)]
struct Sleepers([Mutex<Option<Waker>>; 2]);

/// Who sleeps.
#[derive(Clone, Copy)]
enum Who {
    Reader = 0,
    Writer = 1,
}

impl Who {
    const fn other(self) -> Self {
        match self {
            Self::Reader => Self::Writer,
            Self::Writer => Self::Reader,
        }
    }
}

impl Sleepers {
    fn put(&self, who: Who, waker: &Waker) {
        let mut slot = self.0[who as usize].lock().unwrap_or_else(PoisonError::into_inner);
        match &mut *slot {
            Some(old) => old.clone_from(waker),
            none => *none = Some(waker.clone()),
        }
    }

    fn wake_one(&self, who: Who) {
        let waker = self.0[who as usize].lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

impl Wake for Sleepers {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.wake_one(Who::Reader);
        self.wake_one(Who::Writer);
    }
}

/// A TCP connection that carries nothing but calls to wake up.
pub(super) struct Bell {
    connection: TcpStream,
    sleepers: Arc<Sleepers>,
    /// Wakes both: the connection knows one reader only.
    both: Waker,
}

impl Bell {
    /// Called within a runtime.
    pub(super) fn new(socket: socket2::Socket) -> Result<Self> {
        let connection = TcpStream::from_std(socket.into())?;
        let sleepers = Arc::new(Sleepers::default());
        Ok(Self { connection, both: Waker::from(Arc::clone(&sleepers)), sleepers })
    }

    /// Wakes the other side.
    fn ring(&self) -> Result<()> {
        loop {
            // Not by the runtime, which does not write for a task that has had its turn.
            match socket2::SockRef::from(&self.connection).send(&[0]) {
                Ok(_) => return Ok(()),
                // It has not listened to the many calls before this one, and will find them when it does.
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Waits until the other side calls. Whoever waits has put its waker among the sleepers before it said that it waits.
    ///
    /// # Errors
    /// If the connection has ended.
    fn poll(&self, who: Who) -> Poll<Result<()>> {
        loop {
            ready!(self.connection.poll_read_ready(&mut Context::from_waker(&self.both)))?;
            let (mut calls, mut count) = ([0; 64], None);
            let read = self.connection.try_io(Interest::READABLE, || {
                let found = (&*socket2::SockRef::from(&self.connection)).read(&mut calls)?;
                count = Some(found);
                // Fewer than there might be are all of them: the runtime need not find that out by another call.
                if (1..calls.len()).contains(&found) { Err(ErrorKind::WouldBlock.into()) } else { Ok(()) }
            });
            match (count, read) {
                (Some(0), _) => return Poll::Ready(Err(ErrorKind::UnexpectedEof.into())),
                (Some(_), _) => {
                    // It may have been meant for the other half.
                    self.sleepers.wake_one(who.other());
                    return Poll::Ready(Ok(()));
                }
                (None, Err(error))
                    if !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) =>
                {
                    return Poll::Ready(Err(error));
                }
                (None, _) => {}
            }
        }
    }
}

/// Whether nobody is to be woken: the caller only looks.
fn only_looks(cx: &Context<'_>) -> bool {
    cx.waker().will_wake(Waker::noop())
}

/// The half that reads. One that is polled with the no-op waker looks at the memory alone.
pub struct Reading {
    ring: Consumer,
    bell: Arc<Bell>,
    /// How the connection has ended.
    end: Option<Error>,
}

impl Reading {
    pub(super) const fn new(ring: Consumer, bell: Arc<Bell>) -> Self {
        Self { ring, bell, end: None }
    }

    /// Whether there is something to read, or never will be.
    fn is_ready(&mut self) -> Result<bool> {
        Ok(self.ring.filled()? > 0 || self.ring.is_closed())
    }
}

impl AsyncRead for Reading {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<Result<()>> {
        let this = &mut *self;
        loop {
            // Looked at before the bytes are: those that were put in before it was closed are seen then.
            let closed = this.ring.is_closed();
            let count = this.ring.take(buf.initialize_unfilled())?;
            if count > 0 {
                buf.advance(count);
                if this.ring.has_made_room() {
                    // One that is gone is found when there is nothing left to read.
                    let _ = this.bell.ring();
                }
                return Poll::Ready(Ok(()));
            }
            match &this.end {
                _ if closed => return Poll::Ready(Ok(())),
                None if only_looks(cx) => return Poll::Pending,
                None => {}
                Some(end) if end.kind() == ErrorKind::UnexpectedEof => return Poll::Ready(Ok(())),
                Some(end) => return Poll::Ready(Err(Error::new(end.kind(), end.to_string()))),
            }
            this.bell.sleepers.put(Who::Reader, cx.waker());
            this.ring.wait();
            if this.is_ready()? {
                this.ring.wait_no_more();
                continue;
            }
            if let Err(error) = ready!(this.bell.poll(Who::Reader)) {
                // What was put in before the end is there now.
                this.end = Some(error);
            }
        }
    }
}

/// The half that writes. One that is polled with the no-op waker does not wait for room.
pub struct Writing {
    ring: Producer,
    bell: Arc<Bell>,
}

impl Writing {
    pub(super) const fn new(ring: Producer, bell: Arc<Bell>) -> Self {
        Self { ring, bell }
    }

    fn publish(&mut self) -> Result<()> {
        if self.ring.publish() { self.bell.ring() } else { Ok(()) }
    }

    /// Puts in as much as fits.
    fn put(&mut self, bufs: &[IoSlice<'_>]) -> Result<usize> {
        let mut sum = 0;
        'full: for buf in bufs {
            for piece in buf.chunks(PIECE) {
                let count = self.ring.put(piece)?;
                sum += count;
                if count < piece.len() {
                    break 'full;
                }
                if self.ring.unpublished() >= PIECE as u64 {
                    self.publish()?;
                }
            }
        }
        if self.ring.unpublished() > 0 {
            self.publish()?;
        }
        Ok(sum)
    }
}

impl AsyncWrite for Writing {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<Result<usize>> {
        self.poll_write_vectored(cx, &[IoSlice::new(buf)])
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[IoSlice<'_>],
    ) -> Poll<Result<usize>> {
        let this = &mut *self;
        loop {
            let sum = this.put(bufs)?;
            if sum > 0 || bufs.iter().all(|buf| buf.is_empty()) {
                return Poll::Ready(Ok(sum));
            }
            if only_looks(cx) {
                return Poll::Pending;
            }
            this.bell.sleepers.put(Who::Writer, cx.waker());
            this.ring.wait();
            if this.ring.room(1)? > 0 {
                this.ring.wait_no_more();
                continue;
            }
            if let Err(error) = ready!(this.bell.poll(Who::Writer)) {
                // The other side does not take what is in the ring.
                return Poll::Ready(Err(Error::new(ErrorKind::BrokenPipe, error)));
            }
        }
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, _cx: &mut Context<'_>) -> Poll<Result<()>> {
        if self.ring.close() {
            // One that is gone needs no call.
            let _ = self.bell.ring();
        }
        Poll::Ready(Ok(()))
    }
}
