//! NEIGHBOUR: whose process is at the other end of a loopback connection.
//!
//! Without certificates a master listens on loopback, which every user of the PC reaches. The system says which user each socket is of, so
//! nobody needs a secret: callers of the master's own user, and of the administrator, are taken in, all others refused.

use std::{fmt, net::SocketAddr};

use system::{Caller, callers::whose};

/// Why a caller is refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It is of another user.
    User { theirs: String, ours: String },
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
    match whose(ours, theirs) {
        Ok(Caller::Own | Caller::Administrator | Caller::NoList) => Ok(()),
        Ok(Caller::Other { theirs, ours }) => Err(Refusal::User { theirs, ours }),
        Ok(Caller::Unlisted) => Err(Refusal::Unlisted(theirs)),
        Err(error) => Err(Refusal::Unreadable(error.to_string())),
    }
}
