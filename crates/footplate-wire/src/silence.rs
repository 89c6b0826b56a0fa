//! Detects a station that has stopped answering.

use footplate_core::{TimeSpan, Timestamp};

use crate::session::LinkNotice;

/// A station counts as silent after this time without a message while one is due: six repeats, and short enough to act while
/// trains still run.
const SILENT_AFTER: TimeSpan = TimeSpan::from_ms(1_500);

/// Unreadable bytes that are not reported yet: a message or two that were cut off when the line was opened.
const NOISE: usize = 64;
/// A line counts as noisy this long after bytes that could not be read: several messages of a quiet line.
const NOISY_FOR: TimeSpan = TimeSpan::from_s(5.0);

/// What a person should check on a kind of link.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Checks {
    /// When nothing at all was heard.
    pub(crate) nothing_heard: &'static str,
    /// When bytes came and none of them made a message.
    pub(crate) nothing_whole: &'static str,
    /// When much of what came could not be read.
    pub(crate) noise: &'static str,
}

/// The watch over what the station says.
#[derive(Debug, Clone)]
pub(crate) struct Silence {
    checks: Checks,
    /// The first request since the last message.
    since: Option<Timestamp>,
    /// Bytes that could not be read since then, and since the line was opened.
    unread: usize,
    unread_in_all: usize,
    is_silent: bool,
    is_noise_known: bool,
    /// When bytes last came that could not be read.
    noise: Option<Timestamp>,
}

impl Silence {
    pub(crate) const fn new(checks: Checks) -> Self {
        let (since, unread, unread_in_all, is_silent, is_noise_known) = (None, 0, 0, false, false);
        Self { checks, since, unread, unread_in_all, is_silent, is_noise_known, noise: None }
    }

    /// Notes a request that expects an answer.
    pub(crate) fn asked(&mut self, at: Timestamp) {
        self.since.get_or_insert(at);
    }

    /// Notes a message; returns whether the station was reported silent before.
    pub(crate) fn heard(&mut self) -> bool {
        (self.since, self.unread) = (None, 0);
        core::mem::take(&mut self.is_silent)
    }

    /// Counts bytes that form no message; reports them once.
    pub(crate) fn heard_noise(&mut self, now: Timestamp, bytes: usize) -> Option<LinkNotice> {
        self.noise = Some(now);
        self.unread = self.unread.saturating_add(bytes);
        self.unread_in_all = self.unread_in_all.saturating_add(bytes);
        if self.unread_in_all < NOISE || self.is_noise_known {
            return None;
        }
        self.is_noise_known = true;
        Some(LinkNotice::Unreadable { bytes: self.unread_in_all, check: self.checks.noise })
    }

    /// Whether the line may garble what is sent now.
    pub(crate) fn is_noisy(&self, now: Timestamp) -> bool {
        self.noise.is_some_and(|noise| now - noise < NOISY_FOR)
    }

    /// Reports once that the station has become silent.
    pub(crate) fn watch(&mut self, now: Timestamp) -> Option<LinkNotice> {
        let since = now - self.since?;
        if since < SILENT_AFTER || self.is_silent {
            return None;
        }
        self.is_silent = true;
        let check = if self.unread == 0 { self.checks.nothing_heard } else { self.checks.nothing_whole };
        Some(LinkNotice::Silent { since, bytes: self.unread, check })
    }

    /// Returns when to look again.
    pub(crate) fn due(&self) -> Option<Timestamp> {
        self.since.filter(|_| !self.is_silent).map(|since| since + SILENT_AFTER)
    }
}
