//! Who watches a run: what is written down, what people are told, and what they want.

use footplate_core::control::Machine;
use footplate_core::{Command, Event, Timestamp};
use footplate_wire::{CommandError, LinkNotice};

/// What writes the entries of a run down, before anybody acts on them.
pub(crate) trait Recorder {
    /// Writes them down; what is not written when this returns must not be called measured.
    ///
    /// # Errors
    /// Why they could not be written. The run ends, and trains are commanded to stop.
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()>;
}

/// How a run goes on after somebody was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wish {
    /// As before.
    GoOn,
    /// Not at all: what was wanted is reached, or nothing more is wanted.
    Finish,
}

/// Who watches a run of a machine.
pub(crate) trait Attendant<M: Machine> {
    /// The machine has something to say.
    fn hear(&mut self, now: Timestamp, notice: M::Notice);

    /// The line has something to say.
    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice);

    /// Something for people to read that concerns the line itself.
    fn read(&mut self, words: &str) {
        eprintln!("{words}");
    }

    /// A command of the machine was not taken. Without an own answer it is only said.
    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError);

    /// Between entries, and at least every few hundredths of a second of real time: whatever people want of the
    /// machine now, and whether the run goes on.
    fn attend(&mut self, now: Timestamp, machine: &mut M) -> Wish;
}
