//! A few lines at the foot of a terminal that follow what happens, under lines that stay.
//!
//! Every frame is one write: up to where the last one began, line by line over what was there, with wrapping off, so
//! nothing flickers, no width has to be known, and a program that ends in between leaves the terminal as it was. Where the output is no terminal only the lines that stay are written.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

/// Fifteen frames a second look smooth and can still be read.
const FRAME: Duration = Duration::from_millis(66);

/// Terminals that know it show a frame at once; others pass over it (the "synchronized output" mode 2026).
const BEGIN_FRAME: &str = "\x1b[?2026h\x1b[?7l";
const END_FRAME: &str = "\x1b[?7h\x1b[?2026l";
const TO_END_OF_LINE: &str = "\x1b[K";
const TO_END_OF_SCREEN: &str = "\x1b[J";

/// Lines that stay, and lines that follow.
pub(crate) struct LiveLines<'o> {
    output: &'o mut dyn Write,
    is_terminal: bool,
    has_colours: bool,
    /// How many lines of the last frame stand above the cursor.
    shown: usize,
    last: Option<Instant>,
}

impl<'o> LiveLines<'o> {
    /// On standard output, which `output` writes to.
    pub(crate) fn new(output: &'o mut dyn Write) -> Self {
        let is_terminal = io::stdout().is_terminal();
        let has_colours = is_terminal
            && std::env::var_os("NO_COLOR").is_none()
            && std::env::var_os("TERM").is_none_or(|term| term != "dumb");
        Self { output, is_terminal, has_colours, shown: 0, last: None }
    }

    /// Whether anybody sees lines that follow.
    pub(crate) const fn is_terminal(&self) -> bool {
        self.is_terminal
    }

    /// Text in a style, where styles can be shown.
    pub(crate) fn styled(&self, style: Style, text: &str) -> String {
        if self.has_colours { format!("\x1b[{}m{text}\x1b[0m", style.code()) } else { text.to_owned() }
    }

    /// A line that stays.
    pub(crate) fn line(&mut self, text: &str) -> io::Result<()> {
        let mut frame = self.back();
        frame.push_str(text);
        frame.push('\n');
        self.shown = 0;
        self.last = None;
        self.write(&frame)
    }

    /// Whether it is time for another frame.
    #[expect(
        clippy::disallowed_methods,
        reason = "how often a terminal is written to is no time of the railway"
    )]
    pub(crate) fn is_due(&self) -> bool {
        self.is_terminal && self.last.is_none_or(|last| Instant::now() - last >= FRAME)
    }

    /// The lines that follow, in place of those before.
    #[expect(
        clippy::disallowed_methods,
        reason = "how often a terminal is written to is no time of the railway"
    )]
    pub(crate) fn frame(&mut self, lines: &[String]) -> io::Result<()> {
        if !self.is_terminal {
            return Ok(());
        }
        let mut frame = String::from(BEGIN_FRAME);
        if self.shown > 0 {
            frame.push_str(&format!("\x1b[{}A\r", self.shown));
        }
        for line in lines {
            frame.push_str(line);
            frame.push_str(TO_END_OF_LINE);
            frame.push('\n');
        }
        frame.push_str(TO_END_OF_SCREEN);
        frame.push_str(END_FRAME);
        self.shown = lines.len();
        self.last = Some(Instant::now());
        self.write(&frame)
    }

    /// Takes the lines that follow away.
    pub(crate) fn clear(&mut self) -> io::Result<()> {
        let frame = self.back();
        self.shown = 0;
        self.write(&frame)
    }

    /// What leads back to where the last frame began, and makes room.
    fn back(&self) -> String {
        match (self.is_terminal, self.shown) {
            (false, _) => String::new(),
            (true, 0) => String::new(),
            (true, shown) => format!("\x1b[{shown}A\r{TO_END_OF_SCREEN}"),
        }
    }

    fn write(&mut self, text: &str) -> io::Result<()> {
        self.output.write_all(text.as_bytes())?;
        self.output.flush()
    }
}

/// How a text looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// What to look at first.
    Bold,
    /// What to look at last.
    Dim,
    /// As it should be.
    Good,
    /// Not as it should be.
    Bad,
    /// Something that has not ended.
    Moving,
}

impl Style {
    const fn code(self) -> &'static str {
        match self {
            Self::Bold => "1",
            Self::Dim => "2",
            Self::Good => "32",
            Self::Bad => "31",
            Self::Moving => "36",
        }
    }
}
