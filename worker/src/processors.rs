//! Processors that a process is confined to, as users list them.

use std::{collections::HashSet, fs, path::Path, str::FromStr};

/// Processors of this machine, as in `0,2-3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Processors(Vec<usize>);

impl Processors {
    /// The highest number that is read.
    const LAST: usize = 1023;

    /// Confines this process to them: the calling thread, and all that it starts from now on.
    ///
    /// # Errors
    /// If this machine has none of them.
    pub fn apply(&self) -> Result<(), String> {
        crate::compute::pin(&self.0)
    }
}

/// Cores that this process may use: threads of one core share its arithmetic, so that a second compute thread on it gains nothing. Where
/// the machine does not say which processors share a core, each is one. At most as many as the process has a share of, in
/// a container.
pub fn cores() -> usize {
    let granted = std::thread::available_parallelism().map_or(1, usize::from);
    let allowed = rustix::thread::sched_getaffinity(None)
        .map(|set| (0..=Processors::LAST).filter(|&n| set.is_set(n)).collect::<Vec<_>>());
    let distinct = |allowed: Vec<usize>| cores_among(&allowed, Path::new("/sys/devices/system/cpu"));
    allowed.ok().and_then(distinct).map_or(granted, |cores| cores.clamp(1, granted))
}

/// Number of cores that processors belong to; none if one of them does not say.
fn cores_among(processors: &[usize], folder: &Path) -> Option<usize> {
    let siblings =
        |n: &usize| fs::read_to_string(folder.join(format!("cpu{n}/topology/thread_siblings_list"))).ok();
    Some(processors.iter().map(siblings).collect::<Option<HashSet<String>>>()?.len())
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
    fn threads_of_one_core_count_once() {
        let folder = std::env::temp_dir().join(format!("bolide-cores-{}", std::process::id()));
        for (n, siblings) in [(0, "0,4\n"), (1, "1,5\n"), (4, "0,4\n"), (5, "1,5\n"), (8, "8\n")] {
            let topology = folder.join(format!("cpu{n}/topology"));
            fs::create_dir_all(&topology).expect("a folder");
            fs::write(topology.join("thread_siblings_list"), siblings).expect("a file");
        }
        let found = [&[0, 1, 4, 5, 8][..], &[0, 4], &[1, 8], &[0, 9]].map(|list| cores_among(list, &folder));
        fs::remove_dir_all(&folder).expect("the folder that was made");
        assert_eq!(found, [Some(3), Some(1), Some(2), None]);
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
