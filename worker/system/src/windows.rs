//! Windows from version 10 on.

pub mod allocator;
pub mod callers;
pub mod children;
pub mod clock;
pub mod files;
pub mod folders;
pub mod host;
mod identity;
pub mod interrupts;
pub mod memory;
pub mod notice;
pub mod owner;
pub mod private;
pub mod processors;
mod registry;
pub mod service;
pub mod terminal;

pub use crate::unshared as shared;
