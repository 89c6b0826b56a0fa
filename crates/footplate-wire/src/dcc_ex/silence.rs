//! Whether the board answers at all, and since when it does not.

use footplate_core::{TimeSpan, Timestamp};

use crate::session::LinkNotice;

/// After so long without any message while one is due a person should know: six repeats, and short enough to act while trains
/// still run.
const SILENT_AFTER: TimeSpan = TimeSpan::from_ms(1_500);

/// Bytes that could not be read until a person should know: more than a message or two that were cut off when the line was
/// opened.
const NOISE: usize = 64;

/// The watch over what the board says.
#[derive(Debug, Clone, Default)]
pub(super) struct Silence {
    /// The first request since the last message.
    since: Option<Timestamp>,
    /// Bytes that could not be read since then, and since the line was opened.
    unread: usize,
    unread_in_all: usize,
    is_silent: bool,
    is_noise_known: bool,
}

impl Silence {
    /// A request has gone that will be answered.
    pub(super) fn asked(&mut self, at: Timestamp) {
        self.since.get_or_insert(at);
    }

    /// A message has come; returns whether the board was called silent before.
    pub(super) fn heard(&mut self) -> bool {
        (self.since, self.unread) = (None, 0);
        core::mem::take(&mut self.is_silent)
    }

    /// Bytes have come that are no message; says so once.
    pub(super) fn heard_noise(&mut self, bytes: usize) -> Option<LinkNotice> {
        self.unread = self.unread.saturating_add(bytes);
        self.unread_in_all = self.unread_in_all.saturating_add(bytes);
        if self.unread_in_all < NOISE || self.is_noise_known {
            return None;
        }
        self.is_noise_known = true;
        Some(LinkNotice::Unreadable {
            bytes: self.unread_in_all,
            check: "check the line's speed (115200 baud), the cable, and that no other program writes to the port",
        })
    }

    /// Whether it is silent by now; says so once.
    pub(super) fn watch(&mut self, now: Timestamp) -> Option<LinkNotice> {
        let since = now - self.since?;
        if since < SILENT_AFTER || self.is_silent {
            return None;
        }
        self.is_silent = true;
        let check = if self.unread == 0 {
            "check its power, the cable and the port"
        } else {
            "check the line's speed (115200 baud) and that the port belongs to a DCC-EX board"
        };
        Some(LinkNotice::Silent { since, bytes: self.unread, check })
    }

    /// When to look again.
    pub(super) fn due(&self) -> Option<Timestamp> {
        self.since.filter(|_| !self.is_silent).map(|since| since + SILENT_AFTER)
    }
}
