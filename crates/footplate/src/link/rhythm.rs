//! What the bytes of a line tell of its rhythm: how often sensors are asked for, and how soon the answer begins.

use footplate_core::{TimeSpan, Timestamp};
use footplate_wire::marklin_serial::{BYTE_TIME, Message};

/// Reads a line's bytes as they pass.
#[derive(Debug, Default)]
pub(crate) struct Rhythm {
    said: Vec<u8>,
    /// The last request, and how many other messages went since.
    request: Option<(Timestamp, usize)>,
    is_awaited: bool,
}

/// Sensors were asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Request {
    /// How long after the request before, and how many other messages went between them.
    pub(crate) after: Option<(TimeSpan, usize)>,
}

impl Rhythm {
    /// A byte was put on the line; the request that it completes.
    pub(crate) fn written(&mut self, at: Timestamp, byte: u8) -> Option<Request> {
        self.said.push(byte);
        let (message, _) = Message::decode(&self.said)?;
        let is_request = !message.modules_read().is_empty();
        self.said.clear();
        if !is_request {
            self.request = self.request.map(|(asked, others)| (asked, others + 1));
            return None;
        }
        let before = self.request.replace((at, 0));
        self.is_awaited = true;
        Some(Request { after: before.map(|(asked, others)| (at - asked, others)) })
    }

    /// A byte was heard; if it is the first of an answer, how long after the last bit of its request.
    pub(crate) fn heard(&mut self, at: Timestamp) -> Option<TimeSpan> {
        let (asked, _) = self.request.filter(|_| std::mem::take(&mut self.is_awaited))?;
        Some(at - (asked + BYTE_TIME))
    }
}
