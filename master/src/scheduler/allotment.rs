//! Which job may start, and which one a worker is given to that comes while jobs run. It decides and changes nothing.

use std::time::Duration;

use crate::{
    footprint::{self, Bearer},
    queue::Entry,
};

/// Most jobs that run at a time. A job takes all idle workers, so a second one would find only those that come later.
const JOBS_AT_ONCE: usize = 1;
/// How long an interrupted job waits for all of its workers before it goes on with those that are back; later ones are taken
/// in at plan boundaries.
const RETURN_LIMIT: Duration = Duration::from_secs(2);

/// What becomes of the jobs that wait.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Allotments {
    /// The one that starts, on all idle workers.
    pub(super) starts: Option<u32>,
    /// What each of the others waits for.
    pub(super) waits: Vec<(u32, String)>,
}

/// What becomes of the jobs that wait, in the order in which they are to start. One that wants more workers than there are lets those
/// behind it pass; one that was interrupted does not at first, for its workers come back within moments.
pub(super) fn among(
    waiting: &[&Entry],
    running: &[u32],
    idle: &[Bearer<'_>],
    since_start: Duration,
    available: Option<u64>,
) -> Allotments {
    let mut allotments = Allotments::default();
    let mut returns = None;
    for (ahead, entry) in waiting.iter().enumerate() {
        let what = match (of(entry, running, idle, since_start, available), allotments.starts, returns) {
            (Allotment::Start, None, None) => {
                allotments.starts = Some(entry.id);
                continue;
            }
            (Allotment::Start, Some(job), _) | (Allotment::Start, None, Some(job)) => format!("job {job}"),
            (Allotment::Wait(what), ..) if running.is_empty() => what,
            (Allotment::Wait(what), ..) => match ahead {
                0 => what,
                1 => format!("{what}, then 1 job before it"),
                ahead => format!("{what}, then {ahead} jobs before it"),
            },
        };
        if entry.before.is_some() && since_start < RETURN_LIMIT {
            returns = returns.or(Some(entry.id));
        }
        allotments.waits.push((entry.id, what));
    }
    allotments
}

/// What becomes of one job.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Allotment {
    /// It starts on all idle workers.
    Start,
    /// It waits, for this.
    Wait(String),
}

/// What becomes of a job beside those that are `running`, with these workers `idle`, so long after the master's
/// start, with so much memory `available`.
fn of(
    entry: &Entry,
    running: &[u32],
    idle: &[Bearer<'_>],
    since_start: Duration,
    available: Option<u64>,
) -> Allotment {
    if running.len() >= JOBS_AT_ONCE {
        let jobs: Vec<String> = running.iter().map(|job| format!("job {job}")).collect();
        return Allotment::Wait(jobs.join(", "));
    }
    let needed = entry.options.min_workers.max(1) as usize;
    match &entry.before {
        // Any worker will do for what was begun with enough of them.
        Some(at_work) => {
            let all = at_work.len();
            let back = at_work.iter().filter(|name| idle.iter().any(|worker| worker.name == **name)).count();
            if idle.is_empty() || back < all && since_start < RETURN_LIMIT {
                return Allotment::Wait(format!("its workers: {back} of {all} are back"));
            }
        }
        None if idle.len() < needed => {
            let workers = if needed == 1 { "worker" } else { "workers" };
            return Allotment::Wait(format!("{needed} {workers}, {} are idle", idle.len()));
        }
        None => {}
    }
    footprint::shortage(entry.elements, available, idle).map_or(Allotment::Start, Allotment::Wait)
}

/// The job that is given a worker which has just come: of those that run the first; none without any.
pub(super) fn for_newcomer(mut running: impl Iterator<Item = u32>) -> Option<u32> {
    running.next()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use protocol::{options::JobOptions, request::State};

    use super::*;

    fn job(min_workers: u32, before: Option<&[&str]>) -> Entry {
        Entry {
            id: 7,
            name: "deck.toml".to_owned(),
            text: Arc::new(String::new()),
            options: JobOptions { min_workers, ..JobOptions::default() },
            state: State::Queued,
            folder: None,
            before: before.map(|names| names.iter().map(|name| (*name).to_owned()).collect()),
            deck_sum: String::new(),
            starts: crate::queue::Starts::default(),
            cancelled: false,
            elements: 0,
        }
    }

    fn named<'a>(names: &[&'a str]) -> Vec<Bearer<'a>> {
        names.iter().map(|name| Bearer { name, speed: 1.0, memory: 0 }).collect()
    }

    fn waits_for(what: &str) -> Allotment {
        Allotment::Wait(what.to_owned())
    }

    #[test]
    fn a_job_starts_once_enough_workers_are_idle_and_no_other_runs() {
        let (entry, late) = (job(2, None), Duration::from_secs(60));
        assert_eq!(of(&entry, &[], &named(&["a"]), late, None), waits_for("2 workers, 1 are idle"));
        assert_eq!(of(&entry, &[], &named(&["a", "b"]), Duration::ZERO, None), Allotment::Start);
        assert_eq!(of(&entry, &[3], &named(&["a", "b"]), late, None), waits_for("job 3"));
        assert_eq!(of(&job(0, None), &[], &[], late, None), waits_for("1 worker, 0 are idle"));
    }

    #[test]
    fn an_interrupted_job_waits_for_its_workers_a_while_and_then_takes_any() {
        let (entry, soon) = (job(5, Some(&["a", "b"])), Duration::from_secs(1));
        assert_eq!(
            of(&entry, &[], &named(&["a", "x"]), soon, None),
            waits_for("its workers: 1 of 2 are back")
        );
        assert_eq!(of(&entry, &[], &named(&["b", "a"]), soon, None), Allotment::Start);
        assert_eq!(of(&entry, &[], &named(&["x"]), RETURN_LIMIT, None), Allotment::Start);
        assert_eq!(of(&entry, &[], &[], RETURN_LIMIT, None), waits_for("its workers: 0 of 2 are back"));
    }

    #[test]
    fn a_job_that_wants_more_workers_than_there_are_lets_the_next_one_pass() {
        let late = Duration::from_secs(60);
        let of = |id, min_workers, before| Entry { id, ..job(min_workers, before) };
        let (large, small, smaller) = (of(1, 2, None), of(2, 1, None), of(3, 1, None));
        let waiting = [&large, &small, &smaller];
        let said = |pairs: &[(u32, &str)]| pairs.iter().map(|&(id, what)| (id, what.to_owned())).collect();
        assert_eq!(
            among(&waiting, &[], &named(&["a"]), late, None),
            Allotments { starts: Some(2), waits: said(&[(1, "2 workers, 1 are idle"), (3, "job 2")]) }
        );
        assert_eq!(
            among(&waiting, &[], &named(&["a", "b"]), late, None).starts,
            Some(1),
            "it has its turn with two"
        );
        let huge = Entry { elements: 10_000_000, ..of(5, 1, None) };
        let short = among(&[&huge, &small], &[], &named(&["a"]), late, Some(1_000_000_000));
        assert_eq!(short.starts, Some(2));
        assert!(short.waits[0].1.starts_with("memory: 11.1 GB on the master"), "{short:?}");
        let little = Bearer { memory: 1_000_000_000, ..named(&["a"])[0] };
        let short = among(&[&huge, &small], &[], &[little], late, None);
        assert!(
            short.starts == Some(2) && short.waits[0].1.starts_with("memory: 6.0 GB on worker a"),
            "{short:?}"
        );
        assert_eq!(
            among(&waiting, &[7], &[], late, None).waits,
            said(&[(1, "job 7"), (2, "job 7, then 1 job before it"), (3, "job 7, then 2 jobs before it")]),
        );
        let interrupted = of(4, 1, Some(&["a", "b"]));
        assert_eq!(
            among(&[&interrupted, &small], &[], &named(&["a"]), Duration::ZERO, None),
            Allotments { starts: None, waits: said(&[(4, "its workers: 1 of 2 are back"), (2, "job 4")]) },
        );
        assert_eq!(among(&[&interrupted, &small], &[], &named(&["a"]), late, None).starts, Some(4));
        let huge = Entry { elements: 10_000_000, ..of(4, 1, Some(&["a"])) };
        let short = among(&[&huge, &small], &[], &named(&["a"]), late, Some(1_000_000_000));
        assert_eq!(short.starts, Some(2), "one that waits for memory blocks none");
    }

    #[test]
    fn a_newcomer_is_given_to_a_job_that_runs() {
        assert_eq!(for_newcomer([4, 9].into_iter()), Some(4));
        assert_eq!(for_newcomer([].into_iter()), None);
    }
}
