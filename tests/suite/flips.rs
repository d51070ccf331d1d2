//! Single bits that flip in a worker's memory; `cargo run --release -p tests --bin flips -- 100` plays more.

use mechanics::flip::Target;
use tests::seeds::flips::{Campaign, End, FRACTIONS, Try};

#[test]
fn no_flipped_bit_changes_a_run_of_which_all_is_computed_twice() {
    let campaign = Campaign::new();
    let of = |fraction| (0..40).map(|number| campaign.play(number, fraction)).collect::<Vec<Try>>();
    let (without, all) = (of(0), of(FRACTIONS.len() - 1));
    assert_eq!(FRACTIONS[FRACTIONS.len() - 1], 1.0);
    let wrong: Vec<&str> = all.iter().filter(|each| each.is_wrong()).map(|each| &*each.told).collect();
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
    let count = |tries: &[Try], end| tries.iter().filter(|each| each.end == end).count();
    assert!(
        count(&without, End::Silent) >= 5,
        "flips change runs of which nothing is computed twice: {without:?}"
    );
    assert!(count(&all, End::Found) >= 5, "and are found: {all:?}");
    for target in Target::ALL {
        assert!(all.iter().any(|each| each.target == Some(target)), "{target:?} is never hit");
    }
}
