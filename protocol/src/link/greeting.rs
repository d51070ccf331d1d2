//! A handshake carried over a link, in time and with small frames only.

use super::{MISSED_HEARTBEATS, Receiver, Sender};
use crate::frame::{Frame, HELLO_LIMIT, Header, Kind, REASON_LIMIT};
use crate::handshake::{Client, Hello, Policy, Server, Verdict, Welcome};
use crate::memory::Near;
use crate::{Error, Result, codec};
use std::time::Duration;
use tracing::debug;

/// The longest that either side waits for the other's part of a handshake.
pub const GREETING_LIMIT: Duration = Duration::from_secs(10);

/// Dialling side: sends `hello`, waits for the answer and sets the link's intervals by it.
///
/// # Errors
/// [`Error::Refused`] with the peer's reason; what [`Client::new`], [`Client::apply`] and the link give;
/// [`Error::Silent`] after [`GREETING_LIMIT`].
pub async fn greet(sender: &Sender, receiver: &mut Receiver, hello: &Hello) -> Result<Welcome> {
    greet_near(sender, receiver, hello, None).await.map(|(welcome, _)| welcome)
}

/// The same over a connection that may be within this machine: goes on over memory if the other side offers some and it
/// opens. The second value says whether the link does.
///
/// # Errors
/// As for [`greet`], and [`Error::Message`] if memory is offered that was not asked for.
pub async fn greet_near(
    sender: &Sender,
    receiver: &mut Receiver,
    hello: &Hello,
    near: Option<Near>,
) -> Result<(Welcome, bool)> {
    let hello = Hello { near: near.as_ref().map(Near::ends), ..hello.clone() };
    let (mut client, first) = Client::new(&hello)?;
    receiver.set_limit(REASON_LIMIT);
    sender.send(first)?;
    let welcome = client.apply(&in_time(receiver).await?)?;
    let shares = match (&welcome.memory, near) {
        (None, _) => false,
        (Some(_), None) => return Err(Error::Message("memory is offered that was not asked for".into())),
        (Some(offer), Some(near)) => {
            let opened = near.open(offer).inspect_err(|error| debug!("the link stays on TCP: {error}")).ok();
            let shares = opened.is_some();
            if let Some((reading, writing)) = opened {
                sender.go_on_with(Box::new(writing), false);
                receiver.go_on_with(Box::new(reading));
            }
            sender.send(answer(shares)?)?;
            // The other side repeats it by the way on which the link goes on.
            expect_answer(receiver, Some(shares)).await?
        }
    };
    settle(sender, receiver, &welcome);
    Ok((welcome, shares))
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

/// The same over a connection that may be within this machine: offers memory if the caller, who greeted with `hello`, asks
/// for it, and goes on over it if the caller can. Says whether the link does.
///
/// # Errors
/// As for [`admit`], and what the link gives while the caller has not answered.
pub async fn admit_near(
    mut server: Server,
    sender: &Sender,
    receiver: &mut Receiver,
    welcome: Welcome,
    hello: &Hello,
    near: Option<Near>,
) -> Result<bool> {
    let near = near.filter(|near| near.is_from(hello.near));
    let made =
        near.and_then(|near| near.make().inspect_err(|error| debug!("no memory to share: {error}")).ok());
    let Some(offered) = made else { return admit(server, sender, receiver, welcome).map(|()| false) };
    receiver.set_limit(REASON_LIMIT);
    sender.send(server.welcome(Welcome { memory: Some(offered.offer()), ..welcome })?)?;
    let shares = expect_answer(receiver, None).await?;
    if shares {
        let (reading, writing) = offered.halves()?;
        // Heartbeats may still go by the old way, where the caller takes them for calls to wake up.
        sender.go_on_with(Box::new(writing), true);
        receiver.go_on_with(Box::new(reading));
    }
    sender.send(answer(shares)?)?;
    settle(sender, receiver, &welcome);
    Ok(shares)
}

fn answer(shares: bool) -> Result<Frame> {
    Ok(Frame::new(Header::new(Kind::Memory), codec::encode(&shares)?))
}

async fn expect_answer(receiver: &mut Receiver, expected: Option<bool>) -> Result<bool> {
    let frame = in_time(receiver).await?;
    if frame.header.kind != Kind::Memory {
        return Err(Error::Unexpected { found: frame.header.kind, expected: "memory" });
    }
    let shares = codec::decode(&frame.payload, Kind::Memory.limit() as usize)?;
    match expected {
        Some(expected) if expected != shares => {
            Err(Error::Message(format!("memory is shared: {shares}, agreed was {expected}")))
        }
        _ => Ok(shares),
    }
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
