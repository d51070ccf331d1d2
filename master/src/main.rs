//! The `bolide` binary.
fn main() {}
