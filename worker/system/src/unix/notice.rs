//! What a service manager is told: a datagram to the socket that `NOTIFY_SOCKET` names (`sd_notify` of systemd).

#[cfg(target_os = "linux")]
use std::os::{linux::net::SocketAddrExt, unix::ffi::OsStrExt};
use std::{
    ffi::{OsStr, OsString},
    io,
    os::unix::net::{SocketAddr, UnixDatagram},
};

/// Sends lines `KEY=value` to the socket `name`: a path, or an abstract name after `@`. A manager that does not read loses
/// the datagram; nobody waits for it.
///
/// # Errors
/// If nobody listens there.
pub fn send(name: &OsStr, state: &str) -> io::Result<()> {
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
