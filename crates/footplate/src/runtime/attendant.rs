//! Interfaces of the runtime: the recorder, and the attendant that passes notices to people and their requests back.

use crate::standard_error::say;
use footplate_core::control::Machine;
use footplate_core::{Command, Event, Timestamp, TrainId};
use footplate_store::Direction;
use footplate_wire::{BlockReports, CommandError, LinkNotice, ReportedFunctions};

/// Records the entries of a run before the machine receives them.
pub(crate) trait Recorder {
    /// Takes entries for the record, in order.
    ///
    /// # Errors
    /// The entries cannot be recorded. The run ends, and all trains are commanded to stop.
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()>;

    /// Takes the direction that a train is commanded in from now on.
    fn record_direction(&mut self, _direction: Direction) {}
}

/// Whether a run continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wish {
    /// Continue.
    GoOn,
    /// End the run: its purpose is reached, or nothing more is requested.
    Finish,
}

/// Receives the notices of a run, and controls it.
pub(crate) trait Attendant<M: Machine> {
    /// A notice of the machine.
    fn hear(&mut self, now: Timestamp, notice: M::Notice);

    /// A notice of the session about the line.
    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice);

    /// What the detectors of blocks report now; called before [`attend`](Self::attend) on a layout with blocks.
    fn see_blocks(&mut self, _blocks: &BlockReports) {}

    /// What the station has reported of a train's functions.
    fn hear_of_functions(&mut self, _train: TrainId, _reported: ReportedFunctions) {}

    /// What a decoder has reported of its train's speed; see [`Transmit::ReportedSpeed`](footplate_wire::Transmit::ReportedSpeed).
    fn hear_of_speed(&mut self, _train: TrainId, _number: u16) {}

    /// A message about the line for people to read.
    fn read(&mut self, words: &str) {
        say!("{words}");
    }

    /// The session rejected a command of the machine.
    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError);

    /// Called between entries, at least every few hundredths of a second of real time: passes requests of people to the
    /// machine, and returns whether the run continues.
    fn attend(&mut self, now: Timestamp, machine: &mut M) -> Wish;
}
