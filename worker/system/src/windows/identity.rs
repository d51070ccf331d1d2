//! Users as the system writes them: `S-1-5-...`.

use std::{
    io,
    os::windows::io::{AsRawHandle, FromRawHandle, OwnedHandle},
    ptr,
};

use windows_sys::Win32::{
    Foundation::{HANDLE, LocalFree},
    Security::{
        Authorization::ConvertSidToStringSidW, GetTokenInformation, PSID, TOKEN_QUERY, TOKEN_USER, TokenUser,
    },
    System::Threading::{
        GetCurrentProcess, OpenProcess, OpenProcessToken, PROCESS_QUERY_LIMITED_INFORMATION,
    },
};

/// The system itself, and those who administer the machine.
pub const ADMINISTRATORS: [&str; 2] = ["S-1-5-18", "S-1-5-32-544"];
/// Stands in a list for whoever owns the file.
pub const OWNER: &str = "S-1-3-4";

/// The user of this process.
pub fn own() -> io::Result<String> {
    // SAFETY: the handle of this process is always good.
    user_of(unsafe { GetCurrentProcess() })
}

/// The user of a process.
///
/// # Errors
/// Of another user's the system may say nothing.
pub fn of_process(number: u32) -> io::Result<String> {
    // SAFETY: a number that is no process's is refused; the handle is then ours to close.
    let process = unsafe {
        let process = OpenProcess(PROCESS_QUERY_LIMITED_INFORMATION, 0, number);
        if process.is_null() {
            return Err(io::Error::last_os_error());
        }
        OwnedHandle::from_raw_handle(process)
    };
    user_of(process.as_raw_handle())
}

fn user_of(process: HANDLE) -> io::Result<String> {
    let mut token: HANDLE = ptr::null_mut();
    // SAFETY: the caller has the process open; the token is ours to close.
    let token = unsafe {
        if OpenProcessToken(process, TOKEN_QUERY, &raw mut token) == 0 {
            return Err(io::Error::last_os_error());
        }
        OwnedHandle::from_raw_handle(token)
    };
    // A name has at most 68 bytes.
    let mut buffer = [0_u64; 32];
    let (room, mut used) = (size_of_val(&buffer) as u32, 0);
    // SAFETY: the buffer has the room that is told, and is aligned for what the system writes: a `TOKEN_USER` and its name behind.
    unsafe {
        let done = GetTokenInformation(
            token.as_raw_handle(),
            TokenUser,
            buffer.as_mut_ptr().cast(),
            room,
            &raw mut used,
        );
        if done == 0 {
            return Err(io::Error::last_os_error());
        }
        written((*buffer.as_ptr().cast::<TOKEN_USER>()).User.Sid)
    }
}

/// A name of the system in its written form.
///
/// # Safety
/// It must point to one.
pub unsafe fn written(sid: PSID) -> io::Result<String> {
    let mut text = ptr::null_mut();
    // SAFETY: the caller says that it is a name; the text ends in a zero and is ours to free.
    unsafe {
        if ConvertSidToStringSidW(sid, &raw mut text) == 0 {
            return Err(io::Error::last_os_error());
        }
        let mut length = 0;
        while *text.add(length) != 0 {
            length += 1;
        }
        let copy = String::from_utf16_lossy(std::slice::from_raw_parts(text, length));
        LocalFree(text.cast());
        Ok(copy)
    }
}
