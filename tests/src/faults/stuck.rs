//! What does not die: workers that live and do not compute, jobs that kill their masters or workers, hosts that are short of something.

use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use super::{Case, GOES_ON, Running, Scene, Seen, cycles_lost, since};
use crate::cluster::{Cluster, DEADLINE, Process, said, until};

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, run| Case { name, tries: 1, run };
    vec![
        case("worker whose computing is stuck, its link alive", |scene, _| {
            given_up(scene, &["a", "b"], "stick:120")
        }),
        case("the same of seven, of whose votes the master hears the sum", |scene, _| {
            given_up(scene, &["a", "b", "d", "e", "f", "g"], "stick:120")
        }),
        case("worker that only sends signs of life from the start", |scene, _| {
            given_up(scene, &["a", "b"], "stick-in-load:1")
        }),
        case("job cancelled while its only worker is stuck", |scene, _| {
            let running = stuck_alone(scene);
            let at = Instant::now();
            assert_eq!(running.cluster.client(&["cancel", "1"]).code, Some(0));
            wait_for_state(&running.cluster, 1, "cancelled");
            Seen { detected: since(at), note: "ends with what it had".into(), ..Seen::default() }
        }),
        case("master told to leave (SIGTERM) while a worker is stuck", |scene, _| {
            let mut running = stuck_alone(scene);
            let (cycle, at) = (running.cycle(), Instant::now());
            running.cluster.master.signal("TERM");
            assert_eq!(running.cluster.master.wait().code(), Some(0));
            let detected = since(at);
            running.cluster.restart_master();
            running.cluster.worker("d", "1");
            running.cluster.master.wait_for(GOES_ON);
            running.wait_for_cycle(cycle + 1);
            let time_lost = since(at);
            scene.end(&running);
            let note = "detected: until the master had ended; stored, and gone on with by the next one";
            Seen { detected, time_lost, note: note.into(), ..Seen::default() }
        }),
        case("job of which three masters die; another behind it", |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            cluster.worker("a", "1");
            let deck = scene.deck.display().to_string();
            for _ in 0..2 {
                // No snapshot comes of it.
                let job = cluster.json(&["submit", &deck, "--cycles", "60", "--snapshot-every", "100"]);
                assert!(job["job"].as_u64().is_some(), "{job}");
            }
            for _ in 0..3 {
                cluster.master.wait_for("work is dealt out");
                cluster.master.kill();
                cluster.restart_master();
            }
            wait_for_state(&cluster, 1, "held");
            let why = cluster.master.wait_for("held: 3 masters ended while they ran it");
            wait_for_state(&cluster, 2, "done");
            assert_eq!(cluster.client(&["resume", "1"]).code, Some(0), "{why}");
            wait_for_state(&cluster, 1, "done");
            Seen {
                note: "held with the reason, the next one done; resumed by the user".into(),
                ..Seen::default()
            }
        }),
        case("job of which every worker dies; another behind it", |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            let deck = scene.deck.display().to_string();
            for _ in 0..2 {
                cluster.json(&["submit", &deck, "--cycles", "60"]);
            }
            for (deaths, name) in ["a", "b", "c"].into_iter().enumerate() {
                cluster.worker_that_fails(name, "die-in-load:1");
                let died = || format!("death {}; {}", deaths + 1, cluster.master.text());
                until(died, || (cluster.master.count("WARN connection from") > deaths).then_some(()));
            }
            wait_for_state(&cluster, 1, "held");
            cluster.worker("d", "1");
            wait_for_state(&cluster, 2, "done");
            let note = "held with the reason; the next one done by another worker";
            Seen { note: note.into(), ..Seen::default() }
        }),
        case("job that wants two workers of which there is one; another behind it", |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            let deck = scene.deck.display().to_string();
            cluster.json(&["submit", &deck, "--cycles", "60", "--min-workers", "2"]);
            cluster.json(&["submit", &deck, "--cycles", "60"]);
            cluster.worker("a", "1");
            wait_for_state(&cluster, 2, "done");
            until(
                || format!("a reason: {}", cluster.job(1)),
                || (cluster.job(1)["waits_for"] == "2 workers, 1 are idle").then_some(()),
            );
            cluster.worker("b", "1");
            wait_for_state(&cluster, 1, "done");
            Seen { note: "the other one passes it; `jobs` says why it waits".into(), ..Seen::default() }
        }),
        case("cancel acknowledged, then the master killed", |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(900 + k));
            assert_eq!(running.cluster.client(&["cancel", "1"]).code, Some(0));
            running.cluster.master.kill();
            running.cluster.restart_master();
            wait_for_state(&running.cluster, 1, "cancelled");
            Seen { note: "cancelled after the restart as well".into(), ..Seen::default() }
        }),
        case("one bit of a deck in the spool, the master killed", |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(910 + k));
            running.cluster.master.kill();
            flip(&running, "toml");
            running.cluster.restart_master();
            let line = running.cluster.master.wait_for("job-1.toml: damaged");
            assert!(line.contains("its copy is used"), "{line}");
            scene.end(&running);
            Seen { note: "its copy is used, and said so".into(), ..Seen::default() }
        }),
        case("one bit of a deck in the spool and of its copy, the master killed", |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(915 + k));
            running.cluster.master.kill();
            flip(&running, "toml");
            flip(&running, "toml.copy");
            running.cluster.restart_master();
            wait_for_state(&running.cluster, 1, "failed");
            running.cluster.master.wait_for("job-1.toml: damaged");
            Seen {
                note: "fails with the name of the file; nothing wrong is computed".into(),
                ..Seen::default()
            }
        }),
        case("one bit of a state file, the master killed", |scene, k| {
            state_lost(scene, 930 + k, |path| {
                let mut bytes = fs::read(path).expect("it is there");
                let middle = bytes.len() / 2;
                bytes[middle] ^= 1;
                fs::write(path, bytes).expect("room");
            })
        }),
        case("state file removed, the master killed", |scene, k| {
            state_lost(scene, 940 + k, |path| {
                fs::remove_file(path).expect("it is there");
            })
        }),
        case("one bit of a record in the spool, the master killed", |scene, k| {
            let mut running = scene.begin(&[], None);
            running.wait_for_cycle(scene.instant(920 + k));
            running.cluster.master.kill();
            flip(&running, "json");
            running.cluster.restart_master();
            running.cluster.master.wait_for("its copy is used");
            scene.end(&running);
            Seen { note: "its copy is used, and said so".into(), ..Seen::default() }
        }),
        case("disk of the spool full with three jobs queued", |scene, _| {
            let cluster = scene.cluster(&[], None, &[]);
            let spool = cluster.folder().join("spool");
            let Some(disk) = super::disks::Disk::mount(&spool, "1m") else { return super::disks::skipped() };
            fs::create_dir_all(spool.join("queue")).expect("room");
            full(scene, cluster, disk)
        }),
        case("page besieged by 300 callers that say nothing", |scene, _| {
            let cluster = scene.cluster(&["--http", "127.0.0.1:0"], None, &[]);
            let line = cluster.master.wait_for("page: http://");
            let address =
                line.split("//").nth(1).and_then(|rest| rest.split('/').next()).expect("an address");
            let idle: Vec<TcpStream> =
                (0..300).map(|_| TcpStream::connect(address).expect("it is taken")).collect();
            let at = Instant::now();
            let mut asking = TcpStream::connect(address).expect("it is taken");
            let request = format!("GET /healthz HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
            asking.write_all(request.as_bytes()).expect("it is read");
            asking.set_read_timeout(Some(DEADLINE)).expect("a limit");
            let mut answer = String::new();
            asking.read_to_string(&mut answer).expect("an answer");
            assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
            drop(idle);
            assert!(at.elapsed() < Duration::from_secs(3), "{:?}", at.elapsed());
            Seen { detected: since(at), note: "detected: until /healthz said ok".into(), ..Seen::default() }
        }),
        case("spool with a limit of 100 kB for jobs that are over", |scene, _| {
            let mut cluster = scene.cluster(&["--keep-gb", "0.0001"], None, &[]);
            cluster.worker("a", "1");
            let deck = scene.deck.display().to_string();
            for job in 1..=3 {
                cluster.json(&["submit", &deck, "--cycles", "20"]);
                wait_for_state(&cluster, job, "done");
            }
            until(
                || format!("the oldest to go; {}", cluster.master.text()),
                || cluster.find_job(1).is_none().then_some(()),
            );
            assert!(!cluster.results(1).exists(), "its results as well");
            assert!(cluster.find_job(3).is_some(), "what has just ended stays");
            cluster.client(&["rm", "3"]);
            cluster.master.kill();
            cluster.restart_master();
            let next = cluster.json(&["submit", &deck, "--cycles", "20"]);
            assert_eq!(next["job"], 4, "the number of a job that was removed is not given again");
            Seen {
                note: "the oldest are removed, with their results; the last one stays".into(),
                ..Seen::default()
            }
        }),
        case("one bit of a result of a job that is over, the master started anew", |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            cluster.worker("a", "1");
            let deck = scene.deck.display().to_string();
            cluster.json(&["submit", &deck, "--cycles", "20"]);
            wait_for_state(&cluster, 1, "done");
            let path = cluster.results(1).join("history.csv");
            let mut bytes = fs::read(&path).expect("written");
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            fs::write(&path, bytes).expect("room");
            cluster.master.kill();
            cluster.restart_master();
            let line = cluster.master.wait_for("history.csv: damaged");
            assert!(line.contains("job=1"), "{line}");
            Seen { note: "a warning names the file".into(), ..Seen::default() }
        }),
        case("worker whose memory is too small for its share; another job behind it", |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            // 27,000 elements take 50 MB.
            cluster.worker_with("small", "1", &["--memory", "0.04"]);
            let deck = scene.deck.display().to_string();
            cluster.json(&["submit", &deck, "--cycles", "20"]);
            let small = cluster.folder().join("small.toml");
            let text = "title = \"cube\"\nunits = \"SI\"\n[control]\nend_cycle = 20\n[[part]]\nname = \"cube\"\nmaterial = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [1, 1, 1], cells = [3, 3, 3] }\n";
            fs::write(&small, text).expect("room");
            let small = small.display().to_string();
            cluster.json(&["submit", &small]);
            wait_for_state(&cluster, 2, "done");
            let waits = cluster.job(1)["waits_for"].as_str().unwrap_or_default().to_owned();
            assert!(waits.starts_with("memory: ") && waits.contains(" on worker small "), "{waits}");
            cluster.worker("b", "1");
            cluster.worker("c", "20");
            wait_for_state(&cluster, 1, "done");
            Seen { note: "it waits with both numbers; the other one passes it".into(), ..Seen::default() }
        }),
        case("another user of the PC asks a master on loopback", |scene, _| {
            let Some(seen) = another_user(&scene.bolide) else {
                return Seen { note: "skipped: only root may be another user".into(), ..Seen::default() };
            };
            seen
        }),
        case("another user of the PC looks into the spool", |scene, _| {
            let cluster = scene.cluster(&[], None, &[]);
            let deck = scene.deck.display().to_string();
            cluster.json(&["submit", &deck, "--cycles", "10"]);
            let queue = cluster.folder().join("spool/queue");
            for path in [queue.clone(), queue.join("job-1.json"), queue.join("job-1.toml")] {
                let mode = fs::metadata(&path).expect("it is there").permissions().mode() & 0o777;
                assert_eq!(mode & 0o077, 0, "{} is {mode:o}", path.display());
            }
            Seen { note: "0700 and 0600".into(), ..Seen::default() }
        }),
        case("snapshot of another deck given to --resume", |scene, _| {
            let folder = tempfile::tempdir().expect("a folder");
            let out = folder.path().join("out");
            let other = folder.path().join("other.toml");
            let text = fs::read_to_string(&scene.deck).expect("readable");
            let title = text.lines().find(|line| line.starts_with("title")).expect("a title");
            fs::write(&other, text.replace(title, "title = \"another\"")).expect("room");
            let run = |deck: &Path, flag: &str| {
                let mut command = Command::new(&scene.bolide);
                let cycles = scene.cycles.to_string();
                command.arg("run").arg(deck).args(["--cycles", &cycles, "--snapshot-cycles", "20", flag]);
                command.arg(&out);
                command
            };
            let mut begun = Process::start("run", &mut run(&scene.deck, "--out"));
            let second = out.join("snapshots/snapshot-000002.bolide");
            until(|| format!("two snapshots; {}", begun.text()), || second.is_file().then_some(()));
            begun.kill();
            let refused = said(&mut run(&other, "--resume"));
            assert_eq!(refused.code, Some(1), "{}", refused.err);
            assert!(refused.err.contains("the snapshot is of another problem"), "{}", refused.err);
            Seen { note: "refused".into(), ..Seen::default() }
        }),
    ]
}

/// The queue on a full disk, and when there is room again.
fn full(scene: &Scene, mut cluster: Cluster, disk: super::disks::Disk) -> Seen {
    let deck = scene.deck.display().to_string();
    for _ in 0..3 {
        let job = cluster.json(&["submit", &deck, "--cycles", "40"]);
        assert!(job["job"].as_u64().is_some(), "{job}");
    }
    cluster.worker("a", "1");
    let line = cluster.master.wait_for("the queue pauses for");
    assert!(line.contains("No space left"), "{line}");
    assert_eq!(cluster.job(2)["state"], "queued");
    let (grown, at) = (disk.grow("1g"), Instant::now());
    assert!(grown.status.success(), "{grown:?}");
    (1..=3).for_each(|job| wait_for_state(&cluster, job, "done"));
    let time_lost = since(at);
    drop(cluster);
    drop(disk);
    Seen { time_lost, note: "the queue pauses and goes on by itself; none failed".into(), ..Seen::default() }
}

/// One of three workers sticks; the job comes to its end without it.
fn given_up(scene: &Scene, others: &[&str], fault: &str) -> Seen {
    let mut cluster = scene.cluster(&[], None, &[]);
    others.iter().for_each(|name| cluster.worker(name, "1"));
    cluster.worker_that_fails("c", fault);
    let running = scene.submit(cluster);
    running.cluster.master.wait_for("worker c is suspect: the job waits for it");
    let at = Instant::now();
    running.cluster.master.wait_for("worker c is given up: the job waits for it");
    let detected = since(at);
    let summary = scene.end(&running);
    let why = summary["losses"][0]["why"].as_str().unwrap_or_default().to_owned();
    assert!(why.contains("its computing is stuck"), "{summary}");
    let note = "detected: from suspect, by name, to given up";
    Seen { detected, cycles_lost: Some(cycles_lost(&summary)), note: note.into(), ..Seen::default() }
}

/// A job whose only worker is stuck.
fn stuck_alone(scene: &Scene) -> Running {
    let mut cluster = scene.cluster(&[], None, &[]);
    cluster.worker_that_fails("c", "stick:120");
    let (deck, cycles) = (scene.deck.display().to_string(), scene.cycles.to_string());
    let submitted = cluster.json(&["submit", "--cycles", &cycles, "--snapshot-every", "0.2", &deck]);
    assert_eq!(submitted["job"], 1);
    let running = scene.watch(cluster);
    running.cluster.master.wait_for("its computing is stuck");
    running
}

/// Another user submits, cancels and joins, and is refused; none if this process may not be another user.
///
/// # Panics
/// If it is not refused, or is with `--share`.
pub fn another_user(bolide: &Path) -> Option<Seen> {
    const NOBODY: u32 = 65_534;
    if !rustix::process::geteuid().is_root() {
        return None;
    }
    // Where that user may read it.
    let folder =
        tempfile::Builder::new().permissions(fs::Permissions::from_mode(0o755)).tempdir().expect("room");
    let binary = folder.path().join("bolide");
    fs::copy(bolide, &binary).expect("room");
    let master = |flags: &[&str]| {
        let mut command = Command::new(&binary);
        command.args(["master", "--listen", "127.0.0.1:0", "--spool"]).arg(folder.path().join("spool"));
        // Not root, who may ask any master.
        let spool = folder.path().join("spool");
        let _ = fs::create_dir(&spool);
        std::os::unix::fs::chown(&spool, Some(NOBODY - 1), Some(NOBODY - 1)).expect("root may");
        let master = Process::start("master", command.args(flags).uid(NOBODY - 1).gid(NOBODY - 1));
        let line = master.wait_for("listening on ");
        (master, line.trim_start_matches("listening on ").to_owned())
    };
    let ask = |address: &str, user: u32, words: &[&str]| {
        let mut command = Command::new(&binary);
        said(command.args(words).args(["--master", address]).uid(user).gid(user).current_dir("/"))
    };
    let (mut first, address) = master(&[]);
    for words in [&["jobs"][..], &["cancel", "1"], &["worker", "--patience", "0"]] {
        let refused = ask(&address, NOBODY, words);
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.err.contains("a caller of user 65534, this master serves user 65533"), "{refused:?}");
    }
    for user in [NOBODY - 1, 0] {
        assert_eq!(ask(&address, user, &["jobs"]).code, Some(0), "user {user}");
    }
    first.kill();
    let (_second, address) = master(&["--share"]);
    assert_eq!(ask(&address, NOBODY, &["jobs"]).code, Some(0));
    Some(Seen {
        note: "refused as client and as worker; its own user and root are not".into(),
        ..Seen::default()
    })
}

/// The first state of a job is damaged while its master is away.
fn state_lost(scene: &Scene, number: u64, damage: fn(&Path)) -> Seen {
    let mut running = scene.begin(&[], None);
    running.wait_for_snapshots(2);
    running.wait_for_cycle(scene.instant(number));
    running.cluster.master.kill();
    damage(&running.cluster.results(1).join("state-000000.vtu"));
    running.cluster.restart_master();
    running.cluster.master.wait_for("it is computed again from before cycle");
    scene.end(&running);
    Seen { note: "named, and computed again".into(), ..Seen::default() }
}

fn wait_for_state(cluster: &Cluster, job: u64, state: &str) {
    until(
        || format!("job {job} to be {state}: {}; {}", cluster.job(job), cluster.master.text()),
        || cluster.find_job(job).filter(|job| job["state"] == state).map(|_| ()),
    );
}

/// Changes a letter in the middle of a file of job 1.
fn flip(running: &Running, ending: &str) {
    let path = running.cluster.folder().join(format!("spool/queue/job-1.{ending}"));
    let mut bytes = fs::read(&path).expect("it is there");
    let letters = bytes.iter().enumerate().filter(|(_, byte)| byte.is_ascii_digit()).map(|(at, _)| at);
    let digits: Vec<usize> = letters.collect();
    bytes[digits[digits.len() / 2]] ^= 1;
    fs::write(&path, bytes).expect("room");
}
