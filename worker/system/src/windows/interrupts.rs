//! Ctrl-C, Ctrl-Break, a closed window, the end of the session and of the system; and the service manager's word to stop.

use std::io;

use tokio::{
    signal::windows::{
        CtrlBreak, CtrlC, CtrlClose, CtrlLogoff, CtrlShutdown, ctrl_break, ctrl_c, ctrl_close, ctrl_logoff,
        ctrl_shutdown,
    },
    sync::watch,
};

use super::service;

/// Requests to end this process. As long as one listens, Ctrl-C and Ctrl-Break do not end it by themselves; after the others the
/// system ends it some 5 s later.
pub struct Interrupts(Source);

enum Source {
    Console(Console),
    /// How often the service was asked to stop, and how many of that were given.
    Manager(watch::Receiver<u32>, u32),
}

struct Console {
    c: CtrlC,
    pause: CtrlBreak,
    close: CtrlClose,
    logoff: CtrlLogoff,
    shutdown: CtrlShutdown,
}

impl Interrupts {
    /// Listens from now on; needs a runtime of tokio.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn listen() -> io::Result<Self> {
        // A service has no console, yet hears whenever somebody leaves the machine: that is not meant for it.
        if let Some(stops) = service::stops() {
            return Ok(Self(Source::Manager(stops, 0)));
        }
        Ok(Self(Source::Console(Console {
            c: ctrl_c()?,
            pause: ctrl_break()?,
            close: ctrl_close()?,
            logoff: ctrl_logoff()?,
            shutdown: ctrl_shutdown()?,
        })))
    }

    /// Waits for the next. Cancel safe: one that comes while nobody waits is given to the next call.
    pub async fn next(&mut self) {
        match &mut self.0 {
            Source::Console(console) => console.next().await,
            Source::Manager(stops, given) => {
                if stops.wait_for(|said| said > given).await.is_err() {
                    std::future::pending::<()>().await;
                }
                *given += 1;
            }
        }
    }
}

impl Console {
    async fn next(&mut self) {
        tokio::select! {
            _ = self.c.recv() => {}
            _ = self.pause.recv() => {}
            _ = self.close.recv() => {}
            _ = self.logoff.recv() => {}
            _ = self.shutdown.recv() => {}
        }
    }
}
