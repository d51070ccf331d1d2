//! Links over pipes, over TCP and over memory that is shared: both ways at once, overtaking, silence, ends.

use protocol::codec::{Assembler, put_f64s};
use protocol::frame::{CHUNK, Frame, HEADER_LEN, Header, Kind, encode_header};
use protocol::handshake::{Hello, Policy, Role, Welcome};
use protocol::link::{
    GREETING_LIMIT, Receiver, Sender, Settings, UNSENT_BYTES, WRITE_BUFFER, admit, greet, hear, split, tune,
};
use protocol::{Error, Result};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream, duplex};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::time::{Instant, advance, timeout};

use crate::memory;

const SIX_MB: usize = 6_000_000;

/// What a link goes over in a test.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// A pipe of so many bytes.
    Pipe(usize),
    Memory,
}

/// A pipe of so many bytes, and shared memory where there is any.
fn ways(bytes: usize) -> Vec<Way> {
    let memory = system::shared::IS_THERE.then_some(Way::Memory);
    [Way::Pipe(bytes)].into_iter().chain(memory).collect()
}

trait Stream: AsyncRead + AsyncWrite + Send + Unpin {}

impl<S: AsyncRead + AsyncWrite + Send + Unpin> Stream for S {}

fn frame(kind: Kind, cycle: u64, payload: Vec<u8>) -> Frame {
    Frame::new(Header { cycle, ..Header::new(kind) }, payload)
}

fn pair(bytes: usize) -> ((Sender, Receiver), DuplexStream) {
    let (near, far) = duplex(bytes);
    (split(near, Settings::default()), far)
}

/// The same over one of [`ways`].
async fn pair_over(way: Way) -> ((Sender, Receiver), Box<dyn Stream>) {
    match way {
        Way::Pipe(bytes) => {
            let (link, far) = pair(bytes);
            (link, Box::new(far))
        }
        Way::Memory => {
            let (near, far) = memory::streams().await;
            (split(near, Settings::default()), Box::new(far))
        }
    }
}

/// Settings under which a slow machine adds no heartbeats to the counters.
pub(crate) fn no_heartbeats() -> Settings {
    Settings { heartbeat: Duration::from_secs(600), silence: Duration::from_secs(600), ..Settings::default() }
}

/// Sends a 6 MB cycle frame and a 6 MB bulk message, and takes as much from the other side.
pub(crate) async fn exchange((sender, mut receiver): (Sender, Receiver), mine: u8, theirs: u8) {
    sender.send(frame(Kind::Cycle, 1, vec![mine; SIX_MB])).expect("queued");
    sender.send_bulk(Header::new(Kind::Bulk), 1, vec![mine; SIX_MB]).expect("queued");
    let mut assembler = Assembler::new(SIX_MB as u64, 1);
    let cycle = receiver.receive().await.expect("the cycle frame comes first");
    assert_eq!((cycle.header.kind, cycle.header.cycle), (Kind::Cycle, 1));
    assert!(cycle.payload == vec![theirs; SIX_MB]);
    receiver.recycle(cycle.payload);
    let message = loop {
        let chunk = receiver.receive().await.expect("a chunk");
        if let Some(message) = assembler.accept(&chunk).expect("in order") {
            break message;
        }
    };
    assert!(message.bytes == vec![theirs; SIX_MB]);
    sender.finish().await.expect("all is written");
    assert_eq!(receiver.receive().await, Err(Error::Closed));

    let counters = sender.counters();
    let chunks = SIX_MB.div_ceil(CHUNK);
    let bytes = (2 * SIX_MB + HEADER_LEN + chunks * (HEADER_LEN + 16)) as u64;
    assert_eq!((counters.frames_sent, counters.bytes_sent), (1 + chunks as u64, bytes));
    assert_eq!((counters.frames_received, counters.bytes_received), (1 + chunks as u64, bytes));
}

#[tokio::test]
async fn two_peers_that_both_send_megabytes_finish_over_a_pipe_of_a_kilobyte() {
    let (a, b) = duplex(1024);
    let (a, b) = (split(a, no_heartbeats()), split(b, no_heartbeats()));
    let both = async { tokio::join!(exchange(a, 1, 2), exchange(b, 2, 1)) };
    timeout(Duration::from_secs(60), both).await.expect("no deadlock");
}

/// Two ends of a TCP connection, the dialling one first, with receive buffers of 4 KiB and, where
/// `small_sending` says so, send buffers too.
async fn tcp(small_sending: bool) -> (TcpStream, TcpStream) {
    let small = || {
        let socket = TcpSocket::new_v4().expect("a socket");
        socket.set_recv_buffer_size(4096).expect("the system takes it");
        if small_sending {
            socket.set_send_buffer_size(4096).expect("the system takes it");
        }
        socket
    };
    let listening = small();
    listening.bind("127.0.0.1:0".parse().expect("an address")).expect("a free port");
    let listener: TcpListener = listening.listen(1).expect("listens");
    let address = listener.local_addr().expect("bound");
    let (dialled, accepted) = tokio::join!(small().connect(address), listener.accept());
    let (dialled, accepted) = (dialled.expect("connects"), accepted.expect("accepts").0);
    tune(&accepted).expect("TCP");
    tune(&dialled).expect("TCP");
    (dialled, accepted)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_peers_that_both_send_megabytes_finish_over_tcp_with_small_buffers() {
    let (a, b) = tcp(true).await;
    let a = tokio::spawn(exchange(split(a, no_heartbeats()), 1, 2));
    let b = tokio::spawn(exchange(split(b, no_heartbeats()), 2, 1));
    let both = async { tokio::join!(a, b) };
    let (a, b) = timeout(Duration::from_secs(60), both).await.expect("no deadlock");
    a.expect("one side");
    b.expect("the other side");
}

#[tokio::test]
async fn cycle_frames_overtake_bulk() {
    for way in ways(1024) {
        let ((sender, _receiver), far) = pair_over(way).await;
        sender.send_bulk(Header::new(Kind::Bulk), 1, vec![7; 100 * CHUNK]).expect("queued");
        // Let the writer fill its buffer and the pipe before the cycle frame is queued.
        for _ in 0..100 {
            tokio::task::yield_now().await;
        }
        let mut payload = sender.buffer();
        put_f64s(&mut payload, &[1.0, 2.0]);
        sender.send(frame(Kind::Cycle, 5, payload)).expect("queued");
        let (_far_sender, mut receiver) = split(far, Settings::default());
        let mut ahead = 0;
        while receiver.receive().await.expect("a frame").header.kind == Kind::Bulk {
            ahead += 1;
        }
        let held = if way == Way::Memory { protocol::memory::ring::BYTES } else { 0 };
        let limit = (held + WRITE_BUFFER) / CHUNK + 1;
        assert!((1..=limit).contains(&ahead), "{ahead} of 100 chunks were ahead over {way:?}");
    }
}

#[tokio::test]
#[cfg_attr(windows, ignore = "Windows has no limit to set for bytes that it has taken and not sent")]
async fn cycle_frames_overtake_bulk_in_the_system_too() {
    let (near, far) = tcp(false).await;
    let (sender, _receiver) = split(near, no_heartbeats());
    sender.send_bulk(Header::new(Kind::Bulk), 1, vec![7; 200 * CHUNK]).expect("queued");
    // The system takes what it will; nobody reads.
    let mut before = u64::MAX;
    while before != sender.counters().bytes_sent {
        before = sender.counters().bytes_sent;
        for _ in 0..1000 {
            tokio::task::yield_now().await;
        }
    }
    sender.send(frame(Kind::Cycle, 5, Vec::new())).expect("queued");
    let (_far_sender, mut receiver) = split(far, no_heartbeats());
    let mut ahead = 0;
    while receiver.receive().await.expect("a frame").header.kind == Kind::Bulk {
        ahead += 1;
    }
    // Untuned, about forty of the chunks are ahead; one segment on loopback holds 64 KiB.
    let limit = (UNSENT_BYTES as usize + WRITE_BUFFER) / CHUNK + 4;
    assert!((1..=limit).contains(&ahead), "{ahead} of 200 chunks were ahead, limit {limit}");
}

#[tokio::test]
async fn bulk_messages_take_turns() {
    for way in ways(1024) {
        let ((sender, _receiver), far) = pair_over(way).await;
        for stream in [1, 2] {
            sender.send_bulk(Header::new(Kind::Bulk), stream, vec![0; 3 * CHUNK]).expect("queued");
        }
        let (_far_sender, mut receiver) = split(far, Settings::default());
        let mut streams = Vec::new();
        for _ in 0..6 {
            streams.push(receiver.receive().await.expect("a chunk").payload[0]);
        }
        assert_eq!(streams, [1, 2, 1, 2, 1, 2], "over {way:?}");
    }
}

#[tokio::test]
async fn a_stream_cut_at_any_byte_ends_with_an_error() {
    let mut whole = frame(Kind::Control, 3, b"abc".to_vec());
    whole.seal().expect("three bytes");
    let mut bytes = encode_header(&whole.header).to_vec();
    bytes.extend_from_slice(b"abc");
    let cuts = ways(4096).into_iter().flat_map(|way| (0..=bytes.len()).map(move |length| (way, length)));
    for (way, length) in cuts {
        let ((_sender, mut receiver), mut far) = pair_over(way).await;
        far.write_all(&bytes[..length]).await.expect("room");
        drop(far);
        let (found, header) = (length as u64, HEADER_LEN as u64);
        let expected: Result<Frame> = match length {
            0 => Err(Error::Closed),
            1..HEADER_LEN => Err(Error::Truncated { what: "frame header", found, needed: header }),
            HEADER_LEN..55 => Err(Error::Truncated { what: "control", found: found - header, needed: 3 }),
            _ => Ok(whole.clone()),
        };
        assert_eq!(receiver.receive().await, expected, "cut after {length} bytes over {way:?}");
    }
}

#[tokio::test]
async fn a_bit_flipped_anywhere_in_a_stream_never_passes() {
    let mut frames = [frame(Kind::Control, 3, b"abc".to_vec()), frame(Kind::Cycle, 4, vec![5; 20])];
    let mut bytes = Vec::new();
    for frame in &mut frames {
        frame.seal().expect("short");
        bytes.extend_from_slice(&encode_header(&frame.header));
        bytes.extend_from_slice(&frame.payload);
    }
    let first = HEADER_LEN + 3;
    let bits = ways(4096).into_iter().flat_map(|way| (0..bytes.len() * 8).map(move |bit| (way, bit)));
    for (way, bit) in bits {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let ((_sender, mut receiver), mut far) = pair_over(way).await;
        far.write_all(&damaged).await.expect("room");
        if bit / 8 >= first {
            assert_eq!(receiver.receive().await.as_ref(), Ok(&frames[0]));
        }
        // The pipe is still open: the fault is found without waiting for more bytes.
        let answer = timeout(Duration::from_secs(5), receiver.receive()).await.expect("at once");
        assert!(answer.is_err(), "bit {bit} passed over {way:?}: {answer:?}");
        assert_eq!(receiver.receive().await, answer, "what follows is not looked at");
    }
}

#[tokio::test]
async fn a_bad_frame_ends_the_link_for_its_sender_too() {
    for way in ways(4096) {
        let ((sender, mut receiver), mut far) = pair_over(way).await;
        far.write_all(b"GET / HTTP/1.1\r\nHost: 127.0.0.1:4711\r\nAccept: */*\r\n\r\n").await.expect("room");
        let error = receiver.receive().await.expect_err("no frame");
        assert_eq!(error, Error::Magic { found: *b"GET " });
        assert_eq!(sender.send(frame(Kind::Cycle, 1, Vec::new())), Err(error.clone()));
        assert_eq!(sender.finish().await, Err(error));
        let mut rest = Vec::new();
        drop(receiver);
        assert_eq!(far.read_to_end(&mut rest).await.expect("closed"), 0);
    }
}

#[tokio::test]
async fn the_limit_before_the_handshake_holds() {
    let ((_sender, mut receiver), mut far) = pair(4096);
    receiver.set_limit(4096);
    let header = Header { length: 64 << 20, ..Header::new(Kind::Cycle) };
    far.write_all(&encode_header(&header)).await.expect("room");
    let refused = Error::TooLong { what: "cycle", length: 64 << 20, limit: 4096 };
    assert_eq!(receiver.receive().await, Err(refused));
}

#[tokio::test]
async fn receiving_may_be_cancelled_at_any_byte() {
    let mut whole = frame(Kind::Control, 3, b"abc".to_vec());
    whole.seal().expect("three bytes");
    let mut bytes = encode_header(&whole.header).to_vec();
    bytes.extend_from_slice(b"abc");
    for way in ways(4096) {
        let ((_sender, mut receiver), mut far) = pair_over(way).await;
        for byte in &bytes[..bytes.len() - 1] {
            far.write_all(&[*byte]).await.expect("room");
            tokio::select! {
                biased;
                got = receiver.receive() => panic!("{got:?} before the last byte"),
                () = tokio::task::yield_now() => {}
            }
        }
        far.write_all(b"c").await.expect("room");
        assert_eq!(receiver.receive().await.as_ref(), Ok(&whole), "over {way:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn idle_links_send_heartbeats_and_live() {
    let (a, b) = duplex(4096);
    let (a, _a_receiver) = split(a, Settings::default());
    let (b, mut receiver) = split(b, Settings::default());
    let start = Instant::now();
    let quiet = timeout(Duration::from_millis(60_500), receiver.receive()).await;
    assert!(quiet.is_err(), "heartbeats are swallowed, and keep the link: {quiet:?}");
    assert_eq!(b.counters().frames_received, 60);
    assert_eq!(receiver.last_seen() - start, Duration::from_secs(60));
    a.set_heartbeat(Duration::from_millis(100));
    let quiet = timeout(Duration::from_secs(1), receiver.receive()).await;
    assert!(quiet.is_err());
    assert_eq!(b.counters().frames_received, 60 + 10);
}

#[tokio::test(start_paused = true)]
async fn a_silent_peer_is_found_and_any_byte_counts_as_life() {
    let ((sender, mut receiver), mut far) = pair(4096);
    receiver.set_silence(Duration::from_secs(4));
    let start = Instant::now();
    // Half a header, a byte every three seconds, keeps the link for a while.
    let bytes = encode_header(&Header::new(Kind::Bye));
    let drip = async {
        for byte in &bytes[..5] {
            tokio::time::sleep(Duration::from_secs(3)).await;
            far.write_all(&[*byte]).await.expect("room");
        }
    };
    let (error, ()) = tokio::join!(receiver.receive(), drip);
    assert_eq!(error, Err(Error::Silent { after_ms: 4000, limit_ms: 4000 }));
    assert_eq!(start.elapsed(), Duration::from_secs(19));
    assert!(matches!(sender.send(frame(Kind::Bye, 0, Vec::new())), Err(Error::Silent { .. })));
}

#[tokio::test(start_paused = true)]
async fn bytes_that_came_while_this_process_was_stopped_are_life() {
    let ((_sender, mut receiver), mut far) = pair(4096);
    far.write_all(&encode_header(&Header::new(Kind::Bye))[..]).await.expect("room");
    advance(Duration::from_secs(100)).await;
    // The header says an empty payload, whose checksum is zero, so this is a whole frame.
    assert_eq!(receiver.receive().await.map(|frame| frame.header.kind), Ok(Kind::Bye));
}

#[tokio::test]
async fn queues_toward_a_peer_that_does_not_read_are_bounded() {
    let (near, _far) = duplex(16);
    let settings = Settings {
        queued_frames: 3,
        queued_bytes: 100,
        bulk_messages: 2,
        bulk_bytes: 1000,
        later_messages: 1,
        ..Settings::default()
    };
    let (sender, _receiver) = split(near, settings);
    let full = |queue, length, limit| Err(Error::QueueFull { queue, length, limit });
    // The writer does not run between these calls, so nothing leaves the queues.
    let send = |bytes| sender.send(frame(Kind::Cycle, 0, vec![0; bytes]));
    assert_eq!(send(60), Ok(()));
    assert_eq!(send(41), full("bytes of the frame queue", 101, 100));
    assert_eq!((send(20), send(20)), (Ok(()), Ok(())));
    assert_eq!(send(0), full("frame queue", 4, 3));
    let bulk = |bytes| sender.send_bulk(Header::new(Kind::Bulk), 1, vec![0; bytes]);
    assert_eq!(bulk(600), Ok(()));
    assert_eq!(bulk(401), full("bytes of the bulk queue", 1001, 1000));
    assert_eq!(bulk(400), Ok(()));
    assert_eq!(bulk(0), full("bulk queue", 3, 2));
    assert_eq!(sender.queued(), (3, 1000));
    let later = || sender.send_bulk_later(Header::new(Kind::Bulk), 1, Box::new(|| Ok(Vec::new())));
    assert_eq!(later(), Ok(()));
    assert_eq!(later(), full("queue of messages to be made", 2, 1));
    let over = sender.send(frame(Kind::Heartbeat, 0, vec![0]));
    assert_eq!(over, Err(Error::TooLong { what: "heartbeat", length: 1, limit: 0 }));
    let bulk = sender.send(frame(Kind::Bulk, 0, Vec::new()));
    assert!(matches!(bulk, Err(Error::Unexpected { found: Kind::Bulk, .. })));
}

#[tokio::test]
async fn what_is_queued_is_written_when_the_last_sender_is_dropped() {
    for way in ways(100_000) {
        let ((sender, _receiver), mut far) = pair_over(way).await;
        let clone = sender.clone();
        drop(sender);
        clone.send(frame(Kind::Control, 1, vec![1; 10])).expect("one sender is left");
        clone.send_bulk(Header::new(Kind::Bulk), 1, vec![1; 20]).expect("one sender is left");
        drop(clone);
        let mut bytes = Vec::new();
        far.read_to_end(&mut bytes).await.expect("the pipe");
        assert_eq!(bytes.len(), HEADER_LEN + 10 + HEADER_LEN + 16 + 20, "over {way:?}");
    }
}

#[tokio::test]
async fn finishing_refuses_later_frames_and_aborting_ends_both_ways() {
    for way in ways(100_000) {
        let ((sender, mut receiver), _far) = pair_over(way).await;
        assert_eq!(sender.finish().await, Ok(()));
        assert_eq!(sender.send(frame(Kind::Bye, 1, Vec::new())), Err(Error::Closed));
        let reason = Error::Message("job 4 is over".into());
        sender.abort(reason.clone());
        assert_eq!(receiver.receive().await, Err(reason));
    }
}

fn hello(role: Role) -> Hello {
    Hello::new(role, "pc-1", 1.0, 2, "scalar", 7)
}

fn workers_only() -> Policy {
    Policy { roles: vec![Role::Worker], ..Policy::default() }
}

#[tokio::test(start_paused = true)]
async fn greetings_pass_over_a_link_and_set_its_intervals() {
    let (a, b) = duplex(100);
    let ((a, mut a_receiver), (b, mut b_receiver)) =
        (split(a, Settings::default()), split(b, Settings::default()));
    let welcome = Welcome::new(1, 0, 50);
    let answer = async {
        let (server, heard) = hear(&b, &mut b_receiver, workers_only()).await?;
        admit(server, &b, &mut b_receiver, welcome).map(|()| heard)
    };
    let hello = hello(Role::Worker);
    let (greeted, heard) = tokio::join!(greet(&a, &mut a_receiver, &hello), answer);
    assert_eq!((greeted, heard), (Ok(welcome), Ok(hello)));
    // A large frame passes now, and a peer that ends is missed after ten intervals.
    a.send(frame(Kind::Cycle, 1, vec![0; 100_000])).expect("queued");
    assert_eq!(b_receiver.receive().await.map(|frame| frame.payload.len()), Ok(100_000));
    let start = Instant::now();
    a.set_heartbeat(Duration::from_secs(3600));
    let silent = Error::Silent { after_ms: 500, limit_ms: 500 };
    assert_eq!(b_receiver.receive().await, Err(silent));
    assert_eq!(start.elapsed(), Duration::from_millis(500));
}

#[tokio::test(start_paused = true)]
async fn refusals_reach_the_caller_and_silence_is_not_waited_for() {
    let (a, b) = duplex(100);
    let ((a, mut a_receiver), (b, mut b_receiver)) =
        (split(a, Settings::default()), split(b, Settings::default()));
    let reason = "role client, this side takes worker".to_owned();
    let hello = hello(Role::Client);
    let (greeted, heard) =
        tokio::join!(greet(&a, &mut a_receiver, &hello), hear(&b, &mut b_receiver, workers_only()));
    assert_eq!(greeted, Err(Error::Refused { reason: reason.clone() }));
    assert_eq!(heard.map(|(_, hello)| hello), Err(Error::Message(reason)));

    // A caller that only keeps the connection alive is not waited for.
    let ((sender, mut receiver), far) = pair(4096);
    let (_far_sender, _far_receiver) = split(far, Settings::default());
    let start = Instant::now();
    let heard = hear(&sender, &mut receiver, workers_only()).await;
    assert!(matches!(heard, Err(Error::Silent { limit_ms: 10_000, .. })));
    assert_eq!(start.elapsed(), GREETING_LIMIT);
}

#[tokio::test]
async fn callers_with_another_frame_version_see_ours() {
    let ((sender, mut receiver), mut far) = pair(4096);
    let mut bytes = encode_header(&Header::new(Kind::Hello));
    bytes[4] = 3;
    far.write_all(&bytes).await.expect("room");
    let heard = hear(&sender, &mut receiver, workers_only()).await.map(|(_, hello)| hello);
    assert_eq!(heard, Err(Error::FrameVersion { theirs: 3, ours: 1 }));
    let mut answer = Vec::new();
    far.read_to_end(&mut answer).await.expect("an answer and the end");
    assert_eq!(answer[..7], *b"BLDE\x01\0\x03", "magic, version 1, refuse");
}
