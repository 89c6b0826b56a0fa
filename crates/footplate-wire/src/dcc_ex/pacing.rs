//! How fast requests may follow one another: the board drops what its buffer of 64 bytes does not hold, without a word.

use footplate_core::{TimeSpan, Timestamp};

/// From request to request on average: about 20 a second are safe (the project's own client library asks for the same).
const EVERY: TimeSpan = TimeSpan::from_ms(50);

/// Requests that may go at once after a pause: three of the longest, `<t 10239 126 1>`, fill 45 of the 64 bytes.
const AT_ONCE: i64 = 3;

/// What stops a train waits no longer than this for the request before: the board has read that one by then, as its longest
/// answer took 9.1 ms.
const URGENT_AFTER: TimeSpan = TimeSpan::from_ms(10);

/// When the next request may go.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pacing {
    /// The time up to which the average is used up.
    used_until: Timestamp,
    last: Option<Timestamp>,
}

impl Pacing {
    /// When a request may go that can wait.
    pub(super) fn usual_at(&self) -> Timestamp {
        self.used_until - TimeSpan::from_ns(EVERY.as_ns() * (AT_ONCE - 1))
    }

    /// When a request may go that stops something.
    pub(super) fn urgent_at(&self) -> Timestamp {
        let after_last = self.last.map_or(self.usual_at(), |last| last + URGENT_AFTER);
        self.usual_at().min(after_last)
    }

    pub(super) fn sent(&mut self, now: Timestamp) {
        self.used_until = self.used_until.max(now) + EVERY;
        self.last = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_go_at_once_then_twenty_a_second() {
        let (mut pacing, mut now, mut sent) = (Pacing::default(), Timestamp::from_s(1.0), 0);
        let end = Timestamp::from_s(3.0);
        while now < end {
            if now >= pacing.usual_at() {
                pacing.sent(now);
                sent += 1;
            }
            now += TimeSpan::from_ms(1);
        }
        assert_eq!(sent, 42, "three at once, then one each 50 ms");
        assert!(pacing.urgent_at() <= pacing.last.unwrap() + URGENT_AFTER);
    }
}
