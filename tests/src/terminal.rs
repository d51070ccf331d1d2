//! TERMINAL: what a program that draws on a terminal shows, as text and as SVG.
//!
//! The program runs under `script` on a pseudo-terminal of a fixed size; a small interpreter of its control sequences
//! (cursor, colours, clearing: what full-screen programs send) keeps the cells of the screen.

use std::{
    fmt::Write as _,
    io::{Read, Write as _},
    process::{Child, ChildStdin, Command, Stdio},
    sync::{Arc, Mutex, PoisonError},
};

use crate::cluster::until;

/// A character and how it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell {
    letter: char,
    style: Style,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Style {
    /// One of the eight colours.
    colour: Option<u8>,
    dim: bool,
    bold: bool,
}

/// The cells of a screen.
#[derive(Clone, Debug)]
pub struct Screen {
    columns: usize,
    cells: Vec<Cell>,
    row: usize,
    column: usize,
    style: Style,
    /// Bytes of a sequence or letter that is not whole yet.
    rest: Vec<u8>,
}

impl Screen {
    const EMPTY: Cell = Cell { letter: ' ', style: Style { colour: None, dim: false, bold: false } };

    /// An empty one.
    pub fn new(columns: usize, rows: usize) -> Self {
        let cells = vec![Self::EMPTY; columns * rows];
        Self { columns, cells, row: 0, column: 0, style: Style::default(), rest: Vec::new() }
    }

    /// Takes what the program sent.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.rest.extend_from_slice(bytes);
        let bytes = std::mem::take(&mut self.rest);
        let mut at = 0;
        while at < bytes.len() {
            match self.one(&bytes[at..]) {
                Some(n) => at += n,
                None => break,
            }
        }
        self.rest = bytes[at..].to_vec();
    }

    /// The rows, without blanks at their ends.
    pub fn text(&self) -> String {
        let rows = self.cells.chunks(self.columns);
        let lines =
            rows.map(|row| row.iter().map(|cell| cell.letter).collect::<String>().trim_end().to_owned());
        lines.collect::<Vec<_>>().join("\n")
    }

    /// A picture.
    pub fn svg(&self) -> String {
        const COLOURS: [&str; 8] =
            ["#000000", "#f47067", "#6bc46d", "#daaa3f", "#6cb6ff", "#dcbdfb", "#56d4dd", "#cdd9e5"];
        let rows = self.cells.len() / self.columns;
        let (wide, high) = (8.4 * self.columns as f64 + 24.0, 19.0 * rows as f64 + 24.0);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide}\" height=\"{high}\" viewBox=\"0 0 {wide} {high}\">\n\
             <rect width=\"100%\" height=\"100%\" rx=\"6\" fill=\"#1c2128\"/>\n\
             <g font-family=\"DejaVu Sans Mono, monospace\" font-size=\"14\">\n"
        );
        for (row, cells) in self.cells.chunks(self.columns).enumerate() {
            let mut column = 0;
            for run in cells.chunk_by(|a, b| a.style == b.style) {
                let letters: String = run.iter().map(|cell| cell.letter).collect();
                let Style { colour, dim, bold } = run[0].style;
                let fill = COLOURS[usize::from(colour.unwrap_or(7)) % COLOURS.len()];
                let soft = if dim { " opacity=\"0.6\"" } else { "" };
                let weight = if bold { " font-weight=\"bold\"" } else { "" };
                let (x, y) = (12.0 + 8.4 * column as f64, 27.0 + 19.0 * row as f64);
                // Several blanks in a row stay several only if they are hard ones.
                let letters = letters.replace('&', "&amp;").replace('<', "&lt;").replace(' ', "\u{a0}");
                if !letters.trim_matches('\u{a0}').is_empty() {
                    // Writing to a text cannot fail.
                    let _ = writeln!(
                        svg,
                        "<text x=\"{x:.1}\" y=\"{y}\" textLength=\"{:.1}\" fill=\"{fill}\"{soft}{weight}>{letters}</text>",
                        8.4 * run.len() as f64
                    );
                }
                column += run.len();
            }
        }
        svg + "</g>\n</svg>\n"
    }

    /// Takes one letter or sequence; gives its length, or none if it is not whole.
    fn one(&mut self, bytes: &[u8]) -> Option<usize> {
        match bytes {
            [0x1b, b'[', rest @ ..] => {
                let end = rest.iter().position(|byte| (0x40..=0x7e).contains(byte))?;
                self.control(&String::from_utf8_lossy(&rest[..end]), rest[end]);
                Some(end + 3)
            }
            // A title or the like, up to its end.
            [0x1b, b']', rest @ ..] => {
                rest.iter().position(|byte| *byte == 7 || *byte == b'\\').map(|n| n + 3)
            }
            [0x1b, _, ..] => Some(2),
            [] | [0x1b] => None,
            [b'\r', ..] => {
                self.column = 0;
                Some(1)
            }
            [b'\n', ..] => {
                self.row += 1;
                Some(1)
            }
            [byte, ..] if *byte < 0x20 => Some(1),
            [first, ..] => {
                let length = match first {
                    0..0x80 => 1,
                    0x80..0xe0 => 2,
                    0xe0..0xf0 => 3,
                    _ => 4,
                };
                let letter = String::from_utf8_lossy(bytes.get(..length)?).chars().next()?;
                let at = self.row * self.columns + self.column;
                if let Some(cell) = self.cells.get_mut(at).filter(|_| self.column < self.columns) {
                    *cell = Cell { letter, style: self.style };
                }
                self.column += 1;
                Some(length)
            }
        }
    }

    fn control(&mut self, parameters: &str, end: u8) {
        let numbers: Vec<usize> = parameters.split([';', ':']).map(|n| n.parse().unwrap_or(0)).collect();
        let first = numbers.first().copied().unwrap_or(0);
        let here = (self.row * self.columns + self.column).min(self.cells.len());
        match end {
            b'H' | b'f' => {
                self.row = first.max(1) - 1;
                self.column = numbers.get(1).copied().unwrap_or(1).max(1) - 1;
            }
            b'A' => self.row = self.row.saturating_sub(first.max(1)),
            b'B' => self.row += first.max(1),
            b'C' => self.column += first.max(1),
            b'D' => self.column = self.column.saturating_sub(first.max(1)),
            b'G' => self.column = first.max(1) - 1,
            b'J' if first >= 2 => self.cells.fill(Self::EMPTY),
            b'J' if first == 0 => self.cells[here..].fill(Self::EMPTY),
            b'K' if first == 0 => {
                let end = ((self.row + 1) * self.columns).min(self.cells.len()).max(here);
                self.cells[here..end].fill(Self::EMPTY);
            }
            b'm' => self.dress(&numbers),
            _ => {}
        }
    }

    fn dress(&mut self, numbers: &[usize]) {
        let mut numbers = numbers.iter().copied();
        while let Some(number) = numbers.next() {
            match number {
                0 => self.style = Style::default(),
                1 => self.style.bold = true,
                2 => self.style.dim = true,
                22 => (self.style.bold, self.style.dim) = (false, false),
                30..=37 => self.style.colour = Some(number as u8 - 30),
                90..=97 => self.style.colour = Some(number as u8 - 90),
                39 => self.style.colour = None,
                // One of 256 colours, of which the first sixteen are those above; backgrounds are not drawn.
                38 | 48 => {
                    let colour = (numbers.next() == Some(5)).then(|| numbers.next()).flatten();
                    if let (38, Some(colour @ 0..16)) = (number, colour) {
                        self.style.colour = Some(colour as u8 % 8);
                    }
                }
                _ => {}
            }
        }
    }
}

/// A program on a terminal of its own.
pub struct Terminal {
    child: Child,
    keys: ChildStdin,
    screen: Arc<Mutex<Screen>>,
}

impl Terminal {
    /// Starts a command, as a shell takes it.
    ///
    /// # Panics
    /// If there is no `script` on this machine.
    pub fn start(command: &str, columns: usize, rows: usize) -> Self {
        let line = format!("stty cols {columns} rows {rows}; exec {command}");
        let mut child = Command::new("script")
            .args(["--quiet", "--return", "--command", &line, "/dev/null"])
            .env("TERM", "xterm-256color")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("script is there");
        let keys = child.stdin.take().expect("piped");
        let mut out = child.stdout.take().expect("piped");
        let screen = Arc::new(Mutex::new(Screen::new(columns, rows)));
        let drawn = Arc::clone(&screen);
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(n @ 1..) = out.read(&mut bytes) {
                drawn.lock().unwrap_or_else(PoisonError::into_inner).feed(&bytes[..n]);
            }
        });
        Self { child, keys, screen }
    }

    /// What it shows now.
    pub fn screen(&self) -> Screen {
        self.screen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Waits until the screen holds these words.
    ///
    /// # Panics
    /// At the deadline, with the screen.
    pub fn wait_for(&self, words: &str) -> Screen {
        until(
            || format!("{words:?} on\n{}", self.screen().text()),
            || Some(self.screen()).filter(|screen| screen.text().contains(words)),
        )
    }

    /// Presses keys.
    ///
    /// # Panics
    /// If the program has ended.
    pub fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).and_then(|()| self.keys.flush()).expect("it runs");
    }

    /// Waits for its end; gives the exit code.
    ///
    /// # Panics
    /// At the deadline.
    pub fn wait(&mut self) -> Option<i32> {
        let status = until(|| "the end of the program".to_owned(), || self.child.try_wait().ok().flatten());
        status.code()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cursor_colours_and_clearing_leave_what_a_terminal_shows() {
        let mut screen = Screen::new(10, 3);
        screen.feed(b"\x1b[?1049hold\x1b[2J\x1b[2;3H\x1b[38;5;2;49mgr\xc3");
        screen.feed(b"\xbcn\x1b[0m!\x1b[1;1Hab\x1b[K\r\nx\x1b]0;title\x07");
        assert_eq!(screen.text(), "ab\nx gr\u{fc}n!\n");
        let svg = screen.svg();
        assert!(svg.contains(">gr\u{fc}n</text>") && svg.contains("fill=\"#6bc46d\""), "{svg}");
    }
}
