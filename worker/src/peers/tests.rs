//! Links between two workers over loopback, without sessions that compute.

use std::net::Ipv4Addr;

use protocol::{
    dial::{self, Call},
    frame::Frame,
    handshake::{Hello, Membership, Role},
    message::{PeerWorker, Said},
};
use tokio::{net::TcpSocket, time::timeout};

use super::{links::Links, *};
use crate::session::Session;

const KEY: Key = Key { job: 3, epoch: 1 };
/// The longest that a test waits for anything.
const DEADLINE: Duration = Duration::from_secs(60);

/// One worker: its listening side, its links and what its compute thread hears.
struct Side {
    _peers: Peers,
    links: Links,
    news: mpsc::Receiver<Input>,
    _keeps_open: mpsc::Sender<Input>,
    address: SocketAddr,
}

/// One whose links go over memory, where the system has any.
async fn side(listener: TcpListener) -> Side {
    side_over(listener, true).await
}

async fn side_over(listener: TcpListener, share_memory: bool) -> Side {
    let address = listener.local_addr().expect("bound");
    let peers = Peers::start(listener, None, None, share_memory).expect("no certificates");
    let (send, news) = mpsc::channel(16);
    Side {
        links: Links::new(Some(&peers), send.downgrade()),
        _peers: peers,
        news,
        _keeps_open: send,
        address,
    }
}

async fn any_port() -> TcpListener {
    Peers::bind(Ipv4Addr::LOCALHOST.into(), 0).await.expect("a free port")
}

fn introduction(me: u32, addresses: &[SocketAddr]) -> Introduction {
    let member = |(index, address): (usize, &SocketAddr)| PeerWorker {
        name: format!("pc-{index}"),
        address: Some(*address),
        incarnation: 10 + index as u32,
    };
    let peer_workers = addresses.iter().enumerate().map(member).collect();
    Introduction { me, secret: "of the epoch".into(), peer_workers }
}

impl Side {
    fn introduce(&mut self, me: u32, addresses: &[SocketAddr]) {
        self.links.introduce(KEY, introduction(me, addresses));
    }

    async fn next(&mut self) -> News {
        match timeout(DEADLINE, self.news.recv()).await.expect("in time").expect("it stands") {
            Input::Peer(news) => news,
            Input::Master(..) | Input::Leave(_) => panic!("no master is here"),
        }
    }

    async fn step(&mut self) -> links::Step {
        let news = self.next().await;
        self.links.hear(news, &Session::new())
    }
}

/// Worker 1 has dialled worker 0 and both know it.
async fn pair() -> (Side, Side) {
    let (mut low, mut high) = (side(any_port().await).await, side(any_port().await).await);
    join(&mut low, &mut high).await;
    (low, high)
}

async fn join(low: &mut Side, high: &mut Side) {
    let addresses = [low.address, high.address];
    high.introduce(1, &addresses);
    high.links.want([0]);
    assert!(high.links.are_dialling());
    // The other hears of the job later, and keeps the caller waiting until then.
    low.introduce(0, &addresses);
    low.links.want([1]);
    assert!(!low.links.are_dialling(), "the higher of two dials");
    for side in [low, high] {
        let news = side.next().await;
        assert!(matches!(news.what, What::Stands(_)));
        assert_eq!(side.links.hear(news, &Session::new()), links::Step::default());
        assert!(!side.links.are_dialling());
    }
}

fn message(cycle: u64, n: usize) -> ToPeer {
    let partials = (0..n).map(|i| i as f64 + cycle as f64).collect();
    ToPeer { cycle, what: Said::Partials { partials, aboard: None } }
}

#[tokio::test]
async fn frames_pass_both_ways_and_what_may_be_lost_is_relayed_once() {
    let (mut low, mut high) = pair().await;
    for cycle in 0..2 {
        assert_eq!(high.links.send(0, message(cycle, 30), 0), []);
        assert_eq!(low.links.send(1, message(cycle, 30), 0), []);
        assert_eq!(low.step().await.heard, Some((1, message(cycle, 30))));
        assert_eq!(high.step().await.heard, Some((0, message(cycle, 30))));
    }
    let mut report = protocol::phase::Report::default();
    high.links.report(&mut report);
    assert_eq!((&report.linked, &report.relayed), (&vec![0], &vec![]));
    assert!(report.peer_bytes > 2 * 240, "{}", report.peer_bytes);

    // One side's link breaks: both relay what the other may have missed, and the other drops what it has.
    let lost = What::Ended(Error::Closed);
    let step = low.links.hear(News { key: KEY, from: 1, what: lost }, &Session::new());
    assert_eq!(step.relay, Some((1, vec![message(0, 30), message(1, 30)])));
    assert_eq!(high.step().await.relay, Some((0, vec![message(0, 30), message(1, 30)])));
    assert_eq!(high.links.relayed(0, message(1, 30)), None, "it came over the link");
    let other = ToPeer { cycle: 1, what: Said::Partials { partials: vec![0.0; 90], aboard: None } };
    assert_eq!(high.links.relayed(0, other.clone()), Some(other), "for the session to refuse");
    assert_eq!(high.links.relayed(0, message(2, 30)), Some(message(2, 30)), "new");
    assert_eq!(low.links.send(1, message(2, 30), 0), [message(2, 30)]);
    high.links.report(&mut report);
    assert_eq!((&report.linked, &report.relayed), (&vec![], &vec![0]));
}

#[tokio::test]
async fn frames_of_an_older_epoch_are_dropped_and_a_newer_one_replaces_the_links() {
    let (mut low, mut high) = pair().await;
    assert_eq!(high.links.send(0, message(0, 3), 0), []);
    let late = low.next().await;
    let addresses = [low.address, high.address];
    let newer = Key { epoch: 2, ..KEY };
    for (me, side) in [&mut low, &mut high].into_iter().enumerate() {
        side.links.introduce(newer, introduction(me as u32, &addresses));
    }
    assert_eq!(low.links.hear(late, &Session::new()), links::Step::default());
    high.links.want([0]);
    loop {
        let news = low.next().await;
        if news.key == newer {
            assert!(matches!(news.what, What::Stands(_)));
            break;
        }
        assert!(matches!(news.what, What::Ended(Error::Left { .. } | Error::Closed)), "of the older epoch");
    }
}

/// Dials worker 0 as `hello` says.
async fn call(low: &Side, change: impl FnOnce(&mut Hello)) -> Result<Call> {
    let mut hello = Hello::new(Role::Peer, "pc-1", 1.0, 1, "none", 0);
    hello.token = Some("of the epoch".into());
    hello.member = Some(Membership { job: KEY.job, epoch: KEY.epoch, index: 1 });
    change(&mut hello);
    dial::reach_peer(low.address, None, Settings::default()).await?.greet(&hello).await
}

#[tokio::test]
async fn strangers_are_turned_away_in_words() {
    let mut low = side(any_port().await).await;
    let addresses = [low.address; 3];
    low.introduce(0, &addresses);
    let place = |job, epoch, index| Some(Membership { job, epoch, index });
    let no_token = |hello: &mut Hello| hello.token = None;
    let refused = |error: Option<Error>| error.expect("refused").to_string();
    let text = refused(call(&low, no_token).await.err());
    assert!(text.contains("token missing or wrong"), "{text}");
    for (member, words) in [
        (None, "a peer without a place in a job"),
        (place(2, 9, 1), "job 2 epoch 9, this worker has job 3 epoch 1"),
        (place(3, 0, 1), "job 3 epoch 0, this worker has job 3 epoch 1"),
        (place(3, 1, 0), "worker 0 calls worker 0 of 3; the higher of two dials"),
        (place(3, 1, 3), "worker 3 calls worker 0 of 3"),
    ] {
        let text = refused(call(&low, |hello| hello.member = member).await.err());
        assert!(text.contains(words), "{text}, expected {words}");
    }
    let text = refused(call(&low, |hello| hello.role = Role::Worker).await.err());
    assert!(text.contains("role worker, this side takes peer"), "{text}");
    let first = call(&low, |_| {}).await.expect("one of the job");
    assert_eq!(first.welcome.incarnation, 11, "as the master gave it");
    let text = refused(call(&low, |_| {}).await.err());
    assert!(text.contains("worker 1 has called before"), "{text}");
}

#[tokio::test]
async fn frames_that_say_what_they_may_not_end_their_link_by_name() {
    let good = Header { job: 3, epoch: 1, incarnation: 11, ..Header::new(Kind::Cycle) };
    for (header, words) in [
        (Header { job: 4, ..good }, "frame of job 4, this link is of 3"),
        (Header { epoch: 0, ..good }, "frame of epoch 0, this link is of 1"),
        (Header { incarnation: 12, ..good }, "frame of incarnation 12, this link is of 11"),
        (Header { cycle: 1, ..good }, "cycle 0 in a frame of cycle 1"),
        (Header { kind: Kind::Control, ..good }, "control frame, expected a cycle frame"),
        (Header { plan: 5, ..good }, "cycle 0 follows plan 0000000000000005, in force is 0000000000000000"),
    ] {
        let mut low = side(any_port().await).await;
        let addresses = [low.address; 2];
        low.introduce(0, &addresses);
        low.links.want([1]);
        let Call { sender, mut receiver, .. } = call(&low, |_| {}).await.expect("one of the job");
        assert_eq!(low.step().await, links::Step::default());
        assert_eq!(low.links.send(1, message(0, 3), 0), []);
        let payload = wire::pack_to_peer(&message(0, 3)).expect("short").bytes;
        sender.send(Frame::new(header, payload)).expect("queued");
        let news = low.next().await;
        if let What::Ended(error) = &news.what {
            assert!(error.to_string().contains(words), "{error}, expected {words}");
        }
        let step = low.links.hear(news, &Session::new());
        assert_eq!(step, links::Step { heard: None, relay: Some((1, vec![message(0, 3)])) }, "{words}");
        // What was wrong about it was its frame: the same numbers may come by way of the master.
        assert_eq!(low.links.relayed(1, message(0, 3)), Some(message(0, 3)));
        while receiver.receive().await.is_ok() {}
    }
}

#[tokio::test]
async fn a_peer_that_cannot_be_reached_is_found_out_and_relayed() {
    let mut high = side(any_port().await).await;
    let gone = any_port().await.local_addr().expect("bound");
    let addresses = [gone, high.address];
    high.introduce(1, &addresses);
    high.links.want([0]);
    assert!(high.links.are_dialling());
    assert_eq!(high.links.send(0, message(0, 3), 0), [message(0, 3)], "relayed meanwhile");
    assert_eq!(high.step().await.relay, Some((0, vec![])));
    assert!(!high.links.are_dialling());
    assert_eq!(high.links.send(0, message(1, 3), 0), [message(1, 3)]);
}

#[tokio::test]
async fn another_worker_than_the_one_dialled_is_noticed() {
    let mut low = side(any_port().await).await;
    let mut high = side(any_port().await).await;
    // The address of worker 0 leads to worker 1.
    let addresses = [low.address, low.address, high.address];
    low.introduce(1, &addresses);
    high.introduce(2, &addresses);
    high.links.want([0]);
    match high.next().await.what {
        What::Failed(error) => assert!(error.to_string().contains("worker 1 answers there"), "{error}"),
        _ => panic!("it was taken for worker 0"),
    }
    let member = |address: &str| Some(address.parse().expect("an address"));
    let mut who = introduction(2, &addresses);
    who.peer_workers[0].address = member("127.0.0.1:9");
    who.peer_workers[2].address = member("192.0.2.1:9");
    high.links.introduce(Key { epoch: 2, ..KEY }, who);
    high.links.want([0]);
    match high.next().await.what {
        What::Failed(error) => assert!(error.to_string().contains("by a loopback address"), "{error}"),
        _ => panic!("loopback of another host"),
    }
}

/// Both send more than all sockets between them hold before either takes anything off its queue.
#[tokio::test]
async fn large_frames_cross_over_sockets_of_four_kilobytes() {
    let socket = TcpSocket::new_v4().expect("a socket");
    socket.set_send_buffer_size(4096).expect("a buffer");
    socket.set_recv_buffer_size(4096).expect("a buffer");
    socket.bind((Ipv4Addr::LOCALHOST, 0).into()).expect("a port");
    let mut low = side_over(socket.listen(16).expect("listens"), false).await;
    let mut high = side(any_port().await).await;
    large_frames_cross(&mut low, &mut high).await;
}

/// The same with the rings between them.
#[tokio::test]
async fn large_frames_cross_over_memory() {
    let (mut low, mut high) = (side(any_port().await).await, side(any_port().await).await);
    large_frames_cross(&mut low, &mut high).await;
}

async fn large_frames_cross(low: &mut Side, high: &mut Side) {
    join(low, high).await;
    let n = 1_500_000;
    assert_eq!(low.links.send(1, message(0, n), 0), []);
    assert_eq!(high.links.send(0, message(0, n), 0), []);
    assert!(low.step().await.heard == Some((1, message(0, n))));
    assert!(high.step().await.heard == Some((0, message(0, n))));
}
