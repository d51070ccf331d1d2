//! FOOTPRINT: the memory that a job takes of its master and its workers, and what they have.
//!
//! The figures are measured, with contact and states: the peak of a master with jobs of 252,000 and 1,100,000 elements rises by
//! 1,037 bytes for each element, its worker's by 528. What a host has it says itself: the master looks when a job is to start, a worker when
//! it calls.

pub use system::memory::available;
use system::memory::whole;

/// What a master takes for an element of a job, at its peak (bytes).
const OF_ELEMENT: u64 = 1_100;
/// What it takes for any job (bytes).
const OF_JOB: u64 = 64 << 20;
/// What a worker takes for an element of its share, at its peak (bytes).
const OF_ELEMENT_OF_WORKER: u64 = 600;
/// What it takes for any share (bytes).
const OF_SHARE: u64 = 32 << 20;

/// A worker that may take a share of a job.
#[derive(Clone, Copy, Debug)]
pub struct Bearer<'a> {
    pub name: &'a str,
    /// Relative speed: elements are dealt in proportion to it.
    pub speed: f64,
    /// What its process may take (bytes); 0 if it does not say.
    pub memory: u64,
}

/// What a share of so many elements takes of its worker, at its peak (bytes).
pub const fn of_share(elements: u64) -> u64 {
    OF_SHARE.saturating_add(elements.saturating_mul(OF_ELEMENT_OF_WORKER))
}

/// What a job of so many elements takes of its master, at its peak (bytes).
pub const fn of_job(elements: u64) -> u64 {
    OF_JOB.saturating_add(elements.saturating_mul(OF_ELEMENT))
}

/// Most elements of a job that this host could ever run; none where the system does not say what it has.
pub fn most_elements() -> Option<u64> {
    Some(whole()?.saturating_sub(OF_JOB) / OF_ELEMENT)
}

/// What a job waits for that this host, which has so much `available`, or one of the workers has no memory for now, in words.
pub fn shortage(elements: u64, available: Option<u64>, workers: &[Bearer<'_>]) -> Option<String> {
    let needed = of_job(elements);
    match available {
        Some(available) if needed > available => Some(format!(
            "memory: {:.1} GB on the master for {elements} elements, {:.1} GB are available",
            gigabytes(needed),
            gigabytes(available)
        )),
        _ => shortage_of_worker(elements, workers),
    }
}

/// The same of the first worker whose share does not fit.
fn shortage_of_worker(elements: u64, workers: &[Bearer<'_>]) -> Option<String> {
    let all: f64 = workers.iter().map(|worker| worker.speed).sum();
    workers.iter().filter(|worker| worker.memory > 0).find_map(|worker| {
        let share = (elements as f64 * worker.speed / all).ceil() as u64;
        let needed = of_share(share);
        (needed > worker.memory).then(|| {
            format!(
                "memory: {:.1} GB on worker {} for its {share} of {elements} elements, {:.1} GB were available when it called; \
                 start more workers, or this one with a lower --speed",
                gigabytes(needed),
                worker.name,
                gigabytes(worker.memory)
            )
        })
    })
}

pub fn gigabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_waits_for_memory_with_both_numbers() {
        assert_eq!(shortage(1_000_000, None, &[]), None, "who does not know does not refuse");
        assert_eq!(shortage(1_000_000, Some(2_000_000_000), &[]), None);
        assert_eq!(
            shortage(3_000_000, Some(700_000_000), &[]).as_deref(),
            Some("memory: 3.4 GB on the master for 3000000 elements, 0.7 GB are available")
        );
    }

    #[test]
    fn each_worker_needs_memory_for_its_share_by_speed() {
        let worker = |name, speed, memory| Bearer { name, speed, memory };
        let (small, large) = (worker("a", 1.0, 1_000_000_000), worker("b", 3.0, 4_000_000_000));
        assert_eq!(shortage(4_000_000, None, &[small, large]), None);
        let alone = shortage(4_000_000, None, &[small]).expect("2.4 GB do not fit");
        assert!(
            alone.starts_with(
                "memory: 2.4 GB on worker a for its 4000000 of 4000000 elements, 1.0 GB were available"
            ),
            "{alone}"
        );
        assert_eq!(shortage(4_000_000, None, &[worker("c", 1.0, 0)]), None, "it does not say what it has");
    }

    #[test]
    fn the_largest_job_fits_on_this_host() {
        let whole = whole().expect("Linux");
        assert!(most_elements().is_some_and(|most| of_job(most) <= whole));
    }
}
