//! Same bits where the threads of a worker share its contact.

use tests::solve::{Workers, example};

use super::fingerprint;

#[test]
fn plates_that_stick_have_the_same_bits_on_any_threads() {
    let mut model = example("plates-free-slip");
    model.setup.control.end_cycle = 300;
    let contact = model.setup.contact.as_mut().expect("the deck has contact");
    contact.friction.fill(0.3);
    contact.sticks = true;
    let one = fingerprint(&model, Workers::default());
    for threads in [2, 4] {
        assert_eq!(fingerprint(&model, Workers { threads, ..Workers::default() }), one, "{threads} threads");
    }
    model.setup.contact.as_mut().expect("the deck has contact").friction.fill(0.0);
    assert_ne!(fingerprint(&model, Workers::default()).digest, one.digest, "friction changes nothing");
}
