//! Memory that two processes have in common, on systems where it is not used: there is never any.

use std::{
    io,
    sync::atomic::{AtomicU32, AtomicU64},
};

/// Whether this system has such memory.
pub const IS_THERE: bool = false;

/// Memory of this process and another one.
pub enum Shared {}

impl Shared {
    pub const fn bytes(&self) -> usize {
        match *self {}
    }

    /// The number at a place.
    pub const fn number(&self, _at: usize) -> &AtomicU64 {
        match *self {}
    }

    /// The same of a word of 32 bits.
    pub const fn word(&self, _at: usize) -> &AtomicU32 {
        match *self {}
    }

    /// Copies bytes to a place.
    ///
    /// # Safety
    /// There is no such memory.
    pub const unsafe fn put(&self, _at: usize, _from: &[u8]) {
        match *self {}
    }

    /// Copies bytes from a place.
    ///
    /// # Safety
    /// There is no such memory.
    pub const unsafe fn take(&self, _at: usize, _into: &mut [u8]) {
        match *self {}
    }
}

/// Memory that this process has made.
pub struct Made {
    pub shared: Shared,
}

impl Made {
    /// By which number of this process another opens it.
    pub const fn number(&self) -> u32 {
        match self.shared {}
    }
}

/// Makes memory.
///
/// # Errors
/// Always.
pub fn make(_bytes: usize) -> io::Result<Made> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Opens what another process has made.
///
/// # Errors
/// Always.
pub fn open(_process: u32, _number: u32, _bytes: usize) -> io::Result<Shared> {
    Err(io::ErrorKind::Unsupported.into())
}
