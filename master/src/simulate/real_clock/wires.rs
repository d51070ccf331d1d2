//! The links of an emulated cluster: real frames over real loopback TCP, each stream shaped by the emulated wires.
//!
//! The master has a link to every worker; on route direct each worker has one to every other. A hub is one
//! [`Shape`] for all of them, a switch one by host. The master is on host 1, so its link to the first worker passes no
//! wire. Links carry frames as those of daemons do, without greeting and without TLS.

use std::{collections::BTreeMap, net::Ipv4Addr, sync::mpsc, time::Duration};

use protocol::{
    link::{self, Receiver, Settings, split},
    order::{BULK_ON_THE_WAY, Inbox, Letter, Outbox, Place},
    shape::{Rate, Shape, Shaped, Wire},
    wire::Packed,
};
use tokio::{
    net::{TcpListener, TcpStream},
    runtime::Runtime,
};

use super::End;
use crate::simulate::network::{Network, Wires as Kind};

/// Most bytes that a link is granted at a time: messages pass a hub one by one.
const PIECE: usize = 1 << 20;

/// What a link brings.
pub struct Arrival {
    /// Who sent it.
    pub from: End,
    /// Whom it is for.
    pub to: End,
    /// The message, or why the link has ended.
    pub letter: Result<Letter, String>,
}

/// All links.
pub struct Wires {
    outboxes: BTreeMap<(End, End), Outbox>,
    runtime: Option<Runtime>,
}

impl Wires {
    /// Connects the ends; what comes is handed to `arrived`.
    ///
    /// # Errors
    /// What the system refuses, and a network that is too fast for the dilation.
    pub fn new(
        network: &Network,
        dilation: f64,
        n_hosts: usize,
        peers: bool,
        arrived: &(impl Fn(Arrival) + Clone + Send + 'static),
    ) -> Result<Self, String> {
        let ports = ports(network, dilation, n_hosts)?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .thread_name("wire")
            .build()
            .map_err(|e| format!("threads of links: {e}"))?;
        let fault = |e: std::io::Error| format!("loopback: {e}");
        let listener = runtime.block_on(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))).map_err(fault)?;
        let address = listener.local_addr().map_err(fault)?;
        let mut pairs: Vec<(End, End)> = (0..n_hosts).map(|i| (End::Master, End::Worker(i))).collect();
        if peers {
            pairs.extend((0..n_hosts).flat_map(|j| (0..j).map(move |i| (End::Worker(i), End::Worker(j)))));
        }
        let mut outboxes = BTreeMap::new();
        for (a, b) in pairs {
            let streams = runtime.block_on(async {
                let (near, far) = tokio::join!(TcpStream::connect(address), listener.accept());
                Ok::<_, std::io::Error>((near?, far?.0))
            });
            let (near, far) = streams.map_err(fault)?;
            for (stream, from, to) in [(near, a, b), (far, b, a)] {
                link::tune(&stream).map_err(|e| e.to_string())?;
                let shape = (a.host() != b.host()).then(|| &ports[from.host()]);
                let _inside = runtime.enter();
                let (sender, receiver) = split(Shaped::new(stream, shape), Settings::default());
                outboxes.insert((from, to), Outbox::new(sender, 0));
                runtime.spawn(listen(receiver, to, from, arrived.clone()));
            }
        }
        Ok(Self { outboxes, runtime: Some(runtime) })
    }

    /// Queues a message on its link.
    ///
    /// # Errors
    /// Why the link has ended, or that these two have none.
    pub fn send(&mut self, from: End, to: End, packed: Packed) -> Result<(), String> {
        let outbox = self.outboxes.get_mut(&(from, to));
        let outbox = outbox.ok_or_else(|| format!("no link from {from:?} to {to:?}"))?;
        outbox.send(Place::default(), packed).map_err(|e| format!("{from:?} to {to:?}: {e}"))
    }
}

impl Drop for Wires {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// Hands on what comes in at `to`, to the end of the link.
async fn listen(mut receiver: Receiver, from: End, to: End, arrived: impl Fn(Arrival)) {
    let mut inbox = Inbox::new(0, BULK_ON_THE_WAY);
    loop {
        let accepted = match receiver.receive().await {
            Ok(frame) => inbox.accept(frame),
            Err(error) => Err(error),
        };
        if let Err(error) = accepted {
            return arrived(Arrival { from, to, letter: Err(format!("{from:?} to {to:?}: {error}")) });
        }
        while let Some(letter) = inbox.take() {
            arrived(Arrival { from, to, letter: Ok(letter) });
        }
    }
}

/// The shape of every host's streams.
fn ports(network: &Network, dilation: f64, n_hosts: usize) -> Result<Vec<Shape>, String> {
    let bits = network.rate / dilation;
    let rate = Rate::new(bits).ok_or_else(|| {
        let [slowest, fastest] = Rate::RANGE;
        format!("{bits:e} bit/s over loopback is outside {slowest:e} to {fastest:e}; change --dilation")
    })?;
    let Network { payload, overhead, .. } = *network;
    let wire = Wire { rate, payload, overhead, burst: Duration::ZERO, piece: PIECE };
    let latency = Duration::try_from_secs_f64(network.latency * dilation)
        .map_err(|e| format!("latency of {} s times {dilation}: {e}", network.latency))?;
    Ok(match network.wires {
        Kind::Hub => vec![Shape::hub(wire).with_latency(latency); n_hosts],
        Kind::Switch => (0..n_hosts).map(|_| Shape::port(wire).with_latency(latency)).collect(),
    })
}

/// A way into a channel for [`Wires::new`].
pub fn into_channel<T: Send + 'static>(
    channel: mpsc::Sender<T>,
    wrap: impl Fn(Arrival) -> T + Clone + Send + 'static,
) -> impl Fn(Arrival) + Clone + Send + 'static {
    move |arrival| {
        // The receiver is gone only when the run is over.
        let _ = channel.send(wrap(arrival));
    }
}
