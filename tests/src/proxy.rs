//! PROXY: a port of this machine that passes bytes on to another, until it is cut.

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

/// Between two looks whether a frozen proxy was thawed.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// A forwarded port. Its threads end with their connections, the listening one with the process.
pub struct Proxy {
    /// The port that callers dial.
    pub port: u16,
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    /// Where to; none refuses callers.
    to: Mutex<Option<String>>,
    connections: Mutex<Vec<TcpStream>>,
    frozen: AtomicBool,
    flip: AtomicBool,
    litter: AtomicBool,
    delay_us: AtomicU64,
    bytes: AtomicU64,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Proxy {
    /// Takes callers on a free port and hangs up on them, until [`Proxy::forward`].
    ///
    /// # Panics
    /// If there is no free port.
    pub fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let port = listener.local_addr().expect("bound").port();
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        std::thread::spawn(move || {
            for near in listener.incoming().flatten() {
                let Some(to) = lock(&of_thread.to).clone() else { continue };
                let Ok(far) = TcpStream::connect(to) else { continue };
                of_thread.join(&near, &far, true);
                of_thread.join(&far, &near, false);
            }
        });
        Self { port, shared }
    }

    /// Passes callers on to this address from now on.
    pub fn forward(&self, to: &str) {
        *lock(&self.shared.to) = Some(to.to_owned());
    }

    /// Ends every connection in the middle, and takes no more callers; gives how many stood.
    pub fn cut(&self) -> usize {
        *lock(&self.shared.to) = None;
        let ends = std::mem::take(&mut *lock(&self.shared.connections));
        for end in &ends {
            // It may be closed already.
            let _ = end.shutdown(Shutdown::Both);
        }
        ends.len() / 2
    }

    /// Passes no byte on any more and says nothing, as a pulled cable; gives how many connections stand.
    pub fn freeze(&self) -> usize {
        *lock(&self.shared.to) = None;
        self.shared.frozen.store(true, Ordering::Relaxed);
        lock(&self.shared.connections).len() / 2
    }

    /// Passes on again what a frozen proxy held back, and takes callers to this address.
    pub fn thaw(&self, to: &str) {
        self.shared.frozen.store(false, Ordering::Relaxed);
        self.forward(to);
    }

    /// Flips a bit of the next bytes that a caller sends.
    pub fn flip(&self) {
        self.shared.flip.store(true, Ordering::Relaxed);
    }

    /// Puts garbage before the next bytes that a caller sends.
    pub fn litter(&self) {
        self.shared.litter.store(true, Ordering::Relaxed);
    }

    /// Passes on what a caller sends only after so long.
    pub fn delay(&self, delay: Duration) {
        self.shared.delay_us.store(delay.as_micros() as u64, Ordering::Relaxed);
    }

    /// Bytes passed on so far, both ways.
    pub fn bytes(&self) -> u64 {
        self.shared.bytes.load(Ordering::Relaxed)
    }
}

impl Shared {
    /// Starts a thread that passes bytes one way.
    fn join(self: &Arc<Self>, from: &TcpStream, to: &TcpStream, of_caller: bool) {
        let clone = |stream: &TcpStream| stream.try_clone().expect("a file descriptor");
        let (mut from, mut to) = (clone(from), clone(to));
        to.set_nodelay(true).expect("an option of every system");
        lock(&self.connections).push(clone(&from));
        let shared = Arc::clone(self);
        std::thread::spawn(move || {
            let mut buffer = vec![0; 64 << 10];
            while let Ok(n @ 1..) = from.read(&mut buffer) {
                while shared.frozen.load(Ordering::Relaxed) {
                    std::thread::sleep(LOOK_EVERY);
                }
                if of_caller {
                    let delay = shared.delay_us.load(Ordering::Relaxed);
                    std::thread::sleep(Duration::from_micros(delay));
                    if shared.flip.swap(false, Ordering::Relaxed) {
                        buffer[n / 2] ^= 0x08;
                    }
                    if shared.litter.swap(false, Ordering::Relaxed) && to.write_all(&[0x5a; 333]).is_err() {
                        break;
                    }
                }
                if to.write_all(&buffer[..n]).is_err() {
                    break;
                }
                shared.bytes.fetch_add(n as u64, Ordering::Relaxed);
            }
            // A pulled cable does not carry the end of a connection either.
            while shared.frozen.load(Ordering::Relaxed) {
                std::thread::sleep(LOOK_EVERY);
            }
            // The other side has gone, or the proxy was cut.
            let _ = to.shutdown(Shutdown::Write);
        });
    }
}
