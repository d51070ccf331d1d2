//! Peers that are refused or taken back: certificates, tokens, arithmetic, and callers that say nothing or garbage.

use std::{
    io::{Error, ErrorKind, Read, Write},
    net::TcpStream,
    path::Path,
    process::Command,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use protocol::{
    codec,
    frame::{Header, Kind},
    handshake::{Hello, Role},
};

use super::{
    Case, LOST, Running, Scene, Seen,
    links::{frame, knock},
    masters::clock_library,
    since,
    workers::close,
};
use crate::cluster::{Cluster, Said, make_certificates, said};

/// A day (s).
const DAY: i64 = 24 * 3600;

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, tries, run| Case { name, tries, run };
    vec![
        case("certificate of another CA", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                let other = cluster.folder().join("other");
                make_certificates(&scene.bolide, &other);
                call(scene, cluster, &other.join("worker"), "odd")
            })
        }),
        case("no certificate, no TLS", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                let mut command = Command::new(&scene.bolide);
                said(command.args([
                    "worker",
                    "--name",
                    "odd",
                    "--master",
                    &cluster.address,
                    "--patience",
                    "1",
                ]))
            })
        }),
        case("a client's certificate, shown by a worker", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                call(scene, cluster, &cluster.folder().join("certs/client"), "odd")
            })
        }),
        case("certificate of one PC, the name of another", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                call(scene, cluster, &cluster.folder().join("certs/worker"), "b2")
            })
        }),
        case("newcomer that wants to be called master, or as a PC that is there", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                let token = token(scene, &cluster.folder().join("certs"), None);
                let reserved = join(scene, cluster, &token, "master");
                assert_eq!(reserved.code, Some(1), "{reserved:?}");
                assert!(reserved.err.contains("\"master\" must be"), "{reserved:?}");
                join(scene, cluster, &token, "a")
            })
        }),
        case("expired certificate", 1, |scene, k| {
            let Some(clock) = clock_library() else { return no_compiler() };
            let running =
                begin(scene, |folder| host(scene, folder, "old", Some((clock.path(), -1000 * DAY))));
            running.wait_for_cycle(scene.instant(800 + k));
            let at = Instant::now();
            let said = call(scene, &running.cluster, &running.cluster.folder().join("certs/old"), "odd");
            turned_away(scene, &running, &said, since(at))
        }),
        case("certificate that expires in mid-run", 1, |scene, k| {
            let Some(clock) = clock_library() else { return no_compiler() };
            // 825 days less eight seconds ago; the workers join at once.
            let ago = master::certs::HOST_DAYS as i64 * DAY - 8;
            let running = begin(scene, |folder| host(scene, folder, "b", Some((clock.path(), -ago))));
            cut_off(scene, running, k, EXPIRED, |_, running| {
                // However fast the run is, it is not over by then.
                running.cluster.process("a").signal("STOP");
                running.cluster.master.wait_for("the certificate of worker \"b\" has expired");
                let at = Instant::now();
                running.cluster.process("a").signal("CONT");
                at
            })
        }),
        case("certificate revoked in mid-run", 1, |scene, k| {
            let running = begin(scene, |folder| host(scene, folder, "b", None));
            cut_off(scene, running, k, "was revoked", |scene, running| {
                let lab = running.cluster.folder().join("certs");
                let at = Instant::now();
                let revoked = said(Command::new(&scene.bolide).args(["certs", "revoke"]).arg(lab).arg("b"));
                assert_eq!(revoked.code, Some(0), "{revoked:?}");
                at
            })
        }),
        case("token used a second time", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                let token = token(scene, cluster.folder().join("certs").as_path(), None);
                let first = join(scene, cluster, &token, "pc-1");
                assert_eq!(first.code, Some(0), "{first:?}");
                join(scene, cluster, &token, "pc-2")
            })
        }),
        case("token out of date", 1, |scene, k| {
            let Some(clock) = clock_library() else { return no_compiler() };
            let running = begin(scene, |_| {});
            running.wait_for_cycle(scene.instant(820 + k));
            let at = Instant::now();
            let lab = running.cluster.folder().join("certs");
            let token = token(scene, &lab, Some((clock.path(), -2 * DAY)));
            let said = join(scene, &running.cluster, &token, "pc-1");
            turned_away(scene, &running, &said, since(at))
        }),
        case("token of another lab", 1, |scene, k| {
            refused(scene, k, |scene, cluster| {
                let other = cluster.folder().join("other");
                make_certificates(&scene.bolide, &other);
                join(scene, cluster, &token(scene, &other, None), "pc-1")
            })
        }),
        case("a worker whose arithmetic is another, at the door", 1, |scene, k| {
            let running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(830 + k));
            let mut hello = Hello::new(Role::Worker, "odd", 1.0, 1, "scalar", 3);
            hello.proof = Some("0123456789abcdef0123456789abcdef".to_owned());
            let at = Instant::now();
            let hello = codec::encode(&hello).expect("plain");
            knock(&running.cluster.address, &frame(Header::new(Kind::Hello), hello));
            let line = running.cluster.master.wait_for("worker odd: its arithmetic gives");
            let detected = since(at);
            unharmed(scene, &running, detected, last_words(&line))
        }),
        case("one unit in the last place, in a worker's elements", 1, |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            cluster.worker("a", "1");
            cluster.worker("b", "1");
            cluster.worker_that_fails("c", "ulp:100");
            let running = scene.submit(cluster);
            running.wait_for_cycle(100);
            let at = Instant::now();
            running.wait_for_count(LOST, 1);
            let (detected, cycle) = (since(at), running.cycle());
            let line = running.cluster.master.wait_for("is dropped: ");
            assert!(line.contains("worker c ") && line.contains("computed again to"), "{line}");
            let mut seen = close(scene, &running, cycle, at, detected);
            seen.note = line.split("is dropped: ").nth(1).unwrap_or_default().to_owned();
            seen
        }),
        case("a bit flipped in a worker's memory, --verify 1", 1, |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            cluster.worker("a", "1");
            cluster.worker("b", "1");
            // Between two plan boundaries: where an interval ends, a worker lets go of what it held, and of the bit with it.
            cluster.worker_that_fails("c", "flip:107");
            let running = scene.submit_asking(cluster, &["--verify", "1"]);
            running.wait_for_cycle(1);
            let summary = scene.end(&running);
            // By a second computation, or by a sample where it is of an element that is sampled.
            let said = |list: &str, key: Option<&str>| -> Vec<String> {
                let items = summary[list].as_array().cloned().unwrap_or_default();
                let text = |item: serde_json::Value| key.map_or(item.clone(), |key| item[key].clone());
                items.into_iter().map(text).filter_map(|text| text.as_str().map(str::to_owned)).collect()
            };
            let told = [said("warnings", None), said("losses", Some("why"))].concat();
            let is_of_it =
                |note: &&String| note.contains("was wrong and is not") || note.contains("computed again to");
            let note = told.iter().find(is_of_it).unwrap_or_else(|| panic!("it is not found: {summary}"));
            Seen { cycles_lost: Some(0), note: note.clone(), ..Seen::default() }
        }),
        case("200 connections that say nothing or garbage", 1, |scene, _| {
            let running = begin(scene, |_| {});
            running.wait_for_cycle(1);
            let undisturbed = scene.end(&running);
            let cluster = &running.cluster;
            // Paired, since the machine may have other work: the same job with strangers at the door and without.
            let mut used = [0.0; 2];
            for number in 0..6 {
                let strangers = (number % 2 == 0).then(|| Strangers::begin(&cluster.address));
                let before = cluster.processor_seconds();
                let (deck, cycles) = (scene.deck.display().to_string(), scene.cycles.to_string());
                let job = ["submit", "--wait", "--cycles", &cycles, "--min-workers", "3", &deck];
                let ended = cluster.client(&job);
                assert_eq!(ended.code, Some(0), "{ended:?}");
                used[number % 2] += cluster.processor_seconds() - before;
                drop(strangers);
                let summary = cluster.json(&["watch", &(number + 2).to_string()]);
                assert_eq!(summary["losses"], serde_json::json!([]));
                assert_eq!(summary["digest"], undisturbed["digest"]);
            }
            let more = 100.0 * (used[0] / used[1] - 1.0);
            let note = format!(
                "{more:+.1} % processor time of master and workers (three jobs each), the master's memory at most {} MB",
                peak_memory(cluster.master.id()) / 1000
            );
            Seen { cycles_lost: Some(0), note, ..Seen::default() }
        }),
    ]
}

fn no_compiler() -> Seen {
    Seen { note: "skipped: no C compiler to make the clock with".into(), ..Seen::default() }
}

/// A caller who holds its tongue, writes garbage, or begins a TLS record and no more.
///
/// # Panics
/// If the master does not listen.
pub fn stranger(address: &str, number: u8) -> TcpStream {
    let mut stream = TcpStream::connect(address).expect("the master listens");
    // The master may have hung up on garbage already.
    let _ = match number % 4 {
        0 | 1 => Ok(()),
        2 => stream.write_all(&[number; 4096]),
        _ => stream.write_all(&[22, 3, 1, 0x40, 0, 1, 0, 0x3f, 0xfc, 3, 3, number]),
    };
    stream
}

/// 200 callers of whom the master knows nothing, for as long as this value lives: who is hung up on calls again.
struct Strangers {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Strangers {
    fn begin(address: &str) -> Self {
        let ends = Arc::new(AtomicBool::new(false));
        let (address, told) = (address.to_owned(), Arc::clone(&ends));
        let thread = std::thread::spawn(move || {
            let mut callers: Vec<TcpStream> = (0..200).map(|i| stranger(&address, i)).collect();
            while !told.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(500));
                for (number, caller) in callers.iter_mut().enumerate() {
                    // What the master has to say is nothing, an alert of TLS, or the end.
                    let silent = |error: &Error| error.kind() == ErrorKind::WouldBlock;
                    let said = caller.set_nonblocking(true).and_then(|()| caller.read(&mut [0; 4096]));
                    if said.as_ref().is_ok_and(|bytes| *bytes == 0)
                        || said.as_ref().is_err_and(|error| !silent(error))
                    {
                        *caller = stranger(&address, number as u8);
                    }
                }
            }
        });
        Self { ends, thread: Some(thread) }
    }
}

impl Drop for Strangers {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        // It panics if the master is gone, which the case finds by itself.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Largest memory that a process has had (kB).
fn peak_memory(id: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kb| kb.parse().ok()).unwrap_or_default()
}

/// A cluster with certificates and a lab that takes newcomers, its job under way on a, b and c; `more` makes certificates
/// in the CA's folder. Each worker shows its own.
fn begin(scene: &Scene, more: impl Fn(&Path)) -> Running {
    let folder = tempfile::tempdir().expect("a folder");
    let certs = folder.path().join("certs");
    make_certificates(&scene.bolide, &certs);
    more(&certs);
    let lab = certs.display().to_string();
    let mut cluster = Cluster::start_in(&scene.bolide, folder, true, &["--lab", &lab], None, &[]);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    cluster.worker("c", "1");
    scene.submit(cluster)
}

/// A command of the binary whose wall clock is shifted.
fn at_another_time(scene: &Scene, clock: Option<(&Path, i64)>) -> Command {
    let mut command = Command::new(&scene.bolide);
    if let Some((library, shift)) = clock {
        command.env("LD_PRELOAD", library.join("clock.so")).env("BOLIDE_CLOCK_SHIFT", shift.to_string());
    }
    command
}

/// Makes a worker's certificate.
fn host(scene: &Scene, lab: &Path, name: &str, clock: Option<(&Path, i64)>) {
    let mut command = at_another_time(scene, clock);
    command.args(["certs", "host"]).arg(lab).args([name, "--role", "worker", "--address", "127.0.0.1"]);
    let made = said(&mut command);
    assert_eq!(made.code, Some(0), "{made:?}");
}

/// Issues a token.
fn token(scene: &Scene, lab: &Path, clock: Option<(&Path, i64)>) -> String {
    let issued = said(at_another_time(scene, clock).args(["certs", "token"]).arg(lab));
    assert_eq!(issued.code, Some(0), "{issued:?}");
    issued.out.split_whitespace().last().expect("the line to paste").to_owned()
}

/// Exchanges a token.
fn join(scene: &Scene, cluster: &Cluster, token: &str, pc: &str) -> Said {
    let folder = cluster.folder().join(pc);
    let mut command = Command::new(&scene.bolide);
    said(command.args(["certs", "join", &cluster.address, token]).arg(folder).args(["--name", pc]))
}

/// Starts a worker with these certificates, which ends if it is refused.
fn call(scene: &Scene, cluster: &Cluster, certs: &Path, name: &str) -> Said {
    let mut command = Command::new(&scene.bolide);
    said(command.args(["worker", "--name", name, "--master", &cluster.address, "--certs"]).arg(certs))
}

/// Somebody calls while the job runs, is refused in words, and the job has no loss.
fn refused(scene: &Scene, k: u64, caller: fn(&Scene, &Cluster) -> Said) -> Seen {
    let running = begin(scene, |_| {});
    running.wait_for_cycle(scene.instant(810 + k));
    let at = Instant::now();
    let said = caller(scene, &running.cluster);
    turned_away(scene, &running, &said, since(at))
}

fn turned_away(scene: &Scene, running: &Running, said: &Said, detected: Option<f64>) -> Seen {
    assert_eq!(said.code, Some(1), "{said:?}");
    let line = said.err.lines().last().expect("the reason");
    unharmed(scene, running, detected, last_words(line))
}

fn unharmed(scene: &Scene, running: &Running, detected: Option<f64>, note: String) -> Seen {
    let summary = scene.end(running);
    assert_eq!(summary["losses"], serde_json::json!([]));
    Seen { detected, cycles_lost: Some(0), time_lost: None, note }
}

/// What a line of the log or of an error says, without its time.
fn last_words(line: &str) -> String {
    let words = line.trim_start_matches("bolide: ");
    words.split(" WARN ").last().unwrap_or(words).replace('|', "/")
}

/// What is said of a certificate that has expired.
const EXPIRED: &str = "has expired";

/// Worker b's certificate comes to its end in mid-run, at the instant that `end` gives: its links end with the reason, and
/// it is refused from then on.
fn cut_off(
    scene: &Scene,
    mut running: Running,
    k: u64,
    words: &str,
    end: fn(&Scene, &Running) -> Instant,
) -> Seen {
    running.wait_for_cycle(scene.instant(850 + k).min(scene.cycles / 4));
    let cycle = running.cycle();
    let at = end(scene, &running);
    running.wait_for_count(LOST, 1);
    let detected = since(at);
    let b = running.cluster.process_mut("b");
    b.wait_for(words);
    // A date may be wrong because a clock is.
    let tries_again = words == EXPIRED;
    if !tries_again {
        assert_eq!(b.wait().code(), Some(1), "it is refused when it calls again");
    }
    let mut seen = close(scene, &running, cycle, at, detected);
    let b = running.cluster.process_mut("b");
    assert_eq!(b.is_alive(), tries_again, "whether it calls on; it said: {}", b.text().replace('\n', " / "));
    let summary = running.cluster.json(&["watch", "1"]);
    let why = summary["losses"][0]["why"].as_str().unwrap_or_default();
    assert!(why.contains(words), "{why}");
    seen.note = why.split(": ").skip(1).collect::<Vec<_>>().join(": ");
    seen
}
