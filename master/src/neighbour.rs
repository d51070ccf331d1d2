//! NEIGHBOUR: whose process is at the other end of a loopback connection, as Linux knows it.
//!
//! Without certificates a master listens on loopback, which every user of the PC reaches. Linux says which user each socket is of, so
//! nobody needs a secret: callers of the master's own user, and of root, are taken in, all others refused.

use std::{
    fmt, fs, io,
    net::{IpAddr, SocketAddr},
};

/// Why a caller is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It is of another user.
    User { theirs: u32, ours: u32 },
    /// The system does not list its socket, or it is closed already.
    Unlisted(SocketAddr),
    /// The list of sockets cannot be read, for this reason.
    Unreadable(String),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::User { theirs, ours } => write!(
                f,
                "a caller of user {theirs}, this master serves user {ours}; start it with --share, or with --certs, to serve others"
            ),
            Self::Unlisted(address) => {
                write!(f, "the system does not say of which user the caller at {address} is; try again")
            }
            Self::Unreadable(why) => {
                write!(f, "cannot see of which user a caller is: {why}; --share serves all users of the PC")
            }
        }
    }
}

/// Looks who calls from `theirs` at `ours`, both of loopback. A system without a list of sockets lets everybody in, as it did before.
///
/// # Errors
/// Why the caller is refused.
pub fn check(ours: SocketAddr, theirs: SocketAddr) -> Result<(), Refusal> {
    let list = if ours.is_ipv4() { "/proc/net/tcp" } else { "/proc/net/tcp6" };
    let own = rustix::process::geteuid().as_raw();
    // The list may lack a line while other sockets come and go.
    let mut answer = Err(Refusal::Unlisted(theirs));
    for _ in 0..3 {
        answer = match fs::read_to_string(list) {
            Ok(list) => judge(&list, (ours, theirs), own),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(error) => Err(Refusal::Unreadable(format!("{list}: {error}"))),
        };
        if !matches!(answer, Err(Refusal::Unlisted(_))) {
            break;
        }
    }
    answer
}

fn judge(list: &str, (ours, theirs): (SocketAddr, SocketAddr), own: u32) -> Result<(), Refusal> {
    match user_of(list, theirs, ours) {
        None => Err(Refusal::Unlisted(theirs)),
        Some(user) if user == own || user == 0 => Ok(()),
        Some(user) => Err(Refusal::User { theirs: user, ours: own }),
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
    fn a_caller_of_another_user_is_refused_and_one_of_this_user_or_root_is_not() {
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
        assert_eq!(judge(&list(1000), (ours, theirs), 1000), Ok(()));
        assert_eq!(judge(&list(0), (ours, theirs), 1000), Ok(()));
        let refusal = Refusal::User { theirs: 1001, ours: 1000 };
        assert_eq!(judge(&list(1001), (ours, theirs), 1000), Err(refusal));
        assert_eq!(judge("", (ours, theirs), 1000), Err(Refusal::Unlisted(theirs)));
        // Closed by whoever opened it: the system names root.
        assert_eq!(judge(&list_of(0, 0), (ours, theirs), 1000), Err(Refusal::Unlisted(theirs)));
    }

    #[test]
    fn linux_lists_the_sockets_of_this_process() {
        for address in ["127.0.0.1:0", "[::1]:0"] {
            // A machine may have no IPv6.
            let Ok(listener) = TcpListener::bind(address) else { continue };
            let near = TcpStream::connect(listener.local_addr().expect("bound")).expect("it listens");
            let (far, theirs) = listener.accept().expect("one calls");
            assert_eq!(check(far.local_addr().expect("connected"), theirs), Ok(()), "{near:?}");
        }
    }
}
