//! A script runner whose computing is timed.

use std::time::Duration;

use footplate_core::control::{Machine, Output};
use footplate_core::{Event, Timestamp};

use crate::clock::Stopwatch;
use crate::commands::drive::{ScriptRunner, SessionMessage};
use crate::recorded::{Input, Listener};

/// Passes everything on, and counts the time it takes.
pub(super) struct Timed {
    pub(super) script_runner: ScriptRunner,
    /// All time so far.
    pub(super) taken: Duration,
    /// The longest that the line had to wait.
    pub(super) longest: Duration,
}

impl Timed {
    pub(super) const fn new(script_runner: ScriptRunner) -> Self {
        Self { script_runner, taken: Duration::ZERO, longest: Duration::ZERO }
    }

    pub(super) fn handle_word(&mut self, now: Timestamp, word: &Input) {
        self.time(|script_runner| script_runner.handle_word(now, word));
    }

    fn time<A>(&mut self, call: impl FnOnce(&mut ScriptRunner) -> A) -> A {
        let stopwatch = Stopwatch::start();
        let answer = call(&mut self.script_runner);
        let taken = stopwatch.elapsed();
        self.taken += taken;
        self.longest = self.longest.max(taken);
        answer
    }
}

impl Machine for Timed {
    type Notice = SessionMessage;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.time(|script_runner| script_runner.handle_event(now, event));
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.time(|script_runner| script_runner.handle_timeout(now));
    }

    fn poll_output(&mut self) -> Option<Output<SessionMessage>> {
        self.script_runner.poll_output()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        self.script_runner.next_timeout()
    }
}
