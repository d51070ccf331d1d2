//! Processors that a process is confined to, as users list them.

use std::str::FromStr;

/// Processors of this machine, as in `0,2-3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Processors(Vec<usize>);

impl Processors {
    /// The highest number that is read.
    const LAST: usize = 1023;

    /// Confines this process to them: the calling thread, and all that it starts from now on.
    ///
    /// # Errors
    /// If this machine lacks one of them.
    pub fn apply(&self) -> Result<(), String> {
        system::processors::pin(&self.0)
            .map_err(|e| format!("processors {:?}: {e}; `nproc --all` says how many there are", self.0))
    }
}

/// Cores that this process may use: threads of one core share its arithmetic, so that a second compute thread on it gains nothing. Where
/// the machine does not say which processors share a core, each is one. At most as many as the process has a share of, in
/// a container.
pub fn cores() -> usize {
    let granted = std::thread::available_parallelism().map_or(1, usize::from);
    system::processors::n_cores().map_or(granted, |cores| cores.clamp(1, granted))
}

impl FromStr for Processors {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fault = || format!("processors {text:?}: a list of numbers up to {} as in 0,2-3", Self::LAST);
        let number =
            |digits: &str| digits.trim().parse::<usize>().ok().filter(|n| *n <= Self::LAST).ok_or_else(fault);
        let mut processors = Vec::new();
        for range in text.split(',') {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            let (first, last) = (number(first)?, number(last)?);
            if first > last {
                return Err(fault());
            }
            processors.extend(first..=last);
        }
        Ok(Self(processors))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_has_at_least_one_core_and_no_more_than_it_was_granted() {
        let granted = std::thread::available_parallelism().map_or(1, usize::from);
        assert!((1..=granted).contains(&cores()));
    }

    #[test]
    fn lists_are_read_and_faults_say_what_was_read() {
        assert_eq!("0,2-3".parse(), Ok(Processors(vec![0, 2, 3])));
        for text in ["", "a", "3-2", "1024", "0,,1", "-1"] {
            let fault = text.parse::<Processors>().expect_err(text);
            assert!(fault.starts_with(&format!("processors {text:?}: ")), "{fault}");
        }
    }
}
