//! What a service manager is told: a datagram to the socket that `NOTIFY_SOCKET` names (`sd_notify` of systemd).

#[cfg(target_os = "linux")]
use std::os::{linux::net::SocketAddrExt, unix::ffi::OsStrExt};
use std::{
    ffi::{OsStr, OsString},
    io,
    os::unix::net::{SocketAddr, UnixDatagram},
    time::Duration,
};

/// The shortest time between two signs of life.
const SHORTEST: Duration = Duration::from_millis(10);

/// Tells the manager, if there is one, lines `KEY=value`, such as `READY=1`.
///
/// # Errors
/// If it does not listen.
pub fn say(state: &str) -> io::Result<()> {
    let Some(name) = std::env::var_os("NOTIFY_SOCKET") else { return Ok(()) };
    send(&name, state)
        .map_err(|error| io::Error::new(error.kind(), format!("NOTIFY_SOCKET {}: {error}", name.display())))
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

/// Sends lines `KEY=value` to the socket `name`: a path, or an abstract name after `@`. A manager that does not read loses
/// the datagram; nobody waits for it.
fn send(name: &OsStr, state: &str) -> io::Result<()> {
    let address = address(name)?;
    let socket = UnixDatagram::unbound()?;
    socket.set_nonblocking(true)?;
    socket.send_to_addr(state.as_bytes(), &address).map(|_| ())
}

fn address(name: &OsStr) -> io::Result<SocketAddr> {
    #[cfg(target_os = "linux")]
    if let [b'@', rest @ ..] = name.as_bytes() {
        return SocketAddr::from_abstract_name(rest);
    }
    SocketAddr::from_pathname(OsString::from(name))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_state_arrives_as_one_datagram_by_path_and_by_abstract_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("notify");
        let name = path.to_string_lossy().replace('/', "-");
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
