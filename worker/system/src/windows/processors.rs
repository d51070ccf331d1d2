//! Which processors threads may use, and how urgent a thread is.

use std::{collections::HashSet, io};

use windows_sys::Win32::System::{
    SystemInformation::{
        GetLogicalProcessorInformationEx, RelationProcessorCore, SYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX,
    },
    Threading::{
        BELOW_NORMAL_PRIORITY_CLASS, GetCurrentProcess, GetCurrentThread, GetProcessAffinityMask,
        SetPriorityClass, SetProcessAffinityMask, SetThreadPriority, THREAD_PRIORITY_LOWEST,
    },
};

/// Gives the calling thread the lowest priority of the ordinary ones, for good: it runs on what others leave idle. A machine that
/// refuses leaves it as it was.
pub fn lowest_priority() {
    // SAFETY: the handle of the calling thread is always good.
    unsafe {
        SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_LOWEST);
    }
}

/// Gives this process a priority at which it gets little of a processor that another program wants, and all of one that none does.
pub fn low_priority_of_process() {
    // SAFETY: the handle of this process is always good.
    unsafe {
        SetPriorityClass(GetCurrentProcess(), BELOW_NORMAL_PRIORITY_CLASS);
    }
}

/// Confines this process to processors of this machine; it has 64 to choose from, those of its group.
///
/// # Errors
/// If the machine lacks one of them, or refuses.
pub fn pin(processors: &[usize]) -> io::Result<()> {
    let bit = |&n: &usize| u32::try_from(n).ok().and_then(|n| 1_usize.checked_shl(n)).unwrap_or(0);
    let there = masks()?.1;
    let missing = processors.iter().filter(|n| bit(n) & there == 0).count();
    if missing > 0 {
        let why = format!("this process can have {} of them, and not the others", processors.len() - missing);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    }
    let mask = processors.iter().map(bit).fold(0, |mask, bit| mask | bit);
    // SAFETY: the handle of this process is always good.
    let done = unsafe { SetProcessAffinityMask(GetCurrentProcess(), mask) };
    if done == 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// Number of cores that this process may use, however many processors each has; none if the machine does not say.
pub fn n_cores() -> Option<usize> {
    let (allowed, _) = masks().ok()?;
    let cores: HashSet<usize> = cores()?.into_iter().filter(|core| core & allowed != 0).collect();
    (!cores.is_empty()).then_some(cores.len())
}

/// Processors that this process may use, and those that the system has, a bit for each.
fn masks() -> io::Result<(usize, usize)> {
    let (mut own, mut all) = (0, 0);
    // SAFETY: the handle of this process is always good, and the two numbers are ours.
    let done = unsafe { GetProcessAffinityMask(GetCurrentProcess(), &raw mut own, &raw mut all) };
    if done == 0 { Err(io::Error::last_os_error()) } else { Ok((own, all)) }
}

/// Processors of each core of the first group, a bit for each.
fn cores() -> Option<Vec<usize>> {
    let mut bytes = 0_u32;
    // SAFETY: with no room at all the system says how much it needs.
    unsafe { GetLogicalProcessorInformationEx(RelationProcessorCore, std::ptr::null_mut(), &raw mut bytes) };
    // Words, so that the entries are aligned.
    let mut buffer = vec![0_u64; (bytes as usize).div_ceil(8)];
    let first = buffer.as_mut_ptr().cast::<SYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX>();
    // SAFETY: the buffer has as many bytes as it says.
    let done = unsafe { GetLogicalProcessorInformationEx(RelationProcessorCore, first, &raw mut bytes) };
    if done == 0 {
        return None;
    }
    let (mut at, mut cores) = (0_usize, Vec::new());
    while at + size_of::<SYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX>() <= bytes as usize {
        // SAFETY: an entry begins here and ends within the buffer; it is one of a core, which was asked for.
        let (size, group) = unsafe {
            let entry = first.byte_add(at).read_unaligned();
            (entry.Size as usize, entry.Anonymous.Processor.GroupMask[0])
        };
        if group.Group == 0 {
            cores.push(group.Mask);
        }
        at += size.max(8);
    }
    Some(cores)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_told_and_a_processor_that_is_not_there_is_refused() {
        let granted = std::thread::available_parallelism().map_or(1, usize::from);
        assert!(n_cores().is_none_or(|cores| (1..=granted).contains(&cores)), "{:?}", n_cores());
        assert!(pin(&[1023]).is_err());
        pin(&[0]).expect("there is a first one");
        assert_eq!(masks().expect("of this process").0, 1);
    }
}
