//! What is to be done and said next, in order.

use alloc::collections::VecDeque;

use crate::control::Output;
use crate::event::Command;
use crate::ids::SensorId;
use crate::time::Timestamp;

use crate::control::Notice;

/// A queue of outputs, which says of the line only what changed.
#[derive(Debug, Clone, Default)]
pub(super) struct Outputs {
    queue: VecDeque<Output<Notice>>,
    held: Option<Timestamp>,
    watched: Option<SensorId>,
}

impl Outputs {
    pub(super) fn command(&mut self, command: Command) {
        self.queue.push_back(Output::Command(command));
    }

    pub(super) fn say(&mut self, notice: Notice) {
        self.queue.push_back(Output::Notice(notice));
    }

    pub(super) fn hold_line(&mut self, until: Option<Timestamp>) {
        if self.held != until {
            self.held = until;
            self.queue.push_back(Output::HoldLine(until));
        }
    }

    pub(super) fn watch(&mut self, sensor: Option<SensorId>) {
        if self.watched != sensor {
            self.watched = sensor;
            self.queue.push_back(Output::Watch(sensor));
        }
    }

    pub(super) fn next(&mut self) -> Option<Output<Notice>> {
        self.queue.pop_front()
    }
}
