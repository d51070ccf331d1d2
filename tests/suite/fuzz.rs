//! A few hundred damaged inputs into each thing that reads from outside, and every finding there ever was.

use std::time::Duration;

use tests::fuzz;

/// Inputs of each target; `cargo run --release -p tests --bin fuzz` goes on from here.
const INPUTS: u64 = 400;

#[test]
fn no_damaged_input_makes_its_reader_panic() {
    for mut target in fuzz::all() {
        let count = fuzz::attack(&mut *target, 0, INPUTS, Duration::from_secs(60));
        assert!(count.findings.is_empty(), "{}: {:?}", target.name(), count.findings);
        assert!(count.taken > 0 && count.taken < count.inputs, "{}: {count:?}", target.name());
    }
}
