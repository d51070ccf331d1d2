//! The job script for Slurm with commands in Slurm's place: one node, this machine, whose steps are processes.

use std::{fs, os::unix::fs::PermissionsExt, path::Path, process::Command};

use tests::cluster::{Said, repository, said};

use crate::{BOLIDE, reference, small};

/// Names the one node, and gives its address.
const SCONTROL: &str = "#!/bin/sh\ncase \"$2\" in node) echo NodeName=n1 NodeAddr=127.0.0.1 Weight=1 ;; hostnames) echo n1 ;; esac\n";
/// Does what a step does, without the options.
const SRUN: &str = "#!/bin/sh\nwhile [ \"$1\" != bash ]; do shift; done\nexec \"$@\"\n";

fn command(path: &Path, text: &str) {
    fs::write(path, text).expect("room");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("ours");
}

/// Runs the script as job 77 with results in `folder`.
fn job(commands: &Path, folder: &Path) -> Said {
    command(&commands.join("scontrol"), SCONTROL);
    command(&commands.join("srun"), SRUN);
    let path = format!("{}:{}", commands.display(), std::env::var("PATH").expect("a PATH"));
    let script = repository("deploy/slurm/bolide.sbatch");
    let mut bash = Command::new("bash");
    bash.arg(script).arg(small()).args(["--cycles", "40"]).env("PATH", path).env("BOLIDE", BOLIDE);
    bash.env("BOLIDE_FOLDER", folder).env("BOLIDE_LISTEN", "127.0.0.1").env("BOLIDE_SPEEDS", "weight");
    bash.env("SLURM_JOB_ID", "77").env("SLURM_SUBMIT_DIR", commands).env("SLURMD_NODENAME", "n1");
    bash.env("SLURM_JOB_NODELIST", "n1").env("SLURM_CPUS_ON_NODE", "1");
    said(&mut bash)
}

#[test]
fn the_job_script_of_slurm_removes_nothing_that_it_did_not_make() {
    let folder = tempfile::tempdir().expect("a folder");
    let (commands, results) = (folder.path().join("commands"), folder.path().join("results"));
    fs::create_dir(&commands).expect("room");
    let made = said(Command::new(BOLIDE).args(["certs", "ca"]).arg(results.join("lab")));
    assert_eq!(made.code, Some(0), "{made:?}");
    let foreign = results.join("lab/thesis.txt");
    fs::write(&foreign, "of somebody").expect("room");
    let key = fs::read(results.join("lab/ca-key.pem")).expect("a key");

    let done = job(&commands, &results);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(done.out.contains(reference()), "{done:?}");
    assert_eq!(fs::read(results.join("lab/ca-key.pem")).ok(), Some(key), "the key of another lab");
    assert!(foreign.is_file(), "{done:?}");
    assert!(!results.join("lab-77").exists(), "its own keys are gone: {done:?}");

    fs::create_dir(results.join("lab-77")).expect("room");
    let refused = job(&commands, &results);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.err.contains("lab-77 exists and is not of this job"), "{refused:?}");
    assert!(results.join("lab-77").is_dir());
}
