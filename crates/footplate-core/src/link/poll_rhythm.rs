//! When the polls to come will be, as the reports so far let them be foreseen.
//!
//! A contact is reported by the first poll after it closed, so a report can be forecast better than the
//! contact: it is stamped by a poll, and polls come like clockwork from one report to the next.

use crate::time::{TimeSpan, Timestamp};

/// Polls from the last report on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PollRhythm {
    /// The first poll after the last report.
    pub(super) next: Timestamp,
    /// From poll to poll while nothing is reported.
    pub(super) period: TimeSpan,
    /// Beyond this many polls the doubt of the period has grown to a fifth of it, and a poll can no longer be
    /// told from its neighbour.
    pub(super) reaches: i64,
}

impl PollRhythm {
    /// The first poll not before a time; `None` where it can no longer be foreseen.
    #[inline]
    #[must_use]
    pub fn poll_after(self, time: Timestamp) -> Option<Timestamp> {
        let ahead = (time - self.next).as_ns();
        let period = self.period.as_ns();
        if period <= 0 {
            return None;
        }
        // Rounded up: a contact between two polls waits for the later one.
        let polls = ahead.max(0).saturating_add(period - 1) / period;
        (polls <= self.reaches).then(|| self.next + TimeSpan::from_ns(polls * period))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_waits_for_the_next_poll() {
        let rhythm = PollRhythm { next: Timestamp::from_s(1.0), period: TimeSpan::from_ms(60), reaches: 100 };
        assert_eq!(rhythm.poll_after(Timestamp::ZERO), Some(Timestamp::from_s(1.0)));
        assert_eq!(rhythm.poll_after(Timestamp::from_s(1.0)), Some(Timestamp::from_s(1.0)));
        assert_eq!(rhythm.poll_after(Timestamp::from_s(1.001)), Some(Timestamp::from_s(1.06)));
        assert_eq!(rhythm.poll_after(Timestamp::from_s(100.0)), None);
    }
}
