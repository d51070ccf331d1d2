//! Linux, and as far as their means are the same other Unixes.

pub mod allocator;
pub mod callers;
pub mod children;
pub mod clock;
pub mod files;
pub mod folders;
pub mod host;
pub mod interrupts;
pub mod memory;
pub mod notice;
pub mod owner;
pub mod private;
pub mod processors;
pub mod service;
#[cfg(target_os = "linux")]
pub mod shared;
pub mod terminal;

#[cfg(not(target_os = "linux"))]
pub use crate::unshared as shared;
