//! The outputs of a driver, in order.

use alloc::collections::VecDeque;

use crate::control::{Notice, Output};
use crate::event::Command;
use crate::ids::SensorId;
use crate::time::Timestamp;

/// A queue of outputs. Requests to the line are queued only when they change.
#[derive(Debug, Clone, Default)]
pub(super) struct Outputs {
    queue: VecDeque<Output<Notice>>,
    line_free_by: Option<Timestamp>,
    watched: Option<SensorId>,
}

impl Outputs {
    pub(super) fn command(&mut self, command: Command) {
        self.queue.push_back(Output::Command(command));
    }

    pub(super) fn notify(&mut self, notice: Notice) {
        self.queue.push_back(Output::Notice(notice));
    }

    pub(super) fn hold_line(&mut self, until: Option<Timestamp>) {
        if self.line_free_by != until {
            self.line_free_by = until;
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
