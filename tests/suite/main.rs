//! The verification book: the whole system against closed forms, published figures, and itself.
//!
//! `cargo test --release -p tests --test suite -- --nocapture` prints every case with its figure.

mod bits;
mod contact;
mod element;
mod solid;
mod wave;

/// A case that nobody computes would look like one that holds.
#[test]
fn every_row_of_the_reference_is_a_case_of_the_suite() {
    let suite = [
        include_str!("element.rs"),
        include_str!("wave.rs"),
        include_str!("solid.rs"),
        include_str!("contact.rs"),
    ]
    .concat();
    for name in tests::case::names() {
        // Rows of a family are named `family: of what`, and the family's test makes their names.
        let family = name.split(" @ ").next().unwrap_or(name);
        assert!(suite.contains(family), "no test computes \"{name}\"");
    }
}
