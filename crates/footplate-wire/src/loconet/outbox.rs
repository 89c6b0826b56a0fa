//! Messages on their way to the bus: the server takes the next when it has said what became of the one before.

use alloc::collections::VecDeque;

use footplate_core::{TimeSpan, Timestamp};

use super::message::Message;

/// The server says what became of a message within this time. On an idle bus that is a few milliseconds; programs warn after 250 ms.
pub(super) const SENT_WITHIN: TimeSpan = TimeSpan::from_ms(500);

/// At the end of a session it is not waited for longer than this: four times what a message takes on an idle bus.
pub(super) const SENT_WITHIN_AT_END: TimeSpan = TimeSpan::from_ms(20);

/// What waits, and what is on its way.
#[derive(Debug, Clone, Default)]
pub(super) struct Outbox {
    waiting: VecDeque<Message>,
    on_its_way: Option<(Message, Timestamp)>,
}

impl Outbox {
    pub(super) fn push(&mut self, messages: impl IntoIterator<Item = Message>) {
        self.waiting.extend(messages);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.on_its_way.is_none()
    }

    /// The message that may be written now; `within`: how long the server's word on the one before is waited for.
    pub(super) fn next(&mut self, now: Timestamp, within: TimeSpan) -> Option<Message> {
        self.on_its_way.take_if(|(_, written)| now >= *written + within);
        if self.on_its_way.is_some() {
            return None;
        }
        let message = self.waiting.pop_front()?;
        self.on_its_way = Some((message, now));
        Some(message)
    }

    /// The server has said what became of the message on its way.
    pub(super) fn sent(&mut self) -> Option<Message> {
        self.on_its_way.take().map(|(message, _)| message)
    }

    /// Whether a message from the bus is this client's own.
    pub(super) fn is_own(&self, message: &Message) -> bool {
        self.on_its_way.is_some_and(|(own, _)| own == *message)
    }

    /// When the message on its way counts as lost.
    pub(super) fn due(&self, within: TimeSpan) -> Option<Timestamp> {
        self.on_its_way.map(|(_, written)| written + within)
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
        self.on_its_way = None;
    }
}
