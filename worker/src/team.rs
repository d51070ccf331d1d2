//! Threads that stay awake between the dealings of a cycle.
//!
//! A cycle deals work several times, and two dealings lie so close together that a thread which sleeps between them loses more by waking
//! up than it would have waited. The members of a [`Team`] are jobs of the current pool. A member looks for the next dealing all the time, and leaves, so that
//! its thread may sleep, when none has come for [`PATIENCE`] or another thread wants its core. It also does what runs beside the cycles, such as a
//! sort; the dealings meanwhile go to the others, and to that member as soon as it is back.

use std::{
    any::Any,
    collections::VecDeque,
    mem::transmute,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

/// How long a member waits for the next dealing: longer than what lies between two dealings where nobody waits for a wire.
const PATIENCE: Duration = Duration::from_micros(500);

/// A thread that yields and comes back later than this was not the only one that wanted the core.
const CONTENDED: Duration = Duration::from_micros(50);

/// Pauses of the processor between two looks, before the core is offered to other threads.
const PAUSES: usize = 50;

/// What runs beside the cycles.
type Job = Box<dyn FnOnce() + Send>;

/// Members that wait for what one thread deals, one dealing at a time, and for what is to run beside. Clones share them.
#[derive(Clone, Default)]
pub struct Team(Arc<Shared>);

#[derive(Default)]
struct Shared {
    dealing: Mutex<Dealing>,
    jobs: Mutex<VecDeque<Job>>,
    /// Dealings and jobs so far: what members look at.
    news: AtomicU64,
    /// Members that take part in the dealing.
    at_work: AtomicUsize,
    /// Members that have not left.
    members: AtomicUsize,
}

/// What is dealt now.
#[derive(Default)]
struct Dealing {
    /// What each member does; none between dealings.
    work: Option<&'static (dyn Fn() + Sync)>,
    /// How many members may still begin.
    places: usize,
    /// What a member panicked with.
    panic: Option<Box<dyn Any + Send>>,
}

impl Team {
    /// Has the calling thread and up to `n - 1` members do the same. A member that comes late does nothing. Not to be called by `work`
    /// itself, which would be waited for.
    pub fn together(&self, n: usize, work: &(dyn Fn() + Sync)) {
        let shared = &*self.0;
        // SAFETY: `Closing` takes the reference back and waits for every member that has it, on return and on panic: none uses it
        // when this function has been left.
        let erased = unsafe { transmute::<&(dyn Fn() + Sync), &'static (dyn Fn() + Sync)>(work) };
        *locked(&shared.dealing) = Dealing { work: Some(erased), places: n - 1, panic: None };
        let closing = Closing(shared);
        self.tell(n - 1);
        work();
        drop(closing);
        let panic = locked(&shared.dealing).panic.take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }

    /// Has a member do `job` while the others go on.
    pub fn beside(&self, job: impl FnOnce() + Send + 'static) {
        locked(&self.0.jobs).push_back(Box::new(job));
        self.tell(1);
    }

    /// There is something new for so many members.
    fn tell(&self, n: usize) {
        // A member that leaves at this moment sees the news, or is not counted here.
        self.0.news.fetch_add(1, Ordering::SeqCst);
        for _ in self.0.members.load(Ordering::SeqCst)..n {
            self.0.members.fetch_add(1, Ordering::SeqCst);
            let shared = Arc::clone(&self.0);
            rayon::spawn(move || shared.wait_and_work());
        }
    }
}

impl Shared {
    /// What a member does until it leaves.
    fn wait_and_work(&self) {
        let mut seen = 0;
        let mut since = Instant::now();
        loop {
            let news = self.news.load(Ordering::SeqCst);
            if news != seen {
                seen = news;
                // One that finds no place gets tired: the pool has become smaller.
                if self.do_jobs() | self.take_part() {
                    since = Instant::now();
                }
            } else if since.elapsed() > PATIENCE || look_away() {
                self.members.fetch_sub(1, Ordering::SeqCst);
                if self.news.load(Ordering::SeqCst) == seen {
                    return;
                }
                self.members.fetch_add(1, Ordering::SeqCst);
            }
        }
    }

    /// Does what is to run beside the cycles; says whether there was anything.
    fn do_jobs(&self) -> bool {
        let next = || locked(&self.jobs).pop_front();
        std::iter::from_fn(next).map(|job| job()).count() > 0
    }

    /// Does the work of the dealing, if there still is one with a place; says whether it did.
    fn take_part(&self) -> bool {
        let work = {
            let mut dealing = locked(&self.dealing);
            let Some(work) = dealing.work.filter(|_| dealing.places > 0) else { return false };
            dealing.places -= 1;
            self.at_work.fetch_add(1, Ordering::Relaxed);
            work
        };
        if let Err(panic) = catch_unwind(AssertUnwindSafe(work)) {
            locked(&self.dealing).panic = Some(panic);
        }
        self.at_work.fetch_sub(1, Ordering::Release);
        true
    }
}

/// Ends a dealing, also when its work panics.
struct Closing<'a>(&'a Shared);

impl Drop for Closing<'_> {
    fn drop(&mut self) {
        locked(&self.0.dealing).work = None;
        while self.0.at_work.load(Ordering::Acquire) > 0 {
            look_away();
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What `look` finds, for which it looks as long as a member waits; none if that was in vain.
pub fn awake<T>(mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let since = Instant::now();
    loop {
        match look() {
            None if since.elapsed() <= PATIENCE && !look_away() => {}
            found => return found,
        }
    }
}

/// Waits for very little, and lets other threads have the core; says whether one wanted it.
fn look_away() -> bool {
    (0..PAUSES).for_each(|_| std::hint::spin_loop());
    let from = Instant::now();
    std::thread::yield_now();
    from.elapsed() > CONTENDED
}

impl std::fmt::Debug for Team {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Team").field("members", &self.0.members).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pool(n_threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads")
    }

    /// Pauses of all lengths from none to more than members wait.
    fn pause(dealing: u32) {
        let until = Instant::now() + PATIENCE * (dealing * 7 % 13) / 10;
        while dealing.is_multiple_of(3) && Instant::now() < until {
            std::thread::yield_now();
        }
    }

    #[test]
    fn members_take_part_in_each_dealing_and_never_after_its_end() {
        let teams = [Team::default(), Team::default()];
        pool(4).scope(|scope| {
            // Two threads deal at once.
            for team in &teams {
                scope.spawn(move |_| {
                    for dealing in 0..2000 {
                        let (begun, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
                        let n = 2 + dealing as usize % 3;
                        team.together(n, &|| {
                            begun.fetch_add(1, Ordering::Relaxed);
                            pause(dealing);
                            ended.fetch_add(1, Ordering::Relaxed);
                        });
                        let counts = [begun.into_inner(), ended.into_inner()];
                        assert!((1..=n).contains(&counts[0]) && counts[0] == counts[1], "{counts:?} of {n}");
                        pause(dealing + 1);
                    }
                });
            }
        });
    }

    #[test]
    fn members_come_and_all_leave_when_nothing_is_dealt() {
        let team = Team::default();
        pool(3).install(|| {
            let begun = AtomicUsize::new(0);
            // The calling thread waits for the others within the dealing.
            team.together(3, &|| {
                begun.fetch_add(1, Ordering::SeqCst);
                while begun.load(Ordering::SeqCst) < 3 {
                    std::thread::yield_now();
                }
            });
            assert_eq!(begun.into_inner(), 3);
            while team.0.members.load(Ordering::SeqCst) > 0 {
                std::thread::yield_now();
            }
        });
    }

    #[test]
    fn a_member_does_what_is_to_run_beside_and_helps_again() {
        let team = Team::default();
        pool(2).install(|| {
            let (sender, receiver) = std::sync::mpsc::channel();
            let dealer = rayon::current_thread_index();
            for awake in [false, true] {
                let sender = sender.clone();
                team.beside(move || sender.send(rayon::current_thread_index()).expect("the test waits"));
                let by = receiver.recv().expect("a member does it");
                assert!(by.is_some() && by != dealer, "{by:?}, awake before: {awake}");
                let begun = AtomicUsize::new(0);
                team.together(2, &|| {
                    begun.fetch_add(1, Ordering::SeqCst);
                    while begun.load(Ordering::SeqCst) < 2 {
                        std::thread::yield_now();
                    }
                });
            }
        });
    }

    #[test]
    fn a_panic_of_any_thread_reaches_the_caller_when_all_have_ended() {
        let pool = pool(2);
        for culprit in 0..2 {
            let (team, begun, ended) = (Team::default(), AtomicUsize::new(0), AtomicUsize::new(0));
            let dealt = || {
                team.together(2, &|| {
                    begun.fetch_add(1, Ordering::SeqCst);
                    while begun.load(Ordering::SeqCst) < 2 {
                        std::thread::yield_now();
                    }
                    assert_ne!(rayon::current_thread_index(), Some(culprit), "planted");
                    ended.fetch_add(1, Ordering::SeqCst);
                });
            };
            let caught = pool.install(|| catch_unwind(AssertUnwindSafe(dealt)));
            assert!(caught.is_err());
            assert_eq!(ended.load(Ordering::SeqCst), 1);
            // The next dealing knows nothing of it.
            pool.install(|| team.together(2, &|| ()));
        }
    }
}
