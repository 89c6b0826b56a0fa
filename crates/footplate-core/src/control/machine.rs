//! The four verbs of a machine that drives trains, and what it can ask for.

use crate::event::{Command, Event};
use crate::ids::SensorId;
use crate::time::Timestamp;

/// Drives trains by what is reported, without a clock, a cable or a thread.
///
/// The loop around it, live or simulated, is always the same: hand over what happened, then ask for outputs until
/// there are none, then wait for whatever comes first, the next entry or [`next_timeout`](Self::next_timeout).
///
/// Entries come in order of time and not before they are known: a report when its answer was complete, a command
/// when its last bit had left. Their own times are those moments on the line (see
/// [`Event::time`](crate::Event::time)), and never after `now`.
pub trait Machine {
    /// What it has to say to people and programs.
    type Notice;

    /// An entry of the recording: a report of a contact, or a command that has been sent.
    fn handle_event(&mut self, now: Timestamp, event: &Event);

    /// The time has come that it asked for, or it is a good moment to look at the clock anyway.
    fn handle_timeout(&mut self, now: Timestamp);

    /// The next thing to do, until `None`; ask again after every `handle_…`.
    fn poll_output(&mut self) -> Option<Output<Self::Notice>>;

    /// When it wants to be asked again, if it does.
    fn next_timeout(&self) -> Option<Timestamp>;
}

/// What a machine asks of the loop around it.
#[derive(Debug, Clone, PartialEq)]
pub enum Output<Notice> {
    /// Say this to the station, as soon as the line is free.
    Command(Command),
    /// A command will come that should leave at this time: begin nothing that would still occupy the line then.
    /// `None`: none is expected any more. A later word replaces an earlier one.
    HoldLine(Option<Timestamp>),
    /// This contact is due: ask for its module more often than for others. `None`: for all alike.
    Watch(Option<SensorId>),
    /// For people and programs to know.
    Notice(Notice),
}
