//! The state of the line: idle, sending a frame, receiving a reply, or waiting for silence.

use footplate_core::{Command, TimeSpan, Timestamp};

use super::codec::{Frame, Message};
use super::line::{BYTE_TIME, REPLY_BYTE_SPACING, time_on_line};

/// Two bytes a module, 31 modules.
const LONGEST_REPLY: usize = 62;

/// How long the line must be silent after a disturbance before the next frame; srcpd and the course's programs
/// wait as long.
pub(super) const SILENCE: TimeSpan = TimeSpan::from_ms(100);

/// A line that never falls silent is used again after this time: trains must be stoppable.
const LONGEST_SILENCE: TimeSpan = TimeSpan::from_ms(1000);

/// By how much a reply of the 6051 is later than its bytes take at the most; a poll is lost after that.
pub(super) const REPLY_ALLOWANCE: TimeSpan = TimeSpan::from_ms(20);

/// A stop does not wait for all of that silence. Bytes of a reply follow each other after 4.87 ms, so that none is under
/// way after four times that.
const STOP_SILENCE: TimeSpan = TimeSpan::from_ms(20);

/// After a whole reply with a newly closed input, one byte more would still come within this time if one too many
/// is in transit, and then none of them can be trusted.
const SETTLING: TimeSpan = TimeSpan::from_us(6_000);

/// Why a frame is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Purpose {
    /// Synchronises the interface.
    Recovery,
    /// To release the solenoid.
    Release,
    /// A command.
    Command(Command),
    /// To read modules.
    Poll(Message),
    /// The last word of a session.
    PowerAtClose,
}

/// What is on the line.
#[derive(Debug, Clone, Copy)]
pub(super) enum Exchange {
    Free,
    Sending(Sending),
    Awaiting(Awaited),
    /// The reply is whole and it is seen whether more comes.
    Settling(Awaited),
    Quiet(Quiet),
}

/// A frame being written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sending {
    pub(super) frame: Frame,
    pub(super) purpose: Purpose,
    /// Bytes that were written.
    pub(super) sent: usize,
    /// When the last of them was.
    pub(super) written: Timestamp,
}

impl Sending {
    /// When the last written byte has left.
    pub(super) fn gone(&self) -> Timestamp {
        self.written + BYTE_TIME
    }

    pub(super) fn next_byte(&self) -> Option<u8> {
        self.frame.as_bytes().get(self.sent).copied()
    }
}

/// A reply being read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Awaited {
    pub(super) request: Message,
    /// When the last bit of the request had left.
    pub(super) asked: Timestamp,
    /// When it is lost, or settled.
    pub(super) until: Timestamp,
    /// When the last byte of the request or of the reply went over the line.
    pub(super) heard: Timestamp,
}

impl Awaited {
    pub(super) fn new(request: Message, asked: Timestamp, allowance: TimeSpan) -> Self {
        Self { request, asked, until: asked + reply_time(request) + allowance, heard: asked }
    }

    /// How much later than its bytes take a reply is whose last byte comes now.
    pub(super) fn late(&self, now: Timestamp) -> TimeSpan {
        now - self.asked - reply_time(self.request)
    }

    pub(super) fn settling(self, now: Timestamp) -> Self {
        Self { until: now + SETTLING, ..self }
    }
}

/// A silence that is waited for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quiet {
    pub(super) until: Timestamp,
    limit: Timestamp,
    /// Since when the line is silent.
    heard: Timestamp,
    /// Whether the interface may be waiting for a second byte, so that nothing may be said to it but what brings it
    /// back into step.
    pub(super) is_uncertain: bool,
    /// The reply that was given up.
    pub(super) lost: Option<Awaited>,
}

impl Quiet {
    /// The line has been silent since a time.
    pub(super) fn begin(now: Timestamp, heard: Timestamp, is_uncertain: bool) -> Self {
        Self { until: heard + SILENCE, limit: now + LONGEST_SILENCE, heard, is_uncertain, lost: None }
    }

    pub(super) fn disturb(&mut self, now: Timestamp) {
        self.heard = now;
        self.until = (now + SILENCE).min(self.limit);
    }

    /// From when on a stop may be said although the silence is not over: by then no reply is in transit any more.
    pub(super) fn stops_may_go(&self) -> Timestamp {
        (self.heard + STOP_SILENCE).min(self.until)
    }
}

/// How many bytes answer a request.
pub(super) fn reply_bytes(request: Message) -> usize {
    request.modules_read().count() * 2
}

/// From the last bit of a request to the last of its reply, if the interface answers at once.
fn reply_time(request: Message) -> TimeSpan {
    let bytes = i64::try_from(reply_bytes(request)).unwrap_or_default();
    TimeSpan::from_ns(REPLY_BYTE_SPACING.as_ns().saturating_mul(bytes))
}

/// How long a poll occupies the line at the worst.
pub(super) fn longest_poll(request: Message, allowance: TimeSpan) -> TimeSpan {
    time_on_line(1) + reply_time(request) + allowance
}

/// The bytes of the reply that have come.
#[derive(Debug, Clone)]
pub(super) struct Reply {
    bytes: [u8; LONGEST_REPLY],
    count: usize,
}

impl Reply {
    pub(super) const fn empty() -> Self {
        Self { bytes: [0; LONGEST_REPLY], count: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    pub(super) fn push(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.count) {
            *place = byte;
            self.count += 1;
        }
    }

    pub(super) fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.count).unwrap_or_default()
    }
}
