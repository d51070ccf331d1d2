//! Keys one by one, and the size of the screen.

use std::{io, time::Duration};

use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    termios::{OptionalActions, Termios, tcgetattr, tcgetwinsize, tcsetattr},
};

/// The terminal of this process while it gives keys as they are pressed. Dropping it gives it back as it was.
pub struct Terminal {
    before: Termios,
}

impl Terminal {
    /// Takes the terminal: it understands the escape sequences of ECMA-48 from now on.
    ///
    /// # Errors
    /// If there is none, or it refuses.
    pub fn open() -> io::Result<Self> {
        let before = tcgetattr(io::stdin())?;
        let mut raw = before.clone();
        raw.make_raw();
        tcsetattr(io::stdin(), OptionalActions::Now, &raw)?;
        Ok(Self { before })
    }

    /// Its width and height in letters.
    ///
    /// # Errors
    /// If it does not say.
    pub fn size(&self) -> io::Result<(usize, usize)> {
        let size = tcgetwinsize(io::stdout())?;
        Ok((usize::from(size.ws_col), usize::from(size.ws_row)))
    }

    /// The bytes of keys that are pressed within a time; none if none is, an empty slice at the end of the keyboard.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn read<'a>(&self, wait: Duration, bytes: &'a mut [u8]) -> io::Result<Option<&'a [u8]>> {
        let stdin = io::stdin();
        let mut watched = [PollFd::new(&stdin, PollFlags::IN)];
        let wait = Timespec { tv_sec: wait.as_secs() as i64, tv_nsec: i64::from(wait.subsec_nanos()) };
        match poll(&mut watched, Some(&wait)) {
            Ok(0) | Err(rustix::io::Errno::INTR) => return Ok(None),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        let n = rustix::io::read(&stdin, &mut *bytes)?;
        Ok(Some(&bytes[..n]))
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // A terminal that is gone needs nothing back.
        let _ = tcsetattr(io::stdin(), OptionalActions::Now, &self.before);
    }
}
