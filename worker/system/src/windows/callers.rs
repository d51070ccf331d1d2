//! Whose process is at the other end of a loopback connection: Windows lists all connections with their processes.

use std::{
    io,
    net::{IpAddr, SocketAddr},
};

use windows_sys::Win32::{
    Foundation::{ERROR_ACCESS_DENIED, ERROR_INSUFFICIENT_BUFFER, NO_ERROR},
    NetworkManagement::IpHelper::{
        GetExtendedTcpTable, MIB_TCP6ROW_OWNER_PID, MIB_TCPROW_OWNER_PID, TCP_TABLE_OWNER_PID_ALL,
    },
    Networking::WinSock::{AF_INET, AF_INET6},
};

use super::identity;
use crate::Caller;

/// How often the list is asked for while it grows.
const TRIES: usize = 8;

/// Whose process called from `theirs` at `ours`, both of loopback.
///
/// # Errors
/// If the list cannot be read.
pub fn whose(ours: SocketAddr, theirs: SocketAddr) -> io::Result<Caller> {
    let Some(process) = process_of(theirs, ours)? else { return Ok(Caller::Unlisted) };
    let own = identity::own()?;
    Ok(match identity::of_process(process) {
        Ok(user) if user == own => Caller::Own,
        Ok(user) if identity::ADMINISTRATORS.contains(&user.as_str()) => Caller::Administrator,
        Ok(theirs) => Caller::Other { theirs, ours: own },
        // The system says of one's own processes whose they are.
        Err(error) if error.raw_os_error() == Some(ERROR_ACCESS_DENIED as i32) => {
            Caller::Other { theirs: "unknown".into(), ours: own }
        }
        // The process has ended.
        Err(_) => Caller::Unlisted,
    })
}

/// The process of the socket at `local` that is connected with `remote`.
fn process_of(local: SocketAddr, remote: SocketAddr) -> io::Result<Option<u32>> {
    // A port stands in the lower half as the network writes it.
    let port = |number: u32| u16::from_be(number as u16);
    Ok(match (local.ip(), remote.ip()) {
        (IpAddr::V4(near), IpAddr::V4(far)) => {
            let address = |number: u32| number.to_ne_bytes();
            let rows = rows::<MIB_TCPROW_OWNER_PID>(AF_INET)?;
            let row = rows.iter().find(|row| {
                address(row.dwLocalAddr) == near.octets()
                    && address(row.dwRemoteAddr) == far.octets()
                    && (port(row.dwLocalPort), port(row.dwRemotePort)) == (local.port(), remote.port())
            });
            row.map(|row| row.dwOwningPid)
        }
        (IpAddr::V6(near), IpAddr::V6(far)) => {
            let rows = rows::<MIB_TCP6ROW_OWNER_PID>(AF_INET6)?;
            let row = rows.iter().find(|row| {
                row.ucLocalAddr == near.octets()
                    && row.ucRemoteAddr == far.octets()
                    && (port(row.dwLocalPort), port(row.dwRemotePort)) == (local.port(), remote.port())
            });
            row.map(|row| row.dwOwningPid)
        }
        _ => None,
    }
    // What no process has any more is listed as one of the process 0.
    .filter(|&process| process != 0))
}

/// All connections of a family: their number, then a `Row` of words for each.
fn rows<Row: Copy>(family: u16) -> io::Result<Vec<Row>> {
    let mut buffer: Vec<u32> = Vec::new();
    for _ in 0..TRIES {
        let mut bytes = size_of_val(buffer.as_slice()) as u32;
        // SAFETY: the buffer has as many bytes as it says; with too few the system says how many it needs.
        let result = unsafe {
            GetExtendedTcpTable(
                buffer.as_mut_ptr().cast(),
                &raw mut bytes,
                0,
                u32::from(family),
                TCP_TABLE_OWNER_PID_ALL,
                0,
            )
        };
        match result {
            NO_ERROR => {
                let fits = (size_of_val(buffer.as_slice()).saturating_sub(4)) / size_of::<Row>();
                let n = buffer.first().map_or(0, |&n| n as usize).min(fits);
                // SAFETY: behind the number there are as many rows, which are plain numbers in words.
                return Ok((0..n)
                    .map(|i| unsafe { buffer.as_ptr().add(1).cast::<Row>().add(i).read_unaligned() })
                    .collect());
            }
            // Some more, for connections that come meanwhile.
            ERROR_INSUFFICIENT_BUFFER => buffer = vec![0; (bytes as usize).div_ceil(4) + 256],
            error => return Err(io::Error::from_raw_os_error(error as i32)),
        }
    }
    Err(io::Error::other("the list of connections grows faster than it can be read"))
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use super::*;

    #[test]
    fn windows_lists_the_sockets_of_this_process() {
        for address in ["127.0.0.1:0", "[::1]:0"] {
            // A machine may have no IPv6.
            let Ok(listener) = TcpListener::bind(address) else { continue };
            let near = TcpStream::connect(listener.local_addr().expect("bound")).expect("it listens");
            let (far, theirs) = listener.accept().expect("one calls");
            let ours = far.local_addr().expect("connected");
            assert_eq!(whose(ours, theirs).expect("a list"), Caller::Own, "{near:?}");
            assert_eq!(whose(ours, ours).expect("a list"), Caller::Unlisted);
        }
    }
}
