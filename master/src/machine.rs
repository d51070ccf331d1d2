//! This machine, and now.

use time::OffsetDateTime;
use tracing::warn;

pub fn host_name() -> String {
    let name = system::host::name();
    let plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name: String = name.trim().chars().filter(plain).take(40).collect();
    if name.is_empty() { "localhost".to_owned() } else { name }
}

/// Name, kind of system and cores of this machine, as a reader of results is told.
pub fn words() -> String {
    let (system, kind) = (std::env::consts::OS, std::env::consts::ARCH);
    format!("{}, {system} {kind}, {} cores", host_name(), worker::processors::cores())
}

/// Compute threads for each core from which on a mistake is likelier than a wish.
const MOST_THREADS: usize = 4;

/// Warns of compute threads that are far more than this machine has cores for.
pub fn warn_of_threads(threads: usize) {
    if let Some(words) = of_threads(threads, worker::processors::cores()) {
        warn!("{words}");
    }
}

fn of_threads(threads: usize, cores: usize) -> Option<String> {
    (threads > MOST_THREADS * cores).then(|| {
        format!("{threads} compute threads take turns on {cores} cores, which slows a run down; --threads {cores} uses all of them")
    })
}

/// The present date and time in words, UTC: `2026-11-25 16:40 UTC`.
pub fn now() -> String {
    let now = OffsetDateTime::now_utc();
    let (year, month, day) = now.to_calendar_date();
    format!("{year}-{:02}-{day:02} {:02}:{:02} UTC", u8::from(month), now.hour(), now.minute())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_threads_far_above_the_cores_are_warned_of() {
        assert_eq!(of_threads(8, 2), None);
        let words = of_threads(9, 2).expect("more than four for each core");
        assert!(words.starts_with("9 compute threads take turns on 2 cores"), "{words}");
    }
}
