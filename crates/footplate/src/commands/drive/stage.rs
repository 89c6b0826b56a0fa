//! Between the one who drives and the people in front of it: what they write goes in, what is said comes out.

use std::io::{BufRead, IsTerminal, Read, Write};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use footplate_core::control::{LinkNews, Machine as _};
use footplate_core::{Command, Timestamp};
use footplate_wire::{CommandError, LinkNotice};

use super::script_runner::ScriptRunner;
use super::spoken::{Ended, Spoken};
use crate::clock::Stopwatch;
use crate::dashboard::{Alarm, Answer, Board, Painter, Request};
use crate::recorded::{Input, Recorded};
use crate::runtime::{Attendant, Wish};

/// No screen shows more often than this that a train has moved: fifty pictures a second.
const BETWEEN_PICTURES: Duration = Duration::from_millis(20);

/// The longest line that a person writes ...
const LONGEST_LINE: u64 = 4_096;
/// ... and how many wait to be carried out before no more are read.
const LINES_WAITING: usize = 1_000;

/// Lines that a person writes, as they come. Whatever is written, the memory of the program does not grow.
pub(super) fn lines_of_stdin() -> Receiver<String> {
    let (said, lines) = sync_channel(LINES_WAITING);
    // It ends with the input or with the program, whichever is first.
    thread::spawn(move || {
        let mut input = std::io::stdin().lock();
        let mut line = Vec::new();
        let mut is_rest = false;
        loop {
            line.clear();
            match (&mut input).take(LONGEST_LINE).read_until(b'\n', &mut line) {
                Ok(1..) => {}
                _ => return,
            }
            let is_whole = line.ends_with(b"\n") || (line.len() as u64) < LONGEST_LINE;
            let was_rest = std::mem::replace(&mut is_rest, !is_whole);
            if is_whole && !was_rest {
                let text = String::from_utf8_lossy(&line).trim_end().to_owned();
                if said.send(text).is_err() {
                    return;
                }
            } else if !was_rest {
                eprintln!("a line is longer than {LONGEST_LINE} bytes: it is not read");
            }
        }
    });
    lines
}

/// Who watches a session of driving.
pub(super) struct Stage {
    lines: Option<Receiver<String>>,
    screen: Screen,
    watched: Option<Watched>,
    /// What was heard of the line since the script runner was commanded last.
    news: Vec<LinkNews>,
    /// What whoever knows the truth should look at before anything moves on.
    pub(super) for_referee: Vec<Spoken>,
    pub(super) is_over: bool,
}

/// Those who watch in a browser.
struct Watched {
    board: Arc<Board>,
    painter: Painter,
    stopwatch: Stopwatch,
    painted: Duration,
}

impl Watched {
    fn attend(&mut self, now: Timestamp, script_runner: &mut Recorded<ScriptRunner>) {
        while let Some(asked) = self.board.next_asked() {
            let answer = match &asked.request {
                Request::EmergencyStop => {
                    script_runner.handle_word(now, &Input::EmergencyStop);
                    Answer::Taken
                }
                Request::Line(line) => match script_runner.machine().mistake(line) {
                    Some(mistake) => Answer::Refused(mistake),
                    None => {
                        script_runner.handle_word(now, &Input::Line(line.clone()));
                        Answer::Taken
                    }
                },
            };
            asked.answer(answer);
        }
        let elapsed = self.stopwatch.elapsed();
        if elapsed >= self.painted + BETWEEN_PICTURES {
            // Counted from when it was due: a look that came late does not make all others late.
            self.painted = (self.painted + BETWEEN_PICTURES).max(elapsed.saturating_sub(BETWEEN_PICTURES));
            script_runner.machine().show(&mut self.painter, now);
        }
    }
}

/// Where lines for people go.
struct Screen {
    to_errors: bool,
    prompts: bool,
    /// Something else is drawn where they would go.
    is_silent: bool,
}

impl Screen {
    fn say(&self, text: &str, status: &str) {
        // Whoever closed the output has seen enough; trains are driven all the same.
        let _ = if self.is_silent {
            Ok(())
        } else if self.to_errors {
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
    pub(super) fn new(lines: Option<Receiver<String>>, json: bool, board: Option<&Arc<Board>>) -> Self {
        let watched = board.map(|board| Watched {
            board: Arc::clone(board),
            painter: Painter::new(board),
            stopwatch: Stopwatch::start(),
            painted: Duration::ZERO,
        });
        let prompts =
            lines.is_some() && !json && std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
        let screen = Screen { to_errors: json, prompts, is_silent: false };
        Self { lines, screen, watched, news: Vec::new(), for_referee: Vec::new(), is_over: false }
    }

    pub(super) fn say(&self, text: &str, status: &str) {
        self.screen.say(text, status);
    }

    /// From now on something else is drawn where lines would go.
    pub(super) const fn be_silent(&mut self) {
        self.screen.is_silent = true;
    }

    /// Says what is not as it should be.
    fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        if let Some(watched) = &mut self.watched {
            watched.painter.alarm(now, alarm);
        }
    }
}

impl Attendant<Recorded<ScriptRunner>> for Stage {
    fn hear(&mut self, now: Timestamp, notice: Spoken) {
        match notice {
            Spoken::Line { text, status } => {
                if let Some(watched) = &self.watched {
                    watched.board.say((now - Timestamp::ZERO).as_s(), &text);
                }
                self.screen.say(&text, &status);
            }
            Spoken::Passed(passed) => {
                if let Some(watched) = &mut self.watched {
                    watched.painter.passed(passed);
                }
            }
            Spoken::Alarm(alarm) => self.alarm(now, &alarm),
            Spoken::Over => self.is_over = true,
            begun_or_ended => self.for_referee.push(begun_or_ended),
        }
    }

    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice) {
        self.news.extend(notice.news());
        if let Some(alarm) = Alarm::of_line(notice) {
            self.alarm(now, &alarm);
        }
        if !matches!(notice, LinkNotice::Answers | LinkNotice::Closed(_)) {
            self.screen.say(&notice.to_string(), "");
        }
    }

    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError) {
        let why = format!("{command}: {error}");
        self.screen.say(&format!("not sent: {why}"), "");
        self.alarm(now, &Alarm::not_sent(&why));
    }

    fn attend(&mut self, now: Timestamp, script_runner: &mut Recorded<ScriptRunner>) -> Wish {
        for news in std::mem::take(&mut self.news) {
            script_runner.handle_word(now, &Input::Link(news));
        }
        while let Some(lines) = &self.lines {
            match lines.try_recv() {
                Ok(line) => script_runner.handle_word(now, &Input::Line(line)),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    self.lines = None;
                    script_runner.handle_word(now, &Input::NoMoreLines);
                    script_runner.handle_timeout(now);
                }
            }
        }
        if let Some(watched) = &mut self.watched {
            watched.attend(now, script_runner);
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
