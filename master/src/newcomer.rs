//! NEWCOMER: a host without a certificate comes with a token and leaves with one.
//!
//! It dials with TLS, knowing the master by the CA that its token pins, and shows the token in its greeting. Its key is
//! made by itself and never travels: what it sends is a request to have the key signed. It then dials anew as what the
//! certificate says.

use std::{io::Read, net::SocketAddr, path::Path, time::SystemTime};

use protocol::{
    Error, Result, codec,
    dial::{self, leave},
    frame::{Frame, Header, Kind},
    handshake::{Hello, Role, TOKEN_LIMIT},
    link::{Receiver, Sender},
    request::{JOINING_LIMIT, Joined, Joining},
    tls,
    token::Token,
};
use tracing::info;

use crate::{ca_folder::CaFolder, certs};

/// The environment variable that may hold a worker's token.
pub const TOKEN: &str = "BOLIDE_JOIN";

/// Master's side, after Welcome: takes the request, exchanges the token, ends the connection.
pub(crate) async fn serve(
    ca_folder: &CaFolder,
    hello: &Hello,
    address: &str,
    sender: &Sender,
    receiver: &mut Receiver,
) -> Result<()> {
    receiver.set_limit(JOINING_LIMIT);
    let frame = receive(receiver).await?;
    let joining: Joining = codec::decode(&frame.payload, JOINING_LIMIT as usize)?;
    let (ca_folder, name) = (ca_folder.clone(), hello.name.clone());
    let token = hello.token.clone().unwrap_or_default();
    let ip = address.parse().map(|address: SocketAddr| address.ip()).ok();
    let exchange = move || ca_folder.redeem(&token, &name, ip, &joining.request).map_err(|e| e.to_string());
    let exchanged = tokio::task::spawn_blocking(exchange).await;
    let exchanged =
        exchanged.unwrap_or_else(|_| Err("a bug in the master; its log has the words".to_owned()));
    match exchanged {
        Ok((certificate, ca)) => {
            info!(address, "{} has a certificate now", hello.name);
            let payload = codec::encode(&Joined { certificate, ca })?;
            sender.send(Frame::new(Header::new(Kind::Control), payload))?;
            // A newcomer that does not read has lost its token.
            let _ = tokio::time::timeout(protocol::link::GREETING_LIMIT, sender.finish()).await;
            Ok(())
        }
        Err(why) => {
            leave(sender, &why).await;
            Err(Error::Message(why))
        }
    }
}

async fn receive(receiver: &mut Receiver) -> Result<Frame> {
    let limit = protocol::link::GREETING_LIMIT;
    let late = Error::Silent { after_ms: limit.as_millis() as u64, limit_ms: limit.as_millis() as u64 };
    let frame = tokio::time::timeout(limit, receiver.receive()).await.map_err(|_| late)??;
    match frame.header.kind {
        Kind::Control => Ok(frame),
        Kind::Bye => Err(Error::Left { reason: protocol::handshake::reason(&frame)? }),
        found => Err(Error::Unexpected { found, expected: "one control message" }),
    }
}

/// Newcomer's side: exchanges `token` at `master` for a certificate of the host `name`, into `folder`.
///
/// # Errors
/// Why not, as a sentence. A folder that has certificates is left alone.
pub fn join(master: &str, token: &str, name: &str, folder: &Path) -> std::result::Result<(), String> {
    let paths = tls::Paths::in_folder(folder);
    for path in [&paths.ca, &paths.certificate, &paths.key] {
        if path.exists() {
            return Err(format!(
                "{} exists; this host has joined a lab, leave the token out",
                path.display()
            ));
        }
    }
    join_anew(master, token, name, folder)
}

/// Whether a certificate is one, and out of date.
pub fn has_expired(certificate: &Path) -> bool {
    tls::identity_of_file(certificate).is_ok_and(|identity| identity.fault(None, SystemTime::now()).is_some())
}

/// The same in place of certificates that count no more; they stay until there are others.
///
/// # Errors
/// Why not, as a sentence.
pub fn join_anew(master: &str, token: &str, name: &str, folder: &Path) -> std::result::Result<(), String> {
    let token: Token = token.parse().map_err(|e: Error| e.to_string())?;
    let (key, request) = certs::make_request().map_err(|e| e.to_string())?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|e| format!("threads of the link: {e}"))?;
    let joined = runtime.block_on(exchange(master, &token, name, request)).map_err(|e| e.to_string())?;
    certs::install(folder, &key, &joined.certificate, &joined.ca).map_err(|e| e.to_string())?;
    Ok(())
}

/// The token that a user gave: itself, `@FILE`, or `-` for standard input.
///
/// # Errors
/// What the file says no to, as a sentence.
pub fn token(given: &str) -> std::result::Result<String, String> {
    let fault = |e: std::io::Error| format!("the token {given}: {e}");
    let bytes = match given.strip_prefix('@') {
        Some(path) => read_some(std::fs::File::open(path).map_err(fault)?),
        None if given == "-" => read_some(std::io::stdin()),
        None => return Ok(given.to_owned()),
    };
    Ok(String::from_utf8_lossy(&bytes.map_err(fault)?).trim().to_owned())
}

/// As much as a token has at most.
fn read_some(from: impl Read) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(TOKEN_LIMIT as u64 + 2).read_to_end(&mut bytes)?;
    Ok(bytes)
}

async fn exchange(master: &str, token: &Token, name: &str, request: Vec<u8>) -> Result<Joined> {
    let mut hello = Hello::new(Role::Newcomer, name, 1.0, 1, "none", worker::random());
    hello.token = Some(token.to_string());
    let config = tls::newcomer_config(token.pin)?;
    let dial::Call { sender, mut receiver, .. } = dial::dial(master, Some(&config), &hello).await?;
    receiver.set_limit(JOINING_LIMIT);
    sender.send(Frame::new(Header::new(Kind::Control), codec::encode(&Joining { request })?))?;
    let frame = receive(&mut receiver).await?;
    codec::decode(&frame.payload, JOINING_LIMIT as usize)
}
