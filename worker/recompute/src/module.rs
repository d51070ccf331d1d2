//! The module as a browser or Node calls it: a place for the block file, a call, a place with the answer.
//!
//! 1. `input(length)` gives the address of so many bytes, which the caller fills;
//! 2. `compute()` gives the length of the answer, a line of JSON as [`crate::answer`] has it;
//! 3. `output()` gives the address of the answer.
//!
//! A fault that nobody foresaw ends the call as a trap, which the caller is told.

use std::sync::Mutex;

static INPUT: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static OUTPUT: Mutex<String> = Mutex::new(String::new());

/// Room for a block file of this length (bytes); null if it is over the limit.
// SAFETY: no other function of this name is linked.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    if length > crate::LIMIT {
        return std::ptr::null_mut();
    }
    let Ok(mut input) = INPUT.lock() else { return std::ptr::null_mut() };
    *input = vec![0; length];
    input.as_mut_ptr()
}

/// Computes what was put in; gives the length of the answer (bytes).
// SAFETY: no other function of this name is linked.
#[unsafe(no_mangle)]
pub extern "C" fn compute() -> usize {
    let (Ok(mut input), Ok(mut output)) = (INPUT.lock(), OUTPUT.lock()) else { return 0 };
    *output = crate::answer(&std::mem::take(&mut *input));
    output.len()
}

/// Where the answer stands.
// SAFETY: no other function of this name is linked.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    OUTPUT.lock().map_or(std::ptr::null(), |output| output.as_ptr())
}
