//! Damaged inputs into each thing that reads from outside, and every finding there ever was.
//!
//! Each target is tried twice: by a few hundred inputs that are the same in every run, and by bolero, whose engine draws
//! anew in every run, takes what is in `__fuzz__` first and prints the input of a failure with its seed. Long runs:
//! `cargo run --release -p tests --bin fuzz` for the first, `BOLERO_RANDOM_TEST_TIME_MS=60000
//! BOLERO_RANDOM_ITERATIONS=1000000000 cargo test --release -p tests --test suite fuzz` for the second, and
//! `cargo bolero test -p tests fuzz::deck` for engines that watch the code's branches.

use std::{cell::RefCell, panic::AssertUnwindSafe, time::Duration};

use bolero::{ByteSliceGenerator, DefaultEngine, TestTarget};
use tests::{fuzz, seeds::Draws};

/// Inputs of each target; `--bin fuzz` goes on from here.
const INPUTS: u64 = 400;

#[test]
fn no_damaged_input_makes_its_reader_panic() {
    for mut target in fuzz::all() {
        let count = fuzz::attack(&mut *target, 0, INPUTS, Duration::from_secs(60));
        assert!(count.findings.is_empty(), "{}: {:?}", target.name(), count.findings);
        assert!(count.taken > 0 && count.taken < count.inputs, "{}: {count:?}", target.name());
    }
}

/// Drives a target by bytes that a fuzzer draws: each of its choices is one of them.
fn drive(test: TestTarget<ByteSliceGenerator, DefaultEngine, bolero::BorrowedInput>, name: &str) {
    let target = AssertUnwindSafe(RefCell::new(fuzz::named(name)));
    test.with_max_len(256).for_each(|bytes: &[u8]| {
        let target = &target;
        target.borrow_mut().attack(&mut Draws::of_bytes(bytes));
    });
}

/// A test by target, so that each can be named to `cargo bolero`.
macro_rules! targets {
    ($($test:ident: $name:literal),* $(,)?) => {
        $(#[test]
        fn $test() {
            drive(bolero::check!(), $name);
        })*

        #[test]
        fn every_target_is_driven_by_bolero_as_well() {
            let all: Vec<_> = fuzz::all().iter().map(|target| target.name()).collect();
            assert_eq!(all, [$($name),*]);
        }
    };
}

targets! {
    frame_header: "frame header",
    frames: "frames in order",
    greeting: "greeting",
    messages: "messages",
    requests: "requests",
    token: "token",
    deck: "deck",
    keyword_deck: "keyword deck",
    mesh_and_bundle: "mesh and bundle",
    snapshot: "snapshot",
    workers_session: "worker's session",
    jobs_session: "job's session",
}
