//! 200 seeds of the world that goes wrong, and a bug that they find.

use tests::seeds::{Bug, Stage};

#[test]
fn whatever_goes_wrong_in_200_worlds_the_bits_are_those_of_a_quiet_one() {
    let stage = Stage::new();
    let (mut wrong, mut lent) = (Vec::new(), 0);
    for seed in 0..200 {
        match stage.play(seed, None) {
            Ok(played) => lent += played.lent,
            Err(why) => wrong.push(why),
        }
    }
    assert!(wrong.is_empty(), "{} seeds:\n{}", wrong.len(), wrong.join("\n"));
    assert!(lent > 5, "other jobs had {lent} workers");
}

#[test]
fn a_master_that_compares_only_a_part_of_what_is_computed_twice_is_found() {
    let stage = Stage::new();
    let found = (0..1000)
        .find_map(|seed| stage.play(seed, Some(Bug::Narrow)).err())
        .expect("one seed of 1000 shows it");
    assert!(found.contains("another result than undisturbed"), "{found}");
}

#[test]
fn a_master_that_hears_messages_of_epochs_that_are_over_is_found() {
    let stage = Stage::new();
    let found = (0..200)
        .find_map(|seed| stage.play(seed, Some(Bug::Unfenced)).err())
        .expect("one seed of 200 shows it");
    assert!(found.starts_with("seed "), "{found}");
}

#[test]
fn each_planted_bug_of_disks_frames_stuck_tasks_and_shortages_is_found() {
    let stage = Stage::new();
    for bug in [Bug::Trusting, Bug::Unsynced, Bug::Careless, Bug::Deaf, Bug::Patient, Bug::Hasty, Bug::Greedy]
    {
        let found = (0..400).find_map(|seed| stage.play(seed, Some(bug)).err());
        let found = found.unwrap_or_else(|| panic!("no seed of 400 shows {bug:?}"));
        assert!(found.starts_with("seed "), "{found}");
    }
}
