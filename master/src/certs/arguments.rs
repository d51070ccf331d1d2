//! Flags of `bolide certs`.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "what stands in brackets is part of the help that users read"
)]

use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use protocol::tls;

/// What `certs` does.
#[derive(Debug, Subcommand)]
pub enum Certs {
    /// A certificate authority in a folder: ca.pem, and ca-key.pem, which stays there
    Ca {
        /// The folder
        folder: PathBuf,
        /// Replace the CA that is there; its hosts' certificates then become useless
        #[arg(long)]
        force: bool,
    },
    /// The certificate of a host, in FOLDER/NAME, which is copied to that host
    Host {
        /// The folder of the CA
        folder: PathBuf,
        /// Name of the host
        name: String,
        /// Another name or address under which the host is dialled; may be given several times
        #[arg(long)]
        address: Vec<String>,
        /// What the host may be
        #[arg(long, value_enum)]
        role: CertRole,
        /// Replace the certificate that is there
        #[arg(long)]
        force: bool,
    },
    /// Issue a token with which a bare PC gets a certificate from the running master, once
    Token {
        /// The folder of the CA
        folder: PathBuf,
        /// What the host may be
        #[arg(long, value_enum, default_value = "worker")]
        role: JoinRole,
        /// How long the token is good (hours)
        #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u64).range(1..=8760))]
        hours: u64,
        /// The master, for the line to paste
        #[arg(long, value_name = "HOST:PORT", default_value = "HOST:PORT")]
        master: String,
    },
    /// Exchange a token at a master for this host's certificate
    Join {
        /// The master: HOST, HOST:PORT or [ADDRESS]:PORT
        master: String,
        /// The token, as `bolide certs token` prints it
        token: String,
        /// Folder for the certificate
        folder: PathBuf,
        /// Name of this host [default: its host name]
        #[arg(long)]
        name: Option<String>,
    },
    /// Revoke every certificate of a host: a running master ends its links
    Revoke {
        /// The folder of the CA
        folder: PathBuf,
        /// Name of the host
        name: String,
    },
}

/// What a host that joins by a token may be: masters are made where the CA is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum JoinRole {
    /// Computes
    Worker,
    /// Submits and watches jobs
    Client,
}

impl JoinRole {
    /// The same as certificates spell it.
    pub const fn role(self) -> tls::Role {
        match self {
            Self::Worker => tls::Role::Worker,
            Self::Client => tls::Role::Client,
        }
    }
}

/// What the holder of a certificate may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CertRole {
    /// Listens, and may be anything else too
    Master,
    /// Computes
    Worker,
    /// Submits and watches jobs
    Client,
}

impl CertRole {
    /// The same as certificates spell it.
    pub const fn role(self) -> tls::Role {
        match self {
            Self::Master => tls::Role::Master,
            Self::Worker => tls::Role::Worker,
            Self::Client => tls::Role::Client,
        }
    }
}
