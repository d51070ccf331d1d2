//! The link: frames both ways over one byte stream, neither way waiting for the other.
//!
//! [`split`] takes any stream (TCP, TLS, a pipe in memory) apart into a [`Sender`] and a [`Receiver`].
//! Sending puts a frame into a bounded queue and returns; what the stream takes of it at once is written
//! there and then, the rest by a task of the link. So two peers that both send more than their sockets hold
//! do not wait for each other, as long as each of them receives. The queue has two priorities: chunks of
//! bulk messages go one at a time and only when nothing else is queued, so a cycle frame waits for at most
//! one chunk inside the link and what the system has taken ([`UNSENT_BYTES`]).
//!
//! A receiver that did not wait long for its last frame does not sleep at once for the next: it looks for up
//! to [`EAGER`], giving way to other threads. Peers that answer each other within microseconds are spared the
//! time it takes to wake a thread; one that waits for a computation sleeps as before.
//!
//! A link ends as a whole: a bad frame, a silent peer, the receiver's drop or [`Sender::abort`] closes it
//! both ways. Only a clean end is one-sided: when the last sender is dropped, what is queued is written
//! and the stream's sending side closed, while the receiver goes on. What frames mean is not known here, except
//! that heartbeats are swallowed.
//!
//! Make a [`Socket`] of a TCP stream before splitting it: otherwise nobody can look, and the system's own send buffer holds
//! megabytes of bulk that no cycle frame can overtake.

mod greeting;
mod receiver;
mod sender;
mod socket;
mod writer;

pub use greeting::{GREETING_LIMIT, admit, admit_near, greet, greet_near, hear};
pub use receiver::Receiver;
pub use sender::Sender;
pub use socket::Socket;

use crate::codec::{MESSAGE_LIMIT, OPEN_STREAMS};
use crate::frame::{Frame, Kind};
use crate::{Error, Result};
use sender::Queue;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::runtime::Handle;
use tokio::sync::{Notify, watch};
use tokio::time::Instant;
use writer::Writer;

/// Bytes of short frames that are handed to the stream together.
pub const WRITE_BUFFER: usize = 128 << 10;
/// Bytes that the system takes of a tuned TCP stream before it has sent what it took earlier: 10 ms of a
/// 100 Mbit/s link.
pub const UNSENT_BYTES: u32 = 128 << 10;
/// Bytes asked of the stream at a time for headers and short frames; what they do not hold of a payload is
/// read straight to its place.
pub const READ_BUFFER: usize = 8 << 10;
/// Bytes of payload asked of the stream at a time: its checksum is taken while they are in the cache.
pub const READ_AT_ONCE: usize = 256 << 10;
/// How long a receiver looks for bytes before it sleeps, if its last wait was no longer.
pub const EAGER: Duration = Duration::from_micros(30);
/// Bytes of payload that are allocated before as many have come: a lying header costs no more.
pub const FIRST_ALLOCATION: usize = 256 << 10;
/// Heartbeats that a peer may miss before it counts as dead: a busy PC may swap for seconds.
pub const MISSED_HEARTBEATS: u32 = 10;
/// Payload buffers kept for reuse.
pub const SPARE_BUFFERS: usize = 8;
/// Bytes of the largest buffer kept for reuse.
pub const SPARE_BYTES: usize = 8 << 20;

/// The bounds and intervals of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Frames other than bulk that may be queued. At most two cycles are under way toward a neighbour,
    /// so a longer queue means a peer that does not read.
    pub queued_frames: usize,
    /// Bytes of those frames' payloads.
    pub queued_bytes: usize,
    /// Bulk messages that may be queued; [`OPEN_STREAMS`] of them take turns.
    pub bulk_messages: usize,
    /// Bytes of those messages.
    pub bulk_bytes: usize,
    /// Bulk messages that may be queued to be made.
    pub later_messages: usize,
    /// After this long without a frame sent, a heartbeat goes out.
    pub heartbeat: Duration,
    /// After this long without a byte received, [`Receiver::receive`] gives [`Error::Silent`].
    pub silence: Duration,
}

impl Default for Settings {
    /// 1,024 frames and 256 MiB; 256 messages and 2 GiB of bulk, and 4,096 to be made; a heartbeat each second, of
    /// which [`MISSED_HEARTBEATS`] may be missed.
    fn default() -> Self {
        Self {
            queued_frames: 1024,
            queued_bytes: 256 << 20,
            bulk_messages: 16 * OPEN_STREAMS,
            bulk_bytes: 2 * MESSAGE_LIMIT,
            later_messages: 4096,
            heartbeat: Duration::from_secs(1),
            silence: MISSED_HEARTBEATS * Duration::from_secs(1),
        }
    }
}

/// What has passed over a link since it stood, headers and heartbeats included; bytes before encryption.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames handed to the stream.
    pub frames_sent: u64,
    /// Bytes handed to the stream.
    pub bytes_sent: u64,
    /// Whole frames received.
    pub frames_received: u64,
    pub bytes_received: u64,
}

/// Prepares a TCP stream for a link: small frames leave at once (`TCP_NODELAY`; the link gathers them by
/// itself), and on Linux the system queues at most [`UNSENT_BYTES`] that it has not sent yet.
///
/// # Errors
/// [`Error::Io`] when the system refuses an option.
pub fn tune(stream: &TcpStream) -> Result<()> {
    let fault = |error| Error::io("setting TCP options", &error);
    stream.set_nodelay(true).map_err(fault)?;
    #[cfg(any(target_os = "linux", target_os = "android"))]
    socket2::SockRef::from(stream).set_tcp_notsent_lowat(UNSENT_BYTES).map_err(fault)?;
    Ok(())
}

/// Takes `stream` apart and starts the task that writes to it.
///
/// # Panics
/// Outside a tokio runtime with time enabled.
pub fn split<S>(stream: S, settings: Settings) -> (Sender, Receiver)
where
    S: AsyncRead + AsyncWrite + Send + 'static,
{
    let (read, write) = tokio::io::split(stream);
    let shared = Arc::new(Shared::new(settings, Writer::new(Box::new(write))));
    let receiver = Receiver::new(Box::new(read), Arc::clone(&shared));
    (Sender::start(shared), receiver)
}

/// What the two halves and the writing task know together.
struct Shared {
    settings: Settings,
    start: Instant,
    /// Microseconds from `start` to the last byte received.
    last_seen: AtomicU64,
    /// Microseconds from `start` to the last frame handed to the stream.
    last_sent: AtomicU64,
    heartbeat_us: AtomicU64,
    silence_us: AtomicU64,
    frames_sent: AtomicU64,
    bytes_sent: AtomicU64,
    frames_received: AtomicU64,
    bytes_received: AtomicU64,
    queue: Mutex<Queue>,
    /// There may be something queued or under way; a hint, written under the lock of `queue`.
    unwritten: AtomicBool,
    /// Locked before `queue` where both are; none once the link has ended.
    writer: Mutex<Option<Writer>>,
    /// There is something to write, or the interval has changed.
    work: Notify,
    /// Why the link ended, once it has.
    end: watch::Sender<Option<Error>>,
    /// Whether the writing task has stopped.
    written: watch::Sender<bool>,
    spare: Mutex<Vec<Vec<u8>>>,
    /// For senders that write on a thread of their own: a shaped stream waits with the runtime's timer.
    runtime: Handle,
}

impl Shared {
    fn new(settings: Settings, writer: Writer) -> Self {
        Self {
            settings,
            start: Instant::now(),
            last_seen: AtomicU64::new(0),
            last_sent: AtomicU64::new(0),
            heartbeat_us: AtomicU64::new(micros(settings.heartbeat)),
            silence_us: AtomicU64::new(micros(settings.silence)),
            frames_sent: AtomicU64::new(0),
            bytes_sent: AtomicU64::new(0),
            frames_received: AtomicU64::new(0),
            bytes_received: AtomicU64::new(0),
            queue: Mutex::default(),
            unwritten: AtomicBool::new(false),
            writer: Mutex::new(Some(writer)),
            work: Notify::new(),
            end: watch::Sender::new(None),
            written: watch::Sender::new(false),
            spare: Mutex::default(),
            runtime: Handle::current(),
        }
    }

    /// Ends the link; the first reason stays.
    fn fail(&self, error: Error) {
        self.end.send_if_modified(|end| {
            let first = end.is_none();
            if first {
                *end = Some(error);
            }
            first
        });
    }

    fn ended(&self) -> Option<Error> {
        self.end.borrow().clone()
    }

    fn last_seen(&self) -> Instant {
        self.start + Duration::from_micros(self.last_seen.load(Relaxed))
    }

    fn see(&self, bytes: usize) {
        self.bytes_received.fetch_add(bytes as u64, Relaxed);
        self.last_seen.store(micros(self.start.elapsed()), Relaxed);
    }

    fn counters(&self) -> Counters {
        Counters {
            frames_sent: self.frames_sent.load(Relaxed),
            bytes_sent: self.bytes_sent.load(Relaxed),
            frames_received: self.frames_received.load(Relaxed),
            bytes_received: self.bytes_received.load(Relaxed),
        }
    }

    /// An empty buffer, one that has been used before if there is any.
    fn buffer(&self) -> Vec<u8> {
        let mut buffer = self.used_buffer();
        buffer.clear();
        buffer
    }

    /// A buffer with whatever it held when it was given back: its bytes need no zeros before they are read into.
    fn used_buffer(&self) -> Vec<u8> {
        lock(&self.spare).pop().unwrap_or_default()
    }

    /// Keeps a buffer for reuse, within [`SPARE_BUFFERS`] and [`SPARE_BYTES`].
    fn recycle(&self, buffer: Vec<u8>) {
        if buffer.capacity() == 0 || buffer.capacity() > SPARE_BYTES {
            return;
        }
        let mut spare = lock(&self.spare);
        if spare.len() < SPARE_BUFFERS {
            spare.push(buffer);
        }
    }

    /// Counts a frame that the stream has taken, and keeps its buffer.
    fn sent(&self, frame: Frame, header_and_payload: usize) {
        self.frames_sent.fetch_add(1, Relaxed);
        self.bytes_sent.fetch_add(header_and_payload as u64, Relaxed);
        self.last_sent.store(micros(self.start.elapsed()), Relaxed);
        if frame.header.kind != Kind::Bulk {
            lock(&self.queue).written(frame.payload.len());
        }
        self.recycle(frame.payload);
    }
}

/// Locks; nothing that holds one of the link's locks can panic half-way, so a poisoned one is sound.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn micros(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)
}
