//! Whose process is at the other end of a loopback connection: Linux lists all sockets with their users.

use std::{
    fs, io,
    net::{IpAddr, SocketAddr},
};

use crate::Caller;

/// Whose process called from `theirs` at `ours`, both of loopback.
///
/// # Errors
/// If the list cannot be read.
pub fn whose(ours: SocketAddr, theirs: SocketAddr) -> io::Result<Caller> {
    let list = if ours.is_ipv4() { "/proc/net/tcp" } else { "/proc/net/tcp6" };
    let own = rustix::process::geteuid().as_raw();
    // The list may lack a line while other sockets come and go.
    let mut answer = Caller::Unlisted;
    for _ in 0..3 {
        answer = match fs::read_to_string(list) {
            Ok(list) => judge(&list, (ours, theirs), own),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Caller::NoList,
            Err(error) => return Err(io::Error::new(error.kind(), format!("{list}: {error}"))),
        };
        if answer != Caller::Unlisted {
            break;
        }
    }
    Ok(answer)
}

fn judge(list: &str, (ours, theirs): (SocketAddr, SocketAddr), own: u32) -> Caller {
    match user_of(list, theirs, ours) {
        None => Caller::Unlisted,
        Some(user) if user == own => Caller::Own,
        Some(0) => Caller::Administrator,
        Some(user) => Caller::Other { theirs: user.to_string(), ours: own.to_string() },
    }
}

/// The user of the socket at `local` that is connected with `remote`. A socket that its process has closed is listed as one of root,
/// with the inode 0.
fn user_of(list: &str, local: SocketAddr, remote: SocketAddr) -> Option<u32> {
    let (local, remote) = (written(local), written(remote));
    list.lines().find_map(|line| {
        let mut words = line.split_whitespace().skip(1);
        if words.next() != Some(&local) || words.next() != Some(&remote) {
            return None;
        }
        // State, queues, timer and retransmissions stand before the user, a timeout before the inode.
        let (user, inode) = (words.nth(4)?, words.nth(1)?);
        if inode == "0" { None } else { user.parse().ok() }
    })
}

/// An address as the list writes it: words of 32 bits as they lie in memory.
fn written(address: SocketAddr) -> String {
    let bytes = match address.ip() {
        IpAddr::V4(ip) => ip.octets().to_vec(),
        IpAddr::V6(ip) => ip.octets().to_vec(),
    };
    let words = bytes.chunks_exact(4).map(|word| u32::from_ne_bytes([word[0], word[1], word[2], word[3]]));
    let digits: String = words.map(|word| format!("{word:08X}")).collect();
    format!("{digits}:{:04X}", address.port())
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use super::*;

    #[test]
    fn the_list_tells_users_apart_and_a_socket_that_is_closed_is_nobodys() {
        let (ours, theirs) = ("127.0.0.1:7117", "127.0.0.1:50000");
        let (ours, theirs) = (ours.parse().expect("an address"), theirs.parse().expect("an address"));
        let list_of = |user: u32, inode: u32| {
            format!(
                "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n   \
                 0: {1} {0} 01 00000000:00000000 00:00000000 00000000     7        0 1 1\n   \
                 1: {0} {1} 01 00000000:00000000 02:00000A5C 00000000  {user}        0 {inode} 1\n",
                written(theirs),
                written(ours)
            )
        };
        let list = |user| list_of(user, 2);
        assert_eq!(judge(&list(1000), (ours, theirs), 1000), Caller::Own);
        assert_eq!(judge(&list(0), (ours, theirs), 1000), Caller::Administrator);
        let other = Caller::Other { theirs: "1001".into(), ours: "1000".into() };
        assert_eq!(judge(&list(1001), (ours, theirs), 1000), other);
        assert_eq!(judge("", (ours, theirs), 1000), Caller::Unlisted);
        // Closed by whoever opened it: the system names root.
        assert_eq!(judge(&list_of(0, 0), (ours, theirs), 1000), Caller::Unlisted);
    }

    #[test]
    fn linux_lists_the_sockets_of_this_process() {
        for address in ["127.0.0.1:0", "[::1]:0"] {
            // A machine may have no IPv6.
            let Ok(listener) = TcpListener::bind(address) else { continue };
            let near = TcpStream::connect(listener.local_addr().expect("bound")).expect("it listens");
            let (far, theirs) = listener.accept().expect("one calls");
            let caller = whose(far.local_addr().expect("connected"), theirs).expect("a list");
            assert_eq!(caller, Caller::Own, "{near:?}");
        }
    }
}
