//! Ctrl-C and SIGTERM.

use std::io;

use tokio::signal::unix::{Signal, SignalKind, signal};

/// Requests to end this process. As long as one listens, they do not end it by themselves.
pub struct Interrupts {
    interrupt: Signal,
    term: Signal,
}

impl Interrupts {
    /// Listens from now on; needs a runtime of tokio.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn listen() -> io::Result<Self> {
        Ok(Self { interrupt: signal(SignalKind::interrupt())?, term: signal(SignalKind::terminate())? })
    }

    /// Waits for the next. Cancel safe: one that comes while nobody waits is given to the next call.
    pub async fn next(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.term.recv() => {}
        }
    }
}
