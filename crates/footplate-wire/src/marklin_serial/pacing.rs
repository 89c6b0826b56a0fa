//! The pace of bytes: the next may be written after CTS has gone down and up again, or after fixed gaps.

use footplate_core::{TimeSpan, Timestamp};

use super::line::BYTE_TIME;

/// How long after a byte CTS is taken to be up although it was never seen down: the interface may drop it too
/// shortly for a slow computer to notice (after byte 192 it does), and it needs a moment to drop it at all, which
/// published drivers give it 10 ms for.
const CTS_GUARD: TimeSpan = TimeSpan::from_ms(10);

/// How the program knows when the interface accepts the next byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// By its CTS line: after each byte it goes down and up again.
    Cts,
    /// By the clock alone, where CTS is not wired.
    Timed {
        /// From the end of a byte to the beginning of the next.
        byte_gap: TimeSpan,
        /// From the end of a command to the beginning of what follows. After a whole reply nothing is waited for: the
        /// interface has shown that it is done.
        command_gap: TimeSpan,
    },
}

impl Pace {
    /// Gaps that every known interface keeps up with: 10 ms between bytes (Rocrail), 100 ms between commands (the
    /// middle of what published programs wait).
    pub const CAREFUL: Self =
        Self::Timed { byte_gap: TimeSpan::from_ms(10), command_gap: TimeSpan::from_ms(100) };

    /// Short gaps, for an interface that keeps up, as a simulated one does, or an adapter that keeps the hand-shake
    /// itself: longer than the 2 ms for which CTS was seen down.
    pub const FAST: Self = Self::Timed { byte_gap: TimeSpan::from_ms(3), command_gap: TimeSpan::from_ms(3) };
}

/// Keeps the pace.
#[derive(Debug, Clone)]
pub(super) struct Pacing {
    pace: Pace,
    cts_up: bool,
    /// Since when CTS is as it is.
    cts_since: Timestamp,
    written: Option<Written>,
    /// Bytes for which CTS was not seen down before the next was written. On a line that delays it, it comes later.
    owed: usize,
}

/// The byte that was written last, until the interface is known to be done with it.
#[derive(Debug, Clone, Copy)]
struct Written {
    at: Timestamp,
    /// Whether CTS was seen down since.
    lowered: bool,
    /// Whether a whole reply has come since.
    answered: bool,
    ends_frame: bool,
}

impl Pacing {
    pub(super) fn new(now: Timestamp, pace: Pace) -> Self {
        Self { pace, cts_up: false, cts_since: now, written: None, owed: 0 }
    }

    pub(super) fn cts(&mut self, now: Timestamp, up: bool) {
        if up != self.cts_up {
            self.cts_since = now;
        }
        let falls = self.cts_up && !up;
        self.cts_up = up;
        if let Some(written) = &mut self.written
            && !up
        {
            // The interface drops it once the whole byte has arrived: what falls sooner, falls for a byte before.
            let is_earlier = self.owed > 0 || now < written.at + BYTE_TIME;
            written.lowered |= !is_earlier;
        }
        if falls {
            self.owed = self.owed.saturating_sub(1);
        }
    }

    pub(super) fn wrote(&mut self, now: Timestamp, ends_frame: bool) {
        let is_unseen = self.written.is_some_and(|before| !before.lowered && !before.answered);
        self.owed = self.owed.saturating_add(usize::from(self.pace == Pace::Cts && is_unseen));
        let lowered = self.pace == Pace::Cts && !self.cts_up;
        self.written = Some(Written { at: now, lowered, answered: false, ends_frame });
    }

    /// What was written last was one byte that the interface swallows or obeys at once, and a stop waits: it follows as
    /// the next byte of a message would.
    pub(super) fn hurry(&mut self) {
        if let Some(written) = &mut self.written {
            written.ends_frame = false;
        }
    }

    /// A whole reply has come, so the interface is done with what was written before, and CTS is as late as the reply at most.
    pub(super) fn answered(&mut self) {
        self.owed = 0;
        if self.pace != Pace::Cts {
            self.written = None;
        }
        if let Some(written) = &mut self.written {
            written.answered = true;
        }
    }

    /// When the byte that was written last had left.
    pub(super) fn gone(&self) -> Option<Timestamp> {
        self.written.map(|written| written.at + BYTE_TIME)
    }

    /// From when on the next byte may be written if CTS stays as it is; `None` while it is down.
    pub(super) fn ready_at(&self) -> Option<Timestamp> {
        let always = Timestamp::from_ns(i64::MIN);
        let gone = |written: Written| written.at + BYTE_TIME;
        match self.pace {
            Pace::Cts if !self.cts_up => None,
            Pace::Cts => Some(self.written.map_or(always, |written| {
                gone(written) + if written.lowered { TimeSpan::ZERO } else { CTS_GUARD }
            })),
            Pace::Timed { byte_gap, command_gap } => Some(self.written.map_or(always, |written| {
                gone(written) + if written.ends_frame { command_gap } else { byte_gap }
            })),
        }
    }

    /// How long a message of one byte occupies the line until the next may follow, if nothing is amiss.
    pub(super) fn word_time(&self) -> TimeSpan {
        match self.pace {
            Pace::Cts => BYTE_TIME + CTS_GUARD,
            Pace::Timed { command_gap, .. } => BYTE_TIME + command_gap,
        }
    }

    pub(super) fn is_ready(&self, now: Timestamp) -> bool {
        self.ready_at().is_some_and(|at| at <= now)
    }

    /// Since when CTS is down, where it matters.
    pub(super) fn down_since(&self) -> Option<Timestamp> {
        (self.pace == Pace::Cts && !self.cts_up).then_some(self.cts_since)
    }

    /// Whether taken bytes are confirmed at all.
    pub(super) fn has_hand_shake(&self) -> bool {
        self.pace == Pace::Cts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: i64) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_ms(ms)
    }

    #[test]
    fn a_byte_waits_until_cts_has_gone_down_and_up_again() {
        let mut pacing = Pacing::new(ms(0), Pace::Cts);
        assert!(!pacing.is_ready(ms(0)), "nothing is known of CTS yet");
        pacing.cts(ms(0), true);
        assert!(pacing.is_ready(ms(0)));

        pacing.wrote(ms(0), false);
        assert!(!pacing.is_ready(ms(7)), "CTS is still up from before: the interface had no time to drop it");
        pacing.cts(ms(8), false);
        assert!(!pacing.is_ready(ms(1000)), "however long it takes");
        pacing.cts(ms(9), true);
        assert!(pacing.is_ready(ms(9)));
    }

    #[test]
    fn an_edge_too_short_to_be_seen_costs_a_guard_time() {
        let mut pacing = Pacing::new(ms(0), Pace::Cts);
        pacing.cts(ms(0), true);
        pacing.wrote(ms(0), true);
        assert!(!pacing.is_ready(ms(14)));
        assert!(pacing.is_ready(ms(15)), "a byte of 4.6 ms and 10 ms of guard");
    }

    #[test]
    fn an_edge_that_comes_late_does_not_count_for_the_next_byte() {
        let mut pacing = Pacing::new(ms(0), Pace::Cts);
        pacing.cts(ms(0), true);
        // CTS falls at 4.8 ms and rises a millisecond later, and both are seen 10 ms after that.
        pacing.wrote(ms(0), false);
        assert!(pacing.is_ready(ms(15)));
        pacing.wrote(ms(15), false);
        pacing.cts(ms(16), false);
        pacing.cts(ms(17), true);
        assert!(!pacing.is_ready(ms(29)), "the interface is busy with the second byte until 22 ms at least");
        assert!(pacing.is_ready(ms(30)));
        // The edges of the second byte come after the third has left.
        pacing.wrote(ms(30), false);
        pacing.cts(ms(35), false);
        pacing.cts(ms(36), true);
        assert!(!pacing.is_ready(ms(44)));
        // A reply comes after all edges before it.
        pacing.answered();
        pacing.wrote(ms(50), false);
        pacing.cts(ms(56), false);
        pacing.cts(ms(57), true);
        assert!(pacing.is_ready(ms(57)));
    }

    #[test]
    fn without_cts_the_clock_decides() {
        let mut pacing = Pacing::new(ms(0), Pace::CAREFUL);
        assert!(pacing.is_ready(ms(0)));
        pacing.wrote(ms(0), false);
        assert_eq!((pacing.is_ready(ms(14)), pacing.is_ready(ms(15))), (false, true));
        pacing.wrote(ms(20), true);
        assert_eq!((pacing.is_ready(ms(124)), pacing.is_ready(ms(125))), (false, true));
        pacing.answered();
        assert!(pacing.is_ready(ms(30)));
    }
}
