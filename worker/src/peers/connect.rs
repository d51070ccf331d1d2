//! GATE: one task per connection between workers, from its first byte to its end.

use std::sync::Arc;

use protocol::{
    Error, Result, dial,
    handshake::{Hello, Membership, Policy, Role, Welcome},
    link::{self, Receiver, Sender},
    memory::Near,
    shape::Shaped,
    tls,
};
use tokio::{
    net::{TcpListener, TcpStream},
    sync::Semaphore,
};
use tracing::{debug, warn};

use super::{CONNECTIONS, Circle, DIAL_LIMIT, HEARTBEAT_MS, Shared, settings};
use crate::input::{Input, Key, News, What};

/// Takes connections for ever; each fault of one is one line in the log.
pub(super) async fn listen(listener: TcpListener, shared: Arc<Shared>) {
    let places = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let (stream, address) = match listener.accept().await {
            Ok(taken) => taken,
            Err(error) => {
                // Out of file descriptors, most likely: connections that end give some back.
                warn!("taking a peer's connection: {error}");
                tokio::time::sleep(std::time::Duration::from_millis(100)).await;
                continue;
            }
        };
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            warn!("peer's connection from {address} not taken: {CONNECTIONS} stand, at most {CONNECTIONS}");
            continue;
        };
        let shared = Arc::clone(&shared);
        tokio::spawn(async move {
            if let Err(error) = take(&shared, stream).await {
                warn!("peer's connection from {address}: {error}");
            }
            drop(place);
        });
    }
}

/// Serves a connection to its end. What happens once it stands is told to the compute thread.
async fn take(shared: &Shared, stream: TcpStream) -> Result<()> {
    let socket = link::Socket::new(stream)?;
    let near = if shared.share_memory && shared.port.is_none() { Near::of(&socket) } else { None };
    let stream = Shaped::new(socket, shared.port.as_ref());
    match &shared.certificates {
        None => {
            let (sender, receiver) = link::split(stream, settings());
            admit(shared, sender, receiver, None, near).await
        }
        Some((config, _)) => {
            let (stream, identity) = tls::accept(stream, config).await?;
            let (sender, receiver) = link::split(stream, settings());
            let role = identity.role;
            tls::watch(&sender, identity, None);
            admit(shared, sender, receiver, Some(role), near).await
        }
    }
}

async fn admit(
    shared: &Shared,
    sender: Sender,
    mut receiver: Receiver,
    certificate: Option<tls::Role>,
    near: Option<Near>,
) -> Result<()> {
    let policy = Policy { roles: vec![Role::Peer], certificate, ..Policy::default() };
    let (mut server, hello) = link::hear(&sender, &mut receiver, policy).await?;
    let (circle, index, news) = match judge(shared, &hello).await {
        Ok(judged) => judged,
        Err(reason) => {
            sender.send(server.refuse(&reason)?)?;
            let _ = tokio::time::timeout(link::GREETING_LIMIT, sender.finish()).await;
            return Err(Error::Message(reason));
        }
    };
    let incarnation = circle.who.peer_workers[index as usize].incarnation;
    let welcome = Welcome::new(incarnation, circle.who.me, HEARTBEAT_MS);
    let shares = link::admit_near(server, &sender, &mut receiver, welcome, &hello, near).await?;
    debug!("worker {index} has called; shares memory: {shares}");
    // The place in the queue was taken before: the job does not start before the caller knows of its link, so this
    // stands in the queue before the first cycle does.
    news.send(Input::Peer(News { key: circle.key, from: index, what: What::Stands(sender) }));
    circle.carry(index, &mut receiver).await;
    Ok(())
}

type Judged = (Arc<Circle>, u32, tokio::sync::mpsc::OwnedPermit<Input>);

/// Whether a caller belongs to the job in hand. One of a job that this worker has not been told of yet is kept waiting.
async fn judge(shared: &Shared, hello: &Hello) -> std::result::Result<Judged, String> {
    let Membership { job, epoch, index } = hello.member.ok_or("a peer without a place in a job")?;
    let key = Key { job, epoch };
    let mut circles = shared.circle.subscribe();
    let known = circles.wait_for(|circle| circle.as_ref().is_some_and(|circle| circle.key >= key));
    let none = || format!("job {job} epoch {epoch}, this worker has none");
    let circle = match tokio::time::timeout(link::GREETING_LIMIT, known).await {
        Ok(Ok(circle)) => circle.clone().ok_or_else(none)?,
        Ok(Err(_)) | Err(_) => return Err(none()),
    };
    if circle.key != key {
        let Key { job: ours, epoch: our_epoch } = circle.key;
        return Err(format!("job {job} epoch {epoch}, this worker has job {ours} epoch {our_epoch}"));
    }
    if !hello.holds(&circle.who.secret) {
        return Err("token missing or wrong".to_owned());
    }
    let (me, n) = (circle.who.me, circle.who.peer_workers.len());
    if index <= me || index as usize >= n {
        return Err(format!("worker {index} calls worker {me} of {n}; the higher of two dials"));
    }
    let news = circle.news.upgrade().ok_or_else(none)?;
    let permit = news.reserve_owned().await.map_err(|_| none())?;
    if !circle.take(index) {
        return Err(format!("worker {index} has called before"));
    }
    Ok((circle, index, permit))
}

/// Dials another worker and carries its frames to their end.
pub(super) async fn dial(shared: Arc<Shared>, circle: Arc<Circle>, other: u32) {
    let call = tokio::time::timeout(DIAL_LIMIT, reach(&shared, &circle, other)).await.unwrap_or_else(|_| {
        let limit_ms = DIAL_LIMIT.as_millis() as u64;
        Err(Error::Silent { after_ms: limit_ms, limit_ms })
    });
    match call {
        Err(error) => circle.tell(other, What::Failed(error)).await,
        Ok(dial::Call { sender, mut receiver, shares_memory, .. }) => {
            debug!("worker {other} has answered; shares memory: {shares_memory}");
            circle.tell(other, What::Stands(sender)).await;
            circle.carry(other, &mut receiver).await;
        }
    }
}

async fn reach(shared: &Shared, circle: &Circle, other: u32) -> Result<dial::Call> {
    let who = &circle.who;
    let no_address = || Error::Message("it takes no peers".into());
    let address =
        who.peer_workers.get(other as usize).and_then(|member| member.address).ok_or_else(no_address)?;
    let me = who.peer_workers.get(who.me as usize);
    if address.ip().is_loopback() && me.and_then(|me| me.address).is_some_and(|a| !a.ip().is_loopback()) {
        return Err(Error::Message(
            "the master knows it by a loopback address; start it with the master's outward address".into(),
        ));
    }
    let name = me.map_or("", |member| &member.name);
    let mut hello = Hello::new(Role::Peer, name, 1.0, 1, "none", 0);
    hello.token = Some(who.secret.clone());
    hello.member = Some(Membership { job: circle.key.job, epoch: circle.key.epoch, index: who.me });
    let certificates = shared.certificates.as_ref().map(|(_, config)| config);
    let reached = dial::reach_peer(address, certificates, settings()).await?;
    let reached = reached.through(shared.port.as_ref()).sharing_memory(shared.share_memory);
    let call = reached.greet(&hello).await?;
    let found = call.welcome.host;
    if found != other {
        return Err(Error::Message(format!("worker {found} answers there")));
    }
    Ok(call)
}
