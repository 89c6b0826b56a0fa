//! Connects a script runner to its operators: lines of standard input and requests of browsers go in, messages come
//! out.

use std::cell::OnceCell;
use std::io::{BufRead, IsTerminal, Read, Write};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use footplate_core::control::{LinkNews, Machine as _};
use footplate_core::{Command, Timestamp, TrainId};
use footplate_wire::{BlockReports, CommandError, LinkNotice, ReportedFunctions};

use super::script_runner::ScriptRunner;
use super::session_message::{Ended, SessionMessage};
use crate::clock::Stopwatch;
use crate::dashboard::{Alarm, Answer, Board, Painter, PendingRequest, Request, Unfulfilled};
use crate::layout_check::LiveWarning;
use crate::recorded::{Input, Recorded};
use crate::runtime::{Attendant, Wish};
use crate::standard_error::say;

/// The interval between two pictures of the dashboard: 50 a second.
const PICTURE_INTERVAL: Duration = Duration::from_millis(20);

/// The longest line of input, in bytes.
const LONGEST_LINE: u64 = 4_096;
/// Lines that wait to be carried out; reading pauses beyond it.
const LINES_WAITING: usize = 1_000;

/// Reads standard input in a thread. Memory stays bounded whatever the input is.
pub(super) fn lines_of_stdin() -> Receiver<String> {
    let (said, lines) = sync_channel(LINES_WAITING);
    // The thread ends with the input or with the program.
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
                say!("a line is longer than {LONGEST_LINE} bytes: it is not read");
            }
        }
    });
    lines
}

/// The operators of a driving session.
pub(super) struct Console {
    lines: Option<Receiver<String>>,
    screen: Screen,
    live_view: Option<LiveView>,
    /// News of the link since the script runner was last called.
    news: Vec<LinkNews>,
    /// The warning of lengths that are not those of the layout, until it was said.
    lengths: Option<LiveWarning>,
    /// Messages that are scored against the simulated truth before time moves on.
    pub(super) for_scoring: Vec<SessionMessage>,
    /// Requests for the simulated truth.
    pub(super) for_truth: Vec<PendingRequest>,
    pub(super) is_over: bool,
}

/// The dashboard and the terminal view.
struct LiveView {
    board: Arc<Board>,
    painter: Painter,
    stopwatch: Stopwatch,
    painted: Duration,
}

impl LiveView {
    /// Answers all requests but those for the simulated truth, which it returns.
    fn attend(&mut self, now: Timestamp, script_runner: &mut Recorded<ScriptRunner>) -> Vec<PendingRequest> {
        let mut for_truth = Vec::new();
        while let Some(asked) = self.board.next_request(|line| only_stops(script_runner.machine(), line)) {
            let answer = match &asked.request {
                Request::Truth => {
                    for_truth.push(asked);
                    continue;
                }
                Request::CheckSchedule(schedule) => match script_runner.machine().read_schedule(schedule) {
                    Ok(_) => Answer::Taken,
                    Err(mistakes) => Answer::Refused(mistakes),
                },
                Request::SavedSchedules(saved) => {
                    script_runner.handle_word(now, &Input::Schedules(saved.clone()));
                    Answer::Taken
                }
                Request::RunSchedule(schedule) => match script_runner.machine().check_run(schedule) {
                    Ok(()) => {
                        script_runner.handle_word(now, &Input::Schedule(schedule.clone()));
                        Answer::Taken
                    }
                    Err(why) => Answer::Refused(why),
                },
                Request::EndSchedule(name) if script_runner.machine().runs(name) => {
                    script_runner.handle_word(now, &Input::EndSchedule(name.clone()));
                    Answer::Taken
                }
                Request::EndSchedule(name) => Answer::Refused(format!("no schedule `{name}` runs")),
                Request::EndAlarm(id) if self.painter.end_alarm(now, *id) => Answer::Taken,
                Request::EndAlarm(id) => Answer::Refused(format!("alarm {id} is over already")),
                Request::EmergencyStop => {
                    script_runner.handle_word(now, &Input::EmergencyStop);
                    Answer::Taken
                }
                Request::Line(line) => match script_runner.machine().read_line(line) {
                    Err(mistake) => Answer::Refused(mistake.to_string()),
                    Ok(step) => {
                        let line = Input::Line(line.clone());
                        script_runner.ask(now, &line, |script_runner| script_runner.take(now, step));
                        Answer::Taken
                    }
                },
            };
            asked.answer(answer);
        }
        let elapsed = self.stopwatch.elapsed();
        if elapsed >= self.painted + PICTURE_INTERVAL {
            // Counted from when the picture was due, so that a late one does not delay all others.
            self.painted = (self.painted + PICTURE_INTERVAL).max(elapsed.saturating_sub(PICTURE_INTERVAL));
            script_runner.machine().show(&mut self.painter, now);
        }
        for_truth
    }
}

/// Whether a line stops trains and does nothing else.
fn only_stops(script_runner: &ScriptRunner, line: &str) -> bool {
    script_runner.read_line(line).is_ok_and(|step| step.is_some_and(|step| step.instruction.only_stops()))
}

/// Where lines for operators are printed.
struct Screen {
    to_stderr: bool,
    prompts: bool,
    /// Whether the terminal view shows the lines instead.
    is_silent: bool,
}

impl Screen {
    fn say(&self, text: &str, status: &str) {
        // A closed output does not stop the trains.
        let _ = if self.is_silent {
            Ok(())
        } else if self.to_stderr {
            writeln!(std::io::stderr(), "{text}")
        } else if self.prompts {
            let mut output = std::io::stdout();
            write!(output, "\r\x1b[2K{text}\n{status}> ").and_then(|()| output.flush())
        } else {
            writeln!(std::io::stdout(), "{text}")
        };
    }
}

impl Console {
    /// `lines`: the operator's input. `json`: standard output carries results, so that lines go to standard error.
    pub(super) fn new(lines: Option<Receiver<String>>, json: bool, board: Option<&Arc<Board>>) -> Self {
        let live_view = board.map(|board| LiveView {
            board: Arc::clone(board),
            painter: Painter::new(board),
            stopwatch: Stopwatch::start(),
            painted: Duration::ZERO,
        });
        let prompts =
            lines.is_some() && !json && std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
        let screen = Screen { to_stderr: json, prompts, is_silent: false };
        Self {
            lines,
            screen,
            live_view,
            news: Vec::new(),
            lengths: None,
            for_scoring: Vec::new(),
            for_truth: Vec::new(),
            is_over: false,
        }
    }

    pub(super) fn say(&self, text: &str, status: &str) {
        self.screen.say(text, status);
    }

    /// Stops printing: the terminal view shows the lines from now on.
    pub(super) const fn silence(&mut self) {
        self.screen.is_silent = true;
    }

    /// Says it when there is a warning of the layout's lengths, and raises an alarm.
    pub(super) fn watch_lengths(&mut self, warning: LiveWarning) {
        self.lengths = Some(warning);
    }

    fn warn_of_lengths(&mut self, now: Timestamp) {
        let lengths = self.lengths.take_if(|lengths| lengths.get().is_some());
        let Some(warning) = lengths.as_deref().and_then(OnceCell::get) else { return };
        self.screen.say(&warning.english, "");
        self.alarm(now, &Alarm::lengths_differ(&warning.english, &warning.differences));
    }

    fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        if let Some(live_view) = &mut self.live_view {
            live_view.painter.alarm(now, alarm);
        }
    }
}

impl Attendant<Recorded<ScriptRunner>> for Console {
    fn hear(&mut self, now: Timestamp, notice: SessionMessage) {
        match notice {
            SessionMessage::Line { text, status } => {
                if let Some(live_view) = &self.live_view {
                    live_view.board.say((now - Timestamp::ZERO).as_s(), &text);
                }
                let alarms = self.live_view.as_ref().and_then(|live_view| live_view.painter.alarm_summary());
                let status = alarms.map_or_else(|| status.clone(), |alarms| format!("{status}; {alarms}"));
                self.screen.say(&text, &status);
            }
            SessionMessage::Passed(passed) => {
                if let Some(live_view) = &mut self.live_view {
                    live_view.painter.passed(passed);
                }
            }
            SessionMessage::Alarm(alarm) => self.alarm(now, &alarm),
            SessionMessage::Over => self.is_over = true,
            begun_or_ended => {
                if let (SessionMessage::Ended(Ended { text, refused: Some(why), .. }), Some(live_view)) =
                    (&begun_or_ended, &self.live_view)
                {
                    live_view.board.refuse(Unfulfilled::Line(text.clone()), why);
                }
                self.for_scoring.push(begun_or_ended);
            }
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

    fn see_blocks(&mut self, blocks: &BlockReports) {
        if let Some(live_view) = &mut self.live_view {
            live_view.painter.see_blocks(blocks.states());
        }
    }

    fn hear_of_functions(&mut self, train: TrainId, reported: ReportedFunctions) {
        if let Some(live_view) = &mut self.live_view {
            live_view.painter.hear_of_functions(train, reported);
        }
    }

    fn hear_of_speed(&mut self, train: TrainId, number: u16) {
        self.news.push(LinkNews::ReportedSpeed { train, number });
    }

    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError) {
        let why = format!("{command}: {error}");
        self.screen.say(&format!("not sent: {why}"), "");
        self.alarm(now, &Alarm::not_sent(&why));
        if let Some(live_view) = &self.live_view {
            live_view.board.refuse(Unfulfilled::Command(command), &format!("not sent: {why}"));
        }
    }

    fn attend(&mut self, now: Timestamp, script_runner: &mut Recorded<ScriptRunner>) -> Wish {
        self.warn_of_lengths(now);
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
        if let Some(live_view) = &mut self.live_view {
            self.for_truth.extend(live_view.attend(now, script_runner));
        }
        let leaves_loop = self.is_over || !self.for_scoring.is_empty() || !self.for_truth.is_empty();
        if leaves_loop { Wish::Finish } else { Wish::GoOn }
    }
}
