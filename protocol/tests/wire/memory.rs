//! Links that go on over memory: how both sides agree, what they do where they cannot, and how such links end.

use std::{
    net::SocketAddr,
    sync::atomic::Ordering::{Relaxed, Release},
    time::Duration,
};

use protocol::{
    Error, Result, codec,
    frame::{Frame, HEADER_LEN, Header, Kind, encode_header},
    handshake::{Client, Hello, Policy, Role, Server, Verdict, Welcome},
    link::{Receiver, Sender, Socket, admit_near, greet, greet_near, hear, split},
    memory::{BYTES, Near, Offer, Reading, Writing, ring},
    tls,
};
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, Join, join},
    net::{TcpListener, TcpStream},
    time::timeout,
};

use crate::{
    link::{exchange, no_heartbeats},
    tls::Authority,
};

/// The longest that a test waits for anything.
const DEADLINE: Duration = Duration::from_secs(60);
/// Where the dialling side's number of written bytes stands, as a hostile caller knows.
const WRITTEN_THERE: usize = 256;

/// Both ends of a connection within this machine, the dialling one first.
async fn connection() -> (Socket, Socket) {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("bound");
    let (dialled, accepted) = tokio::join!(TcpStream::connect(address), listener.accept());
    let socket = |stream: TcpStream| Socket::new(stream).expect("TCP");
    (socket(dialled.expect("connects")), socket(accepted.expect("accepts").0))
}

fn nearby(socket: &Socket) -> Near {
    Near::of(socket).expect("loopback, and a system that has memory")
}

/// Two ends of a stream over memory.
pub(crate) async fn streams() -> (Join<Reading, Writing>, Join<Reading, Writing>) {
    let (dialled, accepted) = connection().await;
    let offered = nearby(&accepted).make().expect("memory");
    let (reading, writing) = nearby(&dialled).open(&offered.offer()).expect("made a moment ago");
    let (reading_back, writing_back) = offered.halves().expect("within a runtime");
    (join(reading, writing), join(reading_back, writing_back))
}

fn hello() -> Hello {
    Hello::new(Role::Worker, "pc-1", 1.0, 2, "scalar", 7)
}

const WELCOME: Welcome = Welcome::new(1, 0, 1000);

fn policy() -> Policy {
    Policy { roles: vec![Role::Worker], ..Policy::default() }
}

type Link = (Sender, Receiver);

fn link(stream: impl AsyncRead + AsyncWrite + Send + 'static) -> Link {
    split(stream, no_heartbeats())
}

/// Greets over both ends of a connection, each of which may be near; says what either side found.
async fn agree(
    (dialling, near): (&mut Link, Option<Near>),
    (listening, far): (&mut Link, Option<Near>),
) -> (Result<bool>, Result<bool>) {
    let answer = async {
        let (server, hello) = hear(&listening.0, &mut listening.1, policy()).await?;
        admit_near(server, &listening.0, &mut listening.1, WELCOME, &hello, far).await
    };
    let hello = hello();
    let (greeted, admitted) = tokio::join!(greet_near(&dialling.0, &mut dialling.1, &hello, near), answer);
    (greeted.map(|(_, shares)| shares), admitted)
}

fn frame(cycle: u64, payload: Vec<u8>) -> Frame {
    Frame::new(Header { cycle, ..Header::new(Kind::Cycle) }, payload)
}

/// A frame passes each way.
async fn frames_pass(a: &mut Link, b: &mut Link) {
    for cycle in 0..2 {
        let (from, to) = if cycle == 0 { (&*a, &mut *b) } else { (&*b, &mut *a) };
        from.0.send(frame(cycle, vec![cycle as u8; 3000])).expect("it stands");
        let came = timeout(DEADLINE, to.1.receive()).await.expect("in time").expect("it stands");
        assert_eq!((came.header.cycle, came.payload), (cycle, vec![cycle as u8; 3000]));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_peers_that_both_send_megabytes_finish_over_memory() {
    if !system::shared::IS_THERE {
        return;
    }
    let (a, b) = streams().await;
    let a = tokio::spawn(exchange(split(a, no_heartbeats()), 1, 2));
    let b = tokio::spawn(exchange(split(b, no_heartbeats()), 2, 1));
    let both = async { tokio::join!(a, b) };
    let (a, b) = timeout(DEADLINE, both).await.expect("no deadlock");
    a.expect("one side");
    b.expect("the other side");
}

#[tokio::test]
async fn a_greeting_agrees_on_memory_and_frames_go_over_it() {
    if !system::shared::IS_THERE {
        return;
    }
    let (dialled, accepted) = connection().await;
    let (near, far) = (nearby(&dialled), nearby(&accepted));
    let (mut a, mut b) = (link(dialled), link(accepted));
    assert_eq!(agree((&mut a, Some(near)), (&mut b, Some(far))).await, (Ok(true), Ok(true)));
    for _ in 0..100 {
        frames_pass(&mut a, &mut b).await;
    }
    assert_eq!(a.0.counters().bytes_sent, b.0.counters().bytes_received);
    assert_eq!(b.0.counters().bytes_sent, a.0.counters().bytes_received);
    // What one side says last is heard by the other, and then that it has ended.
    a.0.send(frame(9, vec![1; 10])).expect("it stands");
    a.0.finish().await.expect("written");
    drop(a);
    assert_eq!(b.1.receive().await.map(|frame| frame.header.cycle), Ok(9));
    assert_eq!(b.1.receive().await, Err(Error::Closed));
}

#[tokio::test]
async fn under_tls_both_sides_agree_within_it() {
    if !system::shared::IS_THERE {
        return;
    }
    let lab = Authority::new("lab");
    let (_m, master) = lab.host("bolide:master", |_| {});
    let (_w, worker) = lab.host("bolide:worker", |_| {});
    let server = tls::server_config(&master).expect("good");
    let client = tls::client_config(&worker).expect("good");
    let (dialled, accepted) = connection().await;
    let (near, far) = (nearby(&dialled), nearby(&accepted));
    let roles = &[tls::Role::Master];
    let (dialled, accepted) =
        tokio::join!(tls::connect_any(dialled, "127.0.0.1", &client, roles), tls::accept(accepted, &server));
    let (mut a, mut b) = (link(dialled.expect("good").0), link(accepted.expect("good").0));
    assert_eq!(agree((&mut a, Some(near)), (&mut b, Some(far))).await, (Ok(true), Ok(true)));
    for _ in 0..100 {
        frames_pass(&mut a, &mut b).await;
    }
}

#[tokio::test]
async fn one_side_that_does_not_want_memory_keeps_the_link_on_tcp() {
    if !system::shared::IS_THERE {
        return;
    }
    for which in 0..2 {
        let (dialled, accepted) = connection().await;
        let near = (which == 0).then(|| nearby(&dialled));
        let far = (which == 1).then(|| nearby(&accepted));
        let (mut a, mut b) = (link(dialled), link(accepted));
        assert_eq!(agree((&mut a, near), (&mut b, far)).await, (Ok(false), Ok(false)));
        frames_pass(&mut a, &mut b).await;
    }
}

/// A tunnel on each side's loopback looks near from both ends.
#[tokio::test]
async fn a_connection_with_something_in_between_stays_on_tcp() {
    if !system::shared::IS_THERE {
        return;
    }
    let ((dialled, mut between), (mut beyond, accepted)) = (connection().await, connection().await);
    tokio::spawn(async move { tokio::io::copy_bidirectional(&mut between, &mut beyond).await });
    let (near, far) = (nearby(&dialled), nearby(&accepted));
    assert!(!far.is_from(Some(near.ends())) && !far.is_from(None));
    let (mut a, mut b) = (link(dialled), link(accepted));
    assert_eq!(agree((&mut a, Some(near)), (&mut b, Some(far))).await, (Ok(false), Ok(false)));
    frames_pass(&mut a, &mut b).await;
}

/// The listening side's half by hand: its Welcome offers what `change` makes of good memory.
async fn offer_otherwise(listening: &mut Link, far: Near, change: impl FnOnce(&mut Offer)) -> Result<Frame> {
    let mut server = Server::new(policy());
    let Verdict::Good(hello) = server.apply(&listening.1.receive().await?)? else {
        panic!("a good greeting")
    };
    assert!(far.is_from(hello.near));
    let offered = far.make()?;
    let mut offer = offered.offer();
    change(&mut offer);
    listening.0.send(server.welcome(Welcome { memory: Some(offer), ..WELCOME })?)?;
    let answer = listening.1.receive().await?;
    listening.0.send(answer.clone())?;
    Ok(answer)
}

#[tokio::test]
async fn memory_that_does_not_open_or_is_another_keeps_the_link_on_tcp() {
    if !system::shared::IS_THERE {
        return;
    }
    let changes: [fn(&mut Offer); 4] = [
        |offer| offer.number = u32::MAX,
        |offer| offer.process = 0,
        |offer| offer.secret[1] ^= 1 << 63,
        // Standard input: whatever that is here, it is no memory of the right length.
        |offer| offer.number = 0,
    ];
    for change in changes {
        let (dialled, accepted) = connection().await;
        let (near, far) = (nearby(&dialled), nearby(&accepted));
        let (mut a, mut b) = (link(dialled), link(accepted));
        let hello = hello();
        let greeting = greet_near(&a.0, &mut a.1, &hello, Some(near));
        let (greeted, answer) = tokio::join!(greeting, offer_otherwise(&mut b, far, change));
        assert_eq!(answer.expect("an answer").payload, [0], "no");
        assert_eq!(greeted, Ok((greeted.clone().expect("taken in").0, false)));
        frames_pass(&mut a, &mut b).await;
    }
}

#[tokio::test]
async fn answers_that_are_none_end_the_link() {
    if !system::shared::IS_THERE {
        return;
    }
    // Memory that nobody asked for.
    let (dialled, accepted) = connection().await;
    let far = nearby(&accepted);
    let (mut a, mut b) = (link(dialled), link(accepted));
    let offered = async {
        let (mut server, _) = hear(&b.0, &mut b.1, policy()).await.expect("a greeting");
        let offer = far.make().expect("memory").offer();
        b.0.send(server.welcome(Welcome { memory: Some(offer), ..WELCOME }).expect("good"))
            .expect("it stands");
    };
    let hello = hello();
    let (greeted, ()) = tokio::join!(greet(&a.0, &mut a.1, &hello), offered);
    assert_eq!(greeted, Err(Error::Message("memory is offered that was not asked for".into())));

    // Anything but an answer to an offer.
    for (kind, payload, words) in [
        (Kind::Cycle, vec![0; 64], "cycle frame, expected memory"),
        (Kind::Memory, vec![], "control message"),
        (Kind::Memory, vec![2], "control message"),
    ] {
        let (dialled, accepted) = connection().await;
        let (near, far) = (nearby(&dialled), nearby(&accepted));
        let (mut a, mut b) = (link(dialled), link(accepted));
        let answer = async {
            let (server, hello) = hear(&b.0, &mut b.1, policy()).await?;
            admit_near(server, &b.0, &mut b.1, WELCOME, &hello, Some(far)).await
        };
        let call = async {
            let hello = Hello { near: Some(near.ends()), ..hello.clone() };
            a.0.send(Client::new(&hello).expect("good").1).expect("it stands");
            a.1.receive().await.expect("a welcome");
            a.0.send(Frame::new(Header::new(kind), payload)).expect("it stands");
        };
        let (admitted, ()) = tokio::join!(answer, call);
        let text = admitted.expect_err("no answer").to_string();
        assert!(text.contains(words), "{text}, expected {words}");
    }
}

/// A caller that has agreed and can do with memory and connection what it likes.
struct Caller {
    memory: system::shared::Shared,
    socket: Socket,
}

/// One by hand, and the link of the side that has taken it in.
async fn caller() -> (Caller, Link) {
    let (mut socket, accepted) = connection().await;
    let (near, far) = (nearby(&socket), nearby(&accepted));
    let mut b = link(accepted);
    let answer = async {
        let (server, hello) = hear(&b.0, &mut b.1, policy()).await?;
        admit_near(server, &b.0, &mut b.1, WELCOME, &hello, Some(far)).await
    };
    let sealed = |mut frame: Frame| {
        frame.seal().expect("short");
        [&encode_header(&frame.header)[..], &frame.payload].concat()
    };
    let call = async {
        let hello = Hello { near: Some(near.ends()), ..hello() };
        socket.write_all(&sealed(Client::new(&hello).expect("good").1)).await.expect("sent");
        let mut welcome = vec![0; HEADER_LEN + 12 + 1 + 24];
        socket.read_exact(&mut welcome).await.expect("a welcome");
        let welcome: Welcome = codec::decode(&welcome[HEADER_LEN..], 1024).expect("a welcome");
        let offer = welcome.memory.expect("offered");
        let memory = system::shared::open(offer.process, offer.number, BYTES).expect("made a moment ago");
        socket.write_all(&sealed(Frame::new(Header::new(Kind::Memory), vec![1]))).await.expect("sent");
        Caller { memory, socket }
    };
    let (admitted, caller) = tokio::join!(answer, call);
    assert_eq!(admitted, Ok(true));
    (caller, b)
}

impl Caller {
    /// Puts bytes at the beginning of its ring, says that there are so many, and calls.
    async fn say(&mut self, bytes: &[u8], written: u64) {
        // SAFETY: the other side reads nothing there before the number below says so.
        unsafe { self.memory.put(ring::START, bytes) };
        self.memory.number(WRITTEN_THERE).store(written, Release);
        self.socket.write_all(&[0]).await.expect("sent");
    }
}

#[tokio::test]
async fn nonsense_in_memory_ends_the_link_with_an_error() {
    if !system::shared::IS_THERE {
        return;
    }
    let header = encode_header(&Header::new(Kind::Bye));
    for (bytes, written, words) in [
        (&header[..], u64::MAX, "shared memory: 18446744073709551615 bytes written, expected 0 to 1048576"),
        (&header[..], (1 << 20) + 1, "shared memory: 1048577 bytes written, expected 0 to 1048576"),
        (&[0x55; 52][..], 52, "frame starts with [55, 55, 55, 55]"),
        (
            &encode_header(&Header { length: u32::MAX, ..Header::new(Kind::Cycle) })[..],
            52,
            "length 4294967295",
        ),
    ] {
        let (mut caller, (sender, mut receiver)) = caller().await;
        caller.say(bytes, written).await;
        let error = timeout(DEADLINE, receiver.receive()).await.expect("in time").expect_err("nonsense");
        assert!(error.to_string().contains(words), "{error}, expected {words}");
        assert_eq!(sender.send(frame(1, Vec::new())), Err(error));
    }
}

#[tokio::test]
async fn a_process_that_dies_leaves_what_it_said_and_closes_the_link() {
    if !system::shared::IS_THERE {
        return;
    }
    let header = encode_header(&Header::new(Kind::Bye));
    let (needed, what) = (HEADER_LEN as u64, "frame header");
    for found in [0, 1, needed - 1, needed] {
        let (mut caller, (_sender, mut receiver)) = caller().await;
        caller.say(&header, found).await;
        drop(caller);
        if found == needed {
            assert_eq!(receiver.receive().await.map(|frame| frame.header.kind), Ok(Kind::Bye));
        }
        let end = match found {
            0 => Error::Closed,
            found if found == needed => Error::Closed,
            found => Error::Truncated { what, found, needed },
        };
        assert_eq!(timeout(DEADLINE, receiver.receive()).await.expect("in time"), Err(end));
    }
    // One that does not read, and is gone, does not hold the other up.
    let (caller, (sender, mut receiver)) = caller().await;
    sender.send(frame(1, vec![0; 4 << 20])).expect("it stands");
    tokio::task::yield_now().await;
    drop(caller);
    let finished = timeout(DEADLINE, sender.finish()).await.expect("in time");
    assert!(matches!(finished, Err(Error::Io { .. })), "{finished:?}");
    assert_eq!(timeout(DEADLINE, receiver.receive()).await.expect("in time"), Err(Error::Closed));
}

/// Calls that mean nothing cost a look and no more.
#[tokio::test]
async fn bytes_on_the_connection_are_calls_whatever_they_are() {
    if !system::shared::IS_THERE {
        return;
    }
    let (mut caller, (_sender, mut receiver)) = caller().await;
    caller.socket.write_all(&[0x55; 100_000]).await.expect("sent");
    let nothing = timeout(Duration::from_millis(50), receiver.receive()).await;
    assert!(nothing.is_err(), "{nothing:?}");
    caller.say(&encode_header(&Header::new(Kind::Bye)), HEADER_LEN as u64).await;
    assert_eq!(receiver.receive().await.map(|frame| frame.header.kind), Ok(Kind::Bye));
    assert_eq!(caller.memory.number(WRITTEN_THERE + 256).load(Relaxed), HEADER_LEN as u64, "taken");
}

#[test]
fn an_offer_has_its_golden_bytes() {
    let offer = Offer { process: 0x0102, number: 7, secret: [1, 2] };
    let ends = |port| SocketAddr::from(([127, 0, 0, 1], port));
    let bytes = codec::encode(&offer).expect("encodes");
    assert_eq!(bytes, [2, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0]);
    let bytes = codec::encode(&(ends(1), ends(2))).expect("encodes");
    assert_eq!(bytes, [0, 0, 0, 0, 127, 0, 0, 1, 1, 0, 0, 0, 0, 0, 127, 0, 0, 1, 2, 0], "as in a greeting");
}

/// Without heartbeats a frame whose call is lost is never taken: the other side sleeps for ever.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_that_come_just_as_the_other_side_falls_asleep_are_taken() {
    if !system::shared::IS_THERE {
        return;
    }
    const TRIPS: u64 = 20_000;
    let (a, b) = streams().await;
    let (a, mut b) = (split(a, no_heartbeats()), split(b, no_heartbeats()));
    let back = tokio::spawn(async move {
        for cycle in 0..TRIPS {
            let frame = b.1.receive().await.expect("it stands");
            assert_eq!(frame.header.cycle, cycle);
            // Around the time for which the other side looks before it sleeps.
            let until = std::time::Instant::now() + Duration::from_micros(cycle * 7 % 60);
            while std::time::Instant::now() < until {
                std::hint::spin_loop();
            }
            b.0.send(frame).expect("it stands");
        }
        b
    });
    let (sender, mut receiver) = a;
    for cycle in 0..TRIPS {
        sender.send(frame(cycle, vec![0; (cycle % 100) as usize])).expect("it stands");
        let came = timeout(DEADLINE, receiver.receive()).await.expect("no call is lost").expect("it stands");
        assert_eq!(came.header.cycle, cycle);
    }
    drop(back.await.expect("it ends"));
}
