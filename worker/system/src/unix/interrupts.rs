//! Ctrl-C, SIGTERM, and SIGHUP where it is heeded.

use std::io;

use tokio::signal::unix::{Signal, SignalKind, signal};

/// Requests to end this process. As long as one listens, they do not end it by themselves.
pub struct Interrupts {
    interrupt: Signal,
    term: Signal,
    /// The terminal is gone; none where that is ignored, as `nohup` has it, and after the first request.
    hangup: Option<Signal>,
}

impl Interrupts {
    /// Listens from now on; needs a runtime of tokio.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn listen() -> io::Result<Self> {
        let hangup = (!ignores_hangup()).then(|| signal(SignalKind::hangup())).transpose()?;
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            term: signal(SignalKind::terminate())?,
            hangup,
        })
    }

    /// Waits for the next. Cancel safe: one that comes while nobody waits is given to the next call.
    ///
    /// A terminal that is closed is a request only if it is the first: a shell hangs up its jobs and then has the system do so once more,
    /// so what would be the second request is no haste of anybody's.
    pub async fn next(&mut self) {
        let hangup = async {
            match &mut self.hangup {
                Some(hangup) => hangup.recv().await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.term.recv() => {}
            _ = hangup => {}
        }
        self.hangup = None;
    }
}

/// Whether whoever started this process had it outlive its terminal.
fn ignores_hangup() -> bool {
    // SAFETY: all bytes zero are a value of this type, a plain struct of C.
    let mut now: libc::sigaction = unsafe { std::mem::zeroed() };
    // SAFETY: nothing is changed, since no new action is given, and `now` is there to be written to.
    let asked = unsafe { libc::sigaction(libc::SIGHUP, std::ptr::null(), &raw mut now) };
    asked == 0 && now.sa_sigaction == libc::SIG_IGN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn handle_hangup(how: libc::sighandler_t) {
        // SAFETY: no handler is given, only the default or none.
        unsafe { libc::signal(libc::SIGHUP, how) };
    }

    #[test]
    fn a_terminal_that_is_closed_is_heeded_unless_that_is_ignored() {
        handle_hangup(libc::SIG_IGN);
        assert!(ignores_hangup());
        handle_hangup(libc::SIG_DFL);
        assert!(!ignores_hangup());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            let mut interrupts = Interrupts::listen().expect("signals");
            // SAFETY: this process has a handler for it now.
            assert_eq!(unsafe { libc::raise(libc::SIGHUP) }, 0);
            interrupts.next().await;
            // SAFETY: as before.
            assert_eq!(unsafe { libc::raise(libc::SIGHUP) }, 0);
            let again = tokio::time::timeout(std::time::Duration::from_millis(200), interrupts.next()).await;
            assert!(again.is_err(), "the second of a closed terminal is no request");
            // SAFETY: as before, since it is listened for.
            assert_eq!(unsafe { libc::raise(libc::SIGTERM) }, 0);
            interrupts.next().await;
        });
    }
}
