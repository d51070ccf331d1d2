//! What the service manager is told. Windows has states for what systemd is told in words: as long as something is being started
//! or stopped, a number that grows is the sign of life.

use std::{
    io,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use windows_sys::Win32::{
    Foundation::{ERROR_SERVICE_SPECIFIC_ERROR, NO_ERROR},
    System::Services::{
        SERVICE_ACCEPT_PRESHUTDOWN, SERVICE_ACCEPT_SHUTDOWN, SERVICE_ACCEPT_STOP, SERVICE_RUNNING,
        SERVICE_START_PENDING, SERVICE_STATUS, SERVICE_STATUS_CURRENT_STATE, SERVICE_STATUS_HANDLE,
        SERVICE_STOP_PENDING, SERVICE_STOPPED, SERVICE_WIN32_OWN_PROCESS, SetServiceStatus,
    },
};

/// Until a service is ready (ms): `--speed auto` measures for some seconds.
const START_HINT: u32 = 60_000;
/// Until the next sign of life of a service that is stopping (ms).
const STOP_HINT: u32 = 30_000;
/// How often a service gives one.
const BEAT: Duration = Duration::from_secs(5);

/// This process as a service; none otherwise, before it begins and after it has ended.
static REPORT: Mutex<Option<Report>> = Mutex::new(None);

struct Report {
    /// A [`SERVICE_STATUS_HANDLE`], which every thread may use.
    handle: usize,
    state: SERVICE_STATUS_CURRENT_STATE,
    checkpoint: u32,
}

/// Why a service has ended.
pub(super) enum End {
    /// With this exit code of its own.
    Code(u8),
    /// With an error of the system, before it could begin.
    System(u32),
}

impl Report {
    fn tell(&self, end: Option<End>) -> io::Result<()> {
        let (error, code) = match end {
            None | Some(End::Code(0)) => (NO_ERROR, 0),
            Some(End::Code(code)) => (ERROR_SERVICE_SPECIFIC_ERROR, u32::from(code)),
            Some(End::System(error)) => (error, 0),
        };
        let status = SERVICE_STATUS {
            dwServiceType: SERVICE_WIN32_OWN_PROCESS,
            dwCurrentState: self.state,
            // One that is starting cannot stop in order, one that is stopping need not hear it again.
            dwControlsAccepted: match self.state {
                SERVICE_RUNNING => SERVICE_ACCEPT_STOP | SERVICE_ACCEPT_SHUTDOWN | SERVICE_ACCEPT_PRESHUTDOWN,
                _ => 0,
            },
            dwWin32ExitCode: error,
            dwServiceSpecificExitCode: code,
            dwCheckPoint: self.checkpoint,
            dwWaitHint: match self.state {
                SERVICE_START_PENDING => START_HINT,
                SERVICE_STOP_PENDING => STOP_HINT,
                _ => 0,
            },
        };
        // SAFETY: the manager gave this handle to this process, and it is good until `end` says that the service has stopped.
        let done = unsafe { SetServiceStatus(self.handle as SERVICE_STATUS_HANDLE, &raw const status) };
        if done == 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
    }

    fn change(&mut self, state: SERVICE_STATUS_CURRENT_STATE) -> io::Result<()> {
        self.checkpoint = u32::from(matches!(state, SERVICE_START_PENDING | SERVICE_STOP_PENDING));
        self.state = state;
        self.tell(None)
    }
}

fn report<T>(use_it: impl FnOnce(&mut Option<Report>) -> T) -> T {
    use_it(&mut REPORT.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Tells the manager, if there is one, lines `KEY=value` as systemd has them. Windows has no place for `STATUS`.
///
/// # Errors
/// If the manager does not listen.
pub fn say(state: &str) -> io::Result<()> {
    report(|report| {
        let Some(report) = report else { return Ok(()) };
        state.lines().try_for_each(|line| match (line, report.state) {
            ("READY=1", SERVICE_START_PENDING) => report.change(SERVICE_RUNNING),
            ("STOPPING=1", SERVICE_START_PENDING | SERVICE_RUNNING) => report.change(SERVICE_STOP_PENDING),
            ("WATCHDOG=1", SERVICE_START_PENDING | SERVICE_STOP_PENDING) => {
                report.checkpoint += 1;
                report.tell(None)
            }
            _ => Ok(()),
        })
    })
}

/// How often the manager wants a sign of life; none where there is no manager.
pub fn interval() -> Option<Duration> {
    report(|report| report.as_ref().map(|_| BEAT))
}

/// From now on this process is a service, which is starting.
pub(super) fn begin(handle: SERVICE_STATUS_HANDLE) -> io::Result<()> {
    report(|report| {
        let report = report.insert(Report { handle: handle as usize, state: 0, checkpoint: 0 });
        report.change(SERVICE_START_PENDING)
    })
}

/// It was asked to stop; whether for the first time.
pub(super) fn stop() -> bool {
    report(|report| match report {
        Some(report) if report.state != SERVICE_STOP_PENDING => {
            // A manager that does not listen is told again with the next sign of life.
            let _ = report.change(SERVICE_STOP_PENDING);
            true
        }
        _ => false,
    })
}

/// It has ended. The manager may end this process from now on.
pub(super) fn end(end: End) {
    report(|report| {
        if let Some(mut report) = report.take() {
            report.state = SERVICE_STOPPED;
            report.checkpoint = 0;
            // It sees then that the process ends.
            let _ = report.tell(Some(end));
        }
    });
}
