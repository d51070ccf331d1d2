//! Memory that two processes have in common, as Linux has it: a file without a name, sealed at its length.
//!
//! The file is in no folder, so nothing is left behind however its processes end, and no `/dev/shm` can be too small for it.
//! The other process opens it through `/proc`, which lets in its own user's processes only. As neither side can shorten it,
//! memory that is mapped stays there.

use std::{
    fs::File,
    io,
    os::{
        fd::{AsRawFd, OwnedFd},
        unix::fs::{MetadataExt, OpenOptionsExt},
    },
    path::Path,
    ptr::NonNull,
    sync::atomic::{AtomicU32, AtomicU64},
};

use rustix::{
    fs::{MemfdFlags, OFlags, SealFlags, fcntl_add_seals, fcntl_get_seals, ftruncate, memfd_create},
    mm::{MapFlags, ProtFlags, mmap, munmap},
};

/// Whether this system has such memory.
pub const IS_THERE: bool = true;

/// What the system calls it in lists of mappings.
const NAME: &str = "bolide-link";

/// Its length cannot change.
const SEALED: SealFlags = SealFlags::SHRINK.union(SealFlags::GROW);

/// Memory of this process and another one, mapped until this value is dropped.
pub struct Shared {
    start: NonNull<u8>,
    bytes: usize,
}

// SAFETY: the mapping belongs to no thread; what may be done to its bytes at the same time is said where it is done.
unsafe impl Send for Shared {}
// SAFETY: as above; shared references give atomics, and copies whose callers promise that nobody else here is at those bytes.
unsafe impl Sync for Shared {}

impl Shared {
    fn map(file: &OwnedFd, bytes: usize) -> io::Result<Self> {
        let rights = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: the system chooses where, so no memory of this process is replaced.
        let start = unsafe { mmap(std::ptr::null_mut(), bytes, rights, MapFlags::SHARED, file, 0) }?;
        let start = NonNull::new(start.cast()).ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Self { start, bytes })
    }

    pub const fn bytes(&self) -> usize {
        self.bytes
    }

    /// The number at a place, which is the caller's own choice and never the other process's.
    ///
    /// # Panics
    /// Beyond the end, or not at a multiple of 8.
    pub fn number(&self, at: usize) -> &AtomicU64 {
        assert!(at.is_multiple_of(8) && at + 8 <= self.bytes, "number at {at} of {}", self.bytes);
        // SAFETY: within the mapping and aligned, as a mapping starts at a page; atomics may be changed by anybody at any time.
        unsafe { self.start.add(at).cast().as_ref() }
    }

    /// The same of a word of 32 bits.
    ///
    /// # Panics
    /// Beyond the end, or not at a multiple of 4.
    pub fn word(&self, at: usize) -> &AtomicU32 {
        assert!(at.is_multiple_of(4) && at + 4 <= self.bytes, "word at {at} of {}", self.bytes);
        // SAFETY: as in `number`.
        unsafe { self.start.add(at).cast().as_ref() }
    }

    /// Copies bytes to a place.
    ///
    /// # Safety
    /// Nobody in this process is at those bytes meanwhile. What the other process does to them changes values only.
    ///
    /// # Panics
    /// Beyond the end.
    pub unsafe fn put(&self, at: usize, from: &[u8]) {
        assert!(at <= self.bytes && from.len() <= self.bytes - at, "{} bytes at {at}", from.len());
        // SAFETY: within the mapping, and `from` is memory of this process alone; the caller promises the rest.
        unsafe { std::ptr::copy_nonoverlapping(from.as_ptr(), self.start.add(at).as_ptr(), from.len()) }
    }

    /// Copies bytes from a place.
    ///
    /// # Safety
    /// As for [`Shared::put`].
    ///
    /// # Panics
    /// Beyond the end.
    pub unsafe fn take(&self, at: usize, into: &mut [u8]) {
        assert!(at <= self.bytes && into.len() <= self.bytes - at, "{} bytes at {at}", into.len());
        // SAFETY: within the mapping, and `into` is memory of this process alone; the caller promises the rest.
        unsafe { std::ptr::copy_nonoverlapping(self.start.add(at).as_ptr(), into.as_mut_ptr(), into.len()) }
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: it was mapped with this length, and all that refers to it borrows from this value. It fails only for
        // addresses that were never mapped.
        let _ = unsafe { munmap(self.start.as_ptr().cast(), self.bytes) };
    }
}

/// Memory that this process has made, and that another may open while this value lives.
pub struct Made {
    pub shared: Shared,
    file: OwnedFd,
}

impl Made {
    /// By which number of this process the other opens it.
    pub fn number(&self) -> u32 {
        self.file.as_raw_fd().unsigned_abs()
    }
}

/// Makes memory full of zeros.
///
/// # Errors
/// If the system gives none.
pub fn make(bytes: usize) -> io::Result<Made> {
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    // Kernels before 6.3 do not know the flag, later ones may ask for it.
    let file = memfd_create(NAME, flags | MemfdFlags::NOEXEC_SEAL).or_else(|_| memfd_create(NAME, flags))?;
    ftruncate(&file, bytes as u64)?;
    fcntl_add_seals(&file, SEALED | SealFlags::SEAL)?;
    Ok(Made { shared: Shared::map(&file, bytes)?, file })
}

/// Opens what another process of this user has made, by its id and its number. The file may be any: the other side has
/// still to prove that it is the one it meant.
///
/// # Errors
/// If there is none, or it is not what [`make`] makes of this length.
pub fn open(process: u32, number: u32, bytes: usize) -> io::Result<Shared> {
    open_at(Path::new(&format!("/proc/{process}/fd/{number}")), bytes)
}

fn open_at(path: &Path, bytes: usize) -> io::Result<Shared> {
    let wrong = |why: &str| io::Error::new(io::ErrorKind::InvalidData, format!("{}: {why}", path.display()));
    let user = rustix::process::geteuid().as_raw();
    let check = |found: std::fs::Metadata| match found {
        found if !found.is_file() => Err(wrong("no file")),
        found if found.uid() != user => Err(wrong("another user's file")),
        found if found.len() != bytes as u64 => Err(wrong("a file of another length")),
        _ => Ok(()),
    };
    // Opening what is no file may do something, so it is looked at before; it may be another one afterwards.
    check(std::fs::metadata(path)?)?;
    let flags = (OFlags::NONBLOCK | OFlags::NOCTTY).bits().cast_signed();
    let file = File::options().read(true).write(true).custom_flags(flags).open(path)?;
    check(file.metadata()?)?;
    let file = OwnedFd::from(file);
    if !fcntl_get_seals(&file).is_ok_and(|seals| seals.contains(SEALED)) {
        return Err(wrong("a file that may become shorter"));
    }
    Shared::map(&file, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::Ordering::Relaxed;

    const BYTES: usize = 1 << 16;

    #[test]
    fn what_one_mapping_says_another_hears() {
        let made = make(BYTES).expect("memory");
        let other = open(std::process::id(), made.number(), BYTES).expect("made a moment ago");
        made.shared.number(8).store(7, Relaxed);
        made.shared.word(BYTES - 4).store(9, Relaxed);
        assert_eq!((other.number(8).load(Relaxed), other.word(BYTES - 4).load(Relaxed)), (7, 9));
        let mut back = [0; 3];
        // SAFETY: there is one thread.
        unsafe {
            other.put(BYTES - 7, &[1, 2, 3]);
            made.shared.take(BYTES - 7, &mut back);
        }
        assert_eq!(back, [1, 2, 3]);
        // It outlives the file and its maker.
        drop(made);
        assert_eq!(other.number(8).load(Relaxed), 7);
    }

    #[test]
    fn nobody_shortens_it() {
        let made = make(BYTES).expect("memory");
        assert!(ftruncate(&made.file, 0).is_err() && ftruncate(&made.file, 2 * BYTES as u64).is_err());
        assert!(fcntl_add_seals(&made.file, SealFlags::WRITE).is_err(), "nor makes it read-only");
    }

    #[test]
    fn other_files_are_refused() {
        let refused = |path: &Path| open_at(path, BYTES).err().expect("refused").to_string();
        let made = make(BYTES).expect("memory");
        let error = open(std::process::id(), made.number(), 2 * BYTES).err().expect("refused");
        assert!(error.to_string().contains("another length"), "{error}");
        let folder = tempfile::tempdir().expect("a folder");
        assert!(refused(folder.path()).contains("no file"));
        assert!(refused(Path::new("/dev/null")).contains("no file"));
        let plain = folder.path().join("plain");
        std::fs::write(&plain, vec![0; BYTES]).expect("written");
        assert!(refused(&plain).contains("a file that may become shorter"));
        let unsealed = memfd_create("unsealed", MemfdFlags::CLOEXEC).expect("memory");
        ftruncate(&unsealed, BYTES as u64).expect("zeros");
        let path = format!("/proc/self/fd/{}", unsealed.as_raw_fd());
        assert!(refused(Path::new(&path)).contains("a file that may become shorter"));
        assert!(open(std::process::id(), u32::MAX, BYTES).is_err());
    }
}
