//! A connection of the page, which ends when its caller is late.
//!
//! A deadline holds while a request is on its way and between requests, not while its answer is worked out.

use std::{
    net::SocketAddr,
    pin::Pin,
    sync::{Arc, atomic::Ordering},
    task::{Context, Poll},
    time::Duration,
};

use axum::{
    body::{Body, HttpBody},
    extract::{ConnectInfo, Request, connect_info::Connected},
    middleware::Next,
    response::Response,
    serve::IncomingStream,
};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    net::TcpStream,
    sync::oneshot,
    time::Sleep,
};
use tokio_rustls::server::TlsStream;
use tokio_stream::StreamExt;

use super::{Caller, Door};
use crate::places;

/// More bytes than these are no headers any more, but a deck on its way.
const HEADER_BYTES: usize = 16 << 10;

/// How long callers may take.
#[derive(Clone, Copy)]
pub struct Limits {
    /// The longest that a caller may take to say what it asks for.
    pub header: Duration,
    /// The longest that a deck may be on its way, and that a connection may stand after something was answered; a stream
    /// of events says something every 15 s.
    pub idle: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self { header: Duration::from_secs(5), idle: Duration::from_secs(60) }
    }
}

/// Whose request it is.
#[derive(Clone)]
pub struct Asker(Arc<Caller>);

impl Connected<IncomingStream<'_, Door>> for Asker {
    fn connect_info(stream: IncomingStream<'_, Door>) -> Self {
        Self(Arc::clone(&stream.io().caller))
    }
}

/// Notes that a request has come to its end, from where on its caller waits for the answer.
pub async fn note_work(
    ConnectInfo(Asker(caller)): ConnectInfo<Asker>,
    request: Request,
    next: Next,
) -> Response {
    let whole = move || {
        caller.silent.store(false, Ordering::Relaxed);
        caller.waits.store(true, Ordering::Relaxed);
    };
    if request.body().is_end_stream() {
        whole();
        return next.run(request).await;
    }
    let mut end = Some(whole);
    let after = tokio_stream::iter(std::iter::from_fn(move || {
        if let Some(whole) = end.take() {
            whole();
        }
        None
    }));
    next.run(request.map(|body| Body::from_stream(body.into_data_stream().chain(after)))).await
}

/// A connection, which gives its place back when it ends.
pub struct Wire {
    stream: Stream,
    pub from: SocketAddr,
    limits: Limits,
    /// Ends it.
    deadline: Pin<Box<Sleep>>,
    /// Bytes read since something was answered.
    taken: usize,
    caller: Arc<Caller>,
    /// Another one needs its place.
    ended: oneshot::Receiver<()>,
    _place: places::Place,
}

impl Wire {
    /// With its caller, and what tells it to end.
    pub fn new(
        stream: Stream,
        from: SocketAddr,
        limits: Limits,
        (caller, ended): (Arc<Caller>, oneshot::Receiver<()>),
        place: places::Place,
    ) -> Self {
        let deadline = Box::pin(tokio::time::sleep(limits.header));
        Self { stream, from, limits, deadline, taken: 0, caller, ended, _place: place }
    }

    fn grant(&mut self) {
        self.deadline.as_mut().reset(tokio::time::Instant::now() + self.limits.idle);
    }
}

/// What bytes of the page travel on.
pub enum Stream {
    Plain(TcpStream),
    Tls(Box<TlsStream<TcpStream>>),
}

impl AsyncRead for Wire {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<std::io::Result<()>> {
        // While an answer is worked out, the caller is not the one who is late. The server reads meanwhile, to see it go.
        while self.deadline.as_mut().poll(cx).is_ready() {
            if !self.caller.waits.load(Ordering::Relaxed) {
                return Poll::Ready(Err(std::io::ErrorKind::TimedOut.into()));
            }
            self.grant();
        }
        if Pin::new(&mut self.ended).poll(cx).is_ready() {
            return Poll::Ready(Err(std::io::ErrorKind::ConnectionAborted.into()));
        }
        let before = into.filled().len();
        let read = match &mut self.stream {
            Stream::Plain(stream) => Pin::new(stream).poll_read(cx, into),
            Stream::Tls(stream) => Pin::new(stream).poll_read(cx, into),
        };
        let only_headers = self.taken <= HEADER_BYTES;
        self.taken += into.filled().len() - before;
        if only_headers && self.taken > HEADER_BYTES {
            self.caller.silent.store(false, Ordering::Relaxed);
            self.grant();
        }
        read
    }
}

impl AsyncWrite for Wire {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<std::io::Result<usize>> {
        self.taken = 0;
        self.caller.silent.store(false, Ordering::Relaxed);
        self.caller.waits.store(false, Ordering::Relaxed);
        self.grant();
        match &mut self.stream {
            Stream::Plain(stream) => Pin::new(stream).poll_write(cx, bytes),
            Stream::Tls(stream) => Pin::new(stream).poll_write(cx, bytes),
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        match &mut self.stream {
            Stream::Plain(stream) => Pin::new(stream).poll_flush(cx),
            Stream::Tls(stream) => Pin::new(stream).poll_flush(cx),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<std::io::Result<()>> {
        match &mut self.stream {
            Stream::Plain(stream) => Pin::new(stream).poll_shutdown(cx),
            Stream::Tls(stream) => Pin::new(stream).poll_shutdown(cx),
        }
    }
}

#[cfg(test)]
mod tests {
    use axum::{Router, body::Bytes, middleware, routing::post};
    use tokio::{
        io::{AsyncReadExt, AsyncWriteExt},
        time::{Instant, sleep, timeout},
    };

    use super::*;
    use crate::http::{Place, serve_within};

    const LIMITS: Limits = Limits { header: Duration::from_millis(600), idle: Duration::from_millis(1200) };

    /// Serves one path, whose answer takes longer than any limit, and connects to it.
    async fn connect() -> TcpStream {
        let work = |deck: Bytes| async move {
            sleep(2 * LIMITS.idle + LIMITS.header).await;
            format!("{} bytes", deck.len())
        };
        let router = Router::new().route("/", post(work)).layer(middleware::from_fn(note_work));
        let place = Place::open("127.0.0.1:0".parse().expect("an address"), None).await.expect("a port");
        let address = place.address().expect("bound");
        tokio::spawn(serve_within(place, router, LIMITS));
        TcpStream::connect(address).await.expect("taken")
    }

    fn head(bytes: usize) -> Vec<u8> {
        format!("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: {bytes}\r\n\r\n").into_bytes()
    }

    /// Whether the server hangs up while this goes on, not before a limit, and does no work; half a deck may be refused.
    async fn is_cut_off(mut stream: TcpStream, limit: Duration, drip: bool) -> bool {
        let start = Instant::now();
        let (mut said, mut all) = ([0; 512], Vec::new());
        loop {
            match timeout(Duration::from_millis(20), stream.read(&mut said)).await {
                Ok(Ok(count)) if count > 0 => all.extend_from_slice(&said[..count]),
                Ok(_) => {
                    let refused = all.is_empty() || all.starts_with(b"HTTP/1.1 400");
                    return refused && start.elapsed() >= limit;
                }
                Err(_) if start.elapsed() > 4 * LIMITS.idle => return false,
                Err(_) if drip => drop(stream.write_all(b"x").await),
                Err(_) => {}
            }
        }
    }

    #[tokio::test]
    async fn an_answer_may_take_longer_than_the_limits_on_a_new_connection_and_a_kept_one() {
        let mut stream = connect().await;
        for _ in 0..2 {
            stream.write_all(&head(4)).await.expect("written");
            stream.write_all(b"deck").await.expect("written");
            let mut said = [0; 512];
            let count = stream.read(&mut said).await.expect("an answer");
            let said = String::from_utf8_lossy(&said[..count]);
            assert!(said.starts_with("HTTP/1.1 200") && said.ends_with("4 bytes"), "{said:?}");
        }
        assert!(is_cut_off(stream, LIMITS.idle / 2, false).await, "it stands after its answers");
    }

    #[tokio::test]
    async fn who_is_mute_and_who_drips_is_cut_off() {
        let mute = connect().await;
        assert!(is_cut_off(mute, LIMITS.header / 2, false).await, "mute");
        for (bytes, limit) in [(0, LIMITS.header), (HEADER_BYTES + 1, LIMITS.idle)] {
            let mut drips = connect().await;
            drips.write_all(&head(1 << 20)).await.expect("written");
            drips.write_all(&vec![b'x'; bytes]).await.expect("written");
            assert!(is_cut_off(drips, limit / 2, true).await, "after {bytes} bytes");
        }
    }
}
