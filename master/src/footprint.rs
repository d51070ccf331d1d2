//! FOOTPRINT: the memory that a job takes of its master, and what this host has.
//!
//! The figures are measured, with contact and states: the peak of a master with jobs of 252,000 and 1,100,000 elements rises by
//! 1,037 bytes for each element (its worker's by 528).

pub use system::memory::available;
use system::memory::whole;

/// What a master takes for an element of a job, at its peak (bytes).
const OF_ELEMENT: u64 = 1_100;
/// What it takes for any job (bytes).
const OF_JOB: u64 = 64 << 20;

/// What a job of so many elements takes of its master, at its peak (bytes).
pub const fn of_job(elements: u64) -> u64 {
    OF_JOB.saturating_add(elements.saturating_mul(OF_ELEMENT))
}

/// Most elements of a job that this host could ever run; none where the system does not say what it has.
pub fn most_elements() -> Option<u64> {
    Some(whole()?.saturating_sub(OF_JOB) / OF_ELEMENT)
}

/// What a job waits for that this host has no memory for now, in words.
pub fn shortage(elements: u64, available: Option<u64>) -> Option<String> {
    let (needed, available) = (of_job(elements), available?);
    let gigabytes = |bytes: u64| bytes as f64 / 1e9;
    (needed > available).then(|| {
        format!(
            "memory: {:.1} GB on the master for {elements} elements, {:.1} GB are available",
            gigabytes(needed),
            gigabytes(available)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_waits_for_memory_with_both_numbers() {
        assert_eq!(shortage(1_000_000, None), None, "who does not know does not refuse");
        assert_eq!(shortage(1_000_000, Some(2_000_000_000)), None);
        assert_eq!(
            shortage(3_000_000, Some(700_000_000)).as_deref(),
            Some("memory: 3.4 GB on the master for 3000000 elements, 0.7 GB are available")
        );
    }

    #[test]
    fn this_host_says_what_it_has() {
        let (whole, available) = (whole().expect("Linux"), available().expect("Linux"));
        assert!(available <= whole && available > 0, "{available} of {whole}");
        assert!(most_elements().is_some_and(|most| of_job(most) <= whole));
    }
}
