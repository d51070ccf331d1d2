//! `bolide add` over a real sshd, what daemons tell a service manager, and `bolide top` on a terminal.

use std::{
    fs,
    os::unix::net::UnixDatagram,
    process::Command,
    sync::mpsc::{Receiver, channel},
    time::Duration,
};

use tests::{
    cluster::{Cluster, DEADLINE, Process, said},
    sshd::{self, Sshd},
    terminal::Terminal,
};

use crate::{BOLIDE, digest_of, reference, small};

/// Ends processes that are no children of ours.
struct Strangers(Vec<u64>);

impl Drop for Strangers {
    fn drop(&mut self) {
        for process in &self.0 {
            // They end with their master too; whoever is gone already is fine.
            let _ = Command::new("kill").arg(process.to_string()).status();
        }
    }
}

#[test]
fn hosts_are_started_over_ssh_and_each_fault_comes_in_the_words_of_whoever_has_it() {
    let Some(program) = sshd::find() else {
        assert!(std::env::var_os("CI").is_none(), "CI has an sshd: .ci/run installs it");
        println!("skipped: no sshd on this machine (Debian: openssh-server)");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let sshd = Sshd::start(&program, folder.path());
    let cluster = Cluster::start(BOLIDE, true);
    let hosts = folder.path().join("hosts.toml");
    let text = format!(
        r#"
master = "{}"

[defaults]
address = "127.0.0.1"
port = {}
ssh = ["-F", "{}"]
path = "{BOLIDE}"
certs = "{}"
threads = 1
flags = ["--once"]

[[host]]
name = "a"
speed = 2

[[host]]
name = "b"
deferred = true
certs = "CERTS_OF_B"

[[host]]
name = "no-binary"
path = "bolide-that-is-not-there"

[[host]]
name = "no-sshd"
port = 1

[[host]]
name = "no-certificates"
certs = "/nowhere"
"#,
        cluster.address,
        sshd.port,
        sshd.config.display(),
        cluster.folder().join("certs/a").display(),
    );
    cluster.certify("a");
    cluster.certify("b");
    let text = text.replace("CERTS_OF_B", &cluster.folder().join("certs/b").display().to_string());
    fs::write(&hosts, text.replace("address = \"127.0.0.1\"\n", "")).expect("room");
    let add = |arguments: &[&str]| {
        let mut command = Command::new(BOLIDE);
        said(command.arg("add").arg("--hosts").arg(&hosts).args(arguments))
    };
    // Without an address the name is dialled, and "a" is no machine.
    let unknown = add(&["a"]);
    assert_eq!(unknown.code, Some(1), "{unknown:?}");
    assert!(unknown.out.contains("failed: ssh: Could not resolve hostname a"), "{unknown:?}");
    fs::write(&hosts, &text).expect("room");

    let dry = add(&["--dry-run"]);
    assert_eq!(dry.code, Some(0), "{dry:?}");
    assert_eq!(dry.out.matches("ssh -T -o BatchMode=yes").count(), 4, "b is deferred: {}", dry.out);
    assert!(
        dry.out.contains("worker --master") && dry.out.contains("--name a --speed 2 --threads 1"),
        "{dry:?}"
    );

    let said = add(&["--json"]);
    assert_eq!(said.code, Some(1), "{said:?}\n{}", sshd.text());
    assert!(said.err.contains("3 of 4 hosts failed"), "{said:?}");
    let answers: Vec<serde_json::Value> = serde_json::from_str(&said.out).expect("JSON");
    let mut strangers = Strangers(answers.iter().filter_map(|a| a["process"].as_u64()).collect());
    for (answer, (host, outcome, words)) in answers.iter().zip([
        ("a", "joined", ""),
        ("no-binary", "failed", "no program bolide-that-is-not-there on "),
        ("no-sshd", "failed", "Connection refused"),
        ("no-certificates", "failed", "/nowhere/ca.pem: I/O error: No such file or directory"),
    ]) {
        assert_eq!((&answer["host"], &answer["outcome"]), (&host.into(), &outcome.into()), "{answer}");
        assert!(answer["words"].as_str().is_some_and(|said| said.contains(words)), "{answer}");
    }

    // What --dry-run prints is what is done: a shell that is given it starts the deferred host.
    let dry = add(&["b", "--dry-run"]);
    let pasted = tests::cluster::said(Command::new("sh").args(["-c", &dry.out]));
    let process = pasted.out.trim().strip_prefix("joined ").and_then(|id| id.parse().ok());
    strangers.0.push(process.unwrap_or_else(|| panic!("{pasted:?}")));
    let again = add(&["a"]);
    assert_eq!(again.code, Some(1), "{again:?}");
    assert!(again.out.contains("a worker named \"a\" is connected from"), "{again:?}");

    let summary = cluster.json(&["submit", &small(), "--cycles", "40", "--min-workers", "2", "--wait"]);
    assert_eq!((digest_of(&summary), &summary["workers"]), (reference().to_owned(), &2.into()));
    let log = fs::read_to_string(folder.path().join(".bolide/worker-a.log")).expect("its log");
    assert!(log.contains(" joined "), "{log}");
}

/// A service manager's socket, read on a thread of its own.
fn manager(path: &std::path::Path) -> Receiver<String> {
    let socket = UnixDatagram::bind(path).expect("a socket");
    let (send, heard) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 1000];
        while let Ok(n) = socket.recv(&mut bytes) {
            if send.send(String::from_utf8_lossy(&bytes[..n]).into_owned()).is_err() {
                return;
            }
        }
    });
    heard
}

fn wait_for(heard: &Receiver<String>, words: &str) {
    let mut all = Vec::new();
    loop {
        let state = heard.recv_timeout(DEADLINE).unwrap_or_else(|e| panic!("{words}: {e}; only {all:?}"));
        if state.contains(words) {
            return;
        }
        all.push(state);
    }
}

#[test]
fn daemons_say_when_they_are_ready_give_signs_of_life_and_say_when_they_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let (of_master, of_worker) = (folder.path().join("master"), folder.path().join("worker"));
    let (master_says, worker_says) = (manager(&of_master), manager(&of_worker));
    let told = |command: &mut Command, socket: &std::path::Path| {
        command.env("NOTIFY_SOCKET", socket).env("WATCHDOG_USEC", "500000").env_remove("WATCHDOG_PID");
    };
    let mut command = Command::new(BOLIDE);
    command.args(["master", "--listen", "127.0.0.1:0", "--spool"]).arg(folder.path().join("spool"));
    told(&mut command, &of_master);
    let mut master = Process::start("master", &mut command);
    wait_for(&master_says, "READY=1\nSTATUS=listening on 127.0.0.1:");
    let line = master.wait_for("listening on ");
    let address = line.trim_start_matches("listening on ");

    let mut command = Command::new(BOLIDE);
    command.args(["worker", "--master", address, "--name", "a", "--threads", "1"]);
    told(&mut command, &of_worker);
    let mut worker = Process::start("worker", &mut command);
    wait_for(&worker_says, &format!("READY=1\nSTATUS=dialling {address}"));
    wait_for(&worker_says, &format!("STATUS=joined {address} as host 0"));
    for heard in [&master_says, &worker_says] {
        for _ in 0..3 {
            wait_for(heard, "WATCHDOG=1");
        }
    }
    for (process, heard) in [(&mut worker, &worker_says), (&mut master, &master_says)] {
        process.signal("TERM");
        wait_for(heard, "STOPPING=1");
        assert_eq!(process.wait().code(), Some(0), "{}", process.text());
    }

    // Signs of life are for the process that was asked.
    let mut command = Command::new(BOLIDE);
    command.args(["worker", "--master", address, "--patience", "1"]);
    told(&mut command, &of_worker);
    let mut other = Process::start("worker", command.env("WATCHDOG_PID", "1"));
    wait_for(&worker_says, "READY=1");
    assert_eq!(other.wait().code(), Some(1), "{}", other.text());
    while let Ok(state) = worker_says.recv_timeout(Duration::from_millis(10)) {
        assert!(!state.contains("WATCHDOG"), "{state}");
    }
}

#[test]
fn top_shows_hosts_and_jobs_on_a_terminal_and_q_leaves() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("pc-1", "1");
    cluster.worker("pc-2", "2");
    assert_eq!(cluster.json(&["submit", &small(), "--cycles", "40", "--wait"])["workers"], 2);
    let mut top = Terminal::start(&format!("{BOLIDE} top --master {}", cluster.address), 120, 20);
    let screen = top.wait_for(reference());
    for words in ["hosts 2, running 0, queued 0", "pc-1", "pc-2", "done", "q leaves"] {
        assert!(screen.text().contains(words), "{words} in\n{}", screen.text());
    }
    top.press("q");
    assert_eq!(top.wait(), Some(0));
}
