//! NOTIFY: what a service manager is told: that this daemon is ready, alive, ending. systemd hears it as it stands (`sd_notify`), the
//! manager of Windows as states. Where there is none nobody is told, and no daemon waits for a manager that does not listen.

pub use system::notice::interval;

/// Tells the manager, if there is one. `state` is one or several lines, such as `READY=1`.
pub fn say(state: &str) {
    if let Err(error) = system::notice::say(state) {
        tracing::debug!("the service manager: {error}");
    }
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
