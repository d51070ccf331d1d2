//! QUEUE: jobs, their legal states, first come first served within a priority.
//!
//! A plain table in memory: it knows no socket, clock or disk ([`spool`](crate::spool) does). The text of a deck is kept until its job is over.

use std::{cmp::Reverse, collections::BTreeMap, path::PathBuf, sync::Arc};

use protocol::{options::JobOptions, request::State};
use serde::{Deserialize, Serialize};

/// Most jobs that may wait.
pub const QUEUED_LIMIT: usize = 1000;
/// Most jobs that are remembered after their end.
pub const ENDED_LIMIT: usize = 1000;

/// Why the queue does not do what is asked of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// There is no job of this number.
    Unknown(u32),
    /// A job that is to be removed waits, runs or is held.
    NotOver(u32, State),
    /// A job in this state cannot change so.
    Illegal(State, Change),
    /// So many jobs wait, and no more may.
    Full(usize),
}

impl std::error::Error for Error {}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown(job) => write!(f, "no job {job}"),
            Self::NotOver(job, state) => {
                write!(f, "job {job} is {}; `bolide cancel {job}` it first", state.name())?;
                match state {
                    State::Held => {
                        write!(f, ", or go on with it by `bolide resume {job}`: it keeps its checkpoint")
                    }
                    _ => Ok(()),
                }
            }
            Self::Illegal(state, change) => {
                write!(f, "a job that is {} cannot be {}", state.name(), change.participle())
            }
            Self::Full(waiting) => write!(f, "{waiting} jobs wait, at most {QUEUED_LIMIT}; cancel some"),
        }
    }
}

/// What happens to a job in the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Workers were given to it.
    Start,
    /// It came to its end.
    Finish,
    /// Something went wrong.
    Fail,
    /// A user took it back, or it ended early because of that.
    Cancel,
    /// Its master has to leave: it is stored, to be gone on with by the next one.
    Suspend,
    /// A user wants what failed or was held to be gone on with.
    Resume,
    /// A user keeps it back, or master or workers die of it again and again: the next one goes on.
    Hold,
}

impl Change {
    /// What a job is after it: started.
    const fn participle(self) -> &'static str {
        match self {
            Self::Start => "started",
            Self::Finish => "finished",
            Self::Fail => "failed",
            Self::Cancel => "cancelled",
            Self::Suspend => "suspended",
            Self::Resume => "resumed",
            Self::Hold => "held",
        }
    }
}

/// What a user wants of a job that it has still to come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// It is taken back.
    Cancel,
    /// It is kept back, stored where it is.
    Hold,
}

impl Wish {
    /// The change that brings it about in a job that waits, or whose run was stored.
    pub const fn change(self) -> Change {
        match self {
            Self::Cancel => Change::Cancel,
            Self::Hold => Change::Hold,
        }
    }
}

/// Starts of a job that ended neither with it nor in good order, since it last came further.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Starts {
    pub count: u32,
    /// Number of the newest snapshot at that time; 0 for none.
    pub snapshot: u64,
}

impl Starts {
    /// Masters that may die of a job, none of which stored it anew.
    pub const LIMIT: u32 = 3;

    /// The job starts once more, with this newest snapshot.
    pub const fn start(&mut self, snapshot: u64) {
        self.count = if snapshot == self.snapshot { self.count.saturating_add(1) } else { 1 };
        self.snapshot = snapshot;
    }

    /// Whether so many masters died of it that it is to be held.
    pub const fn are_too_many(self, snapshot: u64) -> bool {
        self.count >= Self::LIMIT && snapshot == self.snapshot
    }
}

/// The state after a change.
///
/// # Errors
/// [`Error::Illegal`], where the change cannot happen.
pub fn after(state: State, change: Change) -> Result<State, Error> {
    match (state, change) {
        (State::Queued, Change::Start) => Ok(State::Running),
        (State::Queued | State::Running | State::Held, Change::Cancel) => Ok(State::Cancelled),
        (State::Running, Change::Finish) => Ok(State::Done),
        (State::Running, Change::Fail) => Ok(State::Failed),
        (State::Running, Change::Suspend) | (State::Failed | State::Held, Change::Resume) => {
            Ok(State::Queued)
        }
        (State::Queued | State::Running, Change::Hold) => Ok(State::Held),
        (State::Queued, Change::Finish | Change::Fail | Change::Suspend | Change::Resume)
        | (State::Running, Change::Start | Change::Resume)
        | (State::Done | State::Failed | State::Held | State::Cancelled, _) => {
            Err(Error::Illegal(state, change))
        }
    }
}

/// One job.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its number, from 1.
    pub id: u32,
    /// Name of the deck's file.
    pub name: String,
    /// The deck; empty once the job is over.
    pub text: Arc<String>,
    /// What is asked beside the deck.
    pub options: JobOptions,
    /// Where it stands.
    pub state: State,
    /// Where its results go; none with `no_output`.
    pub folder: Option<PathBuf>,
    /// Of a job that was under way before: the workers it had. It goes on before all others, unless it stands aside.
    pub before: Option<Vec<String>>,
    /// Whether it is stored, or about to be, for a job that came before it.
    pub aside: bool,
    /// BLAKE3 of the deck, hexadecimal; empty where an earlier release queued it.
    pub deck_sum: String,
    pub starts: Starts,
    /// What a user wants of it, until it is over.
    pub wish: Option<Wish>,
    pub size: Size,
    /// Who submitted it, by certificate; empty without one.
    pub owner: String,
}

/// What a job is expected to take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Of its mesh; 0 where an earlier release queued it.
    pub elements: u64,
    /// To its end, at its first time step; 0 where nobody knows.
    pub cycles: u64,
}

/// All jobs, by number.
#[derive(Debug)]
pub struct Queue {
    jobs: BTreeMap<u32, Entry>,
    next: u32,
}

impl Queue {
    /// An empty queue that numbers from `first`.
    pub const fn new(first: u32) -> Self {
        Self { jobs: BTreeMap::new(), next: first }
    }

    /// Puts back what an earlier master left.
    pub fn restore(&mut self, entry: Entry) {
        self.next = self.next.max(entry.id.saturating_add(1));
        self.jobs.insert(entry.id, entry);
    }

    /// Takes back a job that could not be put on disk.
    pub fn take_back(&mut self, id: u32) {
        self.jobs.remove(&id);
    }

    /// Puts a job that failed or was held back, with its deck. One that had begun goes before the others, on any workers.
    ///
    /// # Errors
    /// As for [`Queue::apply`].
    pub fn resume(&mut self, id: u32, text: String, had_begun: bool) -> Result<State, Error> {
        let (state, _) = self.apply(id, Change::Resume)?;
        if let Some(job) = self.jobs.get_mut(&id) {
            job.text = Arc::new(text);
            job.before = had_begun.then(Vec::new);
            job.starts = Starts::default();
        }
        Ok(state)
    }

    /// A job begins with these workers, from this newest snapshot.
    pub fn set_at_work(&mut self, id: u32, at_work: Vec<String>, snapshot: u64) {
        if let Some(job) = self.jobs.get_mut(&id) {
            job.before = Some(at_work);
            job.aside = false;
            job.starts.start(snapshot);
        }
    }

    /// A job is to be stored for one that came before it; false if that is known.
    pub fn set_aside(&mut self, id: u32) -> bool {
        self.jobs.get_mut(&id).is_some_and(|job| !std::mem::replace(&mut job.aside, true))
    }

    /// The session of a job ended in good order, whatever came of the job.
    pub fn forget_starts(&mut self, id: u32) {
        if let Some(job) = self.jobs.get_mut(&id) {
            job.starts = Starts::default();
        }
    }

    /// Forgets a job that is over. One that is held waits for its user, with a checkpoint that would be lost.
    ///
    /// # Errors
    /// If there is none of this number, or it is not over.
    pub fn remove(&mut self, id: u32) -> Result<Entry, Error> {
        let state = self.jobs.get(&id).ok_or(Error::Unknown(id))?.state;
        if !is_over(state) || state == State::Held {
            return Err(Error::NotOver(id, state));
        }
        self.jobs.remove(&id).ok_or(Error::Unknown(id))
    }

    /// The jobs that are over.
    pub fn over(&self) -> impl Iterator<Item = &Entry> {
        self.jobs.values().filter(|job| is_over(job.state))
    }

    /// What a user wants of a job.
    pub fn set_wish(&mut self, id: u32, wish: Option<Wish>) {
        if let Some(job) = self.jobs.get_mut(&id) {
            job.wish = wish;
        }
    }

    /// Adds a job whose results go below `spool`; gives its number.
    ///
    /// # Errors
    /// If too many wait.
    pub fn add(
        &mut self,
        name: String,
        (text, size): (String, Size),
        (options, owner): (JobOptions, String),
        spool: &std::path::Path,
    ) -> Result<u32, Error> {
        let waiting = self.jobs.values().filter(|job| job.state == State::Queued).count();
        if waiting >= QUEUED_LIMIT {
            return Err(Error::Full(waiting));
        }
        let id = self.next;
        self.next += 1;
        let folder = (!options.no_output).then(|| spool.join(format!("job-{id}")));
        let text = Arc::new(text);
        let deck_sum = sum_of(&text);
        let (state, before, starts, wish) = (State::Queued, None, Starts::default(), None);
        let entry = Entry {
            id,
            name,
            text,
            options,
            state,
            folder,
            before,
            aside: false,
            deck_sum,
            starts,
            wish,
            size,
            owner,
        };
        self.jobs.insert(id, entry);
        Ok(id)
    }

    /// The jobs that wait, in the order in which they are to start: those that were interrupted, then by priority, the first come
    /// first.
    pub fn waiting(&self) -> Vec<&Entry> {
        let mut waiting: Vec<&Entry> = self.jobs.values().filter(|job| job.state == State::Queued).collect();
        waiting.sort_by_key(|job| (job.before.is_none() || job.aside, Reverse(job.options.priority), job.id));
        waiting
    }

    /// A job.
    pub fn get(&self, id: u32) -> Option<&Entry> {
        self.jobs.get(&id)
    }

    /// The newest job that is not over, else the newest.
    pub fn last(&self) -> Option<u32> {
        let goes_on = self.jobs.values().rev().find(|job| !is_over(job.state)).map(|job| job.id);
        goes_on.or_else(|| self.jobs.keys().next_back().copied())
    }

    /// Changes a job's state; gives the new one, and the jobs that are forgotten.
    ///
    /// # Errors
    /// As for [`after`], or if there is no such job.
    pub fn apply(&mut self, id: u32, change: Change) -> Result<(State, Vec<u32>), Error> {
        let job = self.jobs.get_mut(&id).ok_or(Error::Unknown(id))?;
        job.state = after(job.state, change)?;
        let state = job.state;
        if is_over(state) {
            (job.text, job.wish) = (Arc::default(), None);
        }
        // A held job waits for its user, and what has just ended is to be seen.
        let ends = |job: &&Entry| is_over(job.state) && job.state != State::Held && job.id != id;
        let ended: Vec<u32> = self.jobs.values().filter(ends).map(|job| job.id).collect();
        let others = ENDED_LIMIT - usize::from(is_over(state));
        let forgotten = ended[..ended.len().saturating_sub(others)].to_vec();
        for id in &forgotten {
            self.jobs.remove(id);
        }
        Ok((state, forgotten))
    }
}

/// Whether nothing more can happen to a job.
pub const fn is_over(state: State) -> bool {
    matches!(state, State::Done | State::Failed | State::Held | State::Cancelled)
}

/// BLAKE3 of a deck, hexadecimal.
pub fn sum_of(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATES: [State; 6] =
        [State::Queued, State::Running, State::Done, State::Failed, State::Held, State::Cancelled];
    const CHANGES: [Change; 7] = [
        Change::Start,
        Change::Finish,
        Change::Fail,
        Change::Cancel,
        Change::Suspend,
        Change::Resume,
        Change::Hold,
    ];

    #[test]
    fn only_eleven_changes_are_legal_and_none_leaves_an_end_but_those_of_a_failed_or_held_job() {
        let mut legal = Vec::new();
        for state in STATES {
            for change in CHANGES {
                match after(state, change) {
                    Ok(next) => legal.push((state, next)),
                    Err(why) => assert_eq!(why, Error::Illegal(state, change)),
                }
            }
        }
        use State::{Cancelled, Done, Failed, Held, Queued, Running};
        let expected = [
            (Queued, Running),
            (Queued, Cancelled),
            (Queued, Held),
            (Running, Done),
            (Running, Failed),
            (Running, Cancelled),
            (Running, Queued),
            (Running, Held),
            (Failed, Queued),
            (Held, Cancelled),
            (Held, Queued),
        ];
        assert_eq!(legal, expected);
    }

    #[test]
    fn three_starts_without_a_snapshot_between_are_too_many() {
        let mut starts = Starts::default();
        for snapshot in [0, 0, 4, 4] {
            starts.start(snapshot);
            assert!(!starts.are_too_many(snapshot), "{starts:?}");
        }
        starts.start(4);
        assert!(starts.are_too_many(4) && !starts.are_too_many(5));
    }

    fn add(queue: &mut Queue) -> Result<u32, Error> {
        queue.add("d".into(), ("text".into(), Size::default()), Default::default(), "spool".as_ref())
    }

    #[test]
    fn the_first_come_is_the_first_served() {
        let mut queue = Queue::new(5);
        assert_eq!((add(&mut queue), add(&mut queue), add(&mut queue)), (Ok(5), Ok(6), Ok(7)));
        assert_eq!(queue.waiting().first().map(|job| job.id), Some(5));
        assert_eq!(queue.apply(6, Change::Cancel), Ok((State::Cancelled, vec![])));
        assert_eq!(queue.apply(5, Change::Start), Ok((State::Running, vec![])));
        assert_eq!(queue.waiting().first().map(|job| job.id), Some(7));
        assert_eq!(queue.apply(5, Change::Fail), Ok((State::Failed, vec![])));
        assert_eq!(queue.get(5).map(|job| job.text.as_str()), Some(""), "the deck is not kept");
        assert_eq!(queue.apply(9, Change::Start), Err(Error::Unknown(9)));
    }

    #[test]
    fn the_interrupted_goes_first_then_the_highest_priority_then_the_first_come() {
        let mut queue = Queue::new(1);
        for priority in [0, 2, 2, -1, 0] {
            let options = JobOptions { priority, ..JobOptions::default() };
            queue
                .add("d".into(), ("text".into(), Size::default()), (options, String::new()), "spool".as_ref())
                .expect("room");
        }
        let interrupted =
            Entry { id: 9, before: Some(vec!["a".into()]), ..queue.get(4).expect("added").clone() };
        queue.restore(interrupted);
        let mut order = Vec::new();
        while let Some(next) = queue.waiting().first().map(|job| job.id) {
            order.push(next);
            queue.apply(next, Change::Start).expect("it waits");
        }
        assert_eq!(order, [9, 2, 3, 1, 5, 4]);
        assert_eq!(add(&mut queue), Ok(10), "numbers go on after those of an earlier master");
    }

    #[test]
    fn a_held_job_is_not_removed_before_its_user_has_given_it_up() {
        let mut queue = Queue::new(1);
        add(&mut queue).expect("room");
        queue.apply(1, Change::Hold).expect("it waits");
        let why = queue.remove(1).expect_err("it is held");
        assert_eq!(
            why.to_string(),
            "job 1 is held; `bolide cancel 1` it first, or go on with it by `bolide resume 1`: it keeps its checkpoint"
        );
        queue.apply(1, Change::Cancel).expect("it is held");
        assert!(queue.remove(1).is_ok());
        let twice = Error::Illegal(State::Done, Change::Cancel).to_string();
        assert_eq!(twice, "a job that is done cannot be cancelled");
    }

    #[test]
    fn the_newest_job_is_the_newest_that_is_not_over() {
        let mut queue = Queue::new(1);
        assert_eq!(queue.last(), None);
        let ids = [(); 3].map(|()| add(&mut queue).expect("room"));
        let mut last_without = |id| queue.apply(id, Change::Cancel).map(|_| queue.last());
        assert_eq!(last_without(ids[2]), Ok(Some(ids[1])));
        assert_eq!(last_without(ids[1]), Ok(Some(ids[0])));
        assert_eq!(last_without(ids[0]), Ok(Some(ids[2])), "all are over");
    }

    #[test]
    fn waiting_and_ended_jobs_have_their_limits() {
        let mut queue = Queue::new(1);
        for _ in 0..QUEUED_LIMIT {
            add(&mut queue).expect("room");
        }
        assert_eq!(add(&mut queue), Err(Error::Full(1000)));
        for id in 1..=ENDED_LIMIT as u32 {
            assert_eq!(queue.apply(id, Change::Cancel), Ok((State::Cancelled, vec![])));
        }
        let next = add(&mut queue).expect("room again");
        assert_eq!(queue.apply(next, Change::Cancel), Ok((State::Cancelled, vec![1])));
        assert!(queue.get(1).is_none() && queue.last() == Some(next));
    }
}
