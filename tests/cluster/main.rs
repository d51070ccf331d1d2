//! The daemons as real processes: the same digest as `bolide run`, and what goes wrong stays where it is.

mod add;
mod begin;
mod disk;
mod faults;
mod http;
mod links;
mod losses;
mod memory;
mod owner;
mod peers;
#[cfg(target_os = "linux")]
mod printing;
mod runs;
mod slurm;
mod study;
mod trust;
mod verify;

use std::{process::Command, sync::OnceLock};

use tests::cluster::{repository, said};

/// The binary of this build, with faults to order.
const BOLIDE: &str = env!("CARGO_BIN_EXE_bolide-under-test");

/// Path of the small deck: 3,456 elements. To its end it runs for five seconds or more.
fn small() -> String {
    repository("tests/decks/plates-small.toml").display().to_string()
}

/// The summary of `bolide run` of the small deck.
fn run(arguments: &[&str]) -> serde_json::Value {
    let mut command = Command::new(BOLIDE);
    command.args(["run", &small(), "--no-output", "--threads", "1", "--json"]).args(arguments);
    let said = said(&mut command);
    assert_eq!(said.code, Some(0), "{said:?}");
    serde_json::from_str(&said.out).expect("a summary")
}

/// The digest after 40 cycles.
fn reference() -> &'static str {
    static DIGEST: OnceLock<String> = OnceLock::new();
    DIGEST.get_or_init(|| digest_of(&run(&["--cycles", "40"])))
}

/// Cycles of a job that goes on while something is done to its cluster: some four seconds of one core.
const LONG: &str = "12000";

/// The digest after [`LONG`] cycles.
fn long_reference() -> &'static str {
    static DIGEST: OnceLock<String> = OnceLock::new();
    DIGEST.get_or_init(|| digest_of(&run(&["--cycles", LONG])))
}

fn digest_of(summary: &serde_json::Value) -> String {
    let digest = summary["digest"].as_str().expect("a digest");
    assert_eq!(digest.len(), 32, "{digest}");
    digest.to_owned()
}

/// Else the test that the shipped binary has none of them would show nothing.
#[test]
fn the_binary_under_test_has_faults_to_order() {
    let bytes = std::fs::read(BOLIDE).expect("the binary of this build");
    for words in tests::cluster::FAULTS {
        assert!(tests::cluster::holds(&bytes, words), "{words:?} is not found");
    }
}
