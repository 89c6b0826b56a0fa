//! Whether the station answers at all, and whether the line garbles what it answers.

use footplate_core::{TimeSpan, Timestamp};

use crate::session::LinkNotice;

/// After so long without a whole reply a person should know. Long enough for a handful of polls to be lost by chance
/// and asked again, short enough to act while trains still run.
const SILENT_AFTER: TimeSpan = TimeSpan::from_ms(1_500);

/// Fewer lost polls than this are no silence, however far apart they were.
const LOST_AT_LEAST: u32 = 3;

/// A line without checksums may turn one command into another. So many replies with bytes too few or too many ...
const GARBLED: usize = 3;
/// ... within this time are no chance.
const GARBLED_WITHIN: TimeSpan = TimeSpan::from_ms(5_000);
/// A line is clean again when none has come for this time.
const CLEAN_FOR: TimeSpan = TimeSpan::from_ms(3_000);
/// For so long after a reply was lost or garbled, single bytes to the station may be altered, too, unnoticed: noise that alters one byte
/// in 300 leaves 170 replies, which come in that time, whole once in 500 times.
const NOISY_FOR: TimeSpan = TimeSpan::from_ms(10_000);

/// The watch over the station's answers.
#[derive(Debug, Clone, Default)]
pub(super) struct Silence {
    /// The first request that was not answered since the last that was.
    since: Option<Timestamp>,
    lost: u32,
    bytes: usize,
    /// When replies last came garbled, the newest last.
    garbled: [Option<Timestamp>; GARBLED],
    /// When a reply was last lost or garbled.
    disturbed: Option<Timestamp>,
    /// What was said of it last.
    said: Option<Said>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Said {
    Answers,
    Silent,
    Garbled,
}

impl Silence {
    pub(super) fn asked(&mut self, at: Timestamp) {
        self.since.get_or_insert(at);
    }

    pub(super) fn heard_stray(&mut self, bytes: usize) {
        self.bytes = self.bytes.saturating_add(bytes);
    }

    /// Whether a single byte to the station may be altered without any other sign.
    pub(super) fn is_noisy(&self, now: Timestamp) -> bool {
        self.disturbed.is_some_and(|at| now - at < NOISY_FOR)
    }

    /// A reply came garbled; says so when it is one of many.
    pub(super) fn garbled(&mut self, now: Timestamp) -> Option<LinkNotice> {
        self.disturbed = Some(now);
        self.garbled.rotate_left(1);
        if let Some(newest) = self.garbled.last_mut() {
            *newest = Some(now);
        }
        let oldest = self.garbled.first().copied().flatten();
        let is_news = self.said == Some(Said::Answers) && oldest.is_some_and(|at| now - at <= GARBLED_WITHIN);
        if is_news {
            self.said = Some(Said::Garbled);
        }
        is_news.then_some(LinkNotice::Garbled)
    }

    /// A whole reply has come; says so when that is news.
    pub(super) fn answered(&mut self, now: Timestamp) -> Option<LinkNotice> {
        (self.since, self.lost, self.bytes) = (None, 0, 0);
        let newest = self.garbled.last().copied().flatten();
        if self.said == Some(Said::Garbled) && newest.is_some_and(|at| now - at < CLEAN_FOR) {
            return None;
        }
        let news = self.said != Some(Said::Answers);
        self.said = Some(Said::Answers);
        news.then_some(LinkNotice::Answers)
    }

    /// Something else makes the station suspect: its next answer is news.
    pub(super) fn suspect(&mut self) {
        self.said = None;
    }

    /// A reply was lost; says so when it is the last straw.
    pub(super) fn lost(&mut self, now: Timestamp) -> Option<LinkNotice> {
        self.disturbed = Some(now);
        if self.lost == 0 {
            // The station may have fallen silent in the middle of a reply.
            self.bytes = 0;
        }
        self.lost = self.lost.saturating_add(1);
        let since = now - self.since?;
        let silent = since >= SILENT_AFTER && self.lost >= LOST_AT_LEAST && self.said != Some(Said::Silent);
        if !silent {
            return None;
        }
        self.said = Some(Said::Silent);
        let check = if self.bytes == 0 {
            "check its power, the cable and the port"
        } else {
            "check the line's speed (2400 baud, 8 data bits, no parity, 2 stop bits) and the number of sensor modules"
        };
        Some(LinkNotice::Silent { since, bytes: self.bytes, check })
    }
}
