//! SCREEN: the whole terminal as a page of lines, and the keys that are pressed meanwhile.
//!
//! A terminal is what understands the escape sequences of ECMA-48, as those of Linux, macOS and Windows do. Lines that are too
//! long end at its edge. Dropping a screen gives the terminal back as it was.

use std::{
    io::{self, Write},
    time::Duration,
};

use system::terminal::Terminal;

/// The other page of the terminal, without cursor and without wrapping.
const ENTER: &str = "\x1b[?1049h\x1b[?25l\x1b[?7l";
const LEAVE: &str = "\x1b[?7h\x1b[?25h\x1b[?1049l";

/// A colour of letters, as the number of SGR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tint {
    /// Less bright than the rest.
    Soft = 2,
    Red = 31,
    Green = 32,
    Yellow = 33,
    Cyan = 36,
}

impl Tint {
    /// A text in this colour.
    pub fn on(self, text: &str) -> String {
        format!("\x1b[{}m{text}\x1b[0m", self as u8)
    }
}

/// A key that `bolide` knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// `q`, Escape, Ctrl-C, or the end of the keyboard.
    Leave,
    Other,
}

impl Key {
    /// By the bytes that a terminal sends for it.
    fn of(bytes: &[u8]) -> Self {
        match bytes {
            // Keys that begin with Escape send more than it.
            [] | [0x1b] => Self::Leave,
            [0x1b, ..] => Self::Other,
            _ if bytes.iter().any(|byte| matches!(byte, b'q' | 0x03)) => Self::Leave,
            _ => Self::Other,
        }
    }
}

/// The terminal of this process while it shows a page.
pub struct Screen {
    terminal: Terminal,
}

impl Screen {
    /// Takes the terminal.
    ///
    /// # Errors
    /// If there is none, or it refuses.
    pub fn open() -> io::Result<Self> {
        let screen = Self { terminal: Terminal::open()? };
        io::stdout().write_all(ENTER.as_bytes())?;
        Ok(screen)
    }

    /// Its width and height in letters.
    ///
    /// # Errors
    /// If the terminal does not say.
    pub fn size(&self) -> io::Result<(usize, usize)> {
        self.terminal.size()
    }

    /// Shows lines from the top, and nothing below them.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn show(&mut self, lines: &[String]) -> io::Result<()> {
        // One write, so that no half of a page is seen.
        let page = format!("\x1b[H{}\x1b[K\x1b[J", lines.join("\x1b[K\r\n"));
        let mut out = io::stdout().lock();
        out.write_all(page.as_bytes())?;
        out.flush()
    }

    /// The key that is pressed within a time; none if none is.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn key(&self, wait: Duration) -> io::Result<Option<Key>> {
        let mut bytes = [0; 64];
        Ok(self.terminal.read(wait, &mut bytes)?.map(Key::of))
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A terminal that is gone needs nothing back.
        let _ = io::stdout().write_all(LEAVE.as_bytes()).and_then(|()| io::stdout().flush());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escape_leaves_and_an_arrow_does_not() {
        for bytes in ["", "q", "\x1b", "\x03", "xq"] {
            assert_eq!(Key::of(bytes.as_bytes()), Key::Leave, "{bytes:?}");
        }
        for bytes in ["x", "\x1b[A", "\x1bOq", "\r"] {
            assert_eq!(Key::of(bytes.as_bytes()), Key::Other, "{bytes:?}");
        }
    }
}
