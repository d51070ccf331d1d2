//! Links that break, fall silent, are slow or carry what nobody sent.

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpStream},
    time::{Duration, Instant},
};

use protocol::{
    codec,
    frame::{Frame, Header, Kind, encode_header},
    handshake::{Hello, Role, VERSION},
};

use super::{Case, LOST, Running, Scene, Seen, since, workers::close};
use crate::{cluster::said, proxy::Proxy};

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, tries, run| Case { name, tries, run };
    vec![
        case("link worker-master cut, the worker dials again", 1, |scene, k| {
            let (running, proxy) = through(scene);
            running.wait_for_cycle(scene.instant(500 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            proxy.cut();
            running.wait_for_count(LOST, 1);
            let detected = since(at);
            proxy.forward(&running.cluster.address);
            running.wait_for_count("worker b joined", 2);
            close(scene, &running, cycle, at, detected)
        }),
        case("partition worker-master for 5 s, healed", 1, |scene, k| {
            let (running, proxy) = through(scene);
            running.wait_for_cycle(scene.instant(510 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            proxy.freeze();
            running.wait_for_count("worker b is suspect", 1);
            let detected = since(at);
            std::thread::sleep(Duration::from_secs(5).saturating_sub(at.elapsed()));
            proxy.thaw(&running.cluster.address);
            let mut seen = close(scene, &running, cycle, at, detected);
            seen.note = "suspect, heard again".to_owned();
            seen
        }),
        case("partition worker-master, healed after the worker was given up", 1, |scene, k| {
            let (running, proxy) = through(scene);
            running.wait_for_cycle(scene.instant(520 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            proxy.freeze();
            running.wait_for_count(LOST, 1);
            let detected = since(at);
            proxy.thaw(&running.cluster.address);
            running.wait_for_cycle(cycle + 1);
            close(scene, &running, cycle, at, detected)
        }),
        case("half-open link: the worker's machine is gone without a word", 1, |scene, k| {
            let (mut running, proxy) = through(scene);
            running.wait_for_cycle(scene.instant(530 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            proxy.freeze();
            running.cluster.kill_worker("b");
            running.wait_for_count(LOST, 1);
            close(scene, &running, cycle, at, since(at))
        }),
        case("link worker-worker cut", 1, |scene, k| {
            let (running, proxy) = beside(scene);
            running.wait_for_cycle(scene.instant(540 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            proxy.cut();
            let mut seen = close(scene, &running, cycle, at, None);
            seen.note = "relayed by the master".to_owned();
            seen
        }),
        case("partition worker-worker", 1, |scene, k| {
            let (running, proxy) = beside(scene);
            running.wait_for_cycle(scene.instant(550 + k));
            let (cycle, at) = (running.cycle(), Instant::now());
            proxy.freeze();
            let mut seen = close(scene, &running, cycle, at, None);
            seen.note = "relayed by the master after 5 s of silence".to_owned();
            seen
        }),
        case("slow link: 2 ms more for every message of a worker", 1, |scene, k| {
            let (running, proxy) = through(scene);
            running.wait_for_cycle(scene.instant(560 + k));
            proxy.delay(Duration::from_millis(2));
            let summary = scene.end(&running);
            assert_eq!(summary["losses"], serde_json::json!([]));
            Seen { cycles_lost: Some(0), note: "slower, nothing else".into(), ..Seen::default() }
        }),
        case("garbage bytes in mid-stream", 1, |scene, k| {
            damaged(scene, 570 + k, Proxy::litter, "frame starts with [5a, 5a, 5a, 5a]")
        }),
        case("a bit flipped on a link", 3, |scene, k| damaged(scene, 580 + k, Proxy::flip, "b at ")),
        case("oversize length, wrong version, garbage, at the door", 1, |scene, k| {
            let running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(590 + k));
            let hello =
                Hello { version: VERSION + 1, ..Hello::new(Role::Worker, "old", 1.0, 1, "scalar", 1) };
            let oversize = Header { length: u32::MAX, ..Header::new(Kind::Hello) };
            for bytes in [
                frame(Header::new(Kind::Hello), codec::encode(&hello).expect("plain")),
                encode_header(&oversize).to_vec(),
                vec![0x55; 400],
            ] {
                knock(&running.cluster.address, &bytes);
            }
            let version = format!("protocol version {}", VERSION + 1);
            for words in [&version, "length 4294967295", "frame starts with [55, 55, 55, 55]"] {
                running.cluster.master.wait_for(words);
            }
            let summary = scene.end(&running);
            assert_eq!(summary["losses"], serde_json::json!([]));
            Seen { cycles_lost: Some(0), note: "each refused in a line".into(), ..Seen::default() }
        }),
        case("a second worker of the same name", 1, |scene, k| {
            let running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(600 + k));
            let second =
                said(&mut running.cluster.command("worker", &["worker", "--name", "b", "--threads", "1"]));
            assert!(second.err.contains("a worker named \"b\" is connected"), "{second:?}");
            let summary = scene.end(&running);
            assert_eq!(summary["losses"], serde_json::json!([]));
            Seen { cycles_lost: Some(0), note: "refused by name".into(), ..Seen::default() }
        }),
    ]
}

/// A cluster whose worker b reaches its master through a proxy.
fn through(scene: &Scene) -> (Running, Proxy) {
    let mut cluster = scene.cluster(&[], None, &[]);
    let proxy = Proxy::start();
    proxy.forward(&cluster.address);
    cluster.worker("a", "1");
    cluster.worker_through("b", &format!("127.0.0.1:{}", proxy.port), "");
    cluster.worker("c", "1");
    (scene.submit(cluster), proxy)
}

/// A cluster whose worker a is reached by the others through a proxy.
fn beside(scene: &Scene) -> (Running, Proxy) {
    let mut cluster = scene.cluster(&[], None, &[]);
    let proxy = Proxy::start();
    cluster.worker_with("a", "1", &["--peer-announce", &proxy.port.to_string()]);
    proxy.forward(&cluster.peer_address("a"));
    cluster.worker("b", "1");
    cluster.worker("c", "1");
    (scene.submit(cluster), proxy)
}

/// What passes the proxy is damaged once: the link ends, its worker is lost and dials again.
fn damaged(scene: &Scene, k: u64, happen: fn(&Proxy), words: &str) -> Seen {
    let (running, proxy) = through(scene);
    running.wait_for_cycle(scene.instant(k));
    let (cycle, at) = (running.cycle(), Instant::now());
    happen(&proxy);
    running.wait_for_count(LOST, 1);
    let detected = since(at);
    let seen = close(scene, &running, cycle, at, detected);
    let summary = running.cluster.json(&["watch", "1"]);
    let why = summary["losses"][0]["why"].as_str().unwrap_or_default().to_owned();
    assert!(why.contains(words), "{why}");
    let note = why.split(": ").skip(1).collect::<Vec<_>>().join(": ");
    Seen { note, ..seen }
}

pub(super) fn frame(header: Header, payload: Vec<u8>) -> Vec<u8> {
    let mut frame = Frame::new(header, payload);
    frame.seal().expect("within its limit");
    let mut bytes = encode_header(&frame.header).to_vec();
    bytes.extend(frame.payload);
    bytes
}

/// Sends bytes and waits until the master has hung up.
pub(super) fn knock(master: &str, bytes: &[u8]) {
    let mut stream = TcpStream::connect(master).expect("the master listens");
    // A master that has closed already refuses the rest, or resets.
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(Shutdown::Write);
    let _ = stream.read_to_end(&mut Vec::new());
}
