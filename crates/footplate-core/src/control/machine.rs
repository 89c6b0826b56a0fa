//! The interface of a machine that drives trains: four verbs, and its outputs.

use crate::event::{Command, Event};
use crate::ids::SensorId;
use crate::time::Timestamp;

/// A state machine that turns reports into commands, without a clock, a cable or a thread.
///
/// The loop around it, live or simulated, is always the same: pass on what happened, then take outputs until there
/// are none, then wait for the next event or for [`next_timeout`](Self::next_timeout), whichever is first.
///
/// Events come in order of time and not before they are known: a report when its answer was complete, a command when
/// its last bit had been sent. Their own times are those moments on the line (see
/// [`Event::time`](crate::Event::time)), never later than `now`.
pub trait Machine {
    /// What it reports to operators and programs.
    type Notice;

    /// Handles an event: a report of a sensor, or a command that has been sent.
    fn handle_event(&mut self, now: Timestamp, event: &Event);

    /// Handles the time that it asked for; may be called at any time.
    fn handle_timeout(&mut self, now: Timestamp);

    /// The next output, until `None`; call again after every `handle_…`.
    fn poll_output(&mut self) -> Option<Output<Self::Notice>>;

    /// When it has to be called again at the latest.
    fn next_timeout(&self) -> Option<Timestamp>;
}

/// What a machine requests from the loop around it.
#[derive(Debug, Clone, PartialEq)]
pub enum Output<Notice> {
    /// Send this to the station as soon as the line is free.
    Command(Command),
    /// A command will have to be sent at this time: start nothing that would still occupy the line then. `None`: no
    /// command is expected. Replaces an earlier request.
    HoldLine(Option<Timestamp>),
    /// A detection is due at this sensor: poll its module more often than others. `None`: poll all alike.
    Watch(Option<SensorId>),
    /// A report for operators and programs.
    Notice(Notice),
}
