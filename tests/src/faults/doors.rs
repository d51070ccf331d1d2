//! What comes in by the doors of a master, and what its host is short of there: callers, clocks, decks that ask for too much.

use std::{
    fs,
    net::TcpStream,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::{Duration, Instant},
};

use serde_json::json;

use super::{Case, Scene, Seen, masters::clock_library, since};
use crate::cluster::{Cluster, make_certificates, repository, said, until};

/// The list.
pub fn cases() -> Vec<Case> {
    let case = |name, run| Case { name, tries: 1, run };
    vec![
        case("1,400 callers that say nothing, at a master that may have 1,024 files open", |scene, k| {
            let folder = tempfile::tempdir().expect("a folder");
            // Both limits, so that it can raise none.
            let master = wrapped(scene, folder.path(), "ulimit -n 1024");
            let mut cluster = Cluster::start_in(&master, folder, false, &[], None, &[]);
            ["a", "b", "c"].into_iter().for_each(|name| cluster.worker(name, "1"));
            let address = cluster.address.clone();
            let running = scene.submit(cluster);
            running.wait_for_cycle(scene.instant(900 + k) / 4);
            assert!(system::files::raise_limit(4096) >= 2048, "this test opens 1,400 connections");
            let idle: Vec<TcpStream> = (0..1400).filter_map(|_| TcpStream::connect(&address).ok()).collect();
            // The job comes to its end while they are there; who asks for it then may be one too many.
            let summary = running.cluster.results(1).join("summary.json");
            until(|| running.cluster.master.text(), || summary.is_file().then_some(()));
            let n_idle = idle.len();
            drop(idle);
            let summary = scene.end(&running);
            assert_eq!(summary["losses"], json!([]));
            let note = format!("{n_idle} of them connected; nobody is lost, the results are whole");
            Seen { cycles_lost: Some(0), note, ..Seen::default() }
        }),
        case("the master's wall clock four years ahead for 8 s, under certificates", |scene, k| {
            let Some(clock) = clock_library() else {
                return Seen {
                    note: "skipped: no C compiler to make the clock with".into(),
                    ..Seen::default()
                };
            };
            let folder = tempfile::tempdir().expect("a folder");
            make_certificates(&scene.bolide, &folder.path().join("certs"));
            let (library, jump) = (clock.path().join("clock.so"), clock.path().join("jump"));
            let set = format!("export LD_PRELOAD={} BOLIDE_CLOCK_FILE={}", library.display(), jump.display());
            let master = wrapped(scene, folder.path(), &set);
            let mut cluster = Cluster::start_in(&master, folder, true, &[], None, &[]);
            ["a", "b", "c"].into_iter().for_each(|name| cluster.worker(name, "1"));
            let mut running = scene.submit(cluster);
            running.wait_for_cycle(scene.instant(910 + k) / 2);
            let at = Instant::now();
            fs::write(&jump, (4 * 365 * 86_400).to_string()).expect("room");
            thread::sleep(Duration::from_secs(8));
            fs::remove_file(&jump).expect("it was written");
            let summary = scene.end(&running);
            let time_lost = since(at);
            for name in ["a", "b", "c"] {
                assert!(
                    running.cluster.process_mut(name).is_alive(),
                    "{name}: {}",
                    running.cluster.process(name).text()
                );
            }
            let n_losses = summary["losses"].as_array().map_or(0, Vec::len);
            let note = format!(
                "{n_losses} losses; every worker was there at the end; time: until the end of the run"
            );
            Seen { time_lost, note, ..Seen::default() }
        }),
        case("deck of 160 bytes that asks for a thousand million elements; another behind it", |scene, _| {
            let mut cluster = scene.cluster(&[], None, &[]);
            cluster.worker("a", "1");
            let cube = |name: &str, cells: u32| {
                let path = cluster.folder().join(name);
                let text = format!(
                    "title = \"cube\"\nunits = \"SI\"\n[control]\nend_cycle = 9\n[[part]]\nname = \"cube\"\nmaterial = \"LEAD\"\n\
                     box = {{ origin = [0, 0, 0], size = [1, 1, 1], cells = [{cells}, {cells}, {cells}] }}\n"
                );
                fs::write(&path, text).expect("room");
                path.display().to_string()
            };
            let (large, small) = (cube("large.toml", 1000), cube("small.toml", 3));
            let at = Instant::now();
            let refused = cluster.client(&["submit", &large]);
            let detected = since(at);
            assert_eq!(refused.code, Some(1), "{refused:?}");
            let line = refused.err.lines().find(|line| line.contains("expected at most")).expect("the limit");
            let note = line.trim().to_owned();
            assert_eq!(cluster.client(&["submit", &small, "--wait"]).code, Some(0));
            Seen { detected, note, ..Seen::default() }
        }),
        case("includes that would be read a thousand million times", |scene, _| {
            let cluster = scene.cluster(&[], None, &[]);
            for i in 0..30 {
                let next = i + 1;
                let text = format!("*KEYWORD\n*INCLUDE\nf{next}.k\n*INCLUDE\nf{next}.k\n*END\n");
                fs::write(cluster.folder().join(format!("f{i}.k")), text).expect("room");
            }
            fs::write(cluster.folder().join("f30.k"), "*KEYWORD\n*END\n").expect("room");
            let at = Instant::now();
            let refused = cluster.client(&["submit", "f0.k"]);
            let detected = since(at);
            assert_eq!(refused.code, Some(1), "{refused:?}");
            let line = refused.err.lines().find(|line| line.contains("expected at most")).expect("the limit");
            Seen { detected, note: line.trim().to_owned(), ..Seen::default() }
        }),
        case("Slurm's script in a folder with a CA that is not its own", |_, _| {
            let folder = tempfile::tempdir().expect("a folder");
            let lab = folder.path().join("lab-7");
            fs::create_dir(&lab).expect("room");
            let key = lab.join("ca-key.pem");
            fs::write(&key, "of somebody else").expect("room");
            let said = said(
                Command::new("bash")
                    .arg(repository("deploy/slurm/bolide.sbatch"))
                    .arg("deck.toml")
                    .env("BOLIDE_FOLDER", folder.path())
                    .env("BOLIDE_ADDRESS", "127.0.0.1")
                    .env("SLURM_JOB_ID", "7"),
            );
            assert_eq!(said.code, Some(1), "{said:?}");
            assert!(said.err.contains("exists and is not of this job"), "{said:?}");
            assert_eq!(fs::read_to_string(&key).expect("it is still there"), "of somebody else");
            Seen { note: "refused, and nothing is removed".into(), ..Seen::default() }
        }),
    ]
}

/// A program that does `first` in its shell where the binary is to be a master, and is the binary then.
fn wrapped(scene: &Scene, folder: &Path, first: &str) -> PathBuf {
    let path = folder.join("bolide");
    let bolide = scene.bolide.display();
    let text = format!("#!/bin/sh\n[ \"$1\" != master ] || {{ {first}; }}\nexec {bolide} \"$@\"\n");
    fs::write(&path, text).expect("room");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("it is ours");
    path
}
