//! What users and machines do wrong.

use std::process::Command;

use tests::cluster::{Cluster, Process, repository, said, until};

use crate::{BOLIDE, digest_of, reference, small};

#[test]
fn a_cancelled_job_keeps_what_it_had_and_frees_its_workers() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    let mut waiting =
        Process::start("submit", &mut cluster.command("client", &["submit", &small(), "--wait"]));
    cluster.wait_until_running(1);
    assert_eq!(cluster.json(&["submit", &small(), "--cycles", "40"])["job"], 2);
    assert_eq!(cluster.json(&["submit", &small(), "--cycles", "40"])["job"], 3);
    let second = cluster.client(&["cancel", "2"]);
    assert_eq!((second.code, second.out.trim()), (Some(0), "job 2 is cancelled"));
    let first = cluster.client(&["cancel", "1"]);
    assert_eq!((first.code, first.out.trim()), (Some(0), "job 1 ends after its present cycle"));
    assert_eq!(waiting.wait().code(), Some(130));
    waiting.wait_for("digest ");
    assert_eq!(digest_of(&cluster.json(&["watch", "3"])), reference());
    for (job, state) in [(1, "cancelled"), (2, "cancelled"), (3, "done")] {
        assert_eq!(cluster.job(job)["state"], state, "job {job}");
    }
    assert!(cluster.folder().join("spool/job-1/summary.json").is_file());
    let again = cluster.client(&["cancel", "1"]);
    assert_eq!(again.code, Some(1));
    assert!(again.err.contains("a job that is cancelled cannot be cancelled"), "{again:?}");
    let unknown = cluster.client(&["cancel", "9"]);
    assert!(unknown.err.contains("no job 9"), "{unknown:?}");
}

#[test]
fn a_bad_deck_comes_back_with_every_fault_at_its_place() {
    let cluster = Cluster::start(BOLIDE, false);
    let deck = repository("tests/decks/submitted.toml").display().to_string();
    let submitted = cluster.client(&["submit", &deck]);
    let checked = said(Command::new(BOLIDE).args(["check", &deck]));
    assert_eq!((submitted.code, &submitted.err), (Some(1), &checked.err));
    for place in [":9:12: read material = \"UNOBTAINIUM\"", ":10:37: read size = 0"] {
        assert!(submitted.err.contains(&format!("{deck}{place}")), "{submitted:?}");
    }
    assert_eq!(cluster.json(&["jobs"]), serde_json::json!([]));
}

/// A deck of somebody else may name any file of whoever reads it, also by a link.
#[cfg(unix)]
#[test]
fn no_word_of_a_file_outside_the_folder_of_a_deck_is_printed() {
    let cluster = Cluster::start(BOLIDE, false);
    let lab = cluster.folder().join("lab");
    std::fs::create_dir(&lab).expect("room");
    let write = |name: &str, text: &str| std::fs::write(lab.join(name), text).expect("room");
    write("../secret", "user me password hunter2\n*hunter2\nhunter2\n");
    write("beside.k", "*NODE\nquoted1,x\n");
    std::os::unix::fs::symlink("../secret", lab.join("link.k")).expect("a link");
    let absolute = cluster.folder().join("secret").display().to_string();
    let head = "title = \"x\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"a\"\nmaterial = \"LEAD\"\n";
    write("mesh.toml", &format!("{head}mesh = {{ file = \"{absolute}\", body = \"b\" }}\n"));
    for (number, include) in ["../secret", &absolute, "link.k"].iter().enumerate() {
        write(&format!("{number}.k"), &format!("*KEYWORD\n*INCLUDE\n{include}\n*INCLUDE\nbeside.k\n*END\n"));
    }
    for deck in ["0.k", "1.k", "2.k", "mesh.toml"] {
        let path = lab.join(deck).display().to_string();
        let submitted = cluster.client(&["submit", &path]);
        let checked = said(Command::new(BOLIDE).args(["check", &path]));
        for said in [submitted, checked] {
            assert_eq!(said.code, Some(1), "{said:?}");
            let words = format!("{}{}", said.out, said.err).to_lowercase();
            assert!(!words.contains("hunter2") && !words.contains("password"), "{deck}: {said:?}");
            assert!(words.contains("its file stands outside the deck's folder"), "{deck}: {said:?}");
            assert!(
                deck == "mesh.toml" || words.contains("quoted1"),
                "{deck}: its own files are quoted: {said:?}"
            );
        }
    }
    let log = cluster.master.text();
    assert!(!log.to_lowercase().contains("hunter2"), "{log}");
}

#[test]
fn a_master_without_certificates_listens_on_loopback_only() {
    let refused = said(Command::new(BOLIDE).args(["master", "--listen", "0.0.0.0:0"]));
    assert_eq!(refused.code, Some(1));
    assert!(refused.err.contains("address 0.0.0.0:0 is not a loopback address"), "{refused:?}");
    let refused = said(Command::new(BOLIDE).args(["worker", "--master", "192.0.2.1:9"]));
    assert_eq!(refused.code, Some(1));
    assert!(refused.err.contains("192.0.2.1:9 is not a loopback address"), "{refused:?}");
}

#[test]
fn a_second_worker_of_the_same_name_is_refused() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    let second = said(&mut cluster.command("worker", &["worker", "--name", "a"]));
    assert_eq!(second.code, Some(1));
    assert!(second.err.contains("a worker named \"a\" is connected from 127.0.0.1:"), "{second:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_of_processes_ends_at_a_whole_cycle_and_leaves_no_child() {
    let mut command = Command::new(BOLIDE);
    command.args(["run", &small(), "--no-output", "--processes", "--workers", "2", "--threads", "1"]);
    let mut run = Process::start("run", &mut command);
    let (me, children) = (run.id(), format!("/proc/{0}/task/{0}/children", run.id()));
    let children = until(
        || format!("two children in {children}"),
        || {
            let text = std::fs::read_to_string(&children).unwrap_or_default();
            let ids: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            (ids.len() == 2).then_some(ids)
        },
    );
    let sent = Command::new("kill").args(["-INT", &me.to_string()]).status().expect("kill is there");
    assert!(sent.success());
    assert_eq!(run.wait().code(), Some(130), "{}", run.text());
    run.wait_for("digest ");
    for id in children {
        assert!(!std::path::Path::new(&format!("/proc/{id}")).exists(), "child {id} is left");
    }
}
