//! NOTIFY: what a service manager is told: that this daemon is ready, alive, ending (`sd_notify` of systemd).
//!
//! A datagram of lines `KEY=value` to the socket that `NOTIFY_SOCKET` names: a path, or an abstract name after `@`.
//! Without the variable nothing is sent. A manager that does not read loses the datagram; no daemon waits for it.

use std::{
    ffi::{OsStr, OsString},
    os::{
        linux::net::SocketAddrExt,
        unix::{
            ffi::OsStrExt,
            net::{SocketAddr, UnixDatagram},
        },
    },
    time::Duration,
};

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

fn send(name: &OsStr, state: &str) -> std::io::Result<()> {
    let address = match name.as_bytes() {
        [b'@', rest @ ..] => SocketAddr::from_abstract_name(rest)?,
        _ => SocketAddr::from_pathname(OsString::from(name))?,
    };
    let socket = UnixDatagram::unbound()?;
    socket.set_nonblocking(true)?;
    socket.send_to_addr(state.as_bytes(), &address).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_arrives_as_one_datagram_by_path_and_by_abstract_name() {
        let name = format!("bolide-notify-{}-{}", std::process::id(), crate::random());
        let path = std::env::temp_dir().join(&name);
        let by_path = UnixDatagram::bind(&path).expect("a socket");
        let address = SocketAddr::from_abstract_name(name.as_bytes()).expect("a name");
        let by_name = UnixDatagram::bind_addr(&address).expect("a socket");
        for (socket, name) in [(by_path, path.clone().into_os_string()), (by_name, format!("@{name}").into())]
        {
            send(&name, "READY=1\nSTATUS=dialling").expect("sent");
            let mut bytes = [0; 100];
            let n = socket.recv(&mut bytes).expect("a datagram");
            assert_eq!(&bytes[..n], b"READY=1\nSTATUS=dialling");
        }
        std::fs::remove_file(&path).expect("it is there");
        assert!(send(path.as_os_str(), "READY=1").is_err(), "nobody listens any more");
    }
}
