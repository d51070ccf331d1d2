//! Runs that go well.

use std::{collections::BTreeMap, fs, process::Command};

use tests::cluster::{Cluster, repository, said, until};

use crate::{BOLIDE, LONG, digest_of, long_reference, reference, run, small};

/// A job on workers of speeds 1, 2 and 0.5, through every client command.
fn three_workers_give_the_digest_of_run(tls: bool) {
    let mut cluster = Cluster::start(BOLIDE, tls);
    for (name, speed) in [("a", "1"), ("b", "2"), ("c", "0.5")] {
        cluster.worker(name, speed);
    }
    let submitted = cluster.json(&["submit", &small(), "--cycles", "40", "--min-workers", "3", "--trace"]);
    assert_eq!(submitted["job"], 1);
    let watched = cluster.client(&["watch", "1"]);
    assert_eq!(watched.code, Some(0), "{watched:?}");
    assert!(watched.err.contains("job 1 done"), "{watched:?}");
    assert!(watched.out.contains(&format!("digest     {}", reference())), "{watched:?}");
    let summary = cluster.json(&["watch"]);
    assert_eq!(digest_of(&summary), reference());
    assert_eq!(summary["workers"], 3);
    assert!(summary["bytes_per_cycle"].as_f64() > Some(1000.0), "{summary}");

    let hosts = cluster.json(&["hosts"]);
    let speeds: BTreeMap<&str, f64> = hosts
        .as_array()
        .expect("rows")
        .iter()
        .map(|h| (h["name"].as_str().expect("a name"), h["speed"].as_f64().expect("a speed")))
        .collect();
    assert_eq!(speeds, BTreeMap::from([("a", 1.0), ("b", 2.0), ("c", 0.5)]));
    let table = cluster.client(&["hosts"]).out;
    assert_eq!(
        table.lines().filter(|line| line.split_whitespace().any(|word| word == "idle")).count(),
        3,
        "{table}"
    );

    // The plates are 24 cells long: an index plane has 12 x 12 of the 3,456 elements.
    let status = cluster.job(1);
    assert_eq!(status["state"], "done");
    let shares = status["shares"].as_array().expect("shares");
    assert_eq!(shares.len(), 3);
    for share in shares {
        let ideal = 3456.0 * share["speed"].as_f64().expect("a speed") / 3.5;
        let elements = share["elements"].as_f64().expect("a count");
        assert!((elements - ideal).abs() <= 144.0, "{share}, ideal {ideal}");
    }
    assert_eq!(shares.iter().filter_map(|s| s["elements"].as_u64()).sum::<u64>(), 3456);
    assert!(cluster.client(&["jobs"]).out.contains(" done "));

    let fetched = cluster.client(&["results", "1", "--out", "fetched"]);
    assert_eq!(fetched.code, Some(0), "{fetched:?}");
    let (spool, out) = (cluster.folder().join("spool/job-1"), cluster.folder().join("fetched"));
    let names = |folder: &std::path::Path| {
        let files = fs::read_dir(folder).expect("a folder").map(|f| f.expect("a file").file_name());
        let mut names: Vec<_> = files.collect();
        names.sort();
        names
    };
    assert_eq!(names(&spool), names(&out));
    assert!(names(&out).len() >= 6, "{:?}", names(&out));
    assert!(names(&out).iter().any(|name| name == "trace.json"), "{:?}", names(&out));
    let again = cluster.client(&["results", "1", "--out", "fetched"]);
    assert!(again.code == Some(1) && again.err.contains("fetched is not empty"), "{again:?}");
    for name in names(&out) {
        let (theirs, ours) = (fs::read(spool.join(&name)), fs::read(out.join(&name)));
        assert!(theirs.expect("there") == ours.expect("fetched"), "{name:?} differs");
    }
}

#[test]
fn three_unequal_workers_give_the_digest_of_run() {
    three_workers_give_the_digest_of_run(false);
}

#[test]
fn three_unequal_workers_under_tls_give_the_digest_of_run() {
    three_workers_give_the_digest_of_run(true);
}

#[test]
fn a_process_for_each_worker_gives_the_digest_of_one_process() {
    // On this route no byte depends on which links stand already.
    // Their speeds say how many workers there are.
    let three = ["--cycles", "40", "--route", "master", "--speeds", "1,2,0.5"];
    let summary = run(&[&three[..], &["--processes"]].concat());
    assert_eq!(digest_of(&summary), reference());
    assert_eq!((&summary["workers"], &summary["cycles"]), (&3.into(), &40.into()));
    // They share the cores.
    let threads = 3 * (worker::processors::cores() / 3).max(1);
    assert_eq!(summary["threads"], threads);
    // Every byte that the pipe in memory counts passes a link, and heartbeats and the like are few. A plan that would act after
    // the last cycle is sent or is not, as its sort is done in time or not: 3 % of such a short run.
    let embedded = run(&three);
    let ratio = summary["bytes_per_cycle"].as_f64().expect("bytes")
        / embedded["bytes_per_cycle"].as_f64().expect("bytes");
    assert!((0.95..1.05).contains(&ratio), "{ratio}");
}

#[test]
fn jobs_run_one_after_another_and_one_waits_for_its_workers() {
    let mut cluster = Cluster::start(BOLIDE, false);
    let submit = ["submit", &small(), "--cycles", "40", "--no-output", "--min-workers", "2"];
    assert_eq!(cluster.json(&submit)["job"], 1);
    assert_eq!(cluster.json(&submit[..5])["job"], 2);
    assert_eq!(cluster.job(1)["waits_for"], "2 workers, 0 are idle");
    assert_eq!(cluster.job(2)["waits_for"], "1 worker, 0 are idle");
    cluster.worker("a", "1");
    assert_eq!(digest_of(&cluster.json(&["watch", "2"])), reference(), "it passes the one that wants two");
    assert_eq!(cluster.job(1)["waits_for"], "2 workers, 1 are idle");
    cluster.worker("b", "1");
    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), reference());
    let removed = cluster.client(&["rm", "2"]);
    assert_eq!((removed.code, removed.out.trim()), (Some(0), "job 2 is removed"), "{removed:?}");
    assert!(cluster.find_job(2).is_none());
    assert!(cluster.client(&["rm", "2"]).err.contains("no job 2"));
    let none = cluster.client(&["results", "1"]);
    assert_eq!(none.code, Some(1));
    assert!(none.err.contains("job 1 writes no results"), "{none:?}");
}

/// A long job on three workers gives one up to a short one, has it back, and neither has other bits than alone. The worker goes from
/// job to job and back on one connection.
#[test]
fn jobs_share_workers_and_have_the_bits_that_they_have_alone() {
    let mut cluster = Cluster::start(BOLIDE, false);
    for (name, speed) in [("a", "1"), ("b", "1"), ("c", "1")] {
        cluster.worker(name, speed);
    }
    assert_eq!(cluster.json(&["submit", &small(), "--cycles", LONG, "--no-output"])["job"], 1);
    let n_shares = |job| cluster.find_job(job).and_then(|job| Some(job["shares"].as_array()?.len()));
    until(|| "job 1 on three workers".to_owned(), || (n_shares(1) == Some(3)).then_some(()));
    let short = ["submit", &small(), "--cycles", "40", "--no-output", "--workers", "1..1", "--wait"];
    let summary = cluster.json(&short);
    assert_eq!(cluster.job(1)["state"], "running", "the short job has passed: {}", cluster.master.text());
    assert_eq!((digest_of(&summary), &summary["workers"]), (reference().to_owned(), &1.into()));
    cluster.master.wait_for("is called to job 2");
    cluster.master.wait_for("joins the job");
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!((digest_of(&summary), &summary["workers"]), (long_reference().to_owned(), &3.into()));
    assert_eq!(summary["losses"].as_array().map(Vec::len), Some(0), "nobody was lost: {summary}");
}

/// Three jobs that use two threads each share the six of one host: the first has all of them until the others come, and has them back when
/// they are over.
#[test]
fn small_jobs_share_a_host_by_its_threads_and_have_the_bits_that_they_have_alone() {
    let mut cluster = Cluster::start(BOLIDE, true);
    cluster.worker_with("a", "6", &["--threads", "6"]);
    let deck = small();
    let submit = |cycles| cluster.json(&["submit", &deck, "--cycles", cycles, "--no-output"])["job"].clone();
    let slots = || -> Vec<(String, u64, String)> {
        let row = |host: &serde_json::Value| {
            let words = |key: &str| host[key].as_str().unwrap_or_default().to_owned();
            (words("name"), host["threads"].as_u64().unwrap_or_default(), words("note"))
        };
        cluster.json(&["hosts"]).as_array().expect("rows").iter().map(row).collect()
    };
    let are = |expected: &[(&str, u64, &str)]| {
        let what = || format!("slots {expected:?}, found {:?}: {}", slots(), cluster.master.text());
        until(what, || {
            let slots = slots();
            let found = slots.iter().map(|(name, threads, note)| (name.as_str(), *threads, note.as_str()));
            found.eq(expected.iter().copied()).then_some(())
        });
    };
    assert_eq!(submit(LONG), 1);
    are(&[("a", 6, "job 1")]);
    assert_eq!(submit(LONG), 2);
    are(&[("a", 2, "job 1"), ("a@2", 4, "job 2")]);
    assert_eq!(submit("40"), 3);
    let summary = cluster.json(&["watch", "3"]);
    assert_eq!((digest_of(&summary), &summary["workers"]), (reference().to_owned(), &1.into()));
    assert!(cluster.master.text().contains("worker a@3 joined"), "{}", cluster.master.text());
    let threads = || slots().iter().map(|slot| slot.1).collect::<Vec<_>>();
    let are_back = || threads() == [4, 2] || threads() == [2, 4];
    until(|| format!("six threads in two slots: {:?}", slots()), || are_back().then_some(()));
    for job in ["1", "2"] {
        let summary = cluster.json(&["watch", job]);
        assert_eq!(digest_of(&summary), long_reference());
        assert_eq!(summary["losses"].as_array().map(Vec::len), Some(0), "nobody was lost: {summary}");
    }
    until(
        || format!("one idle slot: {:?}", slots()),
        || (threads() == [6] && slots()[0].2.is_empty()).then_some(()),
    );
    assert!(!cluster.master.text().contains("WARN"), "{}", cluster.master.text());
}

/// A job that wants both workers is next; a shorter one passes it, and is stored for it when the job before it ends too soon.
#[test]
fn a_job_that_passed_a_reservation_is_stored_for_it_and_goes_on_behind_it() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.worker("b", "1");
    let submit = |flags: &[&str]| {
        let deck = small();
        let always = ["submit", deck.as_str(), "--no-output"];
        cluster.json(&always.iter().chain(flags).copied().collect::<Vec<_>>())
    };
    let is = |job, state| (cluster.job(job)["state"] == state).then_some(());
    submit(&["--cycles", "400000", "--workers", "1..1"]);
    until(
        || "job 1 with a forecast".to_owned(),
        || cluster.find_job(1).filter(|job| job["left_s"].as_f64().is_some_and(|left| left > 10.0)),
    );
    submit(&["--cycles", "40", "--min-workers", "2"]);
    submit(&["--cycles", LONG]);
    until(|| "job 3 under way".to_owned(), || is(3, "running"));
    assert_eq!(cluster.job(2)["state"], "queued");
    cluster.json(&["cancel", "1"]);
    let summary = cluster.json(&["watch", "2"]);
    assert_eq!((digest_of(&summary), &summary["workers"]), (reference().to_owned(), &2.into()));
    cluster.master.wait_for("the job is stored for one that came before it job=3");
    let summary = cluster.json(&["watch", "3"]);
    assert_eq!(digest_of(&summary), long_reference());
    assert_eq!(summary["losses"].as_array().map(Vec::len), Some(0), "nobody was lost: {summary}");
}

#[test]
fn a_job_that_is_held_gives_its_workers_away_and_goes_on_where_it_was_stored() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    assert_eq!(cluster.json(&["submit", &small(), "--cycles", LONG, "--no-output"])["job"], 1);
    let job_once = |is: &dyn Fn(&serde_json::Value) -> bool| cluster.find_job(1).filter(|job| is(job));
    until(|| "job 1 under way".to_owned(), || job_once(&|job| job["cycle"].as_u64() > Some(20)));
    let held = cluster.json(&["hold", "1"]);
    assert_eq!(held["done"], "job 1 is stored after its present cycle");
    let job = until(|| "job 1 held".to_owned(), || job_once(&|job| job["state"] == "held"));
    assert_eq!((&job["waits_for"], &job["ended"]), (&"`bolide resume 1`".into(), &serde_json::Value::Null));
    let until_done = cluster.client(&["watch", "1", "--until", "done"]);
    assert!(until_done.code == Some(1) && until_done.err.contains("job 1 is held"), "{until_done:?}");
    let twice = cluster.client(&["hold", "1"]);
    assert!(twice.code == Some(1) && twice.err.contains("a job that is held cannot be held"), "{twice:?}");
    let removed = cluster.client(&["rm", "1"]);
    assert!(removed.code == Some(1) && removed.err.contains("`bolide resume 1`"), "{removed:?}");
    assert!(cluster.snapshots(1).is_dir(), "it keeps its checkpoint");

    // Its worker computes another one, and a new master knows that it is held.
    let short = cluster.json(&["submit", &small(), "--cycles", "40", "--no-output", "--wait"]);
    assert_eq!(digest_of(&short), reference());
    cluster.master.kill();
    cluster.restart_master();
    assert_eq!(cluster.job(1)["state"], "held");
    assert_eq!(cluster.client(&["resume", "1"]).out.trim(), "job 1 goes on where it was stored");
    let summary = cluster.json(&["watch", "1"]);
    assert_eq!(digest_of(&summary), long_reference());
    cluster.master.wait_for("the job goes on job=1 cycle=");
}

#[test]
fn a_keyword_deck_is_submitted_with_what_it_includes() {
    let deck = repository("deck/examples/block-on-plate.k").display().to_string();
    let mut command = Command::new(BOLIDE);
    command.args(["run", &deck, "--cycles", "40", "--no-output", "--threads", "1", "--json"]);
    let alone = said(&mut command);
    let expected = digest_of(&serde_json::from_str(&alone.out).unwrap_or_else(|e| panic!("{e}: {alone:?}")));
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.worker("b", "2");
    let submitted =
        cluster.client(&["submit", &deck, "--cycles", "40", "--no-output", "--min-workers", "2", "--json"]);
    assert!(
        submitted.err.contains("warning: ") && submitted.err.contains("*DATABASE_GLSTAT"),
        "{submitted:?}"
    );
    assert_eq!(digest_of(&cluster.json(&["watch", "1"])), expected);

    // A bad deck comes back with the lines of its files.
    let bad = repository("tests/decks/bad/keyword-implicit.k").display().to_string();
    let refused = cluster.client(&["submit", &bad]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.err.contains("keyword-implicit.k:8:1: read *CONTROL_IMPLICIT_GENERAL"), "{refused:?}");
    assert!(refused.err.contains("keyword-implicit-nodes.inc:3:8: "), "{refused:?}");
}

#[test]
fn a_worker_waits_for_a_master_that_is_not_there_yet_and_comes_back_to_a_new_one() {
    let mut cluster = Cluster::start(BOLIDE, false);
    cluster.worker("a", "1");
    cluster.master.kill();
    let mut master = Command::new(BOLIDE);
    master.args(["master", "--listen", &cluster.address, "--spool"]).arg(cluster.folder().join("spool"));
    cluster.master = tests::cluster::Process::start("second master", &mut master);
    cluster.master.wait_for("worker a joined");
    let said = said(
        &mut cluster
            .command("client", &["submit", &small(), "--cycles", "40", "--no-output", "--wait", "--json"]),
    );
    let summary = serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{e}: {said:?}"));
    assert_eq!(digest_of(&summary), reference());
}

/// A master tells of jobs that came to their end and of one that a user took back.
#[test]
fn a_master_tells_of_every_job_that_is_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = folder.path().join("told");
    let words = format!("echo \"$BOLIDE_JOB $BOLIDE_STATE $BOLIDE_FOLDER\" >> {}", told.display());
    let mut cluster = Cluster::start_with(BOLIDE, false, &["--notify", &words], None);
    let submit = ["submit", &small(), "--cycles", "40", "--no-output"];
    assert_eq!(cluster.json(&submit)["job"], 1);
    assert_eq!(cluster.json(&submit[..4])["job"], 2);
    assert_eq!(cluster.client(&["cancel", "1"]).code, Some(0));
    cluster.worker("a", "1");
    let expected = format!("1 stopped \n2 done {}\n", cluster.results(2).display());
    let lines = || fs::read_to_string(&told).unwrap_or_default();
    until(|| format!("{} in place of {expected}", lines()), || (lines() == expected).then_some(()));
    let early = cluster.client(&["submit", &small(), "--notify", "true"]);
    assert!(early.code == Some(2) && early.err.contains("--wait"), "{early:?}");
}

/// The master itself is a server of TLS whose certificate is the lab's; what it is told then is no frame.
#[test]
fn a_webhook_goes_to_whom_this_host_trusts() {
    let cluster = Cluster::start(BOLIDE, true);
    let post = |ca: &str| {
        let mut command = Command::new(BOLIDE);
        let url = format!("https://{}/hooks/7", cluster.address);
        command.args(["run", &small(), "--cycles", "2", "--no-output", "--webhook", &url]);
        let ca = cluster.folder().join("certs").join(ca);
        let told = said(command.env("SSL_CERT_FILE", ca).env_remove("SSL_CERT_DIR"));
        assert!(told.code == Some(0) && told.err.contains("--webhook of 127.0.0.1: "), "{told:?}");
        assert!(!told.err.contains("hooks"), "the address is a secret: {told:?}");
        told.err
    };
    let words = "invalid peer certificate: UnknownIssuer";
    assert!(post("none.pem").contains(words));
    let trusted = post("ca.pem");
    assert!(!trusted.contains(words), "{trusted}");
}
