//! Messages that leave for the bus: the server takes the next when it has said what became of the one before.

use alloc::collections::VecDeque;

use footplate_core::{TimeSpan, Timestamp};

use super::message::Message;

/// The server says what became of a message within this time. On an idle bus that is a few milliseconds; programs warn after 250 ms.
pub(super) const SENT_WITHIN: TimeSpan = TimeSpan::from_ms(500);

/// At the end of a session it is not waited for longer than this: four times what a message takes on an idle bus.
pub(super) const SENT_WITHIN_AT_END: TimeSpan = TimeSpan::from_ms(20);

/// What waits, and what is in transit.
#[derive(Debug, Clone, Default)]
pub(super) struct Outbox {
    waiting: VecDeque<Message>,
    in_transit: Option<(Message, Timestamp)>,
}

impl Outbox {
    pub(super) fn push(&mut self, messages: impl IntoIterator<Item = Message>) {
        self.waiting.extend(messages);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.in_transit.is_none()
    }

    /// The message that may be written now; `within`: how long the server's word on the one before is waited for.
    pub(super) fn next(&mut self, now: Timestamp, within: TimeSpan) -> Option<Message> {
        self.in_transit.take_if(|(_, written)| now >= *written + within);
        if self.in_transit.is_some() {
            return None;
        }
        let message = self.waiting.pop_front()?;
        self.in_transit = Some((message, now));
        Some(message)
    }

    /// The server has said what became of the message in transit.
    pub(super) fn sent(&mut self) -> Option<Message> {
        self.in_transit.take().map(|(message, _)| message)
    }

    /// Whether a message from the bus is this client's own.
    pub(super) fn is_own(&self, message: &Message) -> bool {
        self.in_transit.is_some_and(|(own, _)| own == *message)
    }

    /// When the message in transit counts as lost.
    pub(super) fn due(&self, within: TimeSpan) -> Option<Timestamp> {
        self.in_transit.map(|(_, written)| written + within)
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.in_transit = None;
    }
}
