//! Predicts future polls from the reports so far.
//!
//! A sensor is reported by the first poll after it closed. A report can therefore be predicted better than the
//! closing: it is stamped by a poll, and polls follow one another regularly.

use crate::time::{TimeSpan, Timestamp};

/// Polls from the last report on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PollRhythm {
    /// The first poll after the last report.
    pub(super) next: Timestamp,
    /// From poll to poll while nothing is reported.
    pub(super) period: TimeSpan,
    /// Beyond this many polls the uncertainty of the period has grown to a fifth of it, and neighbouring polls can no
    /// longer be distinguished.
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
        // Rounded up: a detection between two polls waits for the later one.
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
