//! A TCP stream as links want it: read without asking first whether there is anything to read.
//!
//! Tokio's own stream reads only after the runtime has heard from the system that bytes are there. A [`Receiver`] that
//! expects its answer within microseconds would rather look by itself; it does so by polling with the no-op waker,
//! which nobody else has a use for.
//!
//! [`Receiver`]: super::Receiver

use super::tune;
use crate::Result;
use std::io::{ErrorKind, IoSlice, Read};
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll, Waker, ready};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

/// A tuned TCP stream whose readers may look before they wait.
pub struct Socket(TcpStream);

impl Socket {
    /// Takes a connected stream, after [`tune`].
    ///
    /// # Errors
    /// As for [`tune`].
    pub fn new(stream: TcpStream) -> Result<Self> {
        tune(&stream)?;
        Ok(Self(stream))
    }

    /// The address of this side.
    ///
    /// # Errors
    /// If the system does not know it.
    pub fn local_addr(&self) -> std::io::Result<SocketAddr> {
        self.0.local_addr()
    }

    /// The address of the other side.
    ///
    /// # Errors
    /// If the system does not know it.
    pub fn peer_addr(&self) -> std::io::Result<SocketAddr> {
        self.0.peer_addr()
    }

    /// The same connection once more: it ends when both are dropped.
    pub(crate) fn another(&self) -> std::io::Result<socket2::Socket> {
        socket2::SockRef::from(&self.0).try_clone()
    }
}

impl AsyncRead for Socket {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<std::io::Result<()>> {
        let into = buf.initialize_unfilled();
        match (&*socket2::SockRef::from(&self.0)).read(into) {
            Ok(count) => {
                buf.advance(count);
                Poll::Ready(Ok(()))
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                if cx.waker().will_wake(Waker::noop()) {
                    return Poll::Pending;
                }
                ready!(Pin::new(&mut self.0).poll_read(cx, buf))?;
                Poll::Ready(Ok(()))
            }
            Err(error) => Poll::Ready(Err(error)),
        }
    }
}

impl AsyncWrite for Socket {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &[u8],
    ) -> Poll<std::io::Result<usize>> {
        Pin::new(&mut self.0).poll_write(cx, buf)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[IoSlice<'_>],
    ) -> Poll<std::io::Result<usize>> {
        Pin::new(&mut self.0).poll_write_vectored(cx, bufs)
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(cx)
    }
}
