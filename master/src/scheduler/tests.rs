//! What the scheduler keeps on disk.

use std::path::Path;

use super::*;

const JOB: u32 = 7;

fn scheduler(folder: &Path) -> Scheduler {
    let (spool, left) = Spool::open(folder).expect("a spool");
    Scheduler::new(folder.to_owned(), spool, left, mpsc::channel(1).0, None)
}

fn queued(cancelled: bool) -> Record {
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
        cancelled,
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
    play(&queued(false), |folder| {
        let mut owner = scheduler(folder);
        let record = owner.spool.record(JOB);
        // No file can take the place of a folder with something in it.
        std::fs::remove_file(&record).expect("it was written");
        std::fs::create_dir_all(record.join("full")).expect("room");
        assert!(matches!(owner.cancel(JOB), Err(Error::Disk { .. })));
        let state = |owner: &Scheduler| owner.queue.get(JOB).map(|entry| (entry.state, entry.cancelled));
        assert_eq!(state(&owner), Some((State::Queued, false)));
        assert_eq!(owner.unwritten, BTreeSet::from([JOB]));

        std::fs::remove_dir_all(&record).expect("it is there");
        owner.write_late();
        assert!(owner.unwritten.is_empty());
        owner.cancel(JOB).expect("there is room");
        drop(owner);
        assert_eq!(state_on_disk(folder), State::Cancelled);
    });
}

#[test]
fn a_job_that_was_to_be_cancelled_when_its_master_died_is_cancelled_by_the_next() {
    play(&queued(true), |folder| {
        drop(scheduler(folder));
        assert_eq!(state_on_disk(folder), State::Cancelled);
    });
}
