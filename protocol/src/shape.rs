//! SHAPE: a stream that carries no more than an emulated wire would.
//!
//! A [`Lane`] is one direction of a wire: it grants time to bytes in the order they ask, so all streams that share it
//! share its rate. A [`Shape`] says which lanes a stream passes: a [port](Shape::port) of a switch has one lane out and
//! one in, for all links of a process; a [hub](Shape::hub) has one lane for everything. [`Shaped`] wraps the stream
//! below TLS, so what is counted is what a wire would carry: the bytes, and for each packet the headers, check sum,
//! preamble and gap of Ethernet, IP and TCP. Acknowledgements, losses and collisions are not emulated.
//!
//! Granted times are kept exactly, waits end on a tick of the runtime's timer ([`TICK`]): the rate is exact over many
//! packets, one packet may be a tick early or late. A stream that is woken late while more waits makes up for it. Time is
//! tokio's, so that tests can pause it.

use std::{
    fmt,
    future::Future,
    pin::Pin,
    str::FromStr,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    task::{Context, Poll},
    time::Duration,
};

use tokio::time::{Instant, Sleep};

mod stream;

pub use stream::Shaped;

/// Resolution of the runtime's timer.
pub const TICK: Duration = Duration::from_millis(1);
/// How far a lane may be ahead of its rate after it was idle.
pub const BURST: Duration = TICK;
/// Payload of a TCP segment over Ethernet, with time stamps (bytes).
pub const SEGMENT: u64 = 1448;
/// What a segment takes beside it: 20 IP, 32 TCP, 14 Ethernet, 4 check sum, 8 preamble, 12 gap (bytes).
pub const SEGMENT_OVERHEAD: u64 = 90;

/// Bits per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate(f64);

impl Rate {
    /// The slowest and the fastest (bit/s).
    pub const RANGE: [f64; 2] = [1e3, 1e12];

    /// A rate in [`Rate::RANGE`]; none outside.
    pub fn new(bits_per_second: f64) -> Option<Self> {
        let [slowest, fastest] = Self::RANGE;
        (slowest..=fastest).contains(&bits_per_second).then_some(Self(bits_per_second))
    }

    pub const fn bits_per_second(self) -> f64 {
        self.0
    }
}

impl FromStr for Rate {
    type Err = String;

    /// `10mbit`, `2.5gbit`, `64kbit`, or a number of bits per second.
    fn from_str(text: &str) -> Result<Self, String> {
        let units = [("kbit", 1e3), ("mbit", 1e6), ("gbit", 1e9), ("bit", 1.0)];
        let (number, unit) = units
            .iter()
            .find_map(|&(name, factor)| text.strip_suffix(name).map(|number| (number, factor)))
            .unwrap_or((text, 1.0));
        let value: f64 = number
            .parse()
            .map_err(|_| format!("{text:?} is no rate; write 10mbit, 100mbit, 1gbit or bits per second"))?;
        Self::new(value * unit).ok_or_else(|| {
            let [slowest, fastest] = Self::RANGE;
            format!("a rate of {text} is outside {slowest:e} to {fastest:e} bit/s")
        })
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            r if r >= 1e9 => write!(f, "{}gbit", r / 1e9),
            r if r >= 1e6 => write!(f, "{}mbit", r / 1e6),
            r => write!(f, "{}kbit", r / 1e3),
        }
    }
}

/// How bytes occupy a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wire {
    /// Bits per second.
    pub rate: Rate,
    /// Payload of a packet (bytes).
    pub payload: u64,
    /// What a packet takes beside it (bytes).
    pub overhead: u64,
    /// How far it may be ahead of the rate after an idle time.
    pub burst: Duration,
    /// Most bytes that are granted at a time: others take their turn between.
    pub piece: usize,
}

impl Wire {
    /// TCP over Ethernet, in pieces of a tick, but of a packet at least.
    pub fn ethernet(rate: Rate) -> Self {
        let packet = SEGMENT + SEGMENT_OVERHEAD;
        let packets = (rate.0 / 8.0 * TICK.as_secs_f64() / packet as f64) as u64;
        Self {
            rate,
            payload: SEGMENT,
            overhead: SEGMENT_OVERHEAD,
            burst: BURST,
            piece: (packets.clamp(1, 1024) * SEGMENT) as usize,
        }
    }

    /// Bytes on the wire of `bytes` sent at once.
    pub const fn wire_bytes(&self, bytes: u64) -> u64 {
        let packets = bytes.div_ceil(self.payload);
        bytes + if packets == 0 { 1 } else { packets } * self.overhead
    }

    /// How long `bytes` sent at once occupy it.
    pub fn occupation(&self, bytes: u64) -> Duration {
        Duration::from_secs_f64(self.wire_bytes(bytes) as f64 * 8.0 / self.rate.0)
    }
}

/// One direction of a wire, or a collision domain: one after the other, in the order they ask.
#[derive(Debug)]
pub struct Lane {
    wire: Wire,
    /// When all that was granted has passed; none before the first.
    free: Mutex<Option<Instant>>,
    carried: AtomicU64,
}

impl Lane {
    /// An idle one.
    pub const fn new(wire: Wire) -> Self {
        Self { wire, free: Mutex::new(None), carried: AtomicU64::new(0) }
    }

    /// Grants the next free time to `bytes` that are ready at `now`: when their first bit and their last bit pass.
    fn grant(&self, now: Instant, bytes: usize) -> (Instant, Instant) {
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let start = free.map_or(now, |free| free.max(now));
        let end = start + self.wire.occupation(bytes as u64);
        *free = Some(end);
        self.carried.fetch_add(self.wire.wire_bytes(bytes as u64), Relaxed);
        (start, end)
    }

    /// Bytes on the wire so far, what packets take beside their payload included.
    pub fn carried(&self) -> u64 {
        self.carried.load(Relaxed)
    }
}

/// The lanes that a stream passes. Clones share them.
#[derive(Clone, Debug)]
pub struct Shape {
    out: Arc<Lane>,
    /// None where `out` stands for the whole way.
    into: Option<Arc<Lane>>,
    latency: Duration,
}

impl Shape {
    /// A port of a switch: one lane in each direction. Of two ports that a message passes, the second begins while the
    /// first still sends.
    pub fn port(wire: Wire) -> Self {
        Self {
            out: Arc::new(Lane::new(wire)),
            into: Some(Arc::new(Lane::new(wire))),
            latency: Duration::ZERO,
        }
    }

    /// A collision domain: one lane for all streams and directions. Both ends of a stream must have this shape.
    pub fn hub(wire: Wire) -> Self {
        Self { out: Arc::new(Lane::new(wire)), into: None, latency: Duration::ZERO }
    }

    /// The same lanes with a latency for what comes in.
    #[must_use]
    pub fn with_latency(mut self, latency: Duration) -> Self {
        self.latency = latency;
        self
    }

    /// Bytes on the wire so far: out (of all, for a hub), in.
    pub fn carried(&self) -> (u64, u64) {
        (self.out.carried(), self.into.as_ref().map_or(0, |lane| lane.carried()))
    }

    /// When `bytes` that are ready at `now` may be written: at their first bit if a lane in follows, else at their last.
    fn leave(&self, now: Instant, bytes: usize) -> Instant {
        let (start, end) = self.out.grant(now, bytes);
        let at = if self.into.is_some() { start } else { end };
        at.checked_sub(self.out.wire.burst).unwrap_or(now).max(now)
    }

    /// When `bytes` whose first bit comes in at `now` are there.
    fn arrive(&self, now: Instant, bytes: usize) -> Instant {
        let at = self.into.as_ref().map_or(now, |lane| {
            let (_, end) = lane.grant(now, bytes);
            end.checked_sub(lane.wire.burst).unwrap_or(now).max(now)
        });
        at + self.latency
    }

    /// Whether what comes in must wait at all.
    fn delays(&self) -> bool {
        self.into.is_some() || self.latency > Duration::ZERO
    }
}

/// Waits until a tick near a time.
#[derive(Debug, Default)]
struct Wait(Option<Pin<Box<Sleep>>>);

impl Wait {
    fn poll(&mut self, until: Instant, cx: &mut Context<'_>) -> Poll<()> {
        // The timer rounds up to a whole tick, and so does the wait of the thread that drives it.
        let until = until.checked_sub(TICK).unwrap_or(until);
        if until <= Instant::now() {
            return Poll::Ready(());
        }
        match &mut self.0 {
            Some(sleep) if sleep.deadline() == until => {}
            Some(sleep) => sleep.as_mut().reset(until),
            none => *none = Some(Box::pin(tokio::time::sleep_until(until))),
        }
        match &mut self.0 {
            Some(sleep) => sleep.as_mut().poll(cx),
            None => Poll::Ready(()),
        }
    }
}

#[cfg(test)]
mod tests;
