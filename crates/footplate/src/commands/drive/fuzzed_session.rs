//! A session without a railway: everything that operators can ask for is carried out, and nothing is commanded.

use std::sync::Arc;

use footplate_core::control::Machine as _;
use footplate_core::model::MotionFit;
use footplate_core::track::TurnoutStates;
use footplate_core::{DecoderSteps, TimeSpan, Timestamp, TrainId};

use super::beginning::DriveBeginning;
use super::console::Console;
use super::script_runner::ScriptRunner;
use crate::commands::written_layout::WrittenLayout;
use crate::dashboard::Board;
use crate::recorded::{Input, Recorded};
use crate::runtime::Attendant as _;

/// The trains, one with each usual decoder.
const TRAINS: [(TrainId, DecoderSteps); 2] =
    [(TrainId(24), DecoderSteps::Fourteen), (TrainId(3850), DecoderSteps::All)];
/// One train is located, so that orders to it are not refused at once.
const LOCATED: &str = "place 24 at C13+120mm";
/// Track time after each line: an order has begun, and its first wait is over.
const RUNS_ON: TimeSpan = TimeSpan::from_ms(2_000);
/// The most timeouts in that time: a machine that asks for more does not come to rest.
const MOST_TIMEOUTS: usize = 20_000;

/// A session for the fuzzer.
pub(crate) struct FuzzedSession {
    /// Where requests of browsers wait.
    pub(crate) board: Arc<Board>,
    /// Its layout.
    pub(crate) written: WrittenLayout,
    console: Console,
    script_runner: Recorded<ScriptRunner>,
    now: Timestamp,
}

impl FuzzedSession {
    /// A session of an operator with two trains that were never calibrated.
    ///
    /// # Errors
    /// The built-in layout cannot be read.
    pub(crate) fn new() -> anyhow::Result<Self> {
        let written = WrittenLayout::named("track-a")?;
        let fits: Vec<MotionFit> =
            TRAINS.into_iter().map(|(train, steps)| MotionFit::new(train, steps.highest())).collect();
        let models = fits.iter().map(|fit| fit.model().clone()).collect();
        let beginning = DriveBeginning::line_by_line(&written, &TurnoutStates::unknown(), (models, fits));
        let script_runner = Recorded::new(beginning.of_a_person().script_runner()?, None);
        let board = Board::new(0);
        let mut console = Console::new(None, true, Some(&board));
        console.silence();
        let mut session = Self { board, written, console, script_runner, now: Timestamp::ZERO };
        session.hear(LOCATED);
        Ok(session)
    }

    /// Takes a line of the prompt, and runs on.
    ///
    /// # Panics
    /// The session does not come to rest.
    pub(crate) fn hear(&mut self, line: &str) {
        self.script_runner.handle_word(self.now, &Input::Line(line.to_owned()));
        self.run_on();
    }

    /// Answers what waits on the board, as a session does between two entries.
    pub(crate) fn attend(&mut self) {
        let _ = self.console.attend(self.now, &mut self.script_runner);
        self.console.for_truth.clear();
    }

    /// Lets time pass.
    ///
    /// # Panics
    /// The session does not come to rest.
    pub(crate) fn run_on(&mut self) {
        let until = self.now + RUNS_ON;
        for _ in 0..MOST_TIMEOUTS {
            while self.script_runner.poll_output().is_some() {}
            match self.script_runner.next_timeout() {
                Some(due) if due <= until => self.now = self.now.max(due),
                _ => {
                    self.now = until;
                    return;
                }
            }
            self.script_runner.handle_timeout(self.now);
        }
        panic!("{MOST_TIMEOUTS} timeouts within {} s", RUNS_ON.as_s());
    }
}
