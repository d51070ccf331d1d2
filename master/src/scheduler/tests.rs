//! What the scheduler keeps on disk.

use std::path::Path;

use super::*;

const JOB: u32 = 7;

fn scheduler(folder: &Path) -> Scheduler {
    let (spool, left) = Spool::open(folder).expect("a spool");
    Scheduler::new(folder.to_owned(), spool, left, mpsc::channel(1).0, None, None)
}

fn queued(wish: Option<Wish>) -> Record {
    Record {
        job: JOB,
        name: "a.toml".to_owned(),
        title: "a".to_owned(),
        state: State::Queued,
        options: JobOptions::default(),
        at_work: Vec::new(),
        cycle: 0,
        time: 0.0,
        ended: None,
        deck_sum: queue::sum_of("a deck"),
        starts: Starts::default(),
        cancelled: wish == Some(Wish::Cancel),
        held: wish == Some(Wish::Hold),
        elements: 1,
        cycles: 0,
        owner: String::new(),
    }
}

/// Plays a test with a spool that has this record, on threads of the kind that a scheduler has.
fn play(record: &Record, test: impl FnOnce(&Path)) {
    let folder = tempfile::tempdir().expect("a folder");
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).build().expect("threads");
    runtime.block_on(async {
        Spool::open(folder.path()).expect("a spool").0.add(record, "a deck").expect("room");
        test(folder.path());
    });
}

fn state_on_disk(folder: &Path) -> State {
    Spool::open(folder).expect("a spool").1.jobs[0].0.state
}

#[test]
fn a_cancel_is_on_disk_before_it_is_acknowledged() {
    play(&queued(None), |folder| {
        let mut owner = scheduler(folder);
        let record = owner.spool.record(JOB);
        // No file can take the place of a folder with something in it.
        std::fs::remove_file(&record).expect("it was written");
        std::fs::create_dir_all(record.join("full")).expect("room");
        assert!(matches!(owner.wish(JOB, Wish::Cancel), Err(Error::Disk { .. })));
        let state = |owner: &Scheduler| owner.queue.get(JOB).map(|entry| (entry.state, entry.wish));
        assert_eq!(state(&owner), Some((State::Queued, None)));
        assert_eq!(owner.unwritten, BTreeSet::from([JOB]));

        std::fs::remove_dir_all(&record).expect("it is there");
        owner.write_late();
        assert!(owner.unwritten.is_empty());
        owner.wish(JOB, Wish::Cancel).expect("there is room");
        drop(owner);
        assert_eq!(state_on_disk(folder), State::Cancelled);
    });
}

#[test]
fn a_job_that_was_to_be_cancelled_when_its_master_died_is_cancelled_by_the_next() {
    play(&queued(Some(Wish::Cancel)), |folder| {
        drop(scheduler(folder));
        assert_eq!(state_on_disk(folder), State::Cancelled);
    });
}

#[test]
fn a_job_that_waits_is_held_over_a_restart_and_takes_its_old_place_when_it_is_resumed() {
    play(&queued(None), |folder| {
        let mut owner = scheduler(folder);
        assert_eq!(owner.wish(JOB, Wish::Hold).ok(), Some("job 7 is held".to_owned()));
        assert!(owner.queue.waiting().is_empty());
        let status = |owner: &Scheduler| owner.status[&JOB].borrow().clone();
        assert_eq!(status(&owner).waits_for.as_deref(), Some("`bolide resume 7`"));
        assert_eq!(status(&owner).ended, None, "who watches it goes on watching");
        assert!(matches!(
            owner.wish(JOB, Wish::Hold),
            Err(Error::Queue(queue::Error::Illegal(State::Held, Change::Hold)))
        ));
        drop(owner);
        assert_eq!(state_on_disk(folder), State::Held);

        let mut owner = scheduler(folder);
        assert_eq!(status(&owner).waits_for.as_deref(), Some("`bolide resume 7`"));
        assert_eq!(owner.resume(JOB).ok(), Some("job 7 waits for workers".to_owned()));
        let waits =
            owner.queue.get(JOB).map(|entry| (entry.state, entry.before.clone(), entry.text.as_str()));
        assert_eq!(waits, Some((State::Queued, None, "a deck")));
        assert_eq!(status(&owner).waits_for, None);
        drop(owner);
        assert_eq!(state_on_disk(folder), State::Queued);
    });
}

#[test]
fn a_job_that_was_to_be_held_when_its_master_died_is_held_by_the_next_and_goes_on_as_one_that_had_begun() {
    let interrupted =
        Record { state: State::Running, at_work: vec!["a".to_owned()], ..queued(Some(Wish::Hold)) };
    play(&interrupted, |folder| {
        let mut owner = scheduler(folder);
        assert_eq!(owner.queue.get(JOB).map(|entry| (entry.state, entry.wish)), Some((State::Held, None)));
        assert_eq!(owner.resume(JOB).ok(), Some("job 7 goes on where it was stored".to_owned()));
        assert_eq!(owner.queue.get(JOB).and_then(|entry| entry.before.clone()), Some(vec![]));
    });
}

#[test]
fn a_job_that_ends_because_it_was_cancelled_cannot_be_held_and_one_that_is_held_can_be_cancelled() {
    play(&queued(None), |folder| {
        let mut owner = scheduler(folder);
        owner.wish(JOB, Wish::Hold).expect("it waits");
        owner.wish(JOB, Wish::Cancel).expect("it is held");
        assert!(matches!(
            owner.wish(JOB, Wish::Hold),
            Err(Error::Queue(queue::Error::Illegal(State::Cancelled, Change::Hold)))
        ));
    });
}
