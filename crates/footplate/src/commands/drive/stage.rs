//! Between the one who drives and the people in front of it: what they write goes in, what is said comes out.

use std::io::{IsTerminal, Write};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use footplate_core::control::Machine as _;
use footplate_core::{Command, Timestamp};
use footplate_wire::{CommandError, LinkNotice};

use super::conductor::Conductor;
use super::spoken::{Ended, Spoken};
use crate::runtime::{Attendant, Wish};
use crate::witness::{Input, Witnessed};

/// Lines that a person writes, as they come.
pub(super) fn lines_of_stdin() -> Receiver<String> {
    let (said, lines) = channel();
    // It ends with the input or with the program, whichever is first.
    thread::spawn(move || {
        for line in std::io::stdin().lines() {
            let Ok(line) = line else { return };
            if said.send(line).is_err() {
                return;
            }
        }
    });
    lines
}

/// Who watches a session of driving.
pub(super) struct Stage {
    lines: Option<Receiver<String>>,
    screen: Screen,
    /// What whoever knows the truth should look at before anything moves on.
    pub(super) for_referee: Vec<Spoken>,
    pub(super) is_over: bool,
}

/// Where lines for people go.
struct Screen {
    to_errors: bool,
    prompts: bool,
}

impl Screen {
    fn say(&self, text: &str, status: &str) {
        // Whoever closed the output has seen enough; trains are driven all the same.
        let _ = if self.to_errors {
            writeln!(std::io::stderr(), "{text}")
        } else if self.prompts {
            let mut output = std::io::stdout();
            write!(output, "\r\x1b[2K{text}\n{status}> ").and_then(|()| output.flush())
        } else {
            writeln!(std::io::stdout(), "{text}")
        };
    }
}

impl Stage {
    /// `lines`: what a person writes. `json`: the output is for results, and people look at standard error.
    pub(super) fn new(lines: Option<Receiver<String>>, json: bool) -> Self {
        let prompts =
            lines.is_some() && !json && std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
        let screen = Screen { to_errors: json, prompts };
        Self { lines, screen, for_referee: Vec::new(), is_over: false }
    }

    pub(super) fn say(&self, text: &str, status: &str) {
        self.screen.say(text, status);
    }
}

impl Attendant<Witnessed<Conductor>> for Stage {
    fn hear(&mut self, _: Timestamp, notice: Spoken) {
        match notice {
            Spoken::Line { text, status } => self.screen.say(&text, &status),
            Spoken::Over => self.is_over = true,
            begun_or_ended => self.for_referee.push(begun_or_ended),
        }
    }

    fn hear_of_line(&mut self, _: Timestamp, notice: &LinkNotice) {
        if !matches!(notice, LinkNotice::Answers | LinkNotice::Closed(_)) {
            self.screen.say(&notice.to_string(), "");
        }
    }

    fn hear_of_refusal(&mut self, _: Timestamp, command: Command, error: CommandError) {
        self.screen.say(&format!("not sent: {command}: {error}"), "");
    }

    fn attend(&mut self, now: Timestamp, conductor: &mut Witnessed<Conductor>) -> Wish {
        while let Some(lines) = &self.lines {
            match lines.try_recv() {
                Ok(line) => conductor.handle_word(now, &Input::Line(line)),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    self.lines = None;
                    conductor.handle_word(now, &Input::NoMoreLines);
                    conductor.handle_timeout(now);
                }
            }
        }
        if self.is_over || !self.for_referee.is_empty() { Wish::Finish } else { Wish::GoOn }
    }
}

/// What of an ended order is said to the one who counts.
pub(super) fn ended(spoken: &Spoken) -> Option<&Ended> {
    match spoken {
        Spoken::Ended(ended) => Some(ended),
        _ => None,
    }
}
