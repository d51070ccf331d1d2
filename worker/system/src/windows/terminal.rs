//! Keys one by one, and the size of the screen.

use std::{io, time::Duration};

use windows_sys::Win32::{
    Foundation::{HANDLE, WAIT_OBJECT_0, WAIT_TIMEOUT},
    System::{
        Console::{
            CONSOLE_SCREEN_BUFFER_INFO, DISABLE_NEWLINE_AUTO_RETURN, ENABLE_PROCESSED_OUTPUT,
            ENABLE_VIRTUAL_TERMINAL_INPUT, ENABLE_VIRTUAL_TERMINAL_PROCESSING, GetConsoleMode,
            GetConsoleScreenBufferInfo, GetNumberOfConsoleInputEvents, GetStdHandle, INPUT_RECORD, KEY_EVENT,
            ReadConsoleInputW, STD_INPUT_HANDLE, STD_OUTPUT_HANDLE, SetConsoleMode,
        },
        Threading::WaitForSingleObject,
    },
};

/// Events of the console that are read at a time.
const EVENTS: usize = 32;

/// The console of this process while it gives keys as they are pressed. Dropping it gives it back as it was.
pub struct Terminal {
    keyboard: HANDLE,
    screen: HANDLE,
    /// Modes of both before.
    before: [u32; 2],
}

impl Terminal {
    /// Takes the console: it understands the escape sequences of ECMA-48 from now on.
    ///
    /// # Errors
    /// If there is none, or it refuses.
    pub fn open() -> io::Result<Self> {
        // SAFETY: standard handles live as long as the process; one that is none is refused below.
        let (keyboard, screen) = unsafe { (GetStdHandle(STD_INPUT_HANDLE), GetStdHandle(STD_OUTPUT_HANDLE)) };
        let terminal = Self { keyboard, screen, before: [mode(keyboard)?, mode(screen)?] };
        set_mode(keyboard, ENABLE_VIRTUAL_TERMINAL_INPUT)?;
        let shows =
            ENABLE_PROCESSED_OUTPUT | ENABLE_VIRTUAL_TERMINAL_PROCESSING | DISABLE_NEWLINE_AUTO_RETURN;
        set_mode(screen, terminal.before[1] | shows)?;
        Ok(terminal)
    }

    /// Its width and height in letters.
    ///
    /// # Errors
    /// If it does not say.
    pub fn size(&self) -> io::Result<(usize, usize)> {
        let mut info = CONSOLE_SCREEN_BUFFER_INFO::default();
        // SAFETY: a handle that is no console's is refused; the structure is ours.
        done(unsafe { GetConsoleScreenBufferInfo(self.screen, &raw mut info) })?;
        let length = |from: i16, to: i16| usize::try_from(i32::from(to) - i32::from(from) + 1).unwrap_or(0);
        let window = info.srWindow;
        Ok((length(window.Left, window.Right), length(window.Top, window.Bottom)))
    }

    /// The bytes of keys that are pressed within a time; none if none is.
    ///
    /// # Errors
    /// If the console is gone.
    pub fn read<'a>(&self, wait: Duration, bytes: &'a mut [u8]) -> io::Result<Option<&'a [u8]>> {
        let wait = u32::try_from(wait.as_millis()).unwrap_or(u32::MAX - 1);
        // SAFETY: a handle that is gone is refused.
        match unsafe { WaitForSingleObject(self.keyboard, wait) } {
            WAIT_OBJECT_0 => {}
            WAIT_TIMEOUT => return Ok(None),
            _ => return Err(io::Error::last_os_error()),
        }
        let mut letters = Vec::new();
        for event in self.events()? {
            if u32::from(event.EventType) != KEY_EVENT {
                continue;
            }
            // SAFETY: its type says that it is a key's, and a key's letter is one of UTF-16 in what `ReadConsoleInputW` gives.
            let (down, letter) =
                unsafe { (event.Event.KeyEvent.bKeyDown, event.Event.KeyEvent.uChar.UnicodeChar) };
            if down != 0 && letter != 0 {
                letters.push(letter);
            }
        }
        let text = String::from_utf16_lossy(&letters);
        let n = text.len().min(bytes.len());
        bytes[..n].copy_from_slice(&text.as_bytes()[..n]);
        // Keys that are let go, the mouse and other windows are events as well.
        Ok((n > 0).then_some(&bytes[..n]))
    }

    /// Takes the events that wait, at most [`EVENTS`].
    fn events(&self) -> io::Result<Vec<INPUT_RECORD>> {
        let (mut waiting, mut n) = (0, 0);
        // SAFETY: a handle that is gone is refused; the number is ours.
        done(unsafe { GetNumberOfConsoleInputEvents(self.keyboard, &raw mut waiting) })?;
        let mut events = vec![INPUT_RECORD::default(); (waiting as usize).clamp(1, EVENTS)];
        // SAFETY: there is room for as many events as are asked for; the system says how many it wrote.
        done(unsafe {
            ReadConsoleInputW(self.keyboard, events.as_mut_ptr(), events.len() as u32, &raw mut n)
        })?;
        events.truncate(n as usize);
        Ok(events)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // A console that is gone needs nothing back.
        let _ = set_mode(self.keyboard, self.before[0]).and_then(|()| set_mode(self.screen, self.before[1]));
    }
}

fn mode(of: HANDLE) -> io::Result<u32> {
    let mut mode = 0;
    // SAFETY: a handle that is no console's is refused; the number is ours.
    done(unsafe { GetConsoleMode(of, &raw mut mode) })?;
    Ok(mode)
}

fn set_mode(of: HANDLE, mode: u32) -> io::Result<()> {
    // SAFETY: a handle that is no console's is refused.
    done(unsafe { SetConsoleMode(of, mode) })
}

fn done(result: i32) -> io::Result<()> {
    if result == 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}
