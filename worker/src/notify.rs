//! NOTIFY: what a service manager is told: that this daemon is ready, alive, ending (`sd_notify` of systemd).
//!
//! A datagram of lines `KEY=value` to the socket that `NOTIFY_SOCKET` names: a path, or an abstract name after `@`.
//! Without the variable nothing is sent. A manager that does not read loses the datagram; no daemon waits for it.

use std::time::Duration;

use system::notice::send;

/// The shortest time between two signs of life.
const SHORTEST: Duration = Duration::from_millis(10);

/// Tells the manager, if there is one. `state` is one or several lines, such as `READY=1`.
pub fn say(state: &str) {
    if let Some(name) = std::env::var_os("NOTIFY_SOCKET")
        && let Err(error) = send(&name, state)
    {
        tracing::debug!("NOTIFY_SOCKET {}: {error}", name.display());
    }
}

/// How often the manager wants a sign of life: twice within `WATCHDOG_USEC`. None where it does not ask, or asks another
/// process (`WATCHDOG_PID`).
pub fn interval() -> Option<Duration> {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    if number("WATCHDOG_PID").is_some_and(|asked| asked != u64::from(std::process::id())) {
        return None;
    }
    let limit = number("WATCHDOG_USEC").filter(|limit| *limit > 0)?;
    Some((Duration::from_micros(limit) / 2).max(SHORTEST))
}

/// Gives signs of life for ever, where the manager asks for them: as long as the tasks of this runtime go round.
pub async fn live() {
    let Some(interval) = interval() else { return std::future::pending().await };
    let mut beat = tokio::time::interval(interval);
    loop {
        beat.tick().await;
        say("WATCHDOG=1");
    }
}
