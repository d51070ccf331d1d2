//! A handshake carried over a link, in time and with small frames only.

use super::{MISSED_HEARTBEATS, Receiver, Sender};
use crate::frame::{Frame, HELLO_LIMIT, REASON_LIMIT};
use crate::handshake::{Client, Hello, Policy, Server, Verdict, Welcome};
use crate::{Error, Result};
use std::time::Duration;

/// The longest that either side waits for the other's part of a handshake.
pub const GREETING_LIMIT: Duration = Duration::from_secs(10);

/// Dialling side: sends `hello`, waits for the answer and sets the link's intervals by it.
///
/// # Errors
/// [`Error::Refused`] with the peer's reason; what [`Client::new`], [`Client::apply`] and the link give;
/// [`Error::Silent`] after [`GREETING_LIMIT`].
pub async fn greet(sender: &Sender, receiver: &mut Receiver, hello: &Hello) -> Result<Welcome> {
    let (mut client, first) = Client::new(hello)?;
    receiver.set_limit(REASON_LIMIT);
    sender.send(first)?;
    let welcome = client.apply(&in_time(receiver).await?)?;
    settle(sender, receiver, &welcome);
    Ok(welcome)
}

/// Listening side, first half: waits for a greeting. A bad one is answered with the reason, and the link
/// closed; a good one is for the owner to answer, with [`admit`] or with [`Server::refuse`].
///
/// # Errors
/// [`Error::Message`] with the reason of a refusal, what the link gives, [`Error::Silent`] after
/// [`GREETING_LIMIT`].
pub async fn hear(sender: &Sender, receiver: &mut Receiver, policy: Policy) -> Result<(Server, Hello)> {
    let mut server = Server::new(policy);
    receiver.set_limit(HELLO_LIMIT);
    let first = match in_time(receiver).await {
        Err(error @ Error::FrameVersion { .. }) => {
            // The caller cannot read this frame, but its header tells it what this side speaks.
            turn_away(sender, server.refuse(&error.to_string())?).await?;
            return Err(error);
        }
        first => first?,
    };
    match server.apply(&first)? {
        Verdict::Good(hello) => Ok((server, hello)),
        Verdict::Bad { frame, reason } => {
            turn_away(sender, frame).await?;
            Err(Error::Message(reason))
        }
    }
}

async fn turn_away(sender: &Sender, frame: Frame) -> Result<()> {
    sender.send(frame)?;
    // The caller may not read; then its connection ends without the reason.
    let _ = tokio::time::timeout(GREETING_LIMIT, sender.finish()).await;
    Ok(())
}

/// Listening side, second half: sends `welcome` and sets the link's intervals by it.
///
/// # Errors
/// What [`Server::welcome`] and [`Sender::send`] give.
pub fn admit(mut server: Server, sender: &Sender, receiver: &mut Receiver, welcome: Welcome) -> Result<()> {
    sender.send(server.welcome(welcome)?)?;
    settle(sender, receiver, &welcome);
    Ok(())
}

async fn in_time(receiver: &mut Receiver) -> Result<Frame> {
    tokio::time::timeout(GREETING_LIMIT, receiver.receive()).await.unwrap_or_else(|_| {
        let limit_ms = GREETING_LIMIT.as_millis() as u64;
        Err(Error::Silent { after_ms: receiver.last_seen().elapsed().as_millis() as u64, limit_ms })
    })
}

fn settle(sender: &Sender, receiver: &mut Receiver, welcome: &Welcome) {
    let interval = Duration::from_millis(u64::from(welcome.heartbeat_ms));
    receiver.set_limit(u32::MAX);
    receiver.set_silence(MISSED_HEARTBEATS * interval);
    sender.set_heartbeat(interval);
}
